"""Influence (Green's) functions of a span: the response of its clamped ends to loads and natural curvature inside it.

Loads. With a side load q(x) [N/m] and a rolling couple m(x) [N m/m] (about the long axis, raising the side y > 0) the
strip obeys EI kappa'' = F y'' + q, T phi'' = EI Z kappa - m. The equations are symmetric, so Betti's theorem holds: a
load adds to the curvature at the run-up -1/EI times its work on the shape (y, phi) of a unit angle at the run-up, to
the curvature at the run-off +1/EI times its work on that of a unit angle there, and to the roll of mid-span its work on
the shape of a unit rolling couple there. Work is force times y, couple (about z, x along the travel) times theta,
rolling couple times phi.

Natural curvature kappa_c(x), with the bending moment EI (kappa - kappa_c). It adds to the elastic curvature at the
run-up the integral of -kappa_c k_u, at the run-off that of +kappa_c k_o, and to the roll of mid-span that of
EI kappa_c k_m; k_u, k_o, k_m are the curvatures at x per unit of those angles and of that couple. Uniform camber of a
flat span changes no curvature, as k_u and k_o integrate to 1 and -1. In a hanging span k_u integrates to less.
"""

from dataclasses import dataclass, field
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import pytree
from belt_sim.line.runup import TWO_ZEROS, add
from belt_sim.line.span import Span, condense, dimensionless, inverse


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
    """Fields of a span at equally spaced x (n,) from run-off to run-up; rows (3, n): per unit angle at the run-up, per
    unit angle at the run-off, per unit rolling couple at mid-span.

    per_runup, per_runoff: curvature per unit of those angles [1/m]; per_couple: curvature per unit of that couple
    [1/(N m2)]; place, slope, angle, roll, twist (3, n): y, y', theta, phi and phi' per unit of each.
    """

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
    """Response of a span to one newton towards +y at one place.

    place: y there less y at the run-off, per unit of the span's boundary values, shape (5,); give [m/N] at the place.
    """

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
    """Return what natural curvature at each place adds, per metre and per 1/m of it, shape (3, n).

    Rows: elastic curvature at the run-up and the run-off [1/m], roll of mid-span [rad].
    """
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
