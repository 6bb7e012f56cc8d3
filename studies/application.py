"""A study with a command line: python -m studies.NAME key=value ..., rigs, belts and models as of belt-sim."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from belt_sim.commands.command_line import HELP, compose_request
from belt_sim.errors import BeltError
from belt_sim.files import CONF
from belt_sim.jax_setup import prepare

HERE = Path(__file__).resolve().parent
FIXED = (f"hydra.searchpath=[file://{CONF}]",)  # rigs, belts and models


def application(name: str, study: Callable[[dict[str, Any]], None]) -> None:
    """Run ``study`` with studies/conf/NAME.yaml and what the command line changes in it; -m runs it once a value."""
    module = getattr(sys.modules["__main__"].__spec__, "name", name).removesuffix(".__main__")
    arguments = sys.argv[1:]
    if any(a in HELP for a in arguments):
        print((HERE / "conf" / f"{name}.yaml").read_text(encoding="utf-8"))
        return
    sys.argv = [f"python -m {module}", *arguments]  # what a result says of where it came from
    prepare()
    try:
        for case in compose_request(name, arguments, conf=HERE / "conf", fixed=FIXED).runs:
            study(dict(case.config))
    except BeltError as error:
        sys.exit(f"{name}: {error}")
