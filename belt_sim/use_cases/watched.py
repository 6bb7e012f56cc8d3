"""Watching a simulation: a 3D run in time while it goes on, all others when they are done."""

import sys
import time
from pathlib import Path

from belt_sim.analytic.model import AnalyticModel
from belt_sim.errors import InputError
from belt_sim.frame import Observer
from belt_sim.model import Model, SteadyModel
from belt_sim.results.simulation import Simulation
from belt_sim.use_cases.leave import CurvesSoFar

RECORDING = "belt.rrd"
WATCHED = ("native", "mjx")  # engines that show their instants as they go


def in_time(model: Model | SteadyModel) -> bool:
    """Whether a run of the model goes through its instants one by one, so that it can be watched meanwhile."""
    return not isinstance(model, AnalyticModel) and isinstance(model, Model) and _engine(model) in WATCHED


def _engine(model: Model | SteadyModel) -> str:
    return getattr(model, "engine", "native")


def observers_of(model: Model | SteadyModel, watch: str | None, title: str, folder: Path) -> list[Observer]:
    """Who looks on while ``model`` runs in time: progress, curves so far, with watch = "rrd" a recording, "rerun" and
    "viewer" the live viewers of Rerun and MuJoCo."""
    if watch == "viewer" and getattr(model, "engine", None) != "native":
        raise InputError("watch", watch, "", "only a 3D belt of engine=native is MuJoCo's; use watch=rerun")
    if not in_time(model):
        return []
    from belt_sim.watch.progress import ProgressObserver

    watching: list[Observer] = [ProgressObserver(title), CurvesSoFar(folder)]
    if watch == "viewer":
        from belt_sim.watch.viewer import ViewerObserver

        watching.append(ViewerObserver())
    elif watch is not None:
        from belt_sim.watch.rerun import live, to_file

        watching.append(to_file(folder / RECORDING) if watch == "rrd" else live())
    return watching


def show(s: Simulation, model: Model | SteadyModel, watch: str | None, folder: Path) -> None:
    """Record a finished run in ``folder``, or show it in the Rerun viewer until Enter is pressed.

    A viewer that is a web page of this process is served until Ctrl-C; with nobody at the terminal the run is recorded.
    """
    if watch in (None, "viewer") or s.curves is None:
        return
    if watch == "rrd":
        if not in_time(model):
            _record(s, folder)
        return
    from belt_sim.watch.asked import has_display
    from belt_sim.watch.drawn_curves import frames
    from belt_sim.watch.rerun import live

    if not in_time(model):
        viewer = live()
        viewer.start(s.case, s.travel)
        for frame in frames(s.case, s.curves):
            viewer.frame(frame)
        viewer.finish(s.curves)
    if not sys.stdin.isatty():
        print(f"the viewer ends with this process; rerun {_record(s, folder)} shows the run again")
    elif has_display():
        if not in_time(model):
            input("press Enter to close the viewer")
    else:
        print("the page is served until Ctrl-C")
        try:
            while True:
                time.sleep(1.0)
        except KeyboardInterrupt:
            print()


def _record(s: Simulation, folder: Path) -> Path:
    from belt_sim.watch.record import record_curves

    assert s.curves is not None
    record_curves(folder / RECORDING, {s.model: s.curves}, case=s.case)
    return folder / RECORDING
