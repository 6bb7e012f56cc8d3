"""A sweep: cases one after another, in batches, shared over processes or over Slurm; then one table and one picture.

Cases that are there already, unharmed and of today's inputs, are kept; cases that fail are listed and stop nothing.
"""

import os
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import Any

import pandas as pd

from belt_sim.commands.command_line import Request
from belt_sim.commands.run_dir import Outcome, RunDir, fail, run_case
from belt_sim.cores import cores
from belt_sim.curves import Curves
from belt_sim.errors import BeltError
from belt_sim.files import clear_drafts, read_json, write_with
from belt_sim.whole_number import whole

MIN_TENSIONS = 3  # from here on a picture of rates against tension says something
CURVES_SHOWN = 9
LOST = "its process was lost (memory?); run the same command again"


def run_sweep(request: Request) -> int:
    """Run the cases of a sweep and leave sweep.csv with its pictures; returns the exit status."""
    assert request.folder is not None
    clear_drafts(request.folder)
    if request.searcher != "basic":
        from belt_sim.commands.search import search

        runs, outcomes = search(request)
    else:
        runs = list(request.runs)
        found = dict(_outcomes(request))
        outcomes = [found[k] for k in range(len(runs))]
    if runs and runs[0].command == "simulate":
        _tabulate(request, runs, outcomes)
    return 1 if any(o.failure for o in outcomes) else 0


def _outcomes(request: Request) -> Iterator[tuple[int, Outcome]]:
    """Number and outcome of every case, by the launcher that was chosen."""
    runs, settings = request.runs, request.launching
    if request.launcher == "slurm":
        from belt_sim.commands.slurm import on_slurm

        yield from on_slurm(runs, settings)
    elif request.launcher == "joblib":
        workers = settings["n_jobs"]
        yield from _shared(runs, cores() if workers == -1 else whole("hydra.launcher.n_jobs", workers), space=False)
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
    from belt_sim.mujoco3d.model import BATCH_ENGINES

    at_once = [k for k, run in enumerate(runs) if run.config.get("engine") in BATCH_ENGINES]
    due = [k for k in at_once if runs[k].why_not_done() is not None]
    yield from ((k, run_case(runs[k])) for k in range(len(runs)) if k not in due)
    if not due:
        return
    import jax

    if batch is None and jax.default_backend() == "cpu":
        found = _shared([runs[k] for k in due], min(workers, len(due)), space=True)
    else:
        found = _together([runs[k] for k in due], batch)
    yield from ((due[k], outcome) for k, outcome in found)


def _together(runs: Sequence[RunDir], batch: int | None) -> Iterator[tuple[int, Outcome]]:
    """Cases of like meshes in batches of ``batch`` (None: as many as fit), then each in its folder."""
    from belt_sim.api.simulate import run_in_batches

    for numbers, curves in run_in_batches([run.config for run in runs], batch):
        if len(numbers) > 1 and curves[0] is not None:
            print(f"{len(numbers)} cases at once", flush=True)
        for k, computed in zip(numbers, curves, strict=True):
            yield k, run_case(runs[k], computed=computed)


def _shared(runs: Sequence[RunDir], workers: int, *, space: bool) -> Iterator[tuple[int, Outcome]]:
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
                if runs[k].why_not_done() is not None:
                    fail(runs[k], LOST)
                    yield k, Outcome(failure=LOST)
                else:
                    yield k, Outcome()


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
        row = {"run": run.path.name} | _swept(run, request.swept)
        try:
            summary = {} if outcome.failure else read_json(run.path / "summary.json")
            rows.append(row | (_row(summary) if summary else {"failed": outcome.failure}))
        except (BeltError, OSError, KeyError, TypeError) as error:
            outcome = Outcome(failure=f"summary.json is damaged: {error}")
            rows.append(row | {"failed": outcome.failure})
        if not outcome.failure:
            there.append((run.path, summary))
    rows.sort(key=lambda row: row.get("failed") is not None)
    table = pd.DataFrame(rows)
    write_with(folder / "sweep.csv", lambda path: table.to_csv(path, index=False))
    if there and runs[0].config.get("pictures", False):
        _draw(folder, there, table.head(len(there)))
    failed = len(runs) - len(there)
    said = f"sweep of {len(runs)} runs" + (f", {failed} of them failed" if failed else "")
    print(f"{said}: {folder / 'sweep.csv'}", flush=True)


def _swept(run: RunDir, swept: Sequence[str]) -> dict[str, str]:
    """Swept keys of a case with its values as typed."""
    typed = dict(o.lstrip("+").split("=", 1) for o in run.overrides)
    return {key: typed[key] for key in swept if key in typed}


def _row(summary: Mapping[str, Any]) -> dict[str, Any]:
    row = {k: summary[k] for k in ("model", "tension_n_per_mm2", "yaw_deg", "travel_m")}
    row |= {f"rate{k}_mm_per_m": v for k, v in summary["rate_mm_per_m"].items()}
    row |= {f"offset_{k}_mm": v for k, v in summary["offset_mm"].items()}
    return row | {"steady_rate_mm_per_m": summary.get("steady_rate_mm_per_m"), "failed": None}


def _draw(folder: Path, runs: Sequence[tuple[Path, Mapping[str, Any]]], table: pd.DataFrame) -> None:
    from belt_sim.pictures import Rates, curves_picture, rates_picture

    shown = {f"{s['model']} {s['tension_n_per_mm2']:g} N/mm²": p / "curves.csv" for p, s in runs}
    curves = {name: _curves(path) for name, path in shown.items() if path.is_file()}
    if 1 < len(curves) <= CURVES_SHOWN:
        curves_picture(folder / "sweep_curves.png", curves, "Points 1-4 against travel")
    rates = {}
    for name, rows in table.sort_values("tension_n_per_mm2").groupby("model", sort=False):
        if rows["tension_n_per_mm2"].nunique() >= MIN_TENSIONS:
            tension, rate = rows["tension_n_per_mm2"].to_numpy(), rows["rate1_mm_per_m"].to_numpy()
            rates[str(name)] = Rates(tension=tension, rate=rate)
    if rates:
        rates_picture(folder / "sweep_rates.png", rates, "Late rate of point 1 against tension")


def _curves(path: Path) -> Curves:
    table = pd.read_csv(path)
    y = table[[f"y{k}_mm" for k in (1, 2, 3, 4)]].to_numpy().T * 1e-3
    return Curves(travel=table["travel_m"].to_numpy(), y=y)
