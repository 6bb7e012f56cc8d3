"""A recording of what was measured and what models say of it, run by run."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.pictures.style import AFTER, BEFORE, CYCLE, pale
from belt_sim.si import MM
from belt_sim.watch.geometry import frames as belt_frames
from belt_sim.watch.geometry import view_scale_of
from belt_sim.watch.rerun import APPLICATION, RecordingFile
from belt_sim.watch.scene import TRAVEL, Scene, plot, scale_words, space, style_series, time_panel

MRAD = 1e-3
MEASURED_NAME = "measured"
MEASURED_COLOUR = "#6b7785"  # readable on Rerun's light and dark grounds
MODELS = (BEFORE, AFTER, *CYCLE[2:])
#: Pictures of the belt in a recording; each run has its share, within FEWEST and MOST.
PICTURES, FEWEST, MOST = 400, 20, 120
ROWS = 200  # of a model's curves, at most, in a run


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """One run: the curves that models gave it, by name; what was measured (else NaN); its case.

    The picture in space is the last model's belt in the machine of ``case``; without a case there is none.
    """

    modelled: Mapping[str, Curves] = field(default_factory=dict)
    measured: Curves | None = None
    case: Case | None = None

    @property
    def last_curves(self) -> Curves:
        return list(self.modelled.values())[-1]

    @property
    def length(self) -> float:
        return float(self.last_curves.travel[-1] - self.last_curves.travel[0])


def record_runs(path: str | os.PathLike, runs: Mapping[str, Overlay]) -> None:
    """Write any number of runs to ``path`` (.rrd), one tab a run, all on the travel timeline.

    Logged under runs/RUN, a column a curve: y/NAME (points 1-4 [mm]; where some were measured, those), residual/NAME
    (model - measured [mm], at the travel of the measurement), tilt/NAME (upper, lower [mrad]); belt (movements
    enlarged as the view's name says).
    """
    file, recording = RecordingFile(path), rr.RecordingStream(APPLICATION)
    file.open(recording)
    tabs = [_tab(name, overlay) for name, overlay in runs.items()]
    body = rrb.Tabs(*tabs) if len(tabs) > 1 else tabs[0]
    panels = rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    rr.send_blueprint(rrb.Blueprint(body, time_panel(live=False), *panels), recording=recording)
    pictures = min(max(PICTURES // len(runs), FEWEST), MOST)
    for name, overlay in runs.items():
        _log_run(recording, name, overlay, pictures)
    file.close()


def path_part(name: str) -> str:
    """A name as one part of a path: letters, digits, . and - stay, anything else becomes _."""
    return re.sub(r"[^\w.-]+", "_", name)


def _log_run(recording: rr.RecordingStream, run: str, overlay: Overlay, pictures: int) -> None:
    """Log one run, the belt in space at most ``pictures`` times."""
    root, measured = f"runs/{path_part(run)}", overlay.measured
    wanted = [True] * 4 if measured is None else np.isfinite(np.asarray(measured.y, float)).any(axis=1)

    def log(kind: str, name: str, travel: Any, rows: Mapping[str, np.ndarray], colour: str, width: float) -> None:
        """Time series of one name at once, those of the head pulley and the lower span paler.

        Travel [m] at which none is finite was not measured and is left out; width [px].
        """
        known, path = np.isfinite(list(rows.values())).any(axis=0), f"{root}/{kind}/{path_part(name)}"
        if not known.any():
            return
        values = np.column_stack(list(rows.values()))[known]
        colours = [pale(colour) if label.startswith(("3", "4", "lower")) else colour for label in rows]
        style_series(recording, path, list(rows), colours, width)
        index = rr.TimeColumn(TRAVEL, sequence=np.rint(np.asarray(travel, float)[known] / MM).astype(np.int64))
        shown = rr.Scalars.columns(scalars=values.ravel()).partition([len(rows)] * len(values))
        rr.send_columns(path, [index], shown, recording=recording)

    def log_curves(name: str, curves: Curves, colour: str, width: float = 2.0) -> None:
        """Points 1-4 [mm], of which some were measured, and tilts [mrad]."""
        log("y", name, curves.travel, points(np.asarray(curves.y, float), name), colour, width)
        if curves.tilt is not None and np.any(curves.tilt):
            upper, lower = np.asarray(curves.tilt, float) / MRAD
            log("tilt", name, curves.travel, {f"upper {name}": upper, f"lower {name}": lower}, colour, width)

    def points(y: np.ndarray, name: str) -> dict[str, np.ndarray]:
        return {f"{k + 1} {name}": y[k] / MM for k in range(4) if wanted[k]}

    for k, (name, curves) in enumerate(overlay.modelled.items()):
        colour = MODELS[k % len(MODELS)]
        log_curves(name, _fewer(curves), colour)
        if measured is not None:
            at, known = np.asarray(measured.travel, float), np.asarray(curves.travel, float)
            modelled = [np.interp(at, known, y, left=np.nan, right=np.nan) for y in np.asarray(curves.y, float)]
            log("residual", name, at, points(np.array(modelled) - np.asarray(measured.y), name), colour, 2.0)
    if measured is not None:
        log_curves(MEASURED_NAME, measured, MEASURED_COLOUR, width=1.2)
    if overlay.case is not None and overlay.modelled:
        scene = Scene(recording, f"{root}/belt", overlay.case, view_scale_of(overlay.case, overlay.length))
        scene.frames(list(belt_frames(overlay.case, overlay.last_curves, every=max(overlay.length / pictures, 0.1))))


def _fewer(curves: Curves) -> Curves:
    """Every so many rows of a model's smooth curves, ROWS at most, the last among them."""
    n = len(curves.travel)
    rows = np.arange(n)[:: -(-n // ROWS)]
    rows = rows if rows[-1] == n - 1 else np.append(rows, n - 1)
    tilt = None if curves.tilt is None else np.asarray(curves.tilt, float)[:, rows]
    return Curves(travel=np.asarray(curves.travel, float)[rows], y=np.asarray(curves.y, float)[:, rows], tilt=tilt)


def _tab(run: str, overlay: Overlay) -> rrb.Container:
    """One run: the points beside the residuals and the tilt, the belt in space above."""
    root = f"runs/{path_part(run)}"
    every = [*overlay.modelled.values(), *([overlay.measured] if overlay.measured is not None else [])]
    travel = max(float(curves.travel[-1]) for curves in every)
    plots = [plot(f"{root}/y", f"{run}: lateral position y of points 1-4 [mm] over travel [mm]", travel)]
    if overlay.measured is not None:
        plots.append(plot(f"{root}/residual", "Residual: model - measured [mm]", travel))
    if any(c.tilt is not None for c in overlay.modelled.values()):
        plots.append(plot(f"{root}/tilt", "Tilt at mid-span [mrad]", travel))
    row = rrb.Horizontal(*plots, name=run)
    if overlay.case is None or not overlay.modelled:
        return row
    scale = view_scale_of(overlay.case, overlay.length)
    title = f"{run}, {list(overlay.modelled)[-1]}: {scale_words(overlay.case, scale)}"
    picture = space(overlay.case, f"{root}/belt", title, scale)
    return rrb.Vertical(picture, row, row_shares=[1, 1], name=run)
