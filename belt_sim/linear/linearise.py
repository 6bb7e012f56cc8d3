"""Linearise: the laws of an analytic model and its effects, differentiated at a working point."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.spans import Spans
from belt_sim.case import Case
from belt_sim.effects.base import AFTER_ENGINE, Effect, overrides, uses
from belt_sim.effects.pipeline import as_driven
from belt_sim.errors import CannotRepresent
from belt_sim.jax_setup import compiled, in_float64
from belt_sim.laws.runup import RunUp, Yaw
from belt_sim.laws.wrap import RunOff
from belt_sim.linear.plant import STATES, LinearBelt

_CORRECTIONS = 3  # yaw and moment answer to each other where the drive gives way


@in_float64
def linear_belt(case: Case, model: Composition, effects: Sequence[Effect] = ()) -> LinearBelt:
    """The plant of ``case`` under ``model`` with ``effects``, around the straight belt.

    Raises CannotRepresent for an effect that the model, or a linear plant, cannot honour.
    """
    model.admit(effects)
    for effect in effects:
        if overrides(effect, (*AFTER_ENGINE, "slide")):
            reason = "a linear plant gives where the belt is, not what a sensor shows of it, and it does not slip"
            raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out")
    driven = as_driven(case, effects)
    limp = model.span(case).limp
    constant, now, delayed, drive = (np.asarray(x) for x in _derivatives(driven, tuple(effects), model=model))
    keep = np.array([0, 2]) if limp else np.arange(4)
    arcs = np.array([case.rig.wrap_tail, case.rig.wrap_tail, case.rig.wrap_head, case.rig.wrap_head], dtype=float)
    tail, head = (0, 1) if limp else (0, 2)
    forward = [(tail, False), (tail, True), (head, False), (head, True)]
    places = forward if float(case.settings.direction) > 0 else [forward[k] for k in (1, 0, 3, 2)]
    return LinearBelt(
        model=model.name,
        tension=float(driven.settings.tension),
        speed=float(case.settings.speed),
        states=tuple(STATES[k] for k in keep),
        now=now[np.ix_(keep, keep)],
        delayed=delayed[np.ix_(keep, keep)],
        drive=drive[keep],
        constant=constant[keep],
        arcs=arcs[keep],
        places=tuple(places),
    )


def _at_rest(case: Case, effects: tuple[Effect, ...], *, model: Composition):
    """dx/ds at x = 0 and its derivatives along x (4, 4), the delayed x (4, 4) and the yaws (4, 2)."""
    effects = (*model.built_in, *effects)
    span = model.span(case)
    for e in uses(effects, "span"):
        span = e.span(span, case)
    spans = Spans.of(case, effects, span)

    def rate(x, late, yaws):
        return _rate(spans, x, late, yaws)

    zero = (jnp.zeros(4), jnp.zeros(4), jnp.zeros(2))
    return rate(*zero), *jax.jacfwd(rate, argnums=(0, 1, 2))(*zero)


_derivatives = compiled(_at_rest, static_argnames=("model",))


def _rate(spans: Spans, x, late, yaws):
    """dx/ds of x = (y, alpha) at the tail's, then the head's run-up, when the wraps give ``late`` back."""
    commanded = Yaw.of(yaws[0], yaws[1])
    y, off = x[0::2], _stuck(late)
    yaw, alpha, zero = commanded, x[1::2], jnp.zeros(())
    for _ in range(_CORRECTIONS):
        if spans.span.limp:
            alpha = spans.slope(y, off, yaw) - yaw.runup
        state = spans.state(zero, zero, y, alpha, off, yaw)
        gone = _stuck(late)
        for e in uses(spans.effects, "wrap"):
            gone = e.wrap(gone, state, spans.case)
        yaw, off = commanded, gone
        for e in uses(spans.effects, "yaw"):
            yaw = e.yaw(yaw, state, spans.case)
    if spans.span.limp:
        alpha = spans.slope(y, off, yaw) - yaw.runup
    state = spans.state(zero, zero, y, alpha, off, yaw)
    push = RunUp(drift=jnp.zeros(2), turn=jnp.zeros(2))
    for e in uses(spans.effects, "runup"):
        push = e.runup(push, state, spans.case)
    moved = jnp.stack([-alpha + push.drift, -(state.kappa + push.turn)], axis=1)
    return moved.ravel()


def _stuck(late) -> RunOff:
    """The run-off of a belt that sticks: y and alpha as they come off the tail, then off the head."""
    return RunOff.stuck(late[0::2], late[1::2], jnp.zeros(2))
