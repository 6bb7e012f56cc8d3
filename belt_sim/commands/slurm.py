"""The cases of a sweep as an array of Slurm jobs, by submitit.

Only what is missing is submitted; a job that is lost (killed, out of memory or of time) is listed and stops nothing.
"""

import time
from collections.abc import Iterator, Sequence
from typing import Any

from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, JobStatus
from hydra.plugins.launcher import Launcher
from omegaconf import OmegaConf

from belt_sim.commands.cases import Case, Worker
from belt_sim.commands.failed import failure_in
from belt_sim.errors import BeltError

ASKED_EVERY = 30.0  # [s], at least, of Slurm, whether a job has been lost
#: settings of a job that submitit knows for every kind of cluster; the others are Slurm's
_COMMON = ("timeout_min", "cpus_per_task", "mem_gb", "name")


class Slurm(Launcher):
    """Hydra launcher; its settings stand in conf/hydra/launcher/slurm.yaml."""

    def __init__(self, *, cases_per_job: int, folder: str, cluster: str, **settings: Any) -> None:
        self.cases_per_job, self.folder, self.cluster, self.settings = cases_per_job, folder, cluster, settings
        self.worker: Worker | None = None

    def setup(self, *, hydra_context: Any, task_function: Any, config: Any) -> None:
        """What Hydra gives a launcher."""
        self.worker = Worker(hydra_context, config, task_function, None)

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> list[JobReturn]:
        """Submit what is missing and wait for all of it; what was done before is looked up here."""
        assert self.worker is not None
        worker = Worker(self.worker.context, self.worker.config, self.worker.task, Singleton.get_state())
        cases = worker.cases(job_overrides, initial_job_idx)
        found = {case.number: worker.run(case) for case in cases if case.done()}
        due = [case for case in cases if case.number not in found]
        size = max(int(self.cases_per_job), 1)
        bundles = [due[k : k + size] for k in range(0, len(due), size)]
        print(f"{len(due)} of {len(cases)} cases to run, in {len(bundles)} jobs", flush=True)
        for bundle, job in zip(bundles, self._submitted(worker, bundles), strict=True):
            found |= zip((case.number for case in bundle), _collected(bundle, job), strict=True)
        return [found[case.number] for case in cases]

    def _submitted(self, worker: Worker, bundles: Sequence[Sequence[Case]]) -> list[Any]:
        if not bundles:
            return []
        try:
            import submitit
        except ImportError as missing:
            raise BeltError("Slurm needs submitit: pip install 'belt-sim[sweeps]'") from missing
        given = {k: v for k, v in self.settings.items() if v is not None}
        settings = {k if k in _COMMON else f"slurm_{k}": _plain(v) for k, v in given.items()}
        try:
            executor = submitit.AutoExecutor(folder=self.folder, cluster=self.cluster)
            executor.update_parameters(**settings)
            return list(executor.map_array(worker, bundles))
        except (RuntimeError, OSError, ValueError, NameError) as error:  # no sbatch, an unknown partition ...
            raise BeltError(f"hydra.launcher: {' '.join(str(error).split())}") from error


def _plain(value: Any) -> Any:
    return OmegaConf.to_container(value) if OmegaConf.is_config(value) else value


def _wait(job: Any) -> None:
    """Until the job has ended. A lost one leaves no file: submitit by itself asks Slurm ever less often."""
    asked = time.monotonic()
    while not job.done():
        time.sleep(0.5)
        if time.monotonic() - asked > ASKED_EVERY:
            job.done(force_check=True)
            asked = time.monotonic()


def _collected(bundle: Sequence[Case], job: Any) -> Iterator[JobReturn]:
    """What the cases of a job returned; of a job that was lost, nothing, and why."""
    from submitit.core.utils import UncompletedJobError

    try:
        _wait(job)
        yield from job.results()[0]
    except UncompletedJobError:
        for case in bundle:
            if not case.done():
                failure_in(case.folder, f"job {job.job_id} was lost ({job.state}); run the same command again")
            yield JobReturn(overrides=case.overrides, status=JobStatus.COMPLETED)
