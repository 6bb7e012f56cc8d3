"""The shape of a drawn belt: how much movements are enlarged, fewer stations, tilt and its colours, the ribbon; frames
of a belt that only curves are known of."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, Frame
from belt_sim.line.runup import angle_at
from belt_sim.show.style import DIVERGING, rgb

#: Factors a picture may have.
ENLARGEMENTS = (1, 2, 5, 10, 20, 50, 100, 200)
SHORTENINGS = (1, 2, 3, 4, 5, 6, 8, 10)
#: A rope's drift, the largest there is, should be drawn at most so many belt widths wide.
DRAWN_WIDTHS = 1.5
#: The machine should be drawn at most so many belt widths or pulley diameters long.
DRAWN_LENGTH, DRAWN_DIAMETERS = 15.0, 10.0
#: Angles [rad] that may be drawn: of a pulley's yaw, and of the tilt that gets the full colour.
DRAWN_YAW, DRAWN_TILT = 0.2, 0.2
#: Stations of a drawn 3D belt, at most, on either span and either wrap.
ON_SPAN, ON_WRAP = 56, 24


@dataclass(frozen=True, kw_only=True)
class ViewScale:
    """y is drawn ``lateral`` times as large, tilt ``tilt`` times, the centre distance divided by ``shortened``."""

    lateral: int = 1
    tilt: int = 1
    shortened: int = 1

    @property
    def plan(self) -> int:
        """Factor of angles in plan (yaw): a stuck belt still lies straight on its drawn pulley."""
        return self.lateral * self.shortened

    def words(self, case: Case) -> str:
        """What is not true to scale, and what the colours mean."""
        parts = [f"y x {self.lateral}", f"tilt x {self.tilt}", f"yaw x {self.plan}"]
        parts += [f"length / {self.shortened}"] if self.shortened != 1 else []
        return f"{', '.join(parts)}; colour: tilt, white 0, red/blue +-{full_colour_tilt(case) / 1e-3:.0f} mrad"


TRUE = ViewScale()


def view_scale_of(case: Case, travel: float) -> ViewScale:
    """A scale for ``travel`` [m]: a rope's drift, yaw * travel / 2, within DRAWN_WIDTHS; angles that can be seen."""
    length, width = float(case.rig.centre_distance), float(case.belt.width)
    long = max(DRAWN_LENGTH * width, DRAWN_DIAMETERS * 2.0 * float(case.rig.tail_radius))
    shortened = next((s for s in SHORTENINGS if length / s <= long), SHORTENINGS[-1])
    yaw = max(*(abs(float(s.last())) for s in (case.settings.yaw, case.settings.yaw_head)), 1e-9)
    most = min(DRAWN_WIDTHS * width / (0.5 * yaw * max(travel, 1e-3)), DRAWN_YAW / (yaw * shortened))
    lateral, tilt = (
        max((f for f in ENLARGEMENTS if f <= wanted), default=1)
        for wanted in (most, DRAWN_TILT / full_colour_tilt(case))
    )
    return ViewScale(lateral=lateral, tilt=tilt, shortened=shortened)


def full_colour_tilt(case: Case) -> float:
    """The tilt that gets the full colour [rad]: twenty times the yaw (18 mrad for 0.042 deg at 10 N/mm2)."""
    return max(*(20.0 * abs(float(s.last())) for s in (case.settings.yaw, case.settings.yaw_head)), 1e-3)


def enlarge(frame: Frame, scale: ViewScale) -> Frame:
    """The frame as it is drawn: a centre line (x, y, z) becomes (x', lateral y, z), where x' shortens what lies between
    the axes, the half cross-section (ex, ey, ez) from there to an edge (plan ex, ey, tilt ez)."""
    left, right = np.asarray(frame.left, float), np.asarray(frame.right, float)
    centre, half = 0.5 * (left + right), 0.5 * (left - right)
    points = np.array(frame.points, float)
    for at in (centre, points):
        x = np.clip(at[:, 0], 0.0, frame.tail_x)
        at[:, 0] += x / scale.shortened - x
        at[:, 1] *= scale.lateral
    half = half * [scale.plan, 1.0, scale.tilt]
    drawn: dict[str, Any] = {"yaw_tail": frame.yaw_tail * scale.plan, "yaw_head": frame.yaw_head * scale.plan}
    drawn |= {"left": centre + half, "right": centre - half, "points": points}
    return replace(frame, **drawn, tail_x=frame.tail_x / scale.shortened)


def thin_stations(frame: Frame, radius: float) -> Frame:
    """The frame with at most 2 (ON_SPAN + ON_WRAP) stations, dense on the pulleys of ``radius`` [m]."""
    left, right = np.asarray(frame.left, float), np.asarray(frame.right, float)
    count = 2 * (ON_SPAN + ON_WRAP)
    if len(left) <= count:
        return frame
    closed = [np.vstack([edge, edge[:1]]) for edge in (left, right)]
    centre = 0.5 * (closed[0] + closed[1])
    middle = 0.5 * (centre[:-1, 0] + centre[1:, 0])
    on_wrap = (middle < 0.0) | (middle > frame.tail_x)
    spacing = np.where(on_wrap, np.pi * radius / ON_WRAP, frame.tail_x / ON_SPAN)
    share = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(centre, axis=0), axis=1) / spacing))
    kept = np.linspace(0.0, share[-1], count, endpoint=False)
    thin = [np.column_stack([np.interp(kept, share, column) for column in edge.T]) for edge in closed]
    return replace(frame, left=thin[0], right=thin[1])


#: A cross-section narrower than this [m] is a rope's: it has no tilt.
ROPE_WIDTH = 1e-6


def tilt(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Angle of each cross-section against the horizontal [rad], positive where the edge at +y is higher; left, right:
    shape (n, 3) [m]; 0 of a rope, both edges of which are one line."""
    across = np.asarray(left, float) - np.asarray(right, float)
    width = np.linalg.norm(across, axis=-1)
    rope = width < ROPE_WIDTH
    return np.where(rope, 0.0, np.arcsin(np.clip(across[:, 2] / np.where(rope, 1.0, width), -1.0, 1.0)))


def ribbon_triangles(stations: int) -> np.ndarray:
    """Triangles of a closed ribbon whose vertices are left[0..n-1], right[0..n-1]; shape (2 n, 3)."""
    here = np.arange(stations)
    after = (here + 1) % stations
    first = np.column_stack([here, after, here + stations])
    second = np.column_stack([after, after + stations, here + stations])
    return np.concatenate([first, second]).astype(np.uint32)


def tilt_colours(angles: np.ndarray, full: float) -> np.ndarray:
    """Colours (n, 3) [0..255] of tilts [rad]: blue at -full, near white at 0, red at +full."""
    at = np.clip(0.5 + 0.5 * np.asarray(angles) / full, 0.0, 1.0)
    stops = [p for p, _ in DIVERGING]
    channels = np.array([rgb(c) for _, c in DIVERGING], float)
    return np.stack([np.interp(at, stops, channels[:, k]) for k in range(3)], axis=-1).astype(np.uint8)


STATIONS_ON_SPAN, STATIONS_ON_WRAP = 16, 14  # of a belt that only curves are known of


def frames(case: Case, curves: Curves, every: float = 0.5) -> Iterator[Frame]:
    """One frame each ``every`` [m] of travel: between points 1-4 y runs linearly over each span and each wrap; sag is a
    parabola, tilt a parabola from zero on the pulleys to the curves' value in the middle."""
    travel = np.asarray(curves.travel, float)
    stops = np.unique(np.append(np.arange(travel[0], travel[-1], every), travel[-1]))
    tilt = np.zeros((2, len(travel))) if curves.tilt is None else np.asarray(curves.tilt, float)
    sag = (0.0, 0.0) if curves.sag is None else np.asarray(curves.sag, float)
    a, settings, half_width = float(case.rig.centre_distance), case.settings, 0.5 * float(case.belt.width)
    tail, head = float(case.rig.tail_radius), float(case.rig.head_radius)
    u, w = np.arange(STATIONS_ON_SPAN) / STATIONS_ON_SPAN, np.arange(STATIONS_ON_WRAP) / STATIONS_ON_WRAP
    bow, turn, none = 4.0 * u * (1.0 - u), np.pi * w, np.zeros_like(w)
    for stop in map(float, stops):
        y = np.array([np.interp(stop, travel, row) for row in np.asarray(curves.y, float)])
        mid = [float(np.interp(stop, travel, row)) for row in tilt]
        yaws = [float(angle_at(schedule, stop, np)) for schedule in (settings.yaw, settings.yaw_head)]

        # centre line 4 -> 1 -> 2 -> 3 -> 4 as (x, y, z, tilt) along the upper span, tail wrap, lower span, head wrap
        upper = (a * u, y[3] + (y[0] - y[3]) * u, head + (tail - head) * u - sag[0] * bow, mid[0] * bow)
        over_tail = (a + tail * np.sin(turn), y[0] + (y[1] - y[0]) * w, tail * np.cos(turn), none)
        lower = (a * (1 - u), y[1] + (y[2] - y[1]) * u, -tail + (tail - head) * u - sag[1] * bow, mid[1] * bow)
        over_head = (-head * np.sin(turn), y[2] + (y[3] - y[2]) * w, -head * np.cos(turn), none)
        x, lateral, z, tilts = np.hstack([np.array(piece) for piece in (upper, over_tail, lower, over_head)])
        centre = np.column_stack([x, lateral, z])

        # half cross-sections: across the belt on the spans, along the pulley on the wraps
        span = np.where(z > 0.0, (y[0] - y[3]) / a, (y[1] - y[2]) / a)
        turned = np.where(x >= a, yaws[0], np.where(x <= 0.0, yaws[1], span))
        half = half_width * np.column_stack([-turned, np.cos(tilts), np.sin(tilts)])
        yield Frame(
            travel=stop,
            time=stop / float(settings.speed),
            left=centre + half,
            right=centre - half,
            points=np.column_stack([[a, a, 0.0, 0.0], y, [tail, -tail, -head, head]]),
            yaw_tail=yaws[0],
            yaw_head=yaws[1],
            tail_x=a,
            scalars={"tension": float(settings.tension), "tilt_upper": mid[0], "tilt_lower": mid[1]},
        )
