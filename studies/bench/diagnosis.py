"""How long a diagnosis takes, and its predictions the old way: compiled for one campaign, eight points at a time."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.march import march_traced
from belt_sim.analytic.model import MODELS
from belt_sim.analytic.plan import plan_steps
from belt_sim.campaign import read_campaign
from belt_sim.case import Case
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.samples import samples_of
from belt_sim.effects.around_engine import indicate
from belt_sim.jax_setup import compiled
from belt_sim.use_cases.asked import candidates_of
from belt_sim.use_cases.diagnose import diagnose

CAMPAIGN, MODEL = "slack_belt", "beam_th2"
POINTS = 64
OLD_POINTS = 8  # a batch, the old way
BOOTSTRAPS = 1000


def diagnosis_figures() -> dict[str, Any]:
    """Processor seconds of predictions at POINTS points, old and new, first and later; of a whole diagnosis."""
    campaign, model = read_campaign(CAMPAIGN), MODELS[MODEL]
    classes = [c for c in candidates_of(None, model, None) if not c.heavy]
    forward = Forward(samples_of(campaign), model, classes)
    vectors = np.repeat(forward.null()[None], POINTS, axis=0)
    vectors[:, 0] = np.linspace(0.0, 1.0, POINTS)
    old = _old(forward)
    apart = float(np.abs(old(vectors[:OLD_POINTS]) - forward.values(vectors[:OLD_POINTS])).max())
    begun = time.process_time()
    diagnose(campaign, MODEL, bootstraps=BOOTSTRAPS)
    whole = time.process_time() - begun
    return {
        "points": POINTS,
        "old_ms": 1e3
        * _timed(lambda: [old(vectors[k : k + OLD_POINTS]) for k in range(0, POINTS, OLD_POINTS)])
        / POINTS,
        "new_ms": 1e3 * _timed(lambda: forward.values(vectors)) / POINTS,
        "apart_m": apart,
        "diagnosis_s": whole,
        "bootstraps": BOOTSTRAPS,
    }


def _timed(run: Callable[[], Any]) -> float:
    begun = time.process_time()
    run()
    return time.process_time() - begun


def _old(forward: Forward) -> Callable[[np.ndarray], np.ndarray]:
    """Predictions of eight points by code compiled for the travel, runs and samples of one campaign."""
    samples = forward.samples
    travel = samples.end
    plan = plan_steps(samples.cases, travel=travel, step=forward.step, keep=forward.step)
    one = partial(_one, plan=plan, length=travel, forward=forward)
    runs = jax.vmap(one, in_axes=(None, Case(rig=None, belt=None, settings=0), 0, 0))  # type: ignore[arg-type]
    march = compiled(jax.vmap(runs, in_axes=(0, None, None, None)))
    points = [int(s.at[-1]) - 1 for s in samples.signals]
    return lambda v: np.asarray(march(v, samples.cases, samples.travel, samples.yaw_at))[:, :, points]


def _one(vector, case: Case, travel, yaw_at, *, plan, length: float, forward: Forward):
    """Readings (4, n) of one run."""
    numbers: dict[type, dict] = {c: {} for c in forward.classes}
    for k, slot in enumerate(forward.slots):
        numbers[slot.effect][slot.name] = vector[k] * slot.scale
    effects = tuple(c(**values) for c, values in numbers.items())
    curves = march_traced(case, effects, length, model=forward.model, plan=plan)
    shown = indicate(curves, case, effects, jnp.append(travel, yaw_at))
    return shown.y[:, :-1] - shown.y[:, -1:]
