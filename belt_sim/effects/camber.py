"""Camber: a belt that is curved in its own plane when nothing holds it, evenly or at a weld."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.laws.inside import Along, along
from belt_sim.pytree import pytree

_PLACES = 1024  # of the weld's middle, from where it enters a span to where it has left it
_POINTS = (np.arange(32) + 0.5) / 32 - 0.5  # over the length of a weld
_SHAPE = 1.0 + np.cos(2.0 * np.pi * _POINTS)  # raised cosine of mean 1


def raised_cosine(u):
    """1 + cos(2 pi u) for |u| < 1/2, else 0: a bend of mean 1 over its own length."""
    return jnp.where(jnp.abs(u) < 0.5, 1.0 + jnp.cos(2.0 * jnp.pi * u), 0.0)


@pytree
@dataclass(frozen=True, kw_only=True)
class Influence:
    """What natural curvature adds at the run-up, the run-off [1/m] and to the tilt [rad], shape (3,) in this order.

    even: per unit of uniform curvature; weld, shape (3, n): per radian of a weld whose middle is at x [m], (n,).
    """

    even: jnp.ndarray
    x: jnp.ndarray
    weld: jnp.ndarray


@effect
@dataclass(frozen=True, kw_only=True)
class Camber(Effect):
    """Moment EI (kappa - kappa_c): kappa_c all round, and a weld that adds weld_angle over weld_length.

    A weld comes round once a belt length and leaves no drift. Uniform camber leaves a flat belt where it is, but
    tilts a hanging one (T phi'' = EI Z (kappa - kappa_c)), which then drifts like on two tapered pulleys.
    """

    id = "camber"
    law = "span"
    reference = "physics sheet, section 7; Benson 2002 (JDSMC 124(1) 25) for camber and splices"
    parity = "even"
    on_belt = True
    parameters = {
        "kappa_c": Parameter(unit="1/m", meaning="natural curvature", plausible=(-1e-3, 1e-3), scale=1e-4),
        "weld_angle": Parameter(unit="rad", meaning="kink at the weld", plausible=(-2e-3, 2e-3), scale=2e-4),
        "weld_at": Parameter(
            unit="m",
            meaning="weld at travel 0, from point 4 on by 1, 2, 3",
            plausible=(0, 300),
            scale=2.0,
            modifier=True,
        ),
        "weld_length": Parameter(
            unit="m", meaning="length of the bend", plausible=(0.2, 2.0), scale=0.6, null=0.6, modifier=True
        ),
    }
    kappa_c: float = 0.0
    weld_angle: float = 0.0
    weld_at: float = 0.0
    weld_length: float = 0.6

    def influence(self, span, case):
        fields = along(span)
        rows = jnp.stack([-fields.per_runup, fields.per_runoff, span.bending * fields.per_couple])
        x = jnp.linspace(-0.5 * self.weld_length, span.length + 0.5 * self.weld_length, _PLACES)
        weld = jax.vmap(lambda middle: self._passing(middle, fields, rows, span.length), out_axes=1)(x)
        return Influence(even=_integral(rows, span.length), x=x, weld=weld)

    def _passing(self, middle, fields: Along, rows, length):
        """Influence of the weld while its middle is at ``middle`` [m] from the run-off, as far as it is in the span."""
        at = middle + self.weld_length * _POINTS
        inside = jnp.where((at > 0.0) & (at < length), _SHAPE / len(_SHAPE), 0.0)
        return jnp.stack([jnp.interp(at, fields.x, row) @ inside for row in rows])

    def bend(self, bend, held, known, case):
        rig, half = case.rig, 0.5 * self.weld_length
        to_point_3 = 2.0 * rig.span_length + rig.wrap_tail
        place = jnp.where(held.direction > 0, self.weld_at, to_point_3 - self.weld_at) + held.travel
        place = place - jnp.stack([0.0 * to_point_3, rig.span_length + rig.wrap_tail])  # from each span's run-off
        place = jnp.mod(place + half, rig.belt_length) - half
        passing = jnp.stack([jnp.interp(place, known.x, row, left=0.0, right=0.0) for row in known.weld])
        runup, runoff, tilt = self.kappa_c * known.even[:, None] + self.weld_angle * passing
        bump = self.weld_angle / self.weld_length
        ends = [bump * raised_cosine((place - x) / self.weld_length) for x in (rig.span_length, 0.0)]
        return replace(
            bend,
            runup=bend.runup + runup,
            runoff=bend.runoff + runoff,
            natural_runup=bend.natural_runup + self.kappa_c + ends[0],
            natural_runoff=bend.natural_runoff + self.kappa_c + ends[1],
            tilt=bend.tilt + tilt,
        )

    def edit_scene(self, parts, case):
        around = float(case.rig.belt_length)

        def curvature(s):
            from_weld = np.mod(s - self.weld_at + 0.5 * around, around) - 0.5 * around
            bump = np.asarray(raised_cosine(from_weld / self.weld_length)) / self.weld_length
            return self.kappa_c + self.weld_angle * bump

        if not self.is_null():
            parts.bend(curvature)


def _integral(rows, length):
    """Integral of rows, shape (3, n), over the span by Simpson's rule."""
    weights = np.ones(rows.shape[1])
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return rows @ weights * (length / (rows.shape[1] - 1) / 3.0)
