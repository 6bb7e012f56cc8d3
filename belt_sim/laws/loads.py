"""Loads on a span between its clamped ends: forces, couples and what is spread along it.

With a side load q(x) [N/m] and a rolling load m(x) [N m/m] (a couple about the belt's long axis that raises the side
y > 0) the strip obeys EI kappa'' = F y'' + q, T phi'' = EI Z kappa - m. Its energy makes these equations symmetric, so
that by Betti's theorem a load adds to the curvature at the run-up -1/EI times its work on the shape y, phi that a unit
of angle there gives the span, at the run-off +1/EI times, and to the roll of mid-span its work on the shape that a unit
of rolling couple there gives. Work: force times y, couple (about z, x along the travel) times y', rolling couple times
phi.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from belt_sim.laws.inside import Along, Bend
from belt_sim.laws.span import Span
from belt_sim.pytree import pytree


@pytree
@dataclass(frozen=True, kw_only=True)
class Push:
    """What a load adds to a span: elastic curvature at the run-up and the run-off [1/m], roll of mid-span [rad]."""

    runup: jnp.ndarray
    runoff: jnp.ndarray
    tilt: jnp.ndarray


def force_at(span: Span, share, fields: Along) -> Push:
    """Of one newton towards +y at ``share`` (0..1) of the length from the run-off."""
    return _push(span, _at(fields, fields.place, fields.slope, share))


def couple_at(span: Span, share, fields: Along) -> Push:
    """Of a couple of one newton metre that turns x (along the travel) towards y, at ``share`` of the length."""
    curved = jnp.stack([fields.per_runup, fields.per_runoff, fields.per_couple])
    return _push(span, _at(fields, fields.slope, curved - span.sag_curvature * fields.roll, share))


def spread_force(span: Span, fields: Along) -> Push:
    """Of one newton per metre towards +y all along the span."""
    return _push(span, _integral(fields.place, span))


def spread_roll(span: Span, fields: Along) -> Push:
    """Of a rolling couple of one newton metre per metre that raises the side y > 0, all along the span."""
    return _push(span, _integral(fields.roll, span))


def pushed(bend: Bend, push: Push, loads) -> Bend:
    """``bend`` with a load on each of the two spans, shape (2,), in units of ``push``."""
    return Bend(
        runup=bend.runup + loads * push.runup,
        runoff=bend.runoff + loads * push.runoff,
        natural_runup=bend.natural_runup,
        natural_runoff=bend.natural_runoff,
        tilt=bend.tilt + loads * push.tilt,
    )


def on_upper(load, direction):
    """A load on the upper span as (2,): that is the span up the tail pulley, on reversed travel the one up the head."""
    none = jnp.zeros_like(load)
    return jnp.where(direction > 0, jnp.stack([load, none]), jnp.stack([none, load]))


def from_runoff(place, direction):
    """Share of the upper span's length from its run-off, of a ``place`` that is counted from the head pulley."""
    return jnp.where(direction > 0, place, 1.0 - place)


def _push(span: Span, work) -> Push:
    """By Betti's theorem; work (3,): of the load on the shapes of ``Along``."""
    return Push(runup=-work[0] / span.bending, runoff=work[1] / span.bending, tilt=work[2])


def _at(fields: Along, values, slopes, share):
    """Rows (3, n) at ``share`` of the length, by the cubic through values and slopes at both neighbours."""
    pieces = len(fields.x) - 1
    left = jnp.clip(jnp.floor(share * pieces).astype(int), 0, pieces - 1)
    u, h = share * pieces - left, fields.x[1] - fields.x[0]
    near, far = values[:, left], values[:, left + 1]
    rise, ahead = h * slopes[:, left], h * slopes[:, left + 1]
    bow = (1.0 - u) * (rise - (far - near)) + u * (far - near - ahead)
    return (1.0 - u) * near + u * far + u * (1.0 - u) * bow


def _integral(rows, span: Span):
    """Of rows (3, n) over the span, by Simpson's rule."""
    weights = np.ones(rows.shape[1])
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return rows @ weights * (span.length / (rows.shape[1] - 1) / 3.0)
