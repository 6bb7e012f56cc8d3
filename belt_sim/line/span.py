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
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, pytree
from belt_sim.line.runup import TWO_ZEROS, add

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

    The transfer matrix of a short piece, from its series, becomes a relation between the values at its ends, whose
    doubling (static condensation) stays stable where the transfer matrix of the whole span would overflow.
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
    """What a relative change of ``kind`` adds to the curvature at run-up and run-off and to the roll at mid-span, per
    unit of the boundary values of a span, (7, 3, 5): coefficients of powers 1 to 7 of ``log_of_change``, with the slope
    at no change and through what the changes CHANGES do."""

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


# Influence (Green's) functions of a span: the response of its clamped ends to loads and natural curvature inside it.
#
# Loads. With a side load q(x) [N/m] and a rolling couple m(x) [N m/m] (about the long axis, raising the side y > 0) the
# strip obeys EI kappa'' = F y'' + q, T phi'' = EI Z kappa - m. The equations are symmetric, so Betti's theorem holds: a
# load adds to the curvature at the run-up -1/EI times its work on the shape (y, phi) of a unit angle at the run-up, to
# the curvature at the run-off +1/EI times its work on that of a unit angle there, and to the roll of mid-span its work
# on the shape of a unit rolling couple there. Work is force times y, couple (about z, x along the travel) times theta,
# rolling couple times phi.
#
# Natural curvature kappa_c(x), with the bending moment EI (kappa - kappa_c). It adds to the elastic curvature at the
# run-up the integral of -kappa_c k_u, at the run-off that of +kappa_c k_o, and to the roll of mid-span that of
# EI kappa_c k_m; k_u, k_o, k_m are the curvatures at x per unit of those angles and of that couple. Uniform camber of a
# flat span changes no curvature, as k_u and k_o integrate to 1 and -1. In a hanging span k_u integrates to less.


@pytree
@dataclass(frozen=True, kw_only=True)
class Bend:
    """Curvature and roll that effects inside the spans add, shape (2,): spans up the tail and the head pulley.

    runup, runoff: elastic curvature added at the ends [1/m]; natural_runup, natural_runoff: natural curvature of the
    belt there [1/m]; tilt: roll added at mid-span [rad]; side_force: on the run-up end if both ends were hinged [N];
    tension: what is added to the span's own, as a share.
    """

    runup: jnp.ndarray = field(default_factory=TWO_ZEROS)
    runoff: jnp.ndarray = field(default_factory=TWO_ZEROS)
    natural_runup: jnp.ndarray = field(default_factory=TWO_ZEROS)
    natural_runoff: jnp.ndarray = field(default_factory=TWO_ZEROS)
    tilt: jnp.ndarray = field(default_factory=TWO_ZEROS)
    side_force: jnp.ndarray = field(default_factory=TWO_ZEROS)
    tension: jnp.ndarray = field(default_factory=TWO_ZEROS)


@pytree
@dataclass(frozen=True, kw_only=True)
class BoundaryValues:
    """Boundary values of both spans at one travel: travel [m]; start (2,): y at the run-offs [m]; ends (5, 2): boundary
    values y_u - y_o [m], theta_o, theta_u, phi_o, phi_u [rad]; direction of travel (+1, -1)."""

    travel: jnp.ndarray
    start: jnp.ndarray
    ends: jnp.ndarray
    direction: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class SpanFields:
    """Fields of a span at equally spaced x (n,) from run-off to run-up, per unit angle at the run-up, at the run-off,
    and rolling couple at mid-span: curvature [1/m], [1/(N m2)]; place, slope, angle, roll, twist (3, n): y, y', theta,
    phi and phi' per unit of each."""

    x: jnp.ndarray
    per_runup: jnp.ndarray
    per_runoff: jnp.ndarray
    per_couple: jnp.ndarray
    place: jnp.ndarray
    slope: jnp.ndarray
    angle: jnp.ndarray
    roll: jnp.ndarray
    twist: jnp.ndarray


@pytree
@dataclass(frozen=True, kw_only=True)
class StretchResponse:
    """What a stretch of another stiffness does to a span, by where it lies.

    x (n,): equally spaced places from the run-off [m]; integrals (10, n): from the run-off to each, of what a unit jump
    of the angle there (bending) or of the roll (torsion) adds to the elastic curvature at run-up and run-off and to the
    roll at mid-span, times the curvature (twist) there per unit of the first three boundary values of the span, (9, n);
    and of what that jump takes of the curvature (twist) where it is [1/m]; ends (2, 3): curvature at run-up and run-off
    per unit of the boundary values; None of torsion, which does not change how the belt itself runs up.
    """

    x: jnp.ndarray
    integrals: jnp.ndarray
    ends: jnp.ndarray | None


@pytree
@dataclass(frozen=True, kw_only=True)
class LoadResponse:
    """Response of a span to a unit load: elastic curvature at run-up and run-off [1/m], roll of mid-span [rad], and
    the side_force on the run-up end if both ends were hinged [N]."""

    runup: jnp.ndarray
    runoff: jnp.ndarray
    tilt: jnp.ndarray
    side_force: jnp.ndarray | float


@pytree
@dataclass(frozen=True, kw_only=True)
class Support(LoadResponse):
    """Response of a span to one newton towards +y at one place; place: y there less y at the run-off, per unit of the
    span's boundary values, (5,); give [m/N] at the place."""

    place: jnp.ndarray
    give: jnp.ndarray


@jax.jit
def span_fields(span: Span) -> SpanFields:
    """Return the fields of a span, by undoing the doublings of ``condense``."""
    if span.fields is not None:  # many effects ask for them
        return span.fields
    numbers, roll, scale = dimensionless(span)
    *shorter, ((p, q), (r, s)) = condense(numbers, 0.5)
    meet = inverse(s - p)
    zero, turned = jnp.zeros(3), jnp.eye(3)[:, 1]  # of u = (y/L, theta, phi/roll)
    twisted = meet[:, 2] * span.length / (span.torsion * roll)
    start, middle, end = (zero, turned, zero), (meet @ q @ turned, -meet @ r @ turned, twisted), (turned, zero, zero)
    values = jnp.stack([jnp.stack(columns, axis=1) for columns in (start, middle, end)])
    for (p, q), (r, s) in reversed(shorter):
        between = inverse(s - p) @ (q @ values[1:] - r @ values[:-1])
        values = jnp.concatenate([jnp.stack([values[:-1], between], 1).reshape(-1, 3, 3), values[-1:]])
    left, right = p @ values[:-1] + q @ values[1:], r @ values[-2:-1] + s @ values[-1:]
    forces = jnp.concatenate([left, right])
    bent, sheared = forces[:, 0] / span.length, numbers[2] * scale * forces[:, 1]
    return SpanFields(
        x=jnp.linspace(0.0, 1.0, len(bent)) * span.length,
        per_runup=bent[:, 0],
        per_runoff=bent[:, 1],
        per_couple=bent[:, 2],
        place=values[:, 0].T * span.length,
        slope=(values[:, 1] - sheared).T,
        angle=values[:, 1].T,
        roll=values[:, 2].T * roll,
        twist=forces[:, 2].T * roll / span.length,
    )


def natural_curvature_rows(fields: SpanFields, span: Span):
    """Return what natural curvature at each place adds to the elastic curvature at run-up and run-off [1/m] and to the
    roll of mid-span [rad], per metre and per 1/m of it, (3, n)."""
    return jnp.stack([-fields.per_runup, fields.per_runoff, span.bending * fields.per_couple])


@partial(jax.jit, static_argnames="kind")
def stretch_response(span: Span, kind: str) -> StretchResponse:
    """Return what a stretch of another bending stiffness (kind bending) or torsional stiffness (torsion) does."""
    fields, twists = span_fields(span), kind == "torsion"
    curved = jnp.stack([fields.per_runup, fields.per_runoff, fields.per_couple])
    up, off, couple = fields.twist if twists else curved
    stiffness = span.torsion if twists else span.bending
    there = jnp.stack([-(up + off) / span.length, off, up])

    # what a unit jump of the angle takes of the curvature at its own place [1/m], or one of the roll of the rate of
    # twist, (n,): from the stiffness at the free end of what lies behind every place, and before it
    pieces = condense(dimensionless(span)[0], 0.5)
    (p, q), (r, s) = pieces[0]

    def longer(ends, _):
        left, right = ends
        return (s + r @ inverse(left - p) @ q, p + q @ inverse(right - s) @ r), ends

    _, (left, right) = jax.lax.scan(longer, (s, p), length=2 ** len(pieces))
    inside = -jax.vmap(lambda a, b: a @ inverse(a - b) @ b)(left[:-1], right[-2::-1])
    release = jnp.concatenate([-right[-1:], inside, left[-1:]]) / span.length
    own = release[None, :, 2, 2] if twists else release[None, :, 0, 1]

    def rows(couple):
        added = stiffness * jnp.stack([-up / span.bending, off / span.bending, couple])
        return jnp.concatenate([(added[:, None] * there).reshape(9, -1), own])

    # the rate of twist falls by 1/T where the couple acts, and the fields have what it is beyond that
    before = couple.at[len(fields.x) // 2].add(1.0 / span.torsion) if twists else couple
    steps = 0.5 * (rows(before)[:, 1:] + rows(couple)[:, :-1]) * (fields.x[1] - fields.x[0])
    integrals = jnp.concatenate([jnp.zeros((10, 1)), jnp.cumsum(steps, axis=1)], axis=1)
    return StretchResponse(x=fields.x, integrals=integrals, ends=None if twists else there[:, jnp.array([-1, 0])].T)


def stretch_ends(length, around, behind, wide, xp=jnp):
    """Return where a stretch of the belt begins and ends within a span, counted from its run-off [m]; both at one end
    of the span while it is elsewhere.

    length, around: of the span and of the belt [m]; behind: by how much the middle of the stretch has yet to run up;
    wide: its length, both in belt lengths.
    """
    middle = length - (xp.mod(behind + 0.5 * wide, 1.0) - 0.5 * wide) * around
    return tuple(xp.clip(middle + side * wide * around, 0.0, length) for side in (-0.5, 0.5))


def stretch_adds(response: StretchResponse, jump, wide, place, xp=jnp):
    """Return what a stretch adds to the elastic curvature at run-up and run-off and to the roll at mid-span, per unit
    of the first three boundary values, (3, 3, ...); and its mean of EI / its own EI - 1, by which it bends more than
    its moment bends the rest, where it runs up itself.

    jump: integral of EI / its own EI - 1 along it [m]; below that of a rigid one it counts as rigid; wide: its length
    [m]; place: of ``stretch_ends`` [m]. What the jumps along a stretch take of the curvature in it lies between what
    they do each by themselves, where it is short, and all of it, where it is long. Where nine tenths of
    a stiffness are gone over a tenth of a span, bending is wrong by 2, 5, 14 and 27 % at 5, 10, 20 and 40 N/mm2, twist
    by 7 to 16 %; over three tenths of a span bending by 3 to 60 %, twist, which may change its sign there, by half
    (tests/agreement/test_stretch_of_the_belt.py).
    """
    low, high = (interpolate_rows(response.x, response.integrals, end, xp) for end in place)
    mean = (high - low) / wide
    jump, own = xp.maximum(jump, -wide), xp.maximum(mean[9], 0.0)
    added = jump / (1.0 + jump * own / (1.0 + own * wide)) * mean[:9]
    return xp.reshape(added, (3, 3, *mean.shape[1:])), jump / wide


def interpolate_rows(x, rows, where, xp=jnp):
    """Return rows (k, n) at equally spaced x (n,), read at ``where`` (...) by straight lines, (k, ...): no search,
    which a march feels."""
    place = (where - x[0]) / (x[-1] - x[0]) * (len(x) - 1)
    left = xp.clip(xp.floor(place), 0.0, len(x) - 2.0)
    part, left = place - left, left.astype(int)
    near, far = (xp.take(rows, k, axis=1, mode="clip") for k in (left, left + 1))
    return near * (1.0 - part) + far * part


def supports(span: Span, share, fields: SpanFields) -> tuple[Support, Support]:
    """Return the responses to a side force at ``share`` (0..1) of the length from the run-off, and from the run-up."""
    numbers, _, scale = dimensionless(span)
    short, long = (condense(numbers, part)[-1] for part in (share, 1.0 - share))
    found = []
    for part, pieces in ((share, (short, long)), (1.0 - share, (long, short))):
        # two pieces share y, theta, phi where they meet; EI kappa' jumps by the load
        ((_, q0), (_, s0)), ((p1, _), (r1, _)) = pieces
        pushed = -inverse(s0 - p1)[:, 1] * span.length**2 / (span.bending * scale)
        support = Support(
            place=place_row(span, pieces),
            give=pushed[0] * span.length,
            runup=(r1 @ pushed)[0] / span.length,
            runoff=(q0 @ pushed)[0] / span.length,
            tilt=jnp.interp(part * span.length, fields.x, fields.place[2]),
            side_force=part,
        )
        found.append(support)
    return found[0], found[1]


def place_row(span: Span, pieces):
    """Return y where two pieces meet, less y at the run-off, per unit of the boundary values, shape (5,)."""
    _, roll, _ = dimensionless(span)
    ((_, _), (r0, s0)), ((p1, q1), (_, _)) = pieces
    meet = inverse(s0 - p1)
    held = jnp.stack([-meet @ r0, meet @ q1])[:, 0] * span.length  # y at the place per (y/L, theta, phi/roll), (2, 3)
    return jnp.stack([held[1, 0] / span.length, held[0, 1], held[1, 1], held[0, 2] / roll, held[1, 2] / roll])


def load_response(span: Span, kind: str, fields: SpanFields, share=None) -> LoadResponse:
    """Return the response to a unit load, by Betti's theorem: its work on the shapes of ``SpanFields``.

    kind: force, of 1 N towards +y at ``share`` (0..1) of the length from the run-off; couple, of 1 N m that turns x
    (along the travel) towards y there; spread_force, of 1 N/m towards +y along the whole span; spread_roll, a rolling
    couple of 1 N m/m along it that raises the side y > 0.
    """
    if kind == "spread_force":
        work, side_force = integral(fields.place, span), 0.5 * span.length
    elif kind == "spread_roll":
        work, side_force = integral(fields.roll, span), 0.0
    else:
        values, slopes, side_force = fields.place, fields.slope, share
        if kind == "couple":
            curved = jnp.stack([fields.per_runup, fields.per_runoff, fields.per_couple])
            values, slopes, side_force = fields.angle, curved - span.sag_curvature * fields.roll, 1.0 / span.length
        # the shapes at ``share``, by cubic Hermite polynomials
        pieces = len(fields.x) - 1
        left = jnp.clip(jnp.floor(share * pieces).astype(int), 0, pieces - 1)
        u, h = share * pieces - left, fields.x[1] - fields.x[0]
        near, far = values[:, left], values[:, left + 1]
        rise, ahead = h * slopes[:, left], h * slopes[:, left + 1]
        bow = (1.0 - u) * (rise - (far - near)) + u * (far - near - ahead)
        work = (1.0 - u) * near + u * far + u * (1.0 - u) * bow
    runup, runoff = -work[0] / span.bending, work[1] / span.bending
    return LoadResponse(runup=runup, runoff=runoff, tilt=work[2], side_force=side_force)


def add_load(bend: Bend, unit: LoadResponse, loads) -> Bend:
    """Return ``bend`` plus loads (2,) on the two spans, ``unit`` being the response to a unit load."""
    names = ("runup", "runoff", "tilt", "side_force")
    return add(bend, **{name: loads * getattr(unit, name) for name in names})


def integral(rows, span: Span):
    """Integrate rows (3, n) over the span by Simpson's rule."""
    weights = np.ones(rows.shape[1])
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return rows @ weights * (span.length / (rows.shape[1] - 1) / 3.0)
