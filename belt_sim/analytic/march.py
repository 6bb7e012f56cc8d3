"""The march in travel: a belt's run-up points, step by step, for any linear span law and any set of effects.

The span is solved implicitly (trapezoidal rule) and effects in a predictor-corrector pair, so the march is of second
order in its step and stable for any stiffness of the span. Everything is float64 JAX: jitted once per composition of
laws, vmapped over cases, differentiable in every number of a case and of an effect.
"""

from dataclasses import replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.plan import first, plan_steps, room_for
from belt_sim.analytic.record import by_place, lay, observed, sorted_curves
from belt_sim.analytic.spans import Spans
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.around_engine import as_driven, as_numpy
from belt_sim.effects.base import uses
from belt_sim.errors import InputError, RunFailed
from belt_sim.jax_setup import PROGRAMS, compiled, in_float64
from belt_sim.laws import drive, wrap
from belt_sim.laws.runup import RunUp, Yaw
from belt_sim.si import N_PER_MM2

STEP = 0.05  # [m]; error of y_1 below 1e-4 on the test rig, see tests/convergence
KEEP = 0.1  # [m]
BEFORE = -1.0  # [m]: the instant before the start
RETURNED = ("travel", "y", "angle", "moment", "edge_stress", "tilt", "sag")  # of Curves


def march(
    case: Case, model: Composition, effects=(), *, travel: float, step: float = STEP, keep: float = KEEP
) -> Curves:
    """True curves of one case over ``travel`` [m], kept every ``keep`` [m] (rounded so that steps and record fit).

    What encoder and sensors show of them is the business of ``AnalyticModel.run``. Raises CannotRepresent when the
    model cannot honour an effect, InputError for a step that is too long.
    """
    model.admit(effects)
    return march_driven(in_float64(as_driven)(case, effects), model, effects, travel=travel, step=step, keep=keep)


def march_driven(
    case: Case, model: Composition, effects=(), *, travel: float, step: float = STEP, keep: float = KEEP
) -> Curves:
    """The same for a case whose settings are what they are, not what was commanded."""
    plan = plan_steps(case, travel=travel, step=step, keep=keep)
    tension = float(case.settings.tension)
    if not tension > 0:
        raise InputError("tension", f"{tension / N_PER_MM2:g}", "N/mm2", "effects leave none; make them weaker")
    records, stride, slots = plan
    spacing, roomy = travel / (records * stride), (room_for(records), stride, slots)
    rows = _marching(model, roomy, tuple(map(type, effects)))(case, tuple(effects), spacing)
    curves = first(as_numpy(Curves(**dict(zip(RETURNED, rows, strict=True)))), records + 1)
    if not np.isfinite(curves.y).all():
        raise RunFailed("y is not finite: weaken the effects or shorten model.step")
    return curves


def march_traced(case: Case, effects, travel, *, model: Composition, plan) -> Curves:
    """Drive law and march, for use inside jit and vmap; ``plan`` comes from ``plan_steps``."""
    return _driven_traced(as_driven(case, effects), effects, travel, model=model, plan=plan)


def march_open(
    case: Case,
    effects,
    spacing,
    steps,
    *,
    model: Composition,
    room: int,
    slots: int,
    only: tuple[str, ...] = ("y", "tilt"),
) -> Curves:
    """The same with ``steps`` of ``spacing`` [m], each kept, that are known only when it runs: one compilation serves
    any travel and step.

    room: records that are returned (more than ``steps``; beyond the last step nothing changes any more); slots: of the
    wrap's history; only: which curves, of y, angle, moment and tilt.
    """
    case = as_driven(case, effects)
    spans = _spans(case, (*model.built_in, *effects), model)
    advance = _stepper(spans, spacing)

    start = _start(spans, slots)
    zero = lay(start)

    def seen(carry):
        now = observed(carry, spans)
        now["y"] = now["y"] - zero
        return {n: by_place(now[n], case) for n in only}

    def one(k, loop):
        carry, rows = loop
        carry = advance(carry, k)
        return carry, {n: rows[n].at[k + 1].set(row) for n, row in seen(carry).items()}

    rows = {n: jnp.zeros((room, *row.shape)).at[0].set(row) for n, row in seen(start).items()}
    carry, rows = jax.lax.fori_loop(0, steps, one, (start, rows))
    beyond = jnp.arange(room)[:, None] > steps
    curves = {n: jnp.where(beyond, row, rows[n]).T for n, row in seen(carry).items()}
    return Curves(**({"travel": spacing * jnp.arange(room)} | curves))


def _spans(case: Case, effects, model: Composition) -> Spans:
    """The spans of a case as it is driven."""
    span = model.span(case)
    for e in uses(effects, "span"):
        span = e.span(span, case)
    return Spans.of(case, effects, span)


def _driven_traced(case: Case, effects, travel, *, model: Composition, plan) -> Curves:
    """The march over ``travel`` [m]."""
    records, stride, _ = plan
    return _steps_traced(case, effects, travel / (records * stride), model=model, plan=plan)


def _steps_traced(case: Case, effects, spacing, *, model: Composition, plan) -> Curves:
    """The march itself, in steps of ``spacing`` [m]."""
    records, stride, slots = plan
    spans = _spans(case, (*model.built_in, *effects), model)
    advance = _stepper(spans, spacing)

    def record(carry, k):
        def one(i, carry):
            return advance(carry, k * stride + i)

        carry = one(0, carry) if stride == 1 else jax.lax.fori_loop(0, stride, one, carry)
        return carry, observed(carry, spans)

    start = _start(spans, slots)
    _, rows = jax.lax.scan(record, start, jnp.arange(records))
    first = observed(start, spans)
    rows = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), first, rows)
    rows["y"] = rows["y"] - lay(start)
    return sorted_curves(rows, case, spans.span, spacing * stride * jnp.arange(records + 1))


@lru_cache(PROGRAMS)
def _marching(model: Composition, plan, effects: tuple[type, ...]):
    """A compiled function (case, effects, spacing) -> arrays of RETURNED."""

    def rows(*args):
        curves = _steps_traced(*args, model=model, plan=plan)
        return tuple(getattr(curves, name) for name in RETURNED)

    return compiled(rows)


def _stepper(spans, spacing):
    """A function (carry, step number) -> carry that advances the march by one step."""
    case, effects, span = spans.case, spans.effects, spans.span
    shapers = uses(effects, "yaw") + uses(effects, "runup") + uses(effects, "bend")
    solve = _solve_limp if span.limp else _solve_sticking
    arcs = jnp.stack([case.rig.wrap_tail, case.rig.wrap_head])

    def advance(carry, k):
        ring, now, off, _ = carry
        s0 = k * spacing
        off1 = wrap.delayed(ring, k + 1, arcs, spacing)
        for e in uses(effects, "wrap"):
            off1 = e.wrap(off1, replace(now, travel=s0 + spacing), case)
        commanded = _yaw(case, drive.mean_angle, s0, s0 + spacing)

        def correct(_, guess):
            then = replace(guess[0], travel=s0 + spacing)  # as it is; what depends on travel alone is worked out once
            yaw, push = _forced(effects, commanded, case, now, then)
            y, alpha = solve(now, off, off1, yaw, push, spans, spacing)
            yaw_end = _yaw_now(effects, case, s0 + spacing, then)
            then = spans.state(s0 + spacing, now.travel, y, alpha, off1, yaw_end)
            return spans.slid(then, off1, yaw_end), yaw_end

        guess = (replace(now, travel=s0 + spacing), commanded)
        then, yaw_end = jax.lax.fori_loop(0, 2, correct, guess) if shapers else correct(0, guess)
        ring = ring.at[(k + 1) % ring.shape[0]].set(_landed(then))
        return ring, then, off1, yaw_end

    return advance


def _forced(effects, commanded, case, now, then):
    """Yaw and run-up terms of effects, averaged over the step: yaw by Simpson's rule, as pulleys may wobble."""
    between = _mean(now, then)
    yaw, push = commanded, _nothing()
    for e in uses(effects, "yaw"):
        ends = _mean(e.yaw(yaw, now, case), e.yaw(yaw, then, case))
        yaw = jax.tree.map(lambda end, mid: end + 2.0 * (mid - end) / 3.0, ends, e.yaw(yaw, between, case))
    for e in uses(effects, "runup"):
        push = _mean(e.runup(push, now, case), e.runup(push, then, case))
    return yaw, replace(push, turn=push.turn + between.added)


def _mean(a, b):
    return jax.tree.map(lambda x, y: 0.5 * (x + y), a, b)


def _nothing() -> RunUp:
    return RunUp(drift=jnp.zeros(2), turn=jnp.zeros(2))


def _yaw(case, angle, *where) -> Yaw:
    """Commanded yaw of both pulleys, by ``angle`` (at a travel, or the mean over a step)."""
    settings = case.settings
    return Yaw.of(angle(settings.yaw, *where), angle(settings.yaw_head, *where))


def _yaw_now(effects, case, travel, now) -> Yaw:
    yaw = _yaw(case, drive.angle_at, travel)
    for e in uses(effects, "yaw"):
        yaw = e.yaw(yaw, now, case)
    return yaw


def _solve_sticking(now, off, off1, yaw, push, spans, h):
    """One trapezoidal step of dy/ds = -alpha + drift, dalpha/ds = -(kappa + turn); a 2x2 system by hand."""
    ky, ko, ku, ro, ru = spans.answer.runup.T
    a = 0.5 * h
    known = (
        ky * (yaw.aside_runup - yaw.aside_runoff - 0.5 * _partner(off.y + off1.y))
        + ku * yaw.runup
        + ko * (yaw.runoff + 0.5 * _partner(off.alpha + off1.alpha))
        + ro * yaw.roll_runoff
        + ru * yaw.roll_runup
    )
    right = now.alpha * (1 - a * ku + a * a * ky) - a * ky * (2 * now.y + h * push.drift) - h * (known + push.turn)
    alpha = right / (1 + a * ku - a * a * ky)
    y = now.y - a * (now.alpha + alpha) + h * push.drift
    return y, alpha


def _solve_limp(now, off, off1, yaw, push, spans, h):
    """One trapezoidal step of dy/ds = theta_p - (y_u - y_o)/L (paper eq. 5, 6)."""
    length = spans.span.length
    a = 0.5 * h / length
    partner = _partner(off.y + off1.y) + 2.0 * (yaw.aside_runoff - yaw.aside_runup)
    y = (now.y * (1 - a) + a * partner + h * (yaw.runup + push.drift)) / (1 + a)
    return y, spans.slope(y, off1, yaw) - yaw.runup


def _partner(runoff):
    """(tail, head) pulley's run-off values -> those at the far end of the span that runs up (tail, head)."""
    return runoff[::-1]


def _start(spans, slots):
    """The belt lies straight and sticks: y = 0 and alpha = 0 all round, whatever the yaw (paper eq. 11-13)."""
    zero = jnp.zeros(2)
    off = wrap.RunOff.stuck(zero, zero, zero)
    yaw = _yaw(spans.case, drive.angle_at, 0.0)
    blank = spans.state(jnp.zeros(()), BEFORE, zero, zero, off, yaw)
    yaw = _yaw_now(spans.effects, spans.case, 0.0, blank)
    now = spans.slid(spans.state(jnp.zeros(()), BEFORE, zero, zero, off, yaw), off, yaw)
    return jnp.zeros((slots, 6)).at[0].set(_landed(now)), now, off, yaw


def _landed(now):
    """What the wrap's history keeps of an instant, shape (6,)."""
    return jnp.stack([now.y, now.alpha, now.moment], axis=1).ravel()
