"""The command line called inside the test's own process: a start of Python costs seconds."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from belt_sim.commands.cli import run_command

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
