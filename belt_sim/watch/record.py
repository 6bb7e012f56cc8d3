"""A recording of what was measured and what models say of it, run by run."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.pictures.colours import AFTER, BEFORE, CYCLE
from belt_sim.si import MM
from belt_sim.watch import blueprint, drawn_curves, series
from belt_sim.watch.rerun import APPLICATION, RecordingFile, send_blueprint
from belt_sim.watch.scene import Scene
from belt_sim.watch.shape import lateral_scale

MRAD = 1e-3
MEASURED_NAME = "measured"
MEASURED_COLOUR = "#6b7785"  # readable on Rerun's light and dark grounds
MODELS = (BEFORE, AFTER, *CYCLE[2:])
PICTURES = 200  # at most so many pictures of the belt a run


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """One run: the curves that models gave it, by name; what was measured (else NaN); its case.

    The picture in space is the last model's belt in the machine of ``case``; without a case there is none.
    """

    modelled: Mapping[str, Curves] = field(default_factory=dict)
    measured: Curves | None = None
    case: Case | None = None


def record_curves(
    path: str | os.PathLike,
    named_curves: Mapping[str, Curves],
    measured: Curves | None = None,
    *,
    case: Case | None = None,
    run: str = "run",
) -> None:
    """Write one run's curves, residuals and belt to ``path`` (.rrd); BeltError when it cannot be written."""
    record_runs(path, {run: Overlay(modelled=named_curves, measured=measured, case=case)})


def record_runs(path: str | os.PathLike, runs: Mapping[str, Overlay]) -> None:
    """Write any number of runs to ``path`` (.rrd), one tab a run, all on the travel timeline.

    Logged under runs/RUN: y/NAME/y1..y4 [mm], residual/NAME/y1..y4 (model - measured [mm], at the travel of
    the measurement), tilt/NAME/upper, lower [mrad]; belt (movements enlarged as the view's name says).
    """
    file, recording = RecordingFile(path), rr.RecordingStream(APPLICATION)
    file.open(recording)
    tabs = []
    for name, overlay in runs.items():
        scale = _log_run(recording, name, overlay)
        tabs.append(_tab(name, overlay, scale))
    body = rrb.Tabs(*tabs) if len(tabs) > 1 else tabs[0]
    panels = rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    send_blueprint(recording, rrb.Blueprint(body, blueprint.time_panel(), *panels))
    file.close()


def path_part(name: str) -> str:
    """A name as one part of a path: letters, digits, . and - stay, anything else becomes _."""
    return re.sub(r"[^\w.-]+", "_", name)


def root_of(run: str) -> str:
    """Where a run is logged."""
    return f"runs/{path_part(run)}"


def _log_run(recording: rr.RecordingStream, run: str, overlay: Overlay) -> float:
    """Log one run; returns the lateral scale of its picture."""
    root, measured = root_of(run), overlay.measured
    for k, (name, curves) in enumerate(overlay.modelled.items()):
        colour = MODELS[k % len(MODELS)]
        _log_curves(recording, root, name, curves, colour, 2.0, shown=_measured_points(measured))
        if measured is not None:
            _log_residual(recording, root, name, curves, measured, colour)
    if measured is not None:
        _log_curves(recording, root, MEASURED_NAME, measured, MEASURED_COLOUR, 1.2)
    if overlay.case is None or not overlay.modelled:
        return 1.0
    return _log_picture(recording, root, overlay.case, list(overlay.modelled.values())[-1])


def _measured_points(measured: Curves | None) -> list[bool]:
    """Whether points 1-4 were measured; without a measurement all are of interest."""
    if measured is None:
        return [True] * 4
    return [bool(np.isfinite(row).any()) for row in np.asarray(measured.y, float)]


def _log_curves(
    recording: rr.RecordingStream,
    root: str,
    name: str,
    curves: Curves,
    colour: str,
    width: float,
    shown: Sequence[bool] = (True,) * 4,
) -> None:
    """Points 1-4 [mm] and the tilts [mrad] of one set of curves; points not ``shown`` start switched off."""
    for k, y in enumerate(np.asarray(curves.y, float)):
        path = f"{root}/y/{path_part(name)}/y{k + 1}"
        _column(recording, path, curves.travel, y / MM, f"y{k + 1} {name}", colour, width, shown[k])
    if curves.tilt is not None:
        for side, tilt in zip(("upper", "lower"), np.asarray(curves.tilt, float), strict=True):
            label = f"{side} {name}"
            _column(
                recording,
                f"{root}/tilt/{path_part(name)}/{side}",
                curves.travel,
                tilt / MRAD,
                label,
                colour,
                width,
            )


def _log_residual(
    recording: rr.RecordingStream, root: str, name: str, curves: Curves, measured: Curves, colour: str
) -> None:
    """model - measured at points 1-4 [mm], at the travel of the measurement."""
    at = np.asarray(measured.travel, float)
    outside = {"left": np.nan, "right": np.nan}  # the model says nothing beyond its own travel
    for k in range(4):
        model = np.interp(at, np.asarray(curves.travel, float), np.asarray(curves.y, float)[k], **outside)
        error = (model - np.asarray(measured.y, float)[k]) / MM
        path, label = f"{root}/residual/{path_part(name)}/y{k + 1}", f"y{k + 1} {name}"
        _column(recording, path, at, error, label, colour, 1.5)


def _column(
    recording: rr.RecordingStream,
    path: str,
    travel: np.ndarray,
    values: np.ndarray,
    label: str,
    colour: str,
    width: float,
    shown: bool = True,
) -> None:
    """One time series at once; what is not finite was not measured and is left out."""
    known = np.isfinite(values)
    if not known.any():
        return
    series.style(recording, path, label, colour, width, shown)
    millimetres = np.rint(np.asarray(travel, float)[known] / MM).astype(np.int64)
    index = rr.TimeColumn(series.TRAVEL, sequence=millimetres)
    rr.send_columns(path, [index], rr.Scalars.columns(scalars=values[known]), recording=recording)


def _log_picture(recording: rr.RecordingStream, root: str, case: Case, curves: Curves) -> float:
    """The belt in space, at most PICTURES times; returns its lateral scale."""
    length = float(curves.travel[-1] - curves.travel[0])
    scale = float(lateral_scale(case, length))
    scene = Scene(recording, f"{root}/belt", case, scale)
    for frame in drawn_curves.frames(case, curves, every=max(length / PICTURES, 0.1)):
        series.at(recording, frame.travel)
        scene.frame(frame)
    return scale


def _tab(run: str, overlay: Overlay, scale: float) -> rrb.Container:
    """One run: the points beside the residuals and the tilt, the belt in space above."""
    root = root_of(run)
    every = [*overlay.modelled.values(), *([overlay.measured] if overlay.measured is not None else [])]
    travel = max(float(curves.travel[-1]) for curves in every)
    plots = [blueprint.plot(f"{root}/y", f"{run}: lateral position [mm]", travel)]
    if overlay.measured is not None:
        plots.append(blueprint.plot(f"{root}/residual", "model - measured [mm]", travel))
    if any(c.tilt is not None for c in overlay.modelled.values()):
        plots.append(blueprint.plot(f"{root}/tilt", "tilt at mid-span [mrad]", travel))
    row = rrb.Horizontal(*plots, name=run)
    if overlay.case is None or not overlay.modelled:
        return row
    title = f"{run}: belt of {list(overlay.modelled)[-1]}; lateral movement, yaw and tilt x {scale:g}"
    return rrb.Vertical(blueprint.space(overlay.case, f"{root}/belt", title), row, row_shares=[2, 3], name=run)
