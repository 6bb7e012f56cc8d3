"""Span law: curvature and roll of a free span for given positions and angles of its ends.

The strip is the most general linear span (physics sheet, section 3). With in-plane curvature kappa and roll phi of the
cross-section,

    kappa = y'' + Z phi,   EI kappa'' = F y'',   T phi'' = EI Z kappa,   T = F b^2/12 + G b h^3/3.

Z = 0 makes it the beam of second order, Z = 0 and F = 0 the beam of first order; a limp span is a straight line.
In xi = x/L and with phi scaled by sqrt(EI/T), two numbers remain: (K L)^2 = F L^2/EI and g = L Z sqrt(EI/T).

Where a side force shears the strip (Timoshenko), kappa = theta' + Z phi with the angle theta of the cross-sections, and
y' = theta - shear EI kappa'. Then K^2 = (F/EI)/(1 + shear F), and shear EI/L^2 is a third number.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, pytree

_SQUARINGS = 4  # transfer matrix of L/1024 -> L/64
_DOUBLINGS = 5  # condensed L/64 -> L/2: fields along a span are known at 65 places
_TAYLOR_TERMS = 8
CHANGES = (-3.0, -2.25, -1.5, -0.75, 0.75, 1.5)  # logarithms of 1 + change, between which powers stand for what it does
CHANGE_LIMITS = (-3.1, 1.6)  # logarithms beyond which a change does no more


@pytree
@dataclass(frozen=True, kw_only=True)
class Span:
    """Properties of a span: length [m], force [N] (tension in the bending equation), bending EI [N m2],
    torsion T [N m2], sag_curvature Z [1/m], shear: angle by which a side force of 1 N shears it [rad/N]; limp (static):
    no bending stiffness at all, a straight line; fields: its ``span_fields``, where they are known.
    """

    length: float
    force: float
    bending: float
    torsion: float
    sag_curvature: float
    shear: float = 0.0
    fields: Any = None
    limp: bool = field(default=False, metadata={"static": True})


@pytree
@dataclass(frozen=True, kw_only=True)
class Response:
    """Response of a span per unit of its boundary values d = (y_u - y_o [m], theta_o, theta_u, phi_o, phi_u [rad]).

    runup, runoff: curvature kappa at the ends [1/m]; twist_runup, twist_runoff: rate of twist phi' there [rad/m];
    mid_tilt: roll phi at mid-span [rad]. Shape (5,), or (2, 5) for two spans.
    """

    runup: jnp.ndarray
    runoff: jnp.ndarray
    twist_runup: jnp.ndarray
    twist_runoff: jnp.ndarray
    mid_tilt: jnp.ndarray


def thin_strip_torsion(case: Case):
    """Return G b h^3/3 [N m2], St. Venant torsion of a thin strip."""
    return case.belt.shear_modulus * case.belt.width * case.belt.thickness**3 / 3


def beam_second_order(case: Case) -> Span:
    """Return the beam under tension, y'''' = K^2 y'' with K^2 = F/EI (paper eq. 8, 10).

    Its T = F b^2/12 + G b h^3/3: tension in the twisted edges, and St. Venant torsion of a thin strip.
    """
    return Span(
        length=case.rig.span_length,
        force=case.tension_force,
        bending=case.belt.bending_stiffness,
        torsion=case.tension_force * case.belt.width**2 / 12 + thin_strip_torsion(case),
        sag_curvature=0.0,
    )


def beam_first_order(case: Case) -> Span:
    """Return the beam without the moment of the tension, y'''' = 0 (paper eq. 8, 9)."""
    return replace(beam_second_order(case), force=0.0 * case.tension_force)


def rope(case: Case) -> Span:
    """Return the limp, highly tensioned rope: a straight line between run-off and run-up (paper eq. 5, 6)."""
    return replace(beam_second_order(case), limp=True)


def strip(case: Case) -> Span:
    """Return the hanging strip that may roll: sag couples in-plane bending to the roll of the cross-section."""
    return replace(beam_second_order(case), sag_curvature=case.sag_curvature)


def sag_softening(case: Case):
    """Return Lambda = (rho g L)^2 E / (12 sigma^3) [1], sag over elastic stretch (Ernst 1965)."""
    weight = case.belt.density * case.rig.gravity * case.rig.span_length
    return weight**2 * case.belt.youngs_modulus / (12.0 * case.settings.tension**3)


def ernst_beam(case: Case) -> Span:
    """Return the beam of second order with Ernst's modulus E/(1 + Lambda) in place of E."""
    span = beam_second_order(case)
    return replace(span, bending=span.bending / (1.0 + sag_softening(case)))


def response(span: Span) -> Response:
    """Condense a span onto its boundary values; exact up to rounding for any K L and g.

    The transfer matrix of a short piece comes from its series and becomes a relation between the values at its ends.
    Doubling that (static condensation) stays stable where the transfer matrix of the whole span would overflow.
    """
    numbers, roll, _ = dimensionless(span)
    (p, q), (r, s) = condense(numbers, 0.5)[-1]
    middle = inverse(s - p)
    um0, um1 = -middle @ r, middle @ q  # middle values per unit of either end
    f0 = jnp.concatenate([p + q @ um0, q @ um1], axis=-1)  # values (y/L, theta, phi/roll) at run-off, run-up
    f1 = jnp.concatenate([r @ um0, s + r @ um1], axis=-1)
    mid = jnp.concatenate([um0, um1], axis=-1)
    order = jnp.array([3, 1, 4, 2, 5])  # y_u, theta_o, theta_u, phi_o, phi_u
    scale = jnp.stack([1.0 / span.length, 1.0 + 0 * roll, 1.0 + 0 * roll, 1.0 / roll, 1.0 / roll])
    return Response(
        runup=f1[0, order] * scale / span.length,
        runoff=f0[0, order] * scale / span.length,
        twist_runup=f1[2, order] * scale * roll / span.length,
        twist_runoff=f0[2, order] * scale * roll / span.length,
        mid_tilt=mid[2, order] * scale * roll,
    )


def with_change(span, case: Case, kind: str, share):
    """A span whose bending stiffness, torsional stiffness or tension (force, sag, and what tension adds to torsion) is
    larger by ``share``. Residual stress may have taken most of what tension adds to torsion: St. Venant's part, or what
    there is if that is less, stays."""
    if kind in ("bending", "torsion"):
        return replace(span, fields=None, **{kind: getattr(span, kind) * (1.0 + share)})
    torsion = span.torsion + share * case.tension_force * case.belt.width**2 / 12.0
    torsion = jnp.maximum(torsion, jnp.minimum(span.torsion, thin_strip_torsion(case)))
    force, sag_curvature = span.force * (1.0 + share), span.sag_curvature / (1.0 + share)
    return replace(span, force=force, torsion=torsion, sag_curvature=sag_curvature, fields=None)


def response_by_change(span: Span, case: Case, kind: str) -> jax.Array:
    """What a relative change of ``kind`` adds to the curvature at run-up and run-off and to the roll at mid-span,
    (7, 3, 5): coefficients of powers 1 to 7 of ``log_of_change``, per unit of the boundary values of a span.

    They have the slope at no change and go through what the changes CHANGES do.
    """

    def rows(logarithm):
        answer = response(with_change(span, case, kind, jnp.expm1(logarithm)))
        return jnp.stack([answer.runup, answer.runoff, answer.mid_tilt])

    at = jnp.array(CHANGES)
    none, slope = jax.jvp(rows, (0.0,), (1.0,))
    does = jax.vmap(rows)(at) - none - at[:, None, None] * slope
    bent = np.linalg.inv(np.array(CHANGES)[:, None] ** np.arange(2, 8))
    return jnp.concatenate([slope[None], jnp.tensordot(bent, does, axes=1)])


def log_of_change(change, xp=jnp):
    """log(1 + change) of a relative change (...), as far as CHANGES tell what it does."""
    return xp.clip(xp.log(xp.maximum(1.0 + change, 1e-3)), *CHANGE_LIMITS)


def dimensionless(span: Span):
    """Return the numbers (K L)^2, g and shear EI/L^2 of a span, and roll and scale of ``condense``."""
    kl2 = span.force * span.length**2 / span.bending / (1.0 + span.force * span.shear)
    roll = jnp.sqrt(span.bending / span.torsion)
    numbers = kl2, span.length * span.sag_curvature * roll, span.shear * span.bending / span.length**2
    return numbers, roll, jnp.sqrt(1.0 + kl2)


@jax.jit
def condense(numbers, share):
    """Return ((P, Q), (R, S)) of 1/32, 1/16, ... 1 times the ``share`` of a span, by repeated doubling.

    f_0 = P u_0 + Q u_1, f_1 = R u_0 + S u_1 between its two ends, with
    u = (y/L, theta, phi/roll), f = (kappa L, kappa' L^2/scale, phi' L/roll), roll = sqrt(EI/T), scale =
    sqrt(1 + (K L)^2); L is the length of the whole span.
    """
    kl2, g, shear = numbers
    scale, zero, one = jnp.sqrt(1.0 + kl2), 0.0 * kl2, 1.0 + 0.0 * kl2
    system = [  # d/dxi of (y/L, theta, phi/roll; kappa L, kappa' L^2/scale, phi' L/roll)
        [zero, one, zero, zero, -shear * scale, zero],
        [zero, zero, -g, one, zero, zero],
        [zero, zero, zero, zero, zero, one],
        [zero, zero, zero, zero, scale, zero],
        [zero, zero, -g * kl2 / scale, kl2 / scale, zero, zero],
        [zero, zero, zero, g, zero, zero],
    ]
    m = jnp.array(system) * (share / 2.0 ** (_SQUARINGS + _DOUBLINGS))

    def grow(k, pair):
        term, total = pair
        term = term @ m / k
        return term, total + term

    _, transfer = jax.lax.fori_loop(1, _TAYLOR_TERMS + 1, grow, (jnp.eye(6), jnp.eye(6)))
    transfer = jax.lax.fori_loop(0, _SQUARINGS, lambda _, t: t @ t, transfer)
    a, b, c, d = transfer[:3, :3], transfer[:3, 3:], transfer[3:, :3], transfer[3:, 3:]
    b_inv = inverse(b)

    def double(pieces, _):
        p, q, r, s = pieces
        x = inverse(s - p)
        longer = p - q @ x @ r, q @ x @ q, -r @ x @ r, s + r @ x @ q
        return longer, longer

    start = (-b_inv @ a, b_inv, c - d @ b_inv @ a, d @ b_inv)
    _, longer = jax.lax.scan(double, start, length=_DOUBLINGS)
    stages = [start, *([x[k] for x in longer] for k in range(_DOUBLINGS))]
    return tuple(((p, q), (r, s)) for p, q, r, s in stages)


def inverse(m):
    """Return the inverse of a 3x3 matrix by cross products, which compiles and batches better than a factorisation."""
    rows = jnp.stack([jnp.cross(m[1], m[2]), jnp.cross(m[2], m[0]), jnp.cross(m[0], m[1])])
    return rows.T / (m[0] @ rows[0])


def solve_by_halves(m, right):
    """Return m^-1 right of matrices (..., n, n) near the unit matrix, n a power of 2, by elimination of halves of
    halves: without pivots, and without LAPACK, which takes longer to load than a curve."""
    n = m.shape[-1] // 2
    if n == 0:
        return right / m
    alone = solve_by_halves(m[..., :n, :n], jnp.concatenate([m[..., :n, n:], right[..., :n, :]], axis=-1))
    carried, first, below = alone[..., :n], alone[..., n:], m[..., n:, :n]
    last = solve_by_halves(m[..., n:, n:] - below @ carried, right[..., n:, :] - below @ first)
    return jnp.concatenate([first - carried @ last, last], axis=-2)
