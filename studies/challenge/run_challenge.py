"""A challenge: many campaigns, answered in parallel; stopped at any moment, it goes on where it was.

The work is shared among processes of one thread each; one that dies or takes too long costs its own task only.
"""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any
from unittest.mock import patch

from belt_sim.errors import InputError
from belt_sim.io import read_json
from belt_sim.jax_setup import cores
from belt_sim.virtual_rig.make import SEALED_FILE, reveal
from studies.challenge.run_case import Task, crash_answer, run_case, write_result

PATIENCE = 1800.0  # [s] that one campaign may take
#: compiled code of many shapes piles up in a process: it is replaced by a fresh one after so many tasks
TASKS_A_PROCESS = 40
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NPROC")
_LOOK_EVERY = 1.0  # [s]
BEGUN, DONE = "begun", "done"


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


class _Worker:
    """One process and the task that it is at."""

    def __init__(self, work: Callable[[Any], None]) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.pipe, there = spawn.Pipe()
        self.process = spawn.Process(target=_serve, args=(there, work), daemon=True)
        with patch.dict(os.environ, dict.fromkeys(_ONE_THREAD, "1")):
            self.process.start()
        there.close()
        self.task: Any = None
        self.began, self.done = float("inf"), 0  # the time of a task begins when the process says so

    def give(self, task: Any) -> None:
        self.task, self.began = task, float("inf")
        self.pipe.send(task)

    def has_finished(self) -> bool:
        """Whether the process said that it finished; a pipe that broke says nothing."""
        try:
            while self.pipe.poll():
                if self.pipe.recv() == DONE:
                    return True
                self.began = time.monotonic()
        except (EOFError, OSError):
            return False
        return False

    def trouble(self, limit: float) -> str:
        """What is wrong with a process that has not said that it finished; empty while it works."""
        if time.monotonic() - self.began > limit:
            return f"no answer within {limit:g} s"
        if not self.process.is_alive():
            return f"the process died (exit code {self.process.exitcode})"
        return ""

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


def share(
    tasks: Sequence[Any],
    work: Callable[[Any], None],
    workers: int,
    *,
    limit: float = float("inf"),
    until: float = float("inf"),
) -> Iterator[tuple[Any, str]]:
    """Do ``work(task)`` for all tasks; yields each task as it ends, with what went wrong ("" when it finished).

    limit: seconds that one task may take; until: time.monotonic() after which no new task is begun. ``work`` must be
    a function of a module, and keep its own results.
    """
    waiting, busy, idle = list(reversed(tasks)), list[_Worker](), list[_Worker]()
    try:
        while busy or (waiting and time.monotonic() < until):
            while waiting and len(busy) < workers and time.monotonic() < until:
                worker = idle.pop() if idle else _Worker(work)
                worker.give(waiting.pop())
                busy.append(worker)
            wait([w.pipe for w in busy], timeout=_LOOK_EVERY)
            for worker in list(busy):
                finished = worker.has_finished()
                trouble = "" if finished else worker.trouble(limit)
                if not finished and not trouble:
                    continue
                busy.remove(worker)
                worker.done += 1
                if trouble or worker.done >= TASKS_A_PROCESS:
                    worker.end()
                else:
                    idle.append(worker)
                yield worker.task, trouble
    finally:
        for worker in [*busy, *idle]:
            worker.end()


def _serve(pipe: Connection, work: Callable[[Any], None]) -> None:
    """The life of a process: a task, a word that it is begun and done, until nobody listens."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends it
    from belt_sim.jax_setup import prepare

    prepare()
    while True:
        try:
            task = pipe.recv()
            pipe.send(BEGUN)
            work(task)
            pipe.send(DONE)
        except (EOFError, OSError):
            return
