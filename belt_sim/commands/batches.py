"""The cases of a sweep of 3D belts on JAX: those of one mesh at once on a GPU, shared over the cores of a CPU.

A batch only finds the curves. Each case then runs as it would alone, in its own folder and with its own files, except
that its belt has been marched already. So what is interrupted has lost no more than one batch, and goes on from there.
"""

import os
from collections.abc import Iterator, Sequence
from threading import Thread
from time import sleep
from typing import Any

from hydra._internal.core_plugins.basic_launcher import BasicLauncher
from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, JobStatus, setup_globals
from hydra.plugins.launcher import Launcher

from belt_sim.commands.cases import Case, Worker
from belt_sim.commands.failed import failure_in
from belt_sim.cores import cores
from belt_sim.jax_setup import prepare
from belt_sim.mujoco3d.model import BATCH_ENGINES
from belt_sim.whole_number import whole

_LOOKED_AFTER = 0.5  # [s], how often a worker looks whether its parent lives


class Batches(Launcher):
    """Hydra launcher; its settings stand in conf/hydra/launcher/batches.yaml."""

    def __init__(self, *, batch: Any, workers: Any) -> None:
        self.batch, self.workers = batch, workers
        self.given: dict[str, Any] = {}

    def setup(self, *, hydra_context: Any, task_function: Any, config: Any) -> None:
        """What Hydra gives a launcher."""
        self.given = {"hydra_context": hydra_context, "task_function": task_function, "config": config}

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run what is missing; what was done before is looked up."""
        at_once = self.given["config"].get("engine") in BATCH_ENGINES
        if not at_once and not any(f"engine={name}" in o for o in job_overrides for name in BATCH_ENGINES):
            basic = BasicLauncher()
            basic.setup(**self.given)
            return basic.launch(job_overrides, initial_job_idx)
        batch = None if self.batch == "auto" else whole("hydra.launcher.batch", self.batch, otherwise="auto or ")
        workers = (
            cores() if self.workers is None else whole("hydra.launcher.workers", self.workers, otherwise="null or ")
        )
        setup_globals()
        given = self.given
        worker = Worker(given["hydra_context"], given["config"], given["task_function"], Singleton.get_state())
        cases = worker.cases(job_overrides, initial_job_idx)
        due = [case for case in cases if case.config.get("engine") in BATCH_ENGINES and not case.done()]
        found = {case.number: worker.run(case) for case in cases if case not in due}
        found |= dict(_run(worker, due, batch, workers)) if due else {}
        return [found[case.number] for case in cases]


def _run(worker: Worker, cases: Sequence[Case], batch: int | None, workers: int) -> Iterator[tuple[int, JobReturn]]:
    import jax

    if batch is None and jax.default_backend() == "cpu":
        return _shared(worker, cases, min(workers, len(cases)))
    return _together(worker, cases, batch)


def _together(worker: Worker, cases: Sequence[Case], batch: int | None) -> Iterator[tuple[int, JobReturn]]:
    """Cases of like meshes in batches of ``batch`` (None: as many as fit), then each in its folder."""
    from belt_sim.quasi_static.handed import handing
    from belt_sim.use_cases.batched import batched

    for numbers, curves in batched([case.config for case in cases], batch):
        if len(numbers) > 1 and curves[0] is not None:
            print(f"{len(numbers)} cases at once", flush=True)
        for k, found in zip(numbers, curves, strict=True):
            with handing(found):
                yield cases[k].number, worker.run(cases[k])


def _shared(worker: Worker, cases: Sequence[Case], workers: int) -> Iterator[tuple[int, JobReturn]]:
    """Each case alone, by ``workers`` processes; none of them outlives this one."""
    if workers == 1:
        yield from ((case.number, worker.run(case)) for case in cases)
        return
    from joblib.externals.loky import ProcessPoolExecutor  # pickles what Hydra made of a command
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with ProcessPoolExecutor(workers, initializer=_begin, initargs=(os.getpid(),)) as pool:
        due = [(case, pool.submit(worker, [case])) for case in cases]
        for case, job in due:
            try:
                yield case.number, job.result()[0]
            except BrokenProcessPool:
                if not case.done():
                    failure_in(case.folder, "its process was lost (memory?); run the same command again")
                yield case.number, JobReturn(overrides=case.overrides, status=JobStatus.COMPLETED)


def _begin(parent: int) -> None:
    """In a worker: share the compiled code on disk, and end when ``parent`` has been killed: the next sweep takes up
    its cases."""
    prepare(space=True)

    def watch() -> None:
        while os.getppid() == parent:
            sleep(_LOOKED_AFTER)
        os._exit(1)

    Thread(target=watch, daemon=True).start()
