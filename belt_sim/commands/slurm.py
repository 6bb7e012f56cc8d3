"""The cases of a sweep as an array of Slurm jobs, by submitit.

Only what is missing is submitted; a job that is lost (killed, out of memory or of time) is listed and stops nothing.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from belt_sim.commands.run_dir import Outcome, RunDir, fail, run_case
from belt_sim.errors import BeltError

ASKED_EVERY = 30.0  # [s], at least, of Slurm, whether a job has been lost
#: settings of a job that submitit knows for every kind of cluster; the others are Slurm's
_COMMON = ("timeout_min", "cpus_per_task", "mem_gb", "name")
_OURS = ("cases_per_job", "folder", "cluster")


def on_slurm(runs: Sequence[RunDir], settings: Mapping[str, Any]) -> Iterator[tuple[int, Outcome]]:
    """Number and outcome of every case: what is missing is submitted and waited for, what was done is looked up."""
    due = [k for k, run in enumerate(runs) if run.why_not_done() is not None]
    yield from ((k, run_case(runs[k])) for k in range(len(runs)) if k not in due)
    size = max(int(settings["cases_per_job"]), 1)
    bundles = [due[k : k + size] for k in range(0, len(due), size)]
    print(f"{len(due)} of {len(runs)} cases to run, in {len(bundles)} jobs", flush=True)
    jobs = submitted([[runs[k] for k in bundle] for bundle in bundles], settings)
    for bundle, job in zip(bundles, jobs, strict=True):
        yield from zip(bundle, _collected([runs[k] for k in bundle], job), strict=True)


def run_cases(runs: Sequence[RunDir]) -> list[Outcome]:
    """What a job does."""
    from belt_sim.jax_setup import prepare

    prepare(space=any(run.config.get("engine") not in (None, "native") for run in runs))
    return [run_case(run) for run in runs]


def submitted(bundles: Sequence[Sequence[RunDir]], settings: Mapping[str, Any]) -> list[Any]:
    """A job of submitit a bundle."""
    if not bundles:
        return []
    try:
        import submitit
    except ImportError as missing:
        raise BeltError("Slurm needs submitit: pip install 'belt-sim[sweeps]'") from missing
    given = {k: v for k, v in settings.items() if v is not None and k not in _OURS and not k.startswith("_")}
    try:
        executor = submitit.AutoExecutor(folder=settings["folder"], cluster=settings["cluster"])
        executor.update_parameters(**{k if k in _COMMON else f"slurm_{k}": v for k, v in given.items()})
        return list(executor.map_array(run_cases, bundles))
    except (RuntimeError, OSError, ValueError, NameError) as error:  # no sbatch, an unknown partition ...
        raise BeltError(f"hydra.launcher: {' '.join(str(error).split())}") from error


def _wait(job: Any) -> None:
    """Until the job has ended. A lost one leaves no file: submitit by itself asks Slurm ever less often."""
    asked = time.monotonic()
    while not job.done():
        time.sleep(0.5)
        if time.monotonic() - asked > ASKED_EVERY:
            job.done(force_check=True)
            asked = time.monotonic()


def _collected(runs: Sequence[RunDir], job: Any) -> Iterator[Outcome]:
    """Outcomes of the cases of a job; of a job that was lost, why."""
    from submitit.core.utils import UncompletedJobError

    try:
        _wait(job)
        yield from job.results()[0]
    except UncompletedJobError:
        message = f"job {job.job_id} was lost ({job.state}); run the same command again"
        for run in runs:
            if run.why_not_done() is None:
                yield Outcome()
            else:
                fail(run, message)
                yield Outcome(failure=message)
