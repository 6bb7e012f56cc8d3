"""What sensors beside the belt would read: points 1-4 and the mid-span tilt, at any travel."""

import numpy as np

from belt_sim.virtual_rig.journey import Journey

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
    if wrap is None:
        return journey.at(s)[row]
    return journey.gone_by(s)[0 if wrap == "wrap_tail" else 1][0]


def _tilt(journey: Journey, s: np.ndarray, to_tail: bool) -> np.ndarray:
    """phi at the middle of the span that runs to the tail (or to the head) pulley, from its ends and its loads."""
    line, here, (tail_off, head_off) = journey.line, journey.at(s), journey.gone_by(s)
    beta, beta_head = (journey.between(rows, s) for rows in (journey.tail_yaw, journey.head_yaw))
    if to_tail:
        off, up, turn_off, turn_up = head_off, here[:2], beta_head, beta
    else:
        off, up, turn_off, turn_up = tail_off, here[2:], -beta, -beta_head
    row = journey.spans[0 if to_tail else 1].tilt
    off, up = np.stack([off[0], off[1] + turn_off]), np.stack([up[0], up[1] + turn_up])
    tilt = row[0] * off[0] + row[1] * off[1] + row[2] * up[0] + row[3] * up[1]
    for prop in journey.props:
        acts = prop.acts(s, line, off, up, journey.between(prop.kept, s))[0] * (s > 0)
        tilt = tilt + np.where(prop.to_tail == to_tail, prop.load.tilt * acts, 0.0)
    return tilt
