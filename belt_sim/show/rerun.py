"""Watch a belt in Rerun: live in a viewer, or as a recording on disk; runs of a campaign with what was measured."""

import contextlib
import math
import os
import re
import socket
import sys
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.curves import Curves, Frame
from belt_sim.errors import BeltError
from belt_sim.io import write_with
from belt_sim.show import geometry
from belt_sim.show.geometry import TRUE, ViewScale, full_colour_tilt, view_scale_of
from belt_sim.show.style import BLUE, CYCLE, FAINT_INK, GREEN, INK, POINT_COLOURS, RED, SHORT_POINT_NAMES, rgb
from belt_sim.show.terminal import has_display
from belt_sim.units import DEGREE, MM, N_PER_MM2

TRAVEL_LINE = "travel, 1 s = 1 m"  # Rerun has no timeline of lengths: of its kinds a duration alone reads 10 at 10 m
TIME_LINE = "time"

POINTS_TITLE = "Lateral position y of points 1-4 [mm] over travel [m]"
#: plots of a run that share a place -> their titles
LOADS = {"moment": "Entry moment [N m]", "tension": "Tension [N/mm2]", "slip": "Lateral slip [um]", "sag": "Sag [mm]",
         "further": "Further"}  # fmt: skip
#: SI name -> (plot, label, colour, SI units in one unit drawn)
SERIES_LOOKS: dict[str, tuple[str, str, str, float]] = {
    **{f"y{k + 1}": ("y", SHORT_POINT_NAMES[k], POINT_COLOURS[k], MM) for k in range(4)},
    "tension": ("tension", "tension", GREEN, N_PER_MM2),
    "tilt_upper": ("tilt", "upper", BLUE, 1e-3),
    "tilt_lower": ("tilt", "lower", RED, 1e-3),
    "entry_moment_upper": ("moment", "upper run-up", BLUE, 1.0),
    "entry_moment_lower": ("moment", "lower run-up", RED, 1.0),
    "slip_head": ("slip", "head pulley", BLUE, 1e-6),
    "slip_tail": ("slip", "tail pulley", RED, 1e-6),
    "sag_upper": ("sag", "upper span", BLUE, MM),
    "sag_lower": ("sag", "lower span", RED, MM),
}


def run_title(case: Case) -> str:
    """The settings of a run, as a tab or a view is called: 7 N/mm2, yaw -0.042 deg."""
    tail, head = (float(yaw.last()) for yaw in (case.settings.yaw, case.settings.yaw_head))
    turned = f"yaw {tail / DEGREE:+.3g} deg" + (f", head {head / DEGREE:+.3g} deg" if head else "")
    reversed_ = ", reversed" if float(case.settings.direction) < 0 else ""
    return f"{float(case.settings.tension) / N_PER_MM2:g} N/mm2, {turned}{reversed_}"


def root_of(title: str) -> str:
    """The path under which a run of this title is logged: runs/7_N_mm2/yaw_-0.042_deg."""
    return "/".join(["runs", *(re.sub(r"[^\w.+-]+", "_", part) for part in title.split(", "))])


#: Behind the machine: a level belt, near white, and a tilted one, dark red or blue, stand out from it.
BACKGROUND = [206, 214, 223]
#: Share of a plot's width, to the right of the curves, that is left to its legend.
WIDE_LEGEND, NARROW_LEGEND = 0.22, 0.32


def space(case: Case, root: str, name: str, scale: ViewScale) -> rrb.Spatial3DView:
    """A view of the machine, from beside and beyond the tail pulley, whose yaw is what matters."""
    length, radius = float(case.rig.centre_distance) / scale.shortened, float(case.rig.tail_radius)
    whole = length + 2.0 * radius
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=[0.95 * whole, -0.4 * whole, 0.21 * whole],
        look_target=[0.65 * length, 0.0, -0.3 * radius],
        eye_up=[0.0, 0.0, 1.0],
    )
    return rrb.Spatial3DView(origin=root, name=name, background=BACKGROUND, line_grid=False, eye_controls=eye)


def series_plot(
    origin: str, name: str, travel: float, legend: float = NARROW_LEGEND, most: float | None = None
) -> rrb.TimeSeriesView:
    """One plot of time series over all of the ``travel`` [m] to come, its legend to the right of the curves, 0 = none;
    most: what the ordinate reaches to either side, None = as the curves are."""
    end = travel / (1.0 - max(legend, 0.04))  # without a legend, so that the last number of the axis is not cut
    whole = rrb.TimeRange(*(rrb.TimeRangeBoundary.absolute(seconds=s) for s in (0.0, end)))
    shown = rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=bool(legend))
    axis = None if most is None else rrb.ScalarAxis(range=(-most, most))
    axes: dict[str, Any] = {"axis_x": rrb.TimeAxis(view_range=whole), "axis_y": axis}
    return rrb.TimeSeriesView(origin=origin, name=name, plot_legend=shown, **axes)


def blueprint(body: rrb.Container, live: bool) -> rrb.Blueprint:
    """``body`` over the travel timeline, played at 2 m/s; live: it follows what comes, else it plays from the start."""
    state: Literal["following", "playing"] = "following" if live else "playing"
    time_panel = rrb.TimePanel(timeline=TRAVEL_LINE, playback_speed=2.0, state="collapsed", play_state=state)
    hidden = rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    return rrb.Blueprint(body, time_panel, *hidden)


FACE_TRUE, FACE_DRAWN = 1.6, 3.2  # face of a pulley in belt widths, true to scale and enlarged
#: Width of lines and size of dots on the screen [px]: negative radii are that to Rerun.
EDGE_WIDTH, AXIS_WIDTH, REACH_WIDTH, DOT_SIZE = -0.7, -1.5, -2.0, -5.0
SHADES = 21  # colours in the bar that explains them
CORNERS = 96  # corners of a pulley's rim: Rerun's own cylinders have few enough to be seen


def drum(width: float, radius: float) -> rr.Mesh3D:
    """A pulley about the y axis, with its two faces."""
    turn = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    rim = np.column_stack([radius * np.sin(turn), np.zeros(CORNERS), radius * np.cos(turn)])
    rings = [rim + np.array([0.0, side * 0.5 * width, 0.0]) for side in (-1.0, 1.0)]
    out, flat = rim / radius, np.tile([0.0, 1.0, 0.0], (CORNERS, 1))
    here = np.arange(CORNERS)
    fan = np.column_stack([0 * here[2:], here[1:-1], here[2:]])
    return rr.Mesh3D(
        vertex_positions=np.vstack([*rings, *rings]),
        vertex_normals=np.vstack([out, out, -flat, flat]),
        triangle_indices=np.vstack([geometry.ribbon_triangles(CORNERS), fan + 2 * CORNERS, fan + 3 * CORNERS]),
        albedo_factor=(150, 160, 172),
    )


class Scene:
    """One drawing of the machine under ``root``, as the ``scale`` has it."""

    def __init__(self, recording: rr.RecordingStream, root: str, case: Case, scale: ViewScale = TRUE) -> None:
        self.recording, self.root, self.case, self.scale = recording, root, case, scale
        self.full_tilt, self.stations = full_colour_tilt(case), 0
        self.reach = np.empty((0, 4))  # least and most y of points 1-4 so far
        self.face = (FACE_TRUE if scale == TRUE else FACE_DRAWN) * float(case.belt.width)
        self._log("", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        out = 0.7 * self.face
        for name, radius in (("head", case.rig.head_radius), ("tail", case.rig.tail_radius)):
            under = 0.985 * (float(radius) - 0.5 * float(case.belt.thickness))
            self._log(f"{name}/turned/pulley", drum(self.face, under))
            lines = {"turned/axis": (out, INK, AXIS_WIDTH), "aligned": (1.2 * out, FAINT_INK, EDGE_WIDTH)}
            for path, (reach, colour, thick) in lines.items():
                line = [[[0.0, -reach, 0.0], [0.0, reach, 0.0]]]
                self._log(f"{name}/{path}", rr.LineStrips3D(line, colors=[rgb(colour)], radii=[thick]))
        colours = [rgb(c) for c in POINT_COLOURS]
        self._log("belt/edges", rr.LineStrips3D.from_fields(colors=[rgb(INK)], radii=[EDGE_WIDTH]))
        dots = rr.Points3D.from_fields(colors=colours, radii=[DOT_SIZE], labels=list("1234"), show_labels=True)
        self._log("points", dots)
        self._log("reach", rr.LineStrips3D.from_fields(colors=colours, radii=[REACH_WIDTH]))

        # signs: which way the belt travels and y counts, which pulley is which, and what the colours of the ribbon mean
        radius, face = float(case.rig.tail_radius), self.face
        length = float(case.rig.centre_distance) / scale.shortened
        ahead, above = 0.12 * length * np.sign(float(case.settings.direction)), 1.5 * radius
        arrows = rr.Arrows3D(
            origins=[[0.6 * length - 0.5 * ahead, 0.0, above], [length, -0.5 * face, above]],
            vectors=[[ahead, 0.0, 0.0], [0.0, face, 0.0]],
            labels=["travel", "+y"], colors=[rgb(INK)], radii=[AXIS_WIDTH], show_labels=True,
        )  # fmt: skip
        share = np.linspace(-1.0, 1.0, SHADES)
        places = np.column_stack([length * (0.5 + 0.2 * share), np.full(SHADES, -0.8 * face), np.full(SHADES, -above)])
        bar = rr.Boxes3D(
            centers=places,
            half_sizes=[[0.2 * length / (SHADES - 1), 0.06 * face, 1e-3 * length]] * SHADES,
            colors=geometry.tilt_colours(share * self.full_tilt, self.full_tilt),
            fill_mode="solid",
        )
        most = f"{self.full_tilt / 1e-3:.0f} mrad"
        named = rr.Points3D(
            [[0.0, 0.8 * face, -radius], [length, 0.8 * face, radius], *(places[[0, SHADES // 2, -1]])],
            labels=["head pulley", "tail pulley", f"-{most}", "tilt 0", f"+{most}"],
            colors=[rgb(INK)], radii=[-0.5], show_labels=True,
        )  # fmt: skip
        for name, sign in (("arrows", arrows), ("colours", bar), ("words", named)):
            self._log(f"signs/{name}", sign)

    def _log(self, path: str, what: Any) -> None:
        self.recording.log(f"{self.root}/{path}".rstrip("/"), what, static=True)

    def frames(self, frames: Sequence[Frame]) -> None:
        """Draw instants against travel, all with as many stations, as columns: the belt is a ribbon coloured by its
        true tilt between two edges; points 1-4 have lines over how far they have been to either side."""
        thin = [geometry.thin_stations(frame, float(self.case.rig.tail_radius)) for frame in frames]
        drawn, stations = [geometry.enlarge(frame, self.scale) for frame in thin], len(thin[0].left)
        self.recording.set_time(TRAVEL_LINE, duration=frames[0].travel)
        self.recording.set_time(TIME_LINE, duration=frames[0].time)
        if stations != self.stations:
            triangles = rr.Mesh3D.from_fields(triangle_indices=geometry.ribbon_triangles(stations))
            self.recording.log(f"{self.root}/belt/ribbon", triangles)
            self.stations = stations
        index = [rr.TimeColumn(TRAVEL_LINE, duration=[f.travel for f in frames])]
        index.append(rr.TimeColumn(TIME_LINE, duration=[f.time for f in frames]))

        def send(path: str, columns: rr.ComponentColumnList, each: int = 1) -> None:
            cut = columns.partition([each] * len(frames))
            rr.send_columns(f"{self.root}/{path}", index, cut, recording=self.recording)

        edges = [np.vstack([e, e[:1]]).astype(np.float32) for d in drawn for e in (d.left, d.right)]
        send("belt/edges", rr.LineStrips3D.columns(strips=edges), 2)
        places = np.concatenate([e for d in drawn for e in (d.left, d.right)]).astype(np.float32)
        tilts = np.concatenate([np.tile(geometry.tilt(f.left, f.right), 2) for f in thin])
        colours = geometry.tilt_colours(tilts, self.full_tilt)
        ribbon = rr.Mesh3D.columns(vertex_positions=places, vertex_colors=colours)
        send("belt/ribbon", ribbon, 2 * stations)
        for name, x in (("head", [0.0] * len(drawn)), ("tail", [d.tail_x for d in drawn])):
            turns = [rr.RotationAxisAngle(axis=(0, 0, 1), radians=getattr(d, f"yaw_{name}")) for d in drawn]
            send(name, rr.Transform3D.columns(translation=[[at, 0.0, 0.0] for at in x]))
            send(f"{name}/turned", rr.Transform3D.columns(rotation_axis_angle=turns))
        points = np.array([d.points for d in drawn]) * [1.0, 1.0, 1.04]  # above the belt, which would hide them
        send("points", rr.Points3D.columns(positions=points.reshape(-1, 3).astype(np.float32)), 4)
        y = np.concatenate([self.reach, points[:, :, 1]])
        reach = np.stack([points, points], axis=2)  # (instants, points, least and most, 3)
        reach[..., 0, 1], reach[..., 1, 1] = (f.accumulate(y)[-len(frames) :] for f in (np.minimum, np.maximum))
        self.reach = reach[-1, :, :, 1].T
        send("reach", rr.LineStrips3D.columns(strips=list(reach.reshape(-1, 2, 3).astype(np.float32))), 4)


_NO_PATH = re.compile(r"[^\w.-]+")  # what a name has _ for in a path
READING_EVERY = 0.025  # [m] of travel between two readings
PICTURES = 100  # of the belt, at most, in a run


def send_series(
    recording: rr.RecordingStream, path: str, times: Mapping[str, Any], values: np.ndarray, look: Mapping[str, Any],
    dots: bool = False,
) -> None:  # fmt: skip
    """Log time series as columns: times (n,) of each timeline, values (n, series); look: names and colours of series,
    empty where the path has them already."""
    if look:
        widths = [1.5 if dots else 2.0] * values.shape[1]
        shown: Any = rr.SeriesPoints(**look, marker_sizes=widths) if dots else rr.SeriesLines(**look, widths=widths)
        recording.log(path, shown, static=True)
    index = [rr.TimeColumn(line, duration=np.asarray(at, float).tolist()) for line, at in times.items()]
    cut = rr.Scalars.columns(scalars=values.ravel()).partition([values.shape[1]] * len(values))
    rr.send_columns(path, index, cut, recording=recording)


def recording_named(name: str) -> rr.RecordingStream:
    """A recording that the viewer lists as ``name``."""
    recording = rr.RecordingStream("belt-sim")
    rr.send_recording_name(name, recording=recording)
    return recording


def save_recording(path: str | os.PathLike, recording: rr.RecordingStream) -> Path:
    """Write all that was logged to ``path`` (.rrd). Raises UnwritableError."""

    def save(draft: Path) -> None:
        try:
            recording.save(draft)
            recording.flush()
            recording.disconnect()
        except (RuntimeError, ValueError) as error:
            raise OSError(str(error)) from error

    return write_with(Path(path), save)


@dataclass
class RerunObserver:
    """Logs numbers each ``every`` [m] of travel, the belt at most PICTURES times, and the last instant.

    path: of the file (.rrd, open it with `rerun PATH`), which gets all at the end; None: a live viewer gets every
    instant as it comes, Rerun's own window or, where there is no display, a web viewer whose address is printed to
    standard error. model: its name, in that of the recording.
    """

    path: str | os.PathLike | None = None
    _: KW_ONLY
    model: str = "belt"
    every: float = READING_EVERY
    recording: rr.RecordingStream | None = field(default=None, init=False)

    def start(self, case: Case, travel: float) -> None:
        """Open a viewer, where no file is wanted, send the blueprint and all that does not move; raises BeltError."""
        recording = self.recording = recording_named(f"{self.model}, {run_title(case)}")
        scale, live = view_scale_of(case, travel), self.path is None
        if live:
            try:  # a window, or a web viewer that this process serves for as long as it lives
                if has_display():
                    recording.spawn()
                else:
                    address = rr.serve_grpc(recording=recording, grpc_port=_free_port(9876))
                    port = _free_port(9090)  # Rerun's own defaults
                    rr.serve_web_viewer(web_port=port, open_browser=False, connect_to=address)
                    print(f"watch = rerun: open http://localhost:{port}/?url={address} in a browser", file=sys.stderr)
            except (RuntimeError, OSError, ValueError) as cause:
                reason = str(cause).strip().splitlines()[0]
                raise BeltError(f"watch = rerun: no viewer could be opened ({reason}); use watch=rrd") from cause
        self.rows: list[tuple[float, float, dict[str, float]]] = []
        self.pictures: list[Frame] = []
        self.styled: set[str] = set()
        self.last = self.last_picture = float("-inf")
        self.newest: Frame | None = None
        self.every_picture = max(self.every, travel / PICTURES)
        root = self.root = f"{root_of(run_title(case))}/{_NO_PATH.sub('_', self.model)}"

        # the machine with its movements enlarged (and, as a tab, true to scale) above the plots
        seen = space(case, f"{root}/machine/drawn", f"{run_title(case)}: {scale.words(case)}", scale)
        machine = rrb.Tabs(seen, space(case, f"{root}/machine/true", "True to scale", TRUE), active_tab=0)
        y = series_plot(f"{root}/series/y", POINTS_TITLE, travel, WIDE_LEGEND)
        tilt = series_plot(f"{root}/series/tilt", "Tilt at mid-span [mrad]", travel)
        loads = rrb.Tabs(*(series_plot(f"{root}/series/{name}", title, travel) for name, title in LOADS.items()))
        plots = rrb.Horizontal(y, tilt, loads, column_shares=[3, 2, 2])
        rr.send_blueprint(blueprint(rrb.Vertical(machine, plots, row_shares=[3, 2]), live), recording=recording)
        roots = ((f"{root}/machine/true", TRUE), (f"{root}/machine/drawn", scale))
        self.scenes = [Scene(recording, at, case, s) for at, s in roots]

    def frame(self, frame: Frame, last: bool = False) -> None:
        """Log this instant, unless it is less than ``every`` [m] of travel after another and not the last."""
        if self.recording is None:
            return
        self.newest = frame
        if not last and frame.travel - self.last < self.every * (1.0 - 1e-6):
            return
        pictured = last or frame.travel - self.last_picture >= self.every_picture * (1.0 - 1e-6)
        if frame.travel > self.last:
            numbers = {f"y{k + 1}": float(frame.points[k, 1]) for k in range(4)}
            # tilt of the upper and the lower cross-section nearest to mid-span
            x, z = (0.5 * (frame.left[:, k] + frame.right[:, k]) for k in (0, 2))
            angles, far = geometry.tilt(frame.left, frame.right), np.abs(x - 0.5 * frame.tail_x)
            middle = 0.5 * (frame.points[:, 2].max() + frame.points[:, 2].min())
            for name, side in (("tilt_upper", z > middle), ("tilt_lower", z <= middle)):
                numbers[name] = float(angles[np.argmin(np.where(side, far, np.inf))])
            self.rows.append((frame.travel, frame.time, {**numbers, **frame.scalars}))
            self.last = frame.travel
        if pictured:
            self.last_picture = frame.travel
            self.pictures.append(frame)
        if self.path is None:
            self._send(self.recording)

    def _send(self, recording: rr.RecordingStream) -> None:
        """Send what has been taken, a column a number; one that is not known is drawn in SI in a plot of its own."""
        for name in dict.fromkeys(name for _, _, row in self.rows for name in row):
            unknown = "further", f"{name} [SI]", CYCLE[len(self.styled) % len(CYCLE)], 1.0
            plot, label, colour, unit = SERIES_LOOKS.get(name, unknown)
            there = [(travel, time, row[name] / unit) for travel, time, row in self.rows if name in row]
            travels, times, values = np.array(there).T
            look = {} if name in self.styled else {"names": [label], "colors": [rgb(colour)]}
            self.styled.add(name)
            lines = {TRAVEL_LINE: travels, TIME_LINE: times}
            send_series(recording, f"{self.root}/series/{plot}/{name}", lines, values[:, None], look)
        for scene in self.scenes if self.pictures else ():
            scene.frames(self.pictures)
        self.rows, self.pictures = [], []

    def finish(self, curves: Curves) -> None:
        """Log the last instant and write the file."""
        if self.recording is not None:
            if self.newest is not None and self.newest.travel > self.last_picture:
                self.frame(self.newest, last=True)
            self._send(self.recording)
            self.recording.flush() if self.path is None else save_recording(self.path, self.recording)


def _free_port(wanted: int) -> int:
    """``wanted`` if nobody listens there, else any free port: two runs may be watched at once."""
    for port in (wanted, 0):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("0.0.0.0", port))
            return probe.getsockname()[1]
    raise OSError("no free port")


MEASURED_NAME = "measured"
#: Pictures of the belt in a recording of many runs; each run has its share, within FEWEST_PICTURES and MOST_PICTURES.
IN_ALL, FEWEST_PICTURES, MOST_PICTURES = 400, 20, 120
CURVE_ROWS = 200  # of a model's curves, at most, in a run
VIEWS = 9  # of runs beside each other, at most; each has a tab of its own in any case


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """One run: the curves that models gave it, by name, the last of which is pictured; its case; what was measured."""

    modelled: Mapping[str, Curves]
    case: Case
    measured: Curves | None = None


def record_runs(path: str | os.PathLike, runs: Mapping[str, Overlay], name: str = "belt-sim") -> Path:
    """Write any number of runs, by their titles, to ``path`` (.rrd): side by side, and a tab a run, on one timeline.

    name: of the recording in the viewer's list. Each run is logged under ``root_of`` its title: y/MODEL (points 1-4
    [mm]; where some were measured, those), residual/MODEL (model - measured [mm], at the travel of the measurement),
    tilt/MODEL (upper, lower [mrad]); belt. Models but the last are pale, what was measured are dots. Returns the path.
    """
    recording, tabs, views = recording_named(name), list[rrb.Container](), list[rrb.Container]()
    last = {title: list(overlay.modelled.values())[-1] for title, overlay in runs.items()}
    most = 1.05 * max(float(np.nanmax(np.abs(curves.y), initial=1e-9)) for curves in last.values()) / MM
    for title, overlay in runs.items():  # the points beside the residuals and the tilt, the belt in space above
        root, curves = root_of(title), last[title]
        end = max(float(c.travel[-1]) for c in (*overlay.modelled.values(), overlay.measured) if c is not None)
        plots = [series_plot(f"{root}/y", POINTS_TITLE, end)]
        if overlay.measured is not None:
            plots.append(series_plot(f"{root}/residual", "Residual: model - measured [mm]", end))
        if any(c.tilt is not None for c in overlay.modelled.values()):
            plots.append(series_plot(f"{root}/tilt", "Tilt at mid-span [mrad]", end))
        scale = view_scale_of(overlay.case, float(curves.travel[-1] - curves.travel[0]))
        explained = f"{title}, {list(overlay.modelled)[-1]}: {scale.words(overlay.case)}"
        seen = space(overlay.case, f"{root}/belt", explained, scale)
        tabs.append(rrb.Vertical(seen, rrb.Horizontal(*plots, name=title), row_shares=[1, 1], name=title))

        # beside the others: the belt, whose points have the colours of the curves below, on one scale
        below = series_plot(f"{root}/y", f"y, +-{most:.2g} mm: {title}", end, 0.0, most)
        seen = space(overlay.case, f"{root}/belt", title, scale)
        views.append(rrb.Vertical(seen, below, row_shares=[3, 2], name=title))
    if 1 < len(runs) <= VIEWS:
        grid = rrb.Grid(*views, grid_columns=math.ceil(math.sqrt(len(runs))), name=f"all {len(runs)}")
        tabs.insert(0, grid)
    body = rrb.Tabs(*tabs, active_tab=0) if len(tabs) > 1 else tabs[0]
    rr.send_blueprint(blueprint(body, live=False), recording=recording)
    pictures = min(max(IN_ALL // len(runs), FEWEST_PICTURES), MOST_PICTURES)
    for title, overlay in runs.items():
        _log_run(recording, root_of(title), overlay, pictures)
    return save_recording(path, recording)


def _log_run(recording: rr.RecordingStream, root: str, overlay: Overlay, pictures: int) -> None:
    measured, names = overlay.measured, list(overlay.modelled)
    last = overlay.modelled[names[-1]]
    length = float(last.travel[-1] - last.travel[0])
    wanted = [True] * 4 if measured is None else np.isfinite(np.asarray(measured.y, float)).any(axis=1)

    def log(kind: str, name: str, travel: Any, rows: np.ndarray, labels: Sequence[str], colours: Sequence[str]) -> None:
        """Time series of one name at once; travel [m] at which none is finite was not measured and is left out."""
        known, path = np.isfinite(rows).any(axis=0), f"{root}/{kind}/{_NO_PATH.sub('_', name)}"
        if not known.any():
            return
        shown = np.array([rgb(c) for c in colours])
        if name not in (MEASURED_NAME, names[-1]):  # paler
            shown = np.round(0.45 * shown + 0.55 * 235.0).astype(int)
        look = {"names": [f"{label} {name}" for label in labels], "colors": shown.tolist()}
        times = {TRAVEL_LINE: np.asarray(travel)[known]}
        send_series(recording, path, times, rows.T[known], look, dots=name == MEASURED_NAME)

    points = [k for k in range(4) if wanted[k]]
    numbers, colours = [f"{k + 1}" for k in points], [POINT_COLOURS[k] for k in points]

    def log_curves(name: str, curves: Curves, every: int = 1) -> None:
        """Points 1-4 [mm], of which some were measured, and tilts [mrad]; every so many rows, and the last."""
        last = len(curves.travel) - 1
        rows = np.unique(np.append(np.arange(0, last + 1, every), last))
        travel = np.asarray(curves.travel)[rows]
        log("y", name, travel, np.asarray(curves.y, float)[points][:, rows] / MM, numbers, colours)
        if curves.tilt is not None and np.any(curves.tilt):
            tilts = 1e3 * np.asarray(curves.tilt, float)[:, rows]
            log("tilt", name, travel, tilts, ("upper", "lower"), (BLUE, RED))

    for name, curves in overlay.modelled.items():
        log_curves(name, curves, -(-len(curves.travel) // CURVE_ROWS))
        if measured is not None:
            at, known = np.asarray(measured.travel, float), np.asarray(curves.travel, float)
            modelled = [np.interp(at, known, y, left=np.nan, right=np.nan) for y in np.asarray(curves.y, float)]
            apart = (np.array(modelled) - np.asarray(measured.y))[points] / MM
            log("residual", name, at, apart, numbers, colours)
    if measured is not None:
        log_curves(MEASURED_NAME, measured)
    scene = Scene(recording, f"{root}/belt", overlay.case, view_scale_of(overlay.case, length))
    scene.frames(list(geometry.frames(overlay.case, last, every=max(length / pictures, READING_EVERY))))
