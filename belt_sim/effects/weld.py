"""A weld: the belt is curved in its own plane over a short length, which passes once every belt length."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.effects.base import Cause, Effect, Parameter, effect
from belt_sim.laws.influence import natural_curvature_rows, span_fields
from belt_sim.pytree import pytree

_PLACES = 512  # of the weld's middle, from where it enters a span to where it has left it
_POINTS = (np.arange(16) + 0.5) / 16 - 0.5  # middles of pieces of a weld, which run up one after the other


def raised_cosine(u, xp=jnp):
    """1 + cos(2 pi u) for |u| < 1/2, else 0: a bend of mean 1 over its own length; xp: jax.numpy or numpy."""
    return xp.where(xp.abs(u) < 0.5, 1.0 + xp.cos(2.0 * xp.pi * u), 0.0)


def _between(x, rows, where):
    """Rows (k, n) at equally spaced x (n,), read at ``where`` by straight lines: no search, which a march feels."""
    place = (where - x[0]) / (x[-1] - x[0]) * (len(x) - 1)
    left = jnp.clip(jnp.floor(place), 0.0, len(x) - 2.0)
    part, left = place - left, left.astype(jnp.int32)
    near, far = (rows.at[:, k].get(mode="promise_in_bounds", wrap_negative_indices=False) for k in (left, left + 1))
    return near * (1.0 - part) + far * part


@pytree
@dataclass(frozen=True, kw_only=True)
class Passing:
    """What a weld of 1 rad adds at the run-up, the run-off [1/m] and to the tilt [rad], rows of ``added`` (3, n), with
    its middle at x [m], (n,), from the run-off."""

    x: jnp.ndarray
    added: jnp.ndarray


@effect
@dataclass(frozen=True, kw_only=True)
class Weld(Effect):
    """Natural curvature angle / length (1 + cos) over ``length``: each passage of a run-up turns the belt.

    ``at``: the middle of the weld at travel 0, from point 4 on by the points 1, 2 and 3. It leaves no drift.
    """

    id = "weld"
    law = "span"
    reference = "physics sheet, section 7; Benson 2002 (JDSMC 124(1) 25) for splices"
    parity = "even"
    on_belt = True
    comes_round = True
    min_revolutions = 1.0  # it runs up both pulleys
    cause = Cause(
        "a weld puts a kink into the belt", ("upper", "lower"), "Lay a straightedge along the edge across the weld."
    )
    parameters = {
        "angle": Parameter(unit="rad", meaning="kink of the belt", plausible=(-2e-3, 2e-3), scale=2e-4),
        "at": Parameter(
            unit="m",
            meaning="place at travel 0",
            plausible=(-300.0, 300.0),  # it comes back every belt length
            scale=2.0,
            modifier=True,
            grid=tuple(k / 12 for k in range(12)),
            of_belt=True,
        ),
        "length": Parameter(
            unit="m", meaning="length of the bend", plausible=(0.2, 2.0), scale=0.6, null=0.6, modifier=True
        ),
    }
    angle: float = 0.0
    at: float = 0.0
    length: float = 0.6

    def influence(self, span, case):
        fields, piece = span_fields(span), self.length / len(_POINTS)
        rows = natural_curvature_rows(fields, span)
        shape = raised_cosine(_POINTS) / len(_POINTS)

        def passing(middle):
            place = middle + self.length * _POINTS
            inside = jnp.clip(0.5 + jnp.minimum(place, span.length - place) / piece, 0.0, 1.0)  # share of each piece
            return _between(fields.x, rows, jnp.clip(place, 0.0, span.length)) @ (shape * inside)

        x = jnp.linspace(-0.5 * self.length, span.length + 0.5 * self.length, _PLACES)
        return Passing(x=x, added=jax.vmap(passing, out_axes=1)(x))

    def bend(self, bend, boundary, known, case):
        rig = case.rig
        to_point_3 = 2.0 * rig.span_length + rig.wrap_tail
        place = jnp.where(boundary.direction > 0, self.at, to_point_3 - self.at) + boundary.travel
        place = place + case.settings.start
        place = place - jnp.stack([0.0 * to_point_3, rig.span_length + rig.wrap_tail])  # from each span's run-off
        place = jnp.mod(place + 0.5 * self.length, rig.belt_length) - 0.5 * self.length
        there = (place >= known.x[0]) & (place <= known.x[-1])
        runup, runoff, tilt = self.angle * jnp.where(there, _between(known.x, known.added, place), 0.0)
        ends = [self.angle / self.length * raised_cosine((place - x) / self.length) for x in (rig.span_length, 0.0)]
        return replace(
            bend,
            runup=bend.runup + runup,
            runoff=bend.runoff + runoff,
            natural_runup=bend.natural_runup + ends[0],
            natural_runoff=bend.natural_runoff + ends[1],
            tilt=bend.tilt + tilt,
        )

    def scene(self, parts, case):
        around = float(case.rig.belt_length)

        def camber(s):
            off = np.mod(s - self.at + 0.5 * around, around) - 0.5 * around
            return self.angle / self.length * raised_cosine(off / self.length, np)

        return parts.with_camber(camber) if self.angle else parts
