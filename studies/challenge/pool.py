"""Work shared among processes of one thread each; one that dies or takes too long costs its own task only."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any

#: compiled code of many shapes piles up in a process: it is replaced by a fresh one after so many tasks
TASKS_A_PROCESS = 40
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NPROC")
_LOOK_EVERY = 1.0  # [s]
BEGUN, DONE = "begun", "done"


class _Worker:
    """One process and the task that it is at."""

    def __init__(self, work: Callable[[Any], None]) -> None:
        spawn = multiprocessing.get_context("spawn")
        self.pipe, there = spawn.Pipe()
        self.process = spawn.Process(target=_serve, args=(there, work), daemon=True)
        with one_thread():
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


@contextmanager
def one_thread() -> Iterator[None]:
    """Processes that are started meanwhile compute with one thread each."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
