"""A belt in space drawn from curves against travel: enough to look at, no more than the curves know."""

from collections.abc import Iterator

import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.frame import Frame

SPAN_STATIONS = 16
WRAP_STATIONS = 14


def frames(case: Case, curves: Curves, every: float = 0.5) -> Iterator[Frame]:
    """One frame each ``every`` [m] of travel: straight or sagging spans between points 1-4, wrapped pulleys.

    Between the four points y runs linearly over each span and each wrap; sag is a parabola,
    tilt a parabola from zero on the pulleys to the curves' value in the middle. A point
    that was not measured (NaN) is taken from the other end of its wrap, or is 0.
    """
    travel = np.asarray(curves.travel, float)
    stops = np.unique(np.append(np.arange(travel[0], travel[-1], every), travel[-1]))
    y = _whole(np.asarray(curves.y, float))
    tilt = np.zeros((2, len(travel))) if curves.tilt is None else np.nan_to_num(np.asarray(curves.tilt, float))
    sag = (0.0, 0.0) if curves.sag is None else np.nan_to_num(np.asarray(curves.sag, float))
    for stop in stops:
        points = np.array([np.interp(stop, travel, row) for row in y])
        mid = [float(np.interp(stop, travel, row)) for row in tilt]
        yield _frame(case, float(stop), points, mid, sag)


def _whole(y: np.ndarray) -> np.ndarray:
    """Replace rows that are nowhere known: 1 by 2, 3 by 4 and the reverse, else 0; bridge single gaps."""
    out = y.copy()
    for k, partner in enumerate((1, 0, 3, 2)):
        row = y[k] if np.isfinite(y[k]).any() else y[partner]
        known = np.isfinite(row)
        out[k] = np.interp(np.arange(len(row)), np.flatnonzero(known), row[known]) if known.any() else 0.0
    return out


def yaw_at(schedule: Schedule, travel: float) -> float:
    """Angle of a yaw schedule at this travel [rad]."""
    at, over, change = (np.atleast_1d(np.asarray(v, float)) for v in (schedule.at, schedule.over, schedule.change))
    steps = over <= 0.0
    share = np.where(steps, travel >= at, np.clip((travel - at) / np.where(steps, 1.0, over), 0.0, 1.0))
    return float(share @ change)


def _frame(case: Case, travel: float, y: np.ndarray, mid_tilt: list[float], sag) -> Frame:
    """The belt at one instant, from y at points 1-4 [m], mid-span tilts [rad] and sags [m]."""
    a, settings = float(case.rig.centre_distance), case.settings
    yaws = yaw_at(settings.yaw, travel), yaw_at(settings.yaw_head, travel)
    centre, half = _centre_line(case, y, mid_tilt, sag)
    half[:, 0] = _edge_shift(case, centre, y, yaws)
    z = float(case.rig.tail_radius), float(case.rig.head_radius)
    corner = np.array([[a, y[0], z[0]], [a, y[1], -z[0]], [0.0, y[2], -z[1]], [0.0, y[3], z[1]]])
    scalars = {"tension": float(settings.tension), "tilt_upper": mid_tilt[0], "tilt_lower": mid_tilt[1]}
    return Frame(
        travel=travel,
        time=travel / float(settings.speed),
        left=centre + half,
        right=centre - half,
        points=corner,
        yaw_tail=yaws[0],
        yaw_head=yaws[1],
        tail_x=a,
        scalars=scalars,
    )


def _centre_line(case: Case, y: np.ndarray, mid_tilt: list[float], sag) -> tuple[np.ndarray, np.ndarray]:
    """Centre line 4 -> 1 -> 2 -> 3 -> 4, shape (n, 3) [m], and the half cross-sections there."""
    a, tail, head = (float(v) for v in (case.rig.centre_distance, case.rig.tail_radius, case.rig.head_radius))
    u = np.arange(SPAN_STATIONS) / SPAN_STATIONS
    w = np.arange(WRAP_STATIONS) / WRAP_STATIONS
    bow, turn, none = 4.0 * u * (1.0 - u), np.pi * w, np.zeros_like(w)
    upper = (a * u, y[3] + (y[0] - y[3]) * u, head + (tail - head) * u - sag[0] * bow, mid_tilt[0] * bow)
    over_tail = (a + tail * np.sin(turn), y[0] + (y[1] - y[0]) * w, tail * np.cos(turn), none)
    lower = (
        a * (1 - u),
        y[1] + (y[2] - y[1]) * u,
        -tail + (tail - head) * u - sag[1] * bow,
        mid_tilt[1] * bow,
    )
    over_head = (-head * np.sin(turn), y[2] + (y[3] - y[2]) * w, -head * np.cos(turn), none)
    pieces = [np.column_stack(piece) for piece in (upper, over_tail, lower, over_head)]
    x, lateral, z, tilt = np.concatenate(pieces).T
    half_width = 0.5 * float(case.belt.width)
    half = np.column_stack([np.zeros_like(x), half_width * np.cos(tilt), half_width * np.sin(tilt)])
    return np.column_stack([x, lateral, z]), half


def _edge_shift(case: Case, centre: np.ndarray, y: np.ndarray, yaws: tuple[float, float]) -> np.ndarray:
    """x of the half cross-section [m]: across the belt in the spans, along the pulley on the wraps."""
    a, half_width = float(case.rig.centre_distance), 0.5 * float(case.belt.width)
    slopes = (y[0] - y[3]) / a, (y[1] - y[2]) / a
    x, z = centre[:, 0], centre[:, 2]
    span = np.where(z > 0.0, slopes[0], slopes[1])
    return -half_width * np.where(x >= a, yaws[0], np.where(x <= 0.0, yaws[1], span))
