"""A challenge: many campaigns, answered in parallel; stopped at any moment, it goes on where it was."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from belt_sim.errors import InputError
from belt_sim.io import read_json
from belt_sim.jax_setup import cores
from belt_sim.virtual_rig.make import SEALED_FILE, reveal
from studies.challenge.pool import share
from studies.challenge.run_case import Task, crash_answer, run_case, write_result

PATIENCE = 1800.0  # [s] that one campaign may take


def run_challenge(
    first: Task,
    seeds: Sequence[int],
    *,
    workers: int | None = None,
    minutes: float | None = None,
    patience: float = PATIENCE,
    tell: Callable[[dict[str, Any]], None] = lambda result: None,
) -> list[dict[str, Any]]:
    """Answer the campaigns of ``seeds`` as ``first`` says; returns every result that its folder holds.

    workers: processes (None: one a core); minutes: no campaign is begun later than that; tell: hears every result as
    it comes. Results that are there already are kept. Raises InputError when the folder holds those of other settings.
    """
    tasks = remaining(first, seeds)
    until = time.monotonic() + 60.0 * minutes if minutes is not None else float("inf")
    for task, trouble in share(tasks, run_case, workers or cores(), limit=patience, until=until):
        if trouble:
            sealed = task.file("sealed")
            truth = reveal(sealed) if (sealed / SEALED_FILE).exists() else None
            write_result(task, answer=crash_answer(trouble), truth=truth, seconds={})
        tell(read_json(task.file("results")))
    return results(first.out)


def remaining(first: Task, seeds: Sequence[int]) -> list[Task]:
    """What is not there yet; raises InputError when the folder holds results of other settings."""
    there = results(first.out)
    for name, value in first.settings.items() if there else ():
        if (other := there[0][name]) != value:
            raise InputError(name, value, "", f"{first.out} holds results with {other}; choose another folder")
    known = {r["seed"] for r in there}
    return [replace(first, seed=s) for s in seeds if s not in known]


def results(folder: Path) -> list[dict[str, Any]]:
    """Every result of a challenge, by seed."""
    return sorted(map(read_json, (folder / "results").glob("[0-9]*.json")), key=lambda r: r["seed"])


def drawn_seeds(folder: Path) -> list[int]:
    """Seeds of the campaigns that a challenge has drawn and sealed, answered or not."""
    return sorted(int(path.name) for path in (folder / "sealed").glob("[0-9]*"))
