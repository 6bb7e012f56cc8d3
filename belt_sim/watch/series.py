"""Time series of a run, in the units that people read."""

from collections.abc import Mapping, Sequence

import rerun as rr

from belt_sim.frame import Frame
from belt_sim.pictures.style import BLUE, CYCLE, GREEN, POINT_NAMES, POINTS, RED, rgb
from belt_sim.si import MM, N_PER_MM2
from belt_sim.watch.geometry import mid_span_tilt

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


def style(
    recording: rr.RecordingStream, path: str, names: Sequence[str], colours: Sequence[str], width: float = 2.0
) -> None:
    """Names, colours and line width [px] of the curves of one path."""
    lines = rr.SeriesLines(names=names, colors=[rgb(c) for c in colours], widths=[width] * len(names))
    recording.log(path, lines, static=True)


def numbers(frame: Frame) -> dict[str, float]:
    """y1-y4, the mid-span tilts and every named number of a frame, by name, in SI."""
    upper, lower = mid_span_tilt(frame)
    points = {f"y{k + 1}": float(frame.points[k, 1]) for k in range(4)}
    return {**points, "tilt_upper": upper, "tilt_lower": lower, **frame.scalars}


def columns(
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
            style(recording, path, [label], [colour])
            styled.add(name)
        there = [(travel, time, row[name]) for travel, time, row in rows if name in row]
        index = [
            rr.TimeColumn(TRAVEL, sequence=[millimetres(travel) for travel, _, _ in there]),
            rr.TimeColumn(TIME, duration=[time for _, time, _ in there]),
        ]
        values = rr.Scalars.columns(scalars=[value / unit for _, _, value in there])
        rr.send_columns(path, index, values, recording=recording)
