"""What is kept of a march: instants as they come, and the curves that they make, by point and by span."""

import jax.numpy as jnp

from belt_sim.case import Case
from belt_sim.curves import Curves

POINTS, SPANS = ((0, 2, 1, 3), (2, 0, 3, 1)), ((0, 1), (1, 0))  # where each is in what is kept; the same in reverse


def observed(carry, spans):
    """What is kept of one instant, still in the order (span up the tail, span up the head)."""
    _, now, off, yaw = carry
    return {
        "y": jnp.concatenate([now.y + yaw.aside_runup, off.y + yaw.aside_runoff[::-1]]),
        "angle": jnp.concatenate([yaw.runup + now.alpha, yaw.runoff[::-1] + off.alpha]),
        "moment": now.moment,
        "tilt": spans.tilt(now, off, yaw),
    }


def lay(start):
    """Where the belt lay before the start, at the places of ``observed``."""
    yaw = start[3]
    return jnp.concatenate([yaw.aside_runup, yaw.aside_runoff[::-1]])


def sorted_curves(rows, case, span, travel) -> Curves:
    """What was kept, sorted by place."""
    y, angle, moment, tilt = (by_place(rows[name].T, case) for name in ("y", "angle", "moment", "tilt"))
    edge = case.settings.tension - jnp.abs(moment) * 6.0 / (case.belt.width**2 * case.belt.thickness)
    sag = case.sag_curvature * span.length**2 / 8.0
    return Curves(
        travel=travel, y=y, angle=angle, moment=moment, edge_stress=edge, tilt=tilt, sag=jnp.stack([sag, sag])
    )


def by_place(rows, case: Case):
    """Points 1-4 of rows (4, ...) for run-up tail, run-up head, run-off tail, run-off head; upper and lower span of
    rows (2, ...) for the spans up the tail and up the head pulley; on reversed travel the spans change places."""
    ahead, back = POINTS if len(rows) == len(POINTS[0]) else SPANS
    forward = case.settings.direction > 0
    return jnp.stack([jnp.where(forward, rows[a], rows[b]) for a, b in zip(ahead, back, strict=True)])
