"""One step of the march: the span solved implicitly, effects in a predictor-corrector pair."""

from dataclasses import replace

import jax
import jax.numpy as jnp

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.spans import Spans
from belt_sim.case import Case
from belt_sim.effects.base import uses
from belt_sim.laws import drive, wrap
from belt_sim.laws.runup import RunUp, Yaw

BEFORE = -1.0  # [m]: the instant before the start


def spans_of(case: Case, effects, model: Composition) -> Spans:
    """The spans of a case as it is driven."""
    span = model.span(case)
    for e in uses(effects, "span"):
        span = e.span(span, case)
    return Spans.of(case, effects, span)


def stepper(spans, spacing):
    """A function (carry, step number) -> carry that advances the march by one step."""
    case, arcs = spans.case, arcs_of(spans.case)
    over = step_of(spans, spacing)

    def advance(carry, k):
        ring, now, off, _ = carry
        off1 = landed_off(spans, wrap.delayed(ring, k + 1, arcs, spacing), now, (k + 1) * spacing)
        then, yaw_end = over(now, off, off1, k * spacing)
        ring = ring.at[(k + 1) % ring.shape[0]].set(_landed(then))
        return ring, then, off1, yaw_end

    return advance


def arcs_of(case: Case) -> jax.Array:
    """Wrapped arcs of the tail and the head pulley [m], shape (2,)."""
    return jnp.stack([case.rig.wrap_tail, case.rig.wrap_head])


def landed_off(spans, off, now, travel):
    """Where the belt leaves the pulleys at ``travel``, of what ran up a wrapped arc ago."""
    for e in uses(spans.effects, "wrap"):
        off = e.wrap(off, replace(now, travel=travel), spans.case)
    return off


def step_of(spans, spacing):
    """A function (state, run-off before and after, travel [m]) -> (state, yaw at its end) over one step."""
    case, effects, span = spans.case, spans.effects, spans.span
    shapers = uses(effects, "yaw") + uses(effects, "runup") + uses(effects, "bend")
    solve = _solve_limp if span.limp else _solve_sticking

    def over(now, off, off1, s0):
        s1 = s0 + spacing
        commanded = _yaw(case, drive.mean_angle, s0, s1)

        def correct(_, guess):
            then = replace(guess[0], travel=s1)  # as it is; what depends on travel alone is worked out once
            yaw, push = _forced(effects, commanded, case, now, then)
            y, alpha = solve(now, off, off1, yaw, push, spans, spacing)
            yaw_end = yaw_now(effects, case, s1, then)
            then = spans.state(s1, now.travel, y, alpha, off1, yaw_end)
            return spans.slid(then, off1, yaw_end), yaw_end

        guess = (replace(now, travel=s1), commanded)
        return jax.lax.fori_loop(0, 2, correct, guess) if shapers else correct(0, guess)

    return over


def _forced(effects, commanded, case, now, then):
    """Yaw and run-up terms of effects, averaged over the step: yaw by Simpson's rule, as pulleys may wobble."""
    between = mean(now, then)
    yaw, push = commanded, _nothing()
    for e in uses(effects, "yaw"):
        ends = mean(e.yaw(yaw, now, case), e.yaw(yaw, then, case))
        yaw = jax.tree.map(lambda end, mid: end + 2.0 * (mid - end) / 3.0, ends, e.yaw(yaw, between, case))
    for e in uses(effects, "runup"):
        push = mean(e.runup(push, now, case), e.runup(push, then, case))
    return yaw, replace(push, turn=push.turn + between.added)


def mean(a, b):
    return jax.tree.map(lambda x, y: 0.5 * (x + y), a, b)


def _nothing() -> RunUp:
    return RunUp(drift=jnp.zeros(2), turn=jnp.zeros(2))


def _yaw(case, angle, *where) -> Yaw:
    """Commanded yaw of both pulleys, by ``angle`` (at a travel, or the mean over a step)."""
    settings = case.settings
    return Yaw.of(angle(settings.yaw, *where), angle(settings.yaw_head, *where))


def yaw_now(effects, case, travel, now) -> Yaw:
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


def start_of(spans, slots):
    """The belt lies straight and sticks: y = 0 and alpha = 0 all round, whatever the yaw (paper eq. 11-13)."""
    zero = jnp.zeros(2)
    off = wrap.RunOff(y=zero, alpha=zero)
    yaw = _yaw(spans.case, drive.angle_at, 0.0)
    blank = spans.state(jnp.zeros(()), BEFORE, zero, zero, off, yaw)
    yaw = yaw_now(spans.effects, spans.case, 0.0, blank)
    now = spans.slid(spans.state(jnp.zeros(()), BEFORE, zero, zero, off, yaw), off, yaw)
    return jnp.zeros((slots, 4)).at[0].set(_landed(now)), now, off, yaw


def _landed(now):
    """What the wrap's history keeps of an instant, shape (4,)."""
    return jnp.stack([now.y[0], now.alpha[0], now.y[1], now.alpha[1]])


def observe(carry, spans):
    """What is kept of one instant, still in the order (span up the tail, span up the head)."""
    _, now, off, yaw = carry
    return {
        "y": jnp.concatenate([now.y + yaw.aside_runup, off.y + yaw.aside_runoff[::-1]]),
        "angle": jnp.concatenate([yaw.runup + now.alpha, yaw.runoff[::-1] + off.alpha]),
        "moment": now.moment,
        "tilt": spans.tilt(now, off, yaw),
    }


def places_of(case: Case):
    """Of what was kept (run-up tail, run-up head, run-off tail, run-off head; spans up tail and head): which belongs to
    the points 1-4, and which to the upper and the lower span."""
    forward = case.settings.direction > 0
    places = jnp.where(forward, jnp.array([0, 2, 1, 3]), jnp.array([2, 0, 3, 1]))
    return places, jnp.where(forward, jnp.array([0, 1]), jnp.array([1, 0]))
