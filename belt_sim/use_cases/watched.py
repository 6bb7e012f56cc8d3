"""Watching a simulation: a 3D run while it goes on, an analytic one when it is done."""

import sys
from pathlib import Path

from belt_sim.analytic.model import AnalyticModel
from belt_sim.errors import InputError
from belt_sim.frame import Observer
from belt_sim.model import Model, SteadyModel
from belt_sim.results.simulation import Simulation


def observers_of(model: Model | SteadyModel, watch: str | None, title: str, folder: Path) -> list[Observer]:
    """Who looks on while ``model`` runs: progress, and with watch = "rrd" a recording, "rerun" and "viewer" the live
    viewers of Rerun and MuJoCo."""
    if watch == "viewer" and getattr(model, "engine", None) != "native":
        raise InputError("watch", watch, "", "only a 3D belt of engine=native is MuJoCo's; use watch=rerun")
    if isinstance(model, AnalyticModel) or not isinstance(model, Model):
        return []
    if watch is None and getattr(model, "engine", None) == "quasi_static":  # one compiled call
        return []
    from belt_sim.watch.progress import ProgressObserver

    watching: list[Observer] = [ProgressObserver(title)]
    if watch == "viewer":
        from belt_sim.watch.viewer import ViewerObserver

        watching.append(ViewerObserver())
    elif watch is not None:
        from belt_sim.watch.rerun import live, to_file

        watching.append(to_file(folder / "belt.rrd") if watch == "rrd" else live())
    return watching


def show(s: Simulation, model: Model | SteadyModel, watch: str | None, folder: Path) -> None:
    """An analytic run as a recording in ``folder``, or in the Rerun viewer, which stays open until Enter is pressed."""
    if watch is None or s.curves is None or not isinstance(model, AnalyticModel):
        return
    if watch == "rrd":
        from belt_sim.watch.record import record_curves

        record_curves(folder / "belt.rrd", {s.model: s.curves}, case=s.case)
        return
    from belt_sim.watch.drawn_curves import frames
    from belt_sim.watch.rerun import live

    viewer = live()
    viewer.start(s.case, s.travel)
    for frame in frames(s.case, s.curves):
        viewer.frame(frame)
    viewer.finish(s.curves)
    if sys.stdin.isatty():
        input("press Enter to close the viewer")
