"""A study with a command line: python -m studies.NAME key=value ..., rigs, belts and models as of belt-sim."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from belt_sim.commands import HELP
from belt_sim.commands.cli import apply_hydra
from belt_sim.errors import BeltError
from belt_sim.io import CONF
from belt_sim.jax_setup import prepare

HERE = Path(__file__).resolve().parent
#: rigs, belts and models are those of belt-sim, and Hydra leaves no files of its own
FIXED = (
    f"hydra.searchpath=[file://{CONF}]", "hydra.output_subdir=null", "hydra.run.dir=.", "hydra.sweep.dir=.",
    "hydra.sweep.subdir=.", "hydra/job_logging=none", "hydra/hydra_logging=none",
)  # fmt: skip


def show_help(text: str | None) -> None:
    """Where the command line asks for help, print ``text`` (a module's docstring) and leave, before anything is run."""
    if any(a in HELP for a in sys.argv[1:]):
        print(text)
        sys.exit(0)


def application(name: str, study: Callable[[dict[str, Any]], None]) -> None:
    """Run ``study`` with studies/conf/NAME.yaml and what the command line changes in it; -m runs it once a value."""
    module = getattr(sys.modules["__main__"].__spec__, "name", name).removesuffix(".__main__")
    arguments = sys.argv[1:]
    show_help((HERE / "conf" / f"{name}.yaml").read_text(encoding="utf-8"))
    prepare()

    def task(config: Any) -> None:
        from belt_sim.commands.runs import plain_settings

        try:
            study(plain_settings(config))
        except BeltError as error:  # Hydra would print words of its own
            sys.exit(str(error))
        except Exception as error:
            crashed.append(error)

    crashed: list[Exception] = []
    flags = [a for a in arguments if a.startswith("-")]
    overrides = [*FIXED, *(a for a in arguments if a not in flags)]
    try:
        status = apply_hydra(f"python -m {module}", task, name, [*flags, *overrides], HERE / "conf")
    except BeltError as error:
        sys.exit(f"{name}: {error}")
    if crashed:
        raise crashed[0]
    sys.exit(status)
