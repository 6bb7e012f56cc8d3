"""What people ask of a challenge, checked before any long work."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from belt_sim.errors import InputError
from belt_sim.provenance import provenance
from belt_sim.use_cases.diagnose import MIN_BOOTSTRAPS
from belt_sim.whole_number import whole
from studies.challenge.answers import ABLATIONS, answerer
from studies.challenge.courier import Task
from studies.challenge.sources import source

FEW = 10  # campaigns that are drawn where nobody says how many


def asked(config: Mapping[str, Any], folder: Path) -> tuple[Task, dict[str, Any]]:
    """The first campaign's task, and how the work is shared; raises InputError for what cannot be."""
    source(config["source"])
    answerer(config["ablation"])
    first = Task(
        seed=whole("first_seed", config["first_seed"], 0),
        out=folder.resolve(),
        source=config["source"],
        ablation=config["ablation"],
        bootstraps=whole("bootstraps", config["bootstraps"], MIN_BOOTSTRAPS),
        advised=whole("advice", config["advice"], 0),
        others=bool(config["baselines"]) and config["ablation"] not in ABLATIONS,
        commit=provenance()["commit"],
        of=None if config["of"] is None else Path(config["of"]).resolve(),
    )
    workers = None if config["workers"] is None else whole("workers", config["workers"], 1)
    how = {"workers": workers, "minutes": _positive(config, "minutes"), "patience": _positive(config, "patience")}
    return first, how


def how_many(config: Mapping[str, Any]) -> int | None:
    """Campaigns that are wanted; None: a few that are drawn, or all that the folder ``of`` holds."""
    if config["count"] is None:
        return None if config["of"] is not None else FEW
    return whole("count", config["count"], 0)


def _positive(config: Mapping[str, Any], name: str) -> float | None:
    value = config[name]
    if value is None and name == "minutes":
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
        raise InputError(name, value, "", "give a positive number")
    return float(value)
