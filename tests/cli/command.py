"""The command line called inside the test's own process: a start of Python costs seconds."""

import copy
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, OmegaConf

from belt_sim.commands.cli import run_command
from belt_sim.commands.runs import RunDir, plain_settings
from belt_sim.errors import BeltError
from belt_sim.io import CONF

SHORT = ("travel=2", "pictures=false")


@dataclass(frozen=True)
class Answer:
    """What a call left: exit status, standard output and error, the run's folder."""

    status: int
    out: str
    err: str
    folder: Path


class Shell:
    """Calls ``belt-sim`` with the run's folder in a temporary place."""

    def __init__(self, folder: Path, capture: pytest.CaptureFixture[str]) -> None:
        self.folder, self.capture = folder, capture

    def __call__(self, *arguments: str) -> Answer:
        self.capture.readouterr()
        status = run_command([*arguments, *self._places(arguments)])
        out, err = self.capture.readouterr()
        return Answer(status, out, err, self.folder)

    def simulate(self, *overrides: str) -> Answer:
        """A short run of ``simulate``."""
        return self("simulate", *SHORT, *overrides)

    def _places(self, arguments) -> list[str]:
        if not arguments or "=" not in "".join(arguments):
            return []
        return [f"hydra.run.dir={self.folder}", f"hydra.sweep.dir={self.folder}"]


def carry_out(command: str, folder: Path, base: tuple[str, ...], *values: str) -> None:
    """Carry a command out as the command line does, with values changed after Hydra has composed its configuration:
    to compose takes longer than most commands do until they refuse. Raises BeltError."""
    config = copy.deepcopy(composed(command, base))
    for override in OverridesParser.create().parse_overrides(list(values)):
        OmegaConf.update(config, override.key_or_group, override.value(), force_add=override.is_add())
    RunDir(folder, command, plain_settings(config), [*base, *values]).carry_out()


def refusal(command: str, folder: Path, base: tuple[str, ...], *values: str) -> str:
    """The line with which ``carry_out`` refuses values."""
    with pytest.raises(BeltError) as refused:
        carry_out(command, folder, base, *values)
    assert len(str(refused.value).splitlines()) == 1
    return str(refused.value)


@cache
def composed(command: str, overrides: tuple[str, ...]) -> DictConfig:
    """The configuration of a command, as Hydra composes it."""
    with initialize_config_dir(str(CONF), version_base="1.3"):
        return compose(command, list(overrides))
