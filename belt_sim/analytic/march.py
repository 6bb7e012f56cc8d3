"""The march in travel: a belt's run-up points, step by step, for any linear span law and any set of effects.

The span is solved implicitly (trapezoidal rule) and effects in a predictor-corrector pair, so the march is of second
order in its step and stable for any stiffness of the span. Everything is float64 JAX: jitted once per composition of
laws, vmapped over cases, differentiable in every number of a case and of an effect.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.plan import first, plan_steps, room_for
from belt_sim.analytic.stepping import observe, places_of, spans_of, start_of, stepper
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.around_engine import as_driven, as_numpy
from belt_sim.errors import InputError, RunFailed
from belt_sim.jax_setup import compiled, in_float64
from belt_sim.si import N_PER_MM2

STEP = 0.05  # [m]; error of y_1 below 1e-4 on the test rig, see tests/convergence
KEEP = 0.1  # [m]


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
    curves = first(as_numpy(_march_jit(case, tuple(effects), spacing, model=model, plan=roomy)), records + 1)
    if not np.isfinite(curves.y).all():
        raise RunFailed("y is not finite: weaken the effects or shorten model.step")
    return curves


def march_traced(case: Case, effects, travel, *, model: Composition, plan) -> Curves:
    """Drive law and march, for use inside jit and vmap; ``plan`` comes from ``plan_steps``."""
    return _driven_traced(as_driven(case, effects), effects, travel, model=model, plan=plan)


def _driven_traced(case: Case, effects, travel, *, model: Composition, plan) -> Curves:
    """The march over ``travel`` [m]."""
    records, stride, _ = plan
    return _steps_traced(case, effects, travel / (records * stride), model=model, plan=plan)


def _steps_traced(case: Case, effects, spacing, *, model: Composition, plan) -> Curves:
    """The march itself, in steps of ``spacing`` [m]."""
    records, stride, slots = plan
    spans = spans_of(case, (*model.built_in, *effects), model)
    advance = stepper(spans, spacing)

    def record(carry, k):
        def one(i, carry):
            return advance(carry, k * stride + i)

        carry = one(0, carry) if stride == 1 else jax.lax.fori_loop(0, stride, one, carry)
        return carry, observe(carry, spans)

    start = start_of(spans, slots)
    _, rows = jax.lax.scan(record, start, jnp.arange(records))
    first = observe(start, spans)
    rows = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), first, rows)
    rows["y"] = rows["y"] - first["y"]
    return _curves(rows, case, spans.span, spacing * stride * jnp.arange(records + 1))


_march_jit = compiled(_steps_traced, static_argnames=("model", "plan"))


def _curves(rows, case, span, travel) -> Curves:
    """Sort what was kept by place: points 1-4, upper and lower span; on reversed travel the spans change places."""
    places, spans = places_of(case)
    moment = rows["moment"].T[spans]
    edge = case.settings.tension - jnp.abs(moment) * 6.0 / (case.belt.width**2 * case.belt.thickness)
    sag = case.sag_curvature * span.length**2 / 8.0
    return Curves(
        travel=travel,
        y=rows["y"].T[places],
        angle=rows["angle"].T[places],
        moment=moment,
        edge_stress=edge,
        tilt=rows["tilt"].T[spans],
        sag=jnp.stack([sag, sag]),
    )
