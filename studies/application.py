"""A study as a Hydra application: python -m studies.NAME key=value ..., rigs, belts and models as of belt-sim."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hydra
from omegaconf import OmegaConf

from belt_sim.cli_errors import ordered
from belt_sim.errors import BeltError
from belt_sim.jax_setup import prepare
from belt_sim.paths import CONF

HERE = Path(__file__).resolve().parent
#: a study says itself where its files go
_PLAIN = (
    f"hydra.searchpath=[file://{CONF}]",
    "hydra/job_logging=none",
    "hydra/hydra_logging=none",
    "hydra.output_subdir=null",
    "hydra.run.dir=.",
    "hydra.sweep.dir=.",
    "hydra.sweep.subdir=.",
)


def application(name: str, study: Callable[[dict[str, Any]], None]) -> None:
    """Run ``study`` with studies/conf/NAME.yaml and what the command line changes in it; -m runs it once a value."""

    def job(cfg: Any) -> None:
        try:
            sys.argv = command  # what a result says of where it came from
            study(OmegaConf.to_container(cfg, resolve=True, throw_on_missing=True))  # type: ignore[arg-type]
        except BeltError as error:
            sys.exit(f"{name}: {error}")

    module = getattr(sys.modules["__main__"].__spec__, "name", name).removesuffix(".__main__")
    command = [f"python -m {module}", *sys.argv[1:]]
    prepare()
    sys.argv[1:] = ordered(name, [*_PLAIN, *sys.argv[1:]])
    hydra.main(version_base="1.3", config_path=str(HERE / "conf"), config_name=name)(job)()
