"""How often the diagnosis is right: python -m studies.challenge count=40 first_seed=1000.

Sealed campaigns are answered, one result each is kept in the folder, and the table of targets is shown; stopped and run
again, it goes on.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from belt_sim.api.inference import MIN_BOOTSTRAPS
from belt_sim.errors import InputError, whole
from belt_sim.io import provenance
from belt_sim.show.terminal import progress
from studies.application import application
from studies.challenge.registry import answerer, source
from studies.challenge.report import describe_hidden, publish, target_cells
from studies.challenge.run_case import Task
from studies.challenge.run_challenge import drawn_seeds, remaining, results, run_challenge
from studies.challenge.score import ScoredCase, score_case
from studies.challenge.targets import targets

MIN_WIDTH = 120  # characters of the table


def challenge(config: dict[str, Any]) -> None:
    """Answer sealed campaigns, keep one result each in ``folder``, and show the table of targets."""
    task, sharing = options(config)
    seeds = range(task.seed, task.seed + whole("count", config["count"], 0))
    todo = len(remaining(task, seeds))
    if todo:
        with progress(todo, f"challenge {task.ablation}") as done:

            def tell(result: dict[str, Any]) -> None:
                print(summary(score_case(result)), flush=True)
                done(1, f"campaign {result['seed']}")

            run_challenge(task, seeds, **sharing, tell=tell)
    there = results(task.out)
    print_targets([score_case(result) for result in there], task.out)
    if config["publish"]:
        print(publish(there, Path(config["publish"]), Path(config["stored"]), drawn_seeds(task.out)))


def options(config: Mapping[str, Any]) -> tuple[Task, dict[str, Any]]:
    """The first campaign's task, and how the work is shared; raises InputError for what cannot be."""
    source(config["source"])
    answerer(config["ablation"])
    first = Task(
        seed=whole("first_seed", config["first_seed"], 0),
        out=Path(config["folder"]).resolve(),
        source=config["source"],
        ablation=config["ablation"],
        bootstraps=whole("bootstraps", config["bootstraps"], MIN_BOOTSTRAPS),
        advised=whole("advice", config["advice"], 0),
        commit=provenance()["commit"],
    )
    workers = None if config["workers"] is None else whole("workers", config["workers"], 1)
    minutes = None if config["minutes"] is None else _positive(config, "minutes")
    return first, {"workers": workers, "minutes": minutes, "patience": _positive(config, "patience")}


def _positive(config: Mapping[str, Any], name: str) -> float:
    value = config[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
        raise InputError(name, value, "", "give a positive number")
    return float(value)


def summary(f: ScoredCase) -> str:
    """One campaign in a line: what was hidden, what was answered, what that is worth."""
    said = f"{f.verdict} {', '.join(f.named)}".strip()
    alike = sorted({" + ".join(alias) for aliases in f.aliases.values() for alias in aliases})
    said += f" ~ {', '.join(alike)}" if alike else ""
    spent = f" ({f.seconds:.0f} s)" if f.seconds else ""
    return f"{f.seed} {f.outcome:9s} {describe_hidden(f)} -> {said}{spent}"


def print_targets(cases: Sequence[ScoredCase], folder: Path) -> None:
    """The table of targets in the terminal."""
    out = Console(highlight=False)
    out.width = max(out.width, MIN_WIDTH)
    shown = Table(title=f"{len(cases)} campaigns", title_justify="left")
    for name in ("figure", "target", "found", "95 % interval", "note"):
        shown.add_column(name, justify="left" if name in ("figure", "note") else "right")
    for row in targets(cases):
        shown.add_row(*target_cells(row), style="red" if row.is_met is False else None)
    out.print(shown)
    out.print(str(folder), soft_wrap=True)


if __name__ == "__main__":
    application("challenge", challenge)
