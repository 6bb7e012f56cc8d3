"""A sweep as Hydra calls us: its folder locked, its cases noted, at its end one table and pictures.

Every case, in whatever process, adds a line to ``.cases`` in the sweep's folder when it begins and when it has ended:
its number, its folder, its overrides, why it failed, in JSON. The last line of each becomes a row of sweep.csv.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from belt_sim.errors import BeltError, InputError
from belt_sim.io import clear_drafts, read_json, write_with

try:
    import fcntl
except ImportError:  # not on this system: sweeps in one folder at once are the user's business
    fcntl = None  # type: ignore[assignment]

NOTES = ".cases"
LOST = "its process or job was lost (killed, out of memory or of time); run the same command again"
#: of the run or sweep of this process: its lock, its configuration, and lines about what failed
at_work: dict[str, Any] = {}


class Sweep(Callback):
    """Hydra's callback. stop_after: a sweep whose first so many cases fail alike stops; None: it tries all."""

    def __init__(self, stop_after: int | None = 5) -> None:
        self.stop_after = stop_after

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Lock the folder; end the process where another sweep is at work there, or a search has nothing to seek.

        Hydra only warns of what a callback raises.
        """
        try:
            begin(config)
        except BeltError as error:
            print(f"belt-sim: {error}", file=sys.stderr)
            sys.exit(1)

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Write the table and pictures."""
        finish()


def begin(config: DictConfig) -> None:
    """Lock the folder of a sweep and begin its notes; raises InputError."""
    folder = Path(config.hydra.sweep.dir)
    seeks = OmegaConf.select(config, "hydra.sweeper.direction") is not None
    if seeks and OmegaConf.select(config, "objective") is None:
        remedy = "a search makes a number small: state it, as objective={start: 10, within: 0.5, beyond: 0.2}"
        raise InputError("objective", "null", "", remedy)
    if seeks:
        import optuna

        optuna.logging.set_verbosity(optuna.logging.WARNING)
    folder.mkdir(parents=True, exist_ok=True)
    clear_drafts(folder)
    lock = (folder / NOTES).open("a")
    if fcntl is not None:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            remedy = "another sweep is at work there; wait for it, or give this one a folder of its own"
            raise InputError("hydra.sweep.dir", str(folder), "", remedy) from error
    lock.truncate(0)
    at_work.update(config=config, lock=lock)


def note(hydra: DictConfig, name: str, failure: str) -> None:
    """Note how a run or case has ended; a failure is told, once where several cases fail alike. LOST: it begins."""
    if hydra.mode != RunMode.MULTIRUN:
        if failure:
            at_work.setdefault("failures", []).append(failure)
            print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
        return
    if failure not in ("", LOST) and all(case["failed"] != failure for case in noted(hydra)):
        print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
    line = {"number": hydra.job.num, "run": name, "overrides": list(hydra.overrides.task)}
    with suppress(OSError), (Path(hydra.sweep.dir) / NOTES).open("a", encoding="utf-8") as file:
        file.write(json.dumps(line | {"failed": failure}) + "\n")


def noted(hydra: DictConfig) -> Iterator[dict[str, Any]]:
    """The beginnings and ends of a sweep's cases, in their order."""
    with suppress(OSError, ValueError), (Path(hydra.sweep.dir) / NOTES).open(encoding="utf-8") as file:
        for line in file:
            yield json.loads(line)


def failing_alike(hydra: DictConfig) -> str:
    """Why the first cases of a sweep failed, where all of them did so alike; else empty."""
    most = OmegaConf.select(hydra, "callbacks.sweep.stop_after")
    if most is None:
        return ""
    first = list(islice((case["failed"] for case in noted(hydra) if case["failed"] != LOST), most))
    return first[0] if len(first) == most and len(set(first)) == 1 else ""


def stop_if_all_fail_alike(hydra: DictConfig) -> None:
    """Raise BeltError where the first cases of a sweep have failed alike."""
    if why := failing_alike(hydra):
        most = hydra.callbacks.sweep.stop_after
        key = "hydra.callbacks.sweep.stop_after"
        raise BeltError(f"the first {most} cases failed alike ({why}): the sweep stops; {key}=null tries all cases")


def finish() -> None:
    """The table, pictures and recording of the sweep of this process; its lock is given back."""
    config = at_work.pop("config", None)
    if config is None:
        return
    folder = Path(config.hydra.sweep.dir)
    cases = [case for _, case in sorted({case["number"]: case for case in noted(config.hydra)}.items())]
    failures = [case["failed"] for case in cases if case["failed"]]
    at_work.setdefault("failures", []).extend(failures)
    best = folder / "optimization_results.yaml"
    if len(cases) > 1 and OmegaConf.select(config, "hydra.job.name") == "simulate":
        _tabulate(config, folder, cases)
    if OmegaConf.select(config, "hydra.sweeper.direction") is not None and best.is_file():
        if len(failures) == len(cases):
            best.unlink()
            print(f"belt-sim: none of the {len(cases)} trials came to its end", file=sys.stderr)
        else:
            found = OmegaConf.to_container(OmegaConf.load(best))
            assert isinstance(found, dict)
            print(f"best of {len(cases)}: {found.get('best_value')} with {found.get('best_params')}")
    (folder / NOTES).unlink(missing_ok=True)
    at_work.pop("lock").close()


def _tabulate(config: DictConfig, folder: Path, cases: Sequence[Mapping[str, Any]]) -> None:
    import pandas as pd

    rows, there = [], []
    typed = [dict(o.lstrip("+").split("=", 1) for o in case["overrides"] if "=" in o) for case in cases]
    swept = [key for key in typed[0] if len({own.get(key) for own in typed}) > 1]
    for case, own in zip(cases, typed, strict=True):
        row = {"run": case["run"]} | {key: own[key] for key in swept if key in own}
        told: dict[str, Any] = {"failed": case["failed"] or None}
        if not case["failed"]:
            try:
                summary = read_json(folder / case["run"] / "summary.json")
                told = _row(summary)
                there.append((folder / case["run"], summary))
            except (BeltError, OSError, KeyError, TypeError) as error:
                told = {"failed": f"summary.json is damaged: {error}"}
        rows.append(row | told)
    rows.sort(key=lambda row: row.get("failed") is not None)
    table = pd.DataFrame(rows)
    write_with(folder / "sweep.csv", lambda path: table.to_csv(path, index=False))
    if there:
        _draw(folder, there, pictures=config.pictures is True, recorded=config.watch == "rrd")
    failed = len(rows) - len(there)
    said = f"sweep of {len(rows)} runs" + (f", {failed} of them failed" if failed else "")
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
