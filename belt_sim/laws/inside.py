"""Inside a span: what natural curvature and side loads between its ends do to it.

Camber: the bending moment is EI (kappa - kappa_c). By Betti's theorem a natural curvature kappa_c(x) adds to the
elastic curvature at the run-up the integral of -kappa_c(x) k_u(x), k_u(x) being the curvature at x per unit of angle at
the run-up (at the run-off that of +kappa_c k_o), and to the tilt of mid-span that of EI kappa_c(x) k_m(x), k_m per unit
of couple there. Uniform camber of a flat span changes no curvature: k_u and k_o integrate to 1 and -1, and kappa_c
itself comes on top. In a hanging span k_u integrates to 1 + Z times the integral of the roll, which is less.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from belt_sim.laws.span import Span, condensed, inverse
from belt_sim.pytree import pytree


@pytree
@dataclass(frozen=True, kw_only=True)
class Bend:
    """What bends the spans between their ends; shape (2,): the span up the tail pulley, the span up the head pulley.

    runup, runoff: elastic curvature that it adds at either end [1/m]; natural_runup, natural_runoff: curvature that
    the belt has there by nature [1/m]; tilt: roll that it adds at mid-span [rad].
    """

    runup: jnp.ndarray
    runoff: jnp.ndarray
    natural_runup: jnp.ndarray
    natural_runoff: jnp.ndarray
    tilt: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class BoundaryValues:
    """How the two spans are held at one travel: travel [m]; start (2,): y at the run-offs [m]; ends (5, 2): boundary
    values y_u - y_o [m], theta_o, theta_u, phi_o, phi_u [rad]; direction of travel (+1, -1)."""

    travel: jnp.ndarray
    start: jnp.ndarray
    ends: jnp.ndarray
    direction: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class Along:
    """Fields at equally spaced places x from run-off to run-up, shape (n,), or (3, n): per unit of angle at the run-up,
    at the run-off, and of rolling couple at mid-span.

    per_runup, per_runoff: curvature per unit of those angles [1/m]; per_couple: curvature per unit of that couple
    [1/(N m2)]; place, slope, roll (3, n): y, y' and phi per unit of each.
    """

    x: jnp.ndarray
    per_runup: jnp.ndarray
    per_runoff: jnp.ndarray
    per_couple: jnp.ndarray
    place: jnp.ndarray
    slope: jnp.ndarray
    roll: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class Support:
    """A place within a span where something pushes sideways.

    place: y there less y at the run-off, per unit of the span's boundary values, shape (5,); per newton of push:
    give [m/N] at the place, runup, runoff: curvature at the ends [1/(m N)], tilt of mid-span [rad/N].
    """

    place: jnp.ndarray
    give: jnp.ndarray
    runup: jnp.ndarray
    runoff: jnp.ndarray
    tilt: jnp.ndarray


def no_bend() -> Bend:
    """Nothing bends the spans but their ends."""
    zero = jnp.zeros(2)
    return Bend(runup=zero, runoff=zero, natural_runup=zero, natural_runoff=zero, tilt=zero)


@jax.jit  # many effects ask for it: it is traced once for all of them
def along(span: Span) -> Along:
    """The fields of a span, by halving half of it as ``condensed`` doubled it."""
    kl2, g, roll, _ = numbers(span)
    *shorter, ((p, q), (r, s)) = condensed(kl2, g, 0.5)
    meet = inverse(s - p)
    zero, turned = jnp.zeros(3), jnp.eye(3)[:, 1]  # of u = (y/L, theta, phi/roll)
    twisted = meet[:, 2] * span.length / (span.torsion * roll)
    start, middle, end = (zero, turned, zero), (meet @ q @ turned, -meet @ r @ turned, twisted), (turned, zero, zero)
    values = jnp.stack([jnp.stack(columns, axis=1) for columns in (start, middle, end)])
    for (p, q), (r, s) in reversed(shorter):
        between = inverse(s - p) @ (q @ values[1:] - r @ values[:-1])
        values = jnp.concatenate([jnp.stack([values[:-1], between], 1).reshape(-1, 3, 3), values[-1:]])
    left, right = p @ values[:-1] + q @ values[1:], r @ values[-2:-1] + s @ values[-1:]
    bent = jnp.concatenate([left, right])[:, 0] / span.length
    return Along(
        x=jnp.linspace(0.0, 1.0, len(bent)) * span.length,
        per_runup=bent[:, 0],
        per_runoff=bent[:, 1],
        per_couple=bent[:, 2],
        place=values[:, 0].T * span.length,
        slope=values[:, 1].T,
        roll=values[:, 2].T * roll,
    )


def natural_rows(fields: Along, span: Span):
    """What natural curvature at each place adds, per metre and unit of it, shape (3, n): elastic curvature at the
    run-up and the run-off [1/m], tilt of mid-span [rad]."""
    return jnp.stack([-fields.per_runup, fields.per_runoff, span.bending * fields.per_couple])


def supports(span: Span, share, fields: Along) -> tuple[Support, Support]:
    """What a side load does at ``share`` (0..1) of the length from the run-off, and what at as much from the run-up."""
    kl2, g, *_ = numbers(span)
    short, long = (condensed(kl2, g, part)[-1] for part in (share, 1.0 - share))
    return _support(span, share, (short, long), fields), _support(span, 1.0 - share, (long, short), fields)


def _support(span: Span, share, pieces, fields: Along) -> Support:
    """Of one load between two pieces of a span: they meet with equal y, theta, phi; EI kappa' jumps by the load."""
    _, _, roll, scale = numbers(span)
    ((_, q0), (r0, s0)), ((p1, q1), (r1, _)) = pieces
    meet = inverse(s0 - p1)
    pushed = -meet[:, 1] * span.length**2 / (span.bending * scale)
    held = jnp.stack([-meet @ r0, meet @ q1])[:, 0] * span.length  # y at the place per (y/L, theta, phi/roll), (2, 3)
    place = jnp.stack([held[1, 0] / span.length, held[0, 1], held[1, 1], held[0, 2] / roll, held[1, 2] / roll])
    return Support(
        place=place,
        give=pushed[0] * span.length,
        runup=(r1 @ pushed)[0] / span.length,
        runoff=(q0 @ pushed)[0] / span.length,
        tilt=jnp.interp(share * span.length, fields.x, fields.place[2]),
    )


def numbers(span: Span):
    """(K L)^2, g, roll and scale of ``condensed``."""
    kl2 = span.force * span.length**2 / span.bending
    roll = jnp.sqrt(span.bending / span.torsion)
    return kl2, span.length * span.sag_curvature * roll, roll, jnp.sqrt(1.0 + kl2)
