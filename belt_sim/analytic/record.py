"""What is kept of a march: instants as they come, and the curves that they make, by point and by span."""

import jax.numpy as jnp

from belt_sim.case import Case
from belt_sim.curves import Curves


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
    """Sort what was kept by place: points 1-4, upper and lower span; on reversed travel the spans change places."""
    places, spans = places_of(case)
    moment = rows["moment"].T[spans]
    edge = case.settings.tension - jnp.abs(moment) * 6.0 / (case.belt.width**2 * case.belt.thickness)
    sag = case.sag_curvature * span.length**2 / 8.0
    return Curves(
        travel=travel,
        y=rows["y"].T[places],
        angle=rows["angle"].T[places],
        moment=moment,
        edge_stress=edge,
        tilt=rows["tilt"].T[spans],
        sag=jnp.stack([sag, sag]),
    )


def places_of(case: Case):
    """Of what was kept (run-up tail, run-up head, run-off tail, run-off head; spans up tail and head): which belongs to
    the points 1-4, and which to the upper and the lower span."""
    forward = case.settings.direction > 0
    places = jnp.where(forward, jnp.array([0, 2, 1, 3]), jnp.array([2, 0, 3, 1]))
    return places, jnp.where(forward, jnp.array([0, 1]), jnp.array([1, 0]))
