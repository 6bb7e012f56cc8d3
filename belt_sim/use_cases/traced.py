"""Curves as a function that JAX can see through: for jax.jit, jax.vmap and jax.grad."""

from collections.abc import Callable, Sequence
from typing import Any

from belt_sim.analytic.march import march_traced, plan_steps
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.base import Effect
from belt_sim.use_cases.asked import fitted_model


def traced(case: Case, model: Any = "strip", *, travel: float) -> Callable[..., Curves]:
    """A function (case, effects=()) -> true Curves over ``travel`` [m], pure JAX, of cases whose pulleys are like those
    of ``case``: its sums are planned by them.

    Every number of the case it is given (tension [Pa], yaw [rad], rig, belt: all SI) and of the effects may be traced.
    Wants float64: ``jax.config.update("jax_enable_x64", True)``. Raises CannotRepresent for a model without curves.
    """
    chosen = fitted_model(model)
    plan = plan_steps(case, travel=travel, step=chosen.step, keep=chosen.keep)

    def curves(case: Case, effects: Sequence[Effect] = ()) -> Curves:
        chosen.admit(effects)
        return march_traced(case, tuple(effects), travel, model=chosen, plan=plan)

    return curves
