"""What sensors beside the belt would read: points 1-4 and the mid-span tilt, at any travel."""

import numpy as np

from belt_sim.virtual_rig.travel import Journey

#: place -> (state row, wrapped arc behind it) for travel direction +1; -1 swaps top and bottom.
POINTS = {
    "point_1": (0, None),
    "point_2": (0, "wrap_tail"),
    "point_3": (2, None),
    "point_4": (2, "wrap_head"),
}
_MIRRORED = {"point_1": "point_2", "point_2": "point_1", "point_3": "point_4", "point_4": "point_3"}
TILTS = {
    "upper_mid_span": 1.0,
    "lower_mid_span": -1.0,
}  # direction in which the belt comes from the head pulley


def position(journey: Journey, place: str, s: np.ndarray) -> np.ndarray:
    """Lateral position [m] or tilt [rad] at a place, at travel s, shape (n, batch) -> (n, batch)."""
    forward = journey.line.direction > 0
    if place in TILTS:
        to_tail = TILTS[place] * journey.line.direction > 0
        return np.where(to_tail, _tilt(journey, s, True), _tilt(journey, s, False))
    return np.where(forward, _lateral(journey, place, s), _lateral(journey, _MIRRORED[place], s))


def _lateral(journey: Journey, place: str, s: np.ndarray) -> np.ndarray:
    row, wrap = POINTS[place]
    behind = getattr(journey.line, wrap) if wrap else 0.0
    value = journey.at(s - behind)[row]
    return value + journey.line.wrap_shift(s) if place == "point_2" else value


def _tilt(journey: Journey, s: np.ndarray, to_tail: bool) -> np.ndarray:
    """phi at the middle of the span that runs to the tail (or to the head) pulley, from its ends."""
    line, here = journey.line, journey.at(s)
    beta = _yaw(journey, s)
    beta_head = line.yaw_head * (s > line.yaw_at) + line.offset_head * (s > 0)
    if to_tail:
        off, up, turn_off, turn_up = journey.at(s - line.wrap_head)[2:], here[:2], beta_head, beta
    else:
        off, up, turn_off, turn_up = journey.at(s - line.wrap_tail)[:2], here[2:], -beta, -beta_head
        off = np.stack([off[0] + line.wrap_shift(s), off[1]])
    row = journey.spans[0 if to_tail else 1].tilt
    return row[0] * off[0] + row[1] * (off[1] + turn_off) + row[2] * up[0] + row[3] * (up[1] + turn_up)


def _yaw(journey: Journey, s: np.ndarray) -> np.ndarray:
    """The tail pulley's true yaw, linear between the nodes; 0 up to travel 0."""
    lanes = range(s.shape[1])
    yaw = [np.interp(s[:, b], journey.nodes, journey.tail_yaw[:, b], left=0.0) for b in lanes]
    return np.where(s > 0, np.stack(yaw, axis=1), 0.0)
