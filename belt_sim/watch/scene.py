"""The belt, its pulleys and the four points in Rerun's space, the time series of a run, and how a recording opens: the
machine large, the time series below it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.frame import Frame
from belt_sim.pictures.style import BLUE, CYCLE, FAINT, GREEN, INK, POINT_NAMES, POINTS, RED, rgb
from belt_sim.si import MM, N_PER_MM2
from belt_sim.watch import geometry
from belt_sim.watch.geometry import TRUE, ViewScale, enlarge, full_colour_tilt, mid_span_tilt, thin_stations

# Time series, in the units that people read.

TRAVEL = "travel [mm]"  # Rerun's timelines count whole numbers and have no units of length
TIME = "time"

#: SI name -> (plot, label, colour, SI units in one unit drawn)
KNOWN: dict[str, tuple[str, str, str, float]] = {
    **{f"y{k + 1}": ("y", POINT_NAMES[k].replace(" end", "").replace(" pulley", ""), POINTS[k], MM) for k in range(4)},
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


def millimetres(travel: float) -> int:
    """A travel [m] on its timeline."""
    return round(travel / MM)


def style_series(
    recording: rr.RecordingStream, path: str, names: Sequence[str], colours: Sequence[str], width: float = 2.0
) -> None:
    """Names, colours and line width [px] of the curves of one path."""
    lines = rr.SeriesLines(names=names, colors=[rgb(c) for c in colours], widths=[width] * len(names))
    recording.log(path, lines, static=True)


def frame_numbers(frame: Frame) -> dict[str, float]:
    """y1-y4, the mid-span tilts and every named number of a frame, by name, in SI."""
    upper, lower = mid_span_tilt(frame)
    points = {f"y{k + 1}": float(frame.points[k, 1]) for k in range(4)}
    return {**points, "tilt_upper": upper, "tilt_lower": lower, **frame.scalars}


def send_series(
    recording: rr.RecordingStream, rows: Sequence[tuple[float, float, Mapping[str, float]]], styled: set[str]
) -> None:
    """Send (travel [m], time [s], numbers) of instants, a column a number; ``styled`` gathers names that have a style.

    A number that is not known is drawn in SI in a plot of its own.
    """
    for name in dict.fromkeys(name for _, _, row in rows for name in row):
        unknown = "further", f"{name} [SI]", CYCLE[len(styled) % len(CYCLE)], 1.0
        plot, label, colour, unit = KNOWN.get(name, unknown)
        path = f"series/{plot}/{name}"
        if name not in styled:
            style_series(recording, path, [label], [colour])
            styled.add(name)
        there = [(travel, time, row[name]) for travel, time, row in rows if name in row]
        index = [
            rr.TimeColumn(TRAVEL, sequence=[millimetres(travel) for travel, _, _ in there]),
            rr.TimeColumn(TIME, duration=[time for _, time, _ in there]),
        ]
        values = rr.Scalars.columns(scalars=[value / unit for _, _, value in there])
        rr.send_columns(path, index, values, recording=recording)


TRUE_ROOT = "machine/true"
DRAWN_ROOT = "machine/drawn"
PLAY_SPEED = 2000.0  # [mm of travel per second]
#: Behind the machine: a level belt, near white, and a tilted one, dark red or blue, stand out from it.
BACKGROUND = [206, 214, 223]
#: Share of a plot's width, to the right of the curves, that is left to its legend.
WIDE, NARROW = 0.22, 0.32


def space(case: Case, root: str, name: str, scale: ViewScale) -> rrb.Spatial3DView:
    """A view of the machine as drawn, from beside and beyond the tail pulley, whose yaw is what matters."""
    length, radius = float(case.rig.centre_distance) / scale.shortened, float(case.rig.tail_radius)
    whole = length + 2.0 * radius
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=[0.95 * whole, -0.4 * whole, 0.21 * whole],
        look_target=[0.65 * length, 0.0, -0.3 * radius],
        eye_up=[0.0, 0.0, 1.0],
    )
    return rrb.Spatial3DView(origin=root, name=name, background=BACKGROUND, line_grid=False, eye_controls=eye)


def plot(origin: str, name: str, travel: float, legend: float = NARROW) -> rrb.TimeSeriesView:
    """One plot of time series over all of the ``travel`` [m] to come, its legend to the right of the curves."""
    end = rrb.TimeRangeBoundary.absolute(seq=round(travel / (1.0 - legend) / MM))
    whole = rrb.TimeRange(rrb.TimeRangeBoundary.absolute(seq=0), end)
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        axis_x=rrb.TimeAxis(view_range=whole),
    )


def time_panel(live: bool) -> rrb.TimePanel:
    """The travel timeline, played at 2 m/s; live: it follows what comes, else it plays from the start."""
    state: Literal["following", "playing"] = "following" if live else "playing"
    return rrb.TimePanel(timeline=TRAVEL, fps=PLAY_SPEED, state="collapsed", play_state=state)


def scale_words(case: Case, scale: ViewScale) -> str:
    """What is enlarged, and what the colours mean."""
    return f"{scale.words()}; colour: tilt, white 0, red/blue +-{full_colour_tilt(case) / 1e-3:.0f} mrad"


def of_run(case: Case, travel: float, scale: ViewScale, live: bool) -> rrb.Blueprint:
    """The machine with its movements enlarged (and, as a tab, true to scale) above the plots."""
    seen = space(case, DRAWN_ROOT, scale_words(case, scale), scale)
    machine = rrb.Tabs(seen, space(case, TRUE_ROOT, "True to scale", TRUE), active_tab=0)
    loads = rrb.Tabs(
        plot("series/moment", "Entry moment [N m]", travel),
        plot("series/tension", "Tension [N/mm2]", travel),
        plot("series/slip", "Lateral slip [um]", travel),
        plot("series/sag", "Sag [mm]", travel),
        plot("series/further", "Further", travel),
    )
    plots = rrb.Horizontal(
        plot("series/y", "Lateral position y of points 1-4 [mm] over travel [mm]", travel, WIDE),
        plot("series/tilt", "Tilt at mid-span [mrad]", travel),
        loads,
        column_shares=[3, 2, 2],
    )
    body = rrb.Vertical(machine, plots, row_shares=[3, 2])
    return rrb.Blueprint(
        body, time_panel(live), rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    )


#: Face of a pulley in belt widths, true to scale and enlarged; the axis stands out by STUB faces.
FACE_TRUE, FACE_DRAWN = 1.6, 3.2
STUB = 0.2
PULLEY = (150, 160, 172)
#: Width of lines and size of dots on the screen [px]: negative radii are that to Rerun.
EDGE, AXIS, REACH, DOT = -0.7, -1.5, -2.0, -5.0
#: An arrow's length in lengths of the machine, and colours in the bar that explains them.
SIGN, STEPS = 0.12, 21
#: Marks stand so many pulley radii above the belt, which would hide them.
ABOVE = 0.04
#: cylinders stand along z in Rerun; a pulley's axis lies along y
UP = (0, 0, 1)
LYING = rr.RotationAxisAngle(axis=[1, 0, 0], radians=math.pi / 2)


class Scene:
    """One drawing of the machine under ``root``, as the ``scale`` has it."""

    def __init__(self, recording: rr.RecordingStream, root: str, case: Case, scale: ViewScale = TRUE) -> None:
        self.recording, self.root, self.case, self.scale = recording, root, case, scale
        self.full_tilt = full_colour_tilt(case)
        self.stations = 0
        self.reach = np.empty((0, 4))  # least and most y of points 1-4 so far
        recording.log(root, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        radii = {"head": case.rig.head_radius, "tail": case.rig.tail_radius}
        for name, radius in radii.items():
            self._pulley(name, float(radius) - 0.5 * float(case.belt.thickness))
        self._signs()
        colours, still = [rgb(c) for c in POINTS], {"static": True}
        recording.log(f"{root}/belt/edges", rr.LineStrips3D.from_fields(colors=[rgb(INK)], radii=[EDGE]), **still)
        dots = rr.Points3D.from_fields(colors=colours, radii=[DOT], labels=list("1234"), show_labels=True)
        recording.log(f"{root}/points", dots, **still)
        recording.log(f"{root}/reach", rr.LineStrips3D.from_fields(colors=colours, radii=[REACH]), **still)

    def _pulley(self, name: str, radius: float) -> None:
        """A grey cylinder along y, its axis, and a faint line where an aligned axis would be."""
        width = (FACE_TRUE if self.scale == TRUE else FACE_DRAWN) * float(self.case.belt.width)
        reach = (0.5 + STUB) * width
        path, log = f"{self.root}/{name}", self.recording.log
        body = rr.Cylinders3D(
            lengths=[width], radii=[0.985 * radius], rotation_axis_angles=[LYING], colors=[PULLEY], fill_mode="solid"
        )
        log(f"{path}/turned/pulley", body, static=True)
        axis = [[[0.0, -reach, 0.0], [0.0, reach, 0.0]]]
        log(f"{path}/turned/axis", rr.LineStrips3D(axis, colors=[rgb(INK)], radii=[AXIS]), static=True)
        aligned = [[[0.0, -1.2 * reach, 0.0], [0.0, 1.2 * reach, 0.0]]]
        log(f"{path}/aligned", rr.LineStrips3D(aligned, colors=[rgb(FAINT)], radii=[EDGE]), static=True)

    def _signs(self) -> None:
        """Which way the belt travels and y counts, which pulley is which, and what the colours of the ribbon mean."""
        radius, width = float(self.case.rig.tail_radius), float(self.case.belt.width)
        length, static = float(self.case.rig.centre_distance) / self.scale.shortened, {"static": True}
        face = (FACE_TRUE if self.scale == TRUE else FACE_DRAWN) * width
        arrow, above = SIGN * length, 1.5 * radius
        ahead = arrow * (1.0 if float(self.case.settings.direction) > 0 else -1.0)
        arrows = rr.Arrows3D(
            origins=[[0.6 * length - 0.5 * ahead, 0.0, above], [length, -0.5 * face, above]],
            vectors=[[ahead, 0.0, 0.0], [0.0, face, 0.0]],
            labels=["travel", "+y"],
            colors=[rgb(INK)],
            radii=[AXIS],
            show_labels=True,
        )
        self.recording.log(f"{self.root}/signs/arrows", arrows, **static)
        share = np.linspace(-1.0, 1.0, STEPS)
        places = np.column_stack([length * (0.5 + 0.2 * share), np.full(STEPS, -0.8 * face), np.full(STEPS, -above)])
        bar = rr.Boxes3D(
            centers=places,
            half_sizes=[[0.2 * length / (STEPS - 1), 0.06 * face, 1e-3 * length]] * STEPS,
            colors=geometry.tilt_colours(share * self.full_tilt, self.full_tilt),
            fill_mode="solid",
        )
        self.recording.log(f"{self.root}/signs/colours", bar, **static)
        most = f"{self.full_tilt / 1e-3:.0f} mrad"
        words = rr.Points3D(
            [[0.0, 0.8 * face, -radius], [length, 0.8 * face, radius], *(places[[0, STEPS // 2, -1]])],
            labels=["head pulley", "tail pulley", f"-{most}", "tilt 0", f"+{most}"],
            colors=[rgb(INK)],
            radii=[-0.5],
            show_labels=True,
        )
        self.recording.log(f"{self.root}/signs/words", words, **static)

    def frames(self, frames: Sequence[Frame]) -> None:
        """Draw instants against travel, all with as many stations, as columns.

        The belt is a ribbon coloured by its true tilt between two edges; points 1-4 have lines over how far they have
        been to either side.
        """
        thin = [thin_stations(frame, float(self.case.rig.tail_radius)) for frame in frames]
        drawn, stations = [enlarge(frame, self.scale) for frame in thin], len(thin[0].left)
        self.recording.set_time(TRAVEL, sequence=millimetres(frames[0].travel))
        self.recording.set_time(TIME, duration=frames[0].time)
        if stations != self.stations:
            triangles = rr.Mesh3D.from_fields(triangle_indices=geometry.ribbon_triangles(stations))
            self.recording.log(f"{self.root}/belt/ribbon", triangles)
            self.stations = stations
        index = [
            rr.TimeColumn(TRAVEL, sequence=[millimetres(frame.travel) for frame in frames]),
            rr.TimeColumn(TIME, duration=[frame.time for frame in frames]),
        ]

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
        pulleys = {"head": [(0.0, d.yaw_head) for d in drawn], "tail": [(d.tail_x, d.yaw_tail) for d in drawn]}
        for name, poses in pulleys.items():
            turns = [rr.RotationAxisAngle(axis=UP, radians=yaw) for _, yaw in poses]
            send(name, rr.Transform3D.columns(translation=[[x, 0.0, 0.0] for x, _ in poses]))
            send(f"{name}/turned", rr.Transform3D.columns(rotation_axis_angle=turns))
        points = np.array([d.points for d in drawn]) * [1.0, 1.0, 1.0 + ABOVE]
        send("points", rr.Points3D.columns(positions=points.reshape(-1, 3).astype(np.float32)), 4)
        y = np.concatenate([self.reach, points[:, :, 1]])
        reach = np.stack([points, points], axis=2)  # (instants, points, least and most, 3)
        reach[..., 0, 1], reach[..., 1, 1] = (f.accumulate(y)[-len(frames) :] for f in (np.minimum, np.maximum))
        self.reach = reach[-1, :, :, 1].T
        send("reach", rr.LineStrips3D.columns(strips=list(reach.reshape(-1, 2, 3).astype(np.float32))), 4)
