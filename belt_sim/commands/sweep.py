"""A sweep: cases one after another, in batches, shared over processes or over Slurm; then one table and one picture.

Cases that are there already, unharmed and of today's inputs, are kept; cases that fail are listed and stop nothing.
"""

import os
import signal
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import IntervalSweep
from hydra.errors import HydraException

from belt_sim.commands.command_line import Request, case_of
from belt_sim.commands.run_dir import Outcome, RunDir, run_case
from belt_sim.errors import BeltError, whole
from belt_sim.files import clear_drafts, read_json, write_text, write_with
from belt_sim.jax_setup import cores

LOST = "its process was lost (memory?); run the same command again"


def run_sweep(request: Request) -> int:
    """Run the cases of a sweep and leave sweep.csv with its pictures; returns the exit status."""
    assert request.folder is not None
    clear_drafts(request.folder)
    if request.searcher != "basic":
        runs, outcomes = search(request)
    else:
        runs, found = list(request.runs), dict(_outcomes(request))
        outcomes = [found[k] for k in range(len(runs))]
    if runs and runs[0].command == "simulate":
        _tabulate(request, runs, outcomes)
    return 1 if any(o.failure for o in outcomes) else 0


def _outcomes(request: Request) -> Iterator[tuple[int, Outcome]]:
    """Number and outcome of every case, by the launcher that was chosen."""
    runs, settings = request.runs, request.launching
    if request.launcher == "slurm":
        yield from on_slurm(runs, settings)
    elif request.launcher == "joblib":
        workers = settings["n_jobs"]
        yield from _run_in_processes(
            runs, cores() if workers == -1 else whole("hydra.launcher.n_jobs", workers), space=False
        )
    elif request.launcher == "batches":
        batch = settings["batch"]
        size = None if batch == "auto" else whole("hydra.launcher.batch", batch, otherwise="auto or ")
        workers = settings["workers"]
        workers = cores() if workers is None else whole("hydra.launcher.workers", workers, otherwise="null or ")
        yield from _by_engine(runs, size, workers)
    elif request.launcher == "basic":
        yield from ((k, run_case(run)) for k, run in enumerate(runs))
    else:
        raise BeltError(f"hydra/launcher = {request.launcher}: use basic, batches, joblib or slurm")


def _by_engine(runs: Sequence[RunDir], batch: int | None, workers: int) -> Iterator[tuple[int, Outcome]]:
    """Cases of a batched engine at once on a GPU (or where ``batch`` says so), else shared over processes."""
    from belt_sim.space.model import BATCH_ENGINES

    at_once = [k for k, run in enumerate(runs) if run.config.get("engine") in BATCH_ENGINES]
    due = [k for k in at_once if runs[k].why_not_done() is not None]
    yield from ((k, run_case(runs[k])) for k in range(len(runs)) if k not in due)
    if not due:
        return
    import jax

    if batch is None and jax.default_backend() == "cpu":
        found = _run_in_processes([runs[k] for k in due], min(workers, len(due)), space=True)
    else:
        found = _run_batches([runs[k] for k in due], batch)
    yield from ((due[k], outcome) for k, outcome in found)


def _run_batches(runs: Sequence[RunDir], batch: int | None) -> Iterator[tuple[int, Outcome]]:
    """Cases of like meshes in batches of ``batch`` (None: as many as fit), then each in its folder."""
    from belt_sim.api.simulate import run_in_batches

    for numbers, curves in run_in_batches([run.config for run in runs], batch):
        if len(numbers) > 1 and curves[0] is not None:
            print(f"{len(numbers)} cases at once", flush=True)
        for k, computed in zip(numbers, curves, strict=True):
            yield k, run_case(runs[k], computed=computed)


def _run_in_processes(runs: Sequence[RunDir], workers: int, *, space: bool) -> Iterator[tuple[int, Outcome]]:
    """Each case alone, by ``workers`` processes; none of them outlives this one."""
    if workers == 1 or len(runs) == 1:
        yield from ((k, run_case(run)) for k, run in enumerate(runs))
        return
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_begin_worker, initargs=(space,)) as pool:
        jobs = [pool.submit(run_case, run) for run in runs]
        for k, job in enumerate(jobs):
            try:
                yield k, job.result()
            except BrokenProcessPool:
                yield k, _outcome_of_lost(runs[k], LOST)


def _outcome_of_lost(run: RunDir, message: str) -> Outcome:
    """The outcome of a case whose process or job was lost; it has failed unless its files are there."""
    if run.why_not_done() is None:
        return Outcome()
    run.fail(message)
    return Outcome(failure=message)


def _begin_worker(space: bool) -> None:
    """In a worker: JAX as in its parent, and the end when the parent has been killed."""
    from belt_sim.jax_setup import prepare

    prepare(space)
    parent = parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=follow, daemon=True).start()


def _tabulate(request: Request, runs: Sequence[RunDir], outcomes: Sequence[Outcome]) -> None:
    """sweep.csv, sweep_curves.png and sweep_rates.png in the sweep's folder."""
    folder = request.folder
    assert folder is not None
    if len(runs) < 2:
        return
    rows, there = [], []
    for run, outcome in zip(runs, outcomes, strict=True):
        typed = dict(o.lstrip("+").split("=", 1) for o in run.overrides)
        row = {"run": run.path.name} | {key: typed[key] for key in request.swept if key in typed}
        told: dict[str, Any] = {"failed": outcome.failure}
        if not outcome.failure:
            try:
                summary = read_json(run.path / "summary.json")
                told = _row(summary)
                there.append((run.path, summary))
            except (BeltError, OSError, KeyError, TypeError) as error:
                told = {"failed": f"summary.json is damaged: {error}"}
        rows.append(row | told)
    rows.sort(key=lambda row: row.get("failed") is not None)
    table = pd.DataFrame(rows)
    write_with(folder / "sweep.csv", lambda path: table.to_csv(path, index=False))
    if there:
        asked = runs[0].config
        _draw(folder, there, pictures=asked.get("pictures") is True, recorded=asked.get("watch") == "rrd")
    failed = len(runs) - len(there)
    said = f"sweep of {len(runs)} runs" + (f", {failed} of them failed" if failed else "")
    print(f"{said}: {folder / 'sweep.csv'}", flush=True)


def _row(summary: Mapping[str, Any]) -> dict[str, Any]:
    row = {k: summary[k] for k in ("model", "tension_n_per_mm2", "yaw_deg", "travel_m")}
    row |= {f"rate{k}_mm_per_m": v for k, v in summary["rate_mm_per_m"].items()}
    row |= {f"offset_{k}_mm": v for k, v in summary["offset_mm"].items()}
    return row | {"steady_rate_mm_per_m": summary.get("steady_rate_mm_per_m"), "failed": None}


def _draw(folder: Path, runs: Sequence[tuple[Path, Mapping[str, Any]]], *, pictures: bool, recorded: bool) -> None:
    """Pictures of a sweep, and one recording of all its runs where they were recorded."""
    from belt_sim.commands.outputs import numbers_first
    from belt_sim.show.sweep import draw_sweep, read_run, record_sweep

    with numbers_first("the pictures of the sweep"):
        finished = [read_run(path) for path, _ in runs]
        if pictures:
            draw_sweep(folder, finished)
        if recorded and any(run.curves is not None for run in finished):
            record_sweep(folder / "sweep.rrd", finished)


# A search by Optuna: which settings make the number small (or large) that a run returns. The settings are those of
# Hydra's group ``hydra/sweeper: optuna``: direction, n_trials, sampler, params.


def search(request: Request) -> tuple[list[RunDir], list[Outcome]]:
    """Run the trials of a search and leave optimization_results.yaml with the best; returns all of them."""
    if request.searcher != "optuna":
        raise BeltError(f"hydra/sweeper = {request.searcher}: use basic or optuna")
    try:
        import optuna
        from hydra.utils import instantiate
    except ImportError as missing:
        raise BeltError("a search needs Optuna: pip install 'belt-sim[sweeps]'") from missing
    settings = request.searching
    trials = whole("hydra.sweeper.n_trials", settings["n_trials"])
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    direction = str(settings["direction"]).rpartition(".")[2]
    named = {name: settings[name] for name in ("storage", "study_name")}
    sampler = instantiate(settings["sampler"])
    study = optuna.create_study(sampler=sampler, direction=direction, **named, load_if_exists=True)
    fixed, ranges = _split(request)
    runs, outcomes = [], []
    for number in range(trials):
        trial = study.ask()
        tried = [f"{key}={suggest(trial, key, ranges[key])}" for key in ranges]
        runs.append(case_of(request.command, request, [*fixed, *tried], number))
        outcomes.append(run_case(runs[-1]))
        value = outcomes[-1].value
        state = optuna.trial.TrialState.FAIL if value is None else optuna.trial.TrialState.COMPLETE
        study.tell(trial, value, state=state)
    best = {"name": "optuna", "best_params": dict(study.best_params), "best_value": study.best_value}
    assert request.folder is not None
    write_text(request.folder / "optimization_results.yaml", yaml.safe_dump(best, sort_keys=False))
    print(f"best of {trials}: {best['best_value']:.4g} with {best['best_params']}")
    return runs, outcomes


def _split(request: Request) -> tuple[list[str], dict[str, Any]]:
    """Overrides that all trials share, and the range or the choices of each key that is tried."""
    fixed, ranges = [], {}
    try:
        parsed = OverridesParser.create().parse_overrides(list(request.lines))
    except HydraException as error:
        raise BeltError(f"hydra.sweeper.params: {str(error).splitlines()[0]}") from error
    for override in parsed:
        if not override.is_sweep_override():
            fixed.append(str(override.input_line))
        elif override.is_interval_sweep():
            ranges[override.get_key_element()] = override.value()
        else:
            ranges[override.get_key_element()] = list(override.sweep_string_iterator())
    return fixed, ranges


def suggest(trial: Any, key: str, among: IntervalSweep | Sequence[str] | Mapping[str, Any]) -> Any:
    """What Optuna tries next for a key."""
    if not isinstance(among, IntervalSweep):
        return trial.suggest_categorical(key, among)
    low, high = among.start or 0.0, among.end or 0.0
    if (isinstance(low, int) and isinstance(high, int)) or "int" in among.tags:
        return trial.suggest_int(key, int(low), int(high), log="log" in among.tags)
    return trial.suggest_float(key, low, high, log="log" in among.tags)


# The cases of a sweep as an array of Slurm jobs, by submitit. Only what is missing is submitted; a job that is lost
# (killed, out of memory or of time) is listed and stops nothing.


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
    jobs = submit_jobs([[runs[k] for k in bundle] for bundle in bundles], settings)
    for bundle, job in zip(bundles, jobs, strict=True):
        yield from zip(bundle, _collect_outcomes([runs[k] for k in bundle], job), strict=True)


def run_cases(runs: Sequence[RunDir]) -> list[Outcome]:
    """What a job does."""
    from belt_sim.jax_setup import prepare

    prepare(space=any(run.config.get("engine") not in (None, "native") for run in runs))
    return [run_case(run) for run in runs]


def submit_jobs(bundles: Sequence[Sequence[RunDir]], settings: Mapping[str, Any]) -> list[Any]:
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


def _collect_outcomes(runs: Sequence[RunDir], job: Any) -> Iterator[Outcome]:
    from submitit.core.utils import UncompletedJobError

    asked = time.monotonic()
    try:
        while not job.done():
            time.sleep(0.5)
            if time.monotonic() - asked > ASKED_EVERY:  # by itself submitit asks Slurm ever less often
                job.done(force_check=True)
                asked = time.monotonic()
        yield from job.results()[0]
    except UncompletedJobError:
        message = f"job {job.job_id} was lost ({job.state}); run the same command again"
        yield from (_outcome_of_lost(run, message) for run in runs)
