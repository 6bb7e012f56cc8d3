"""The paper's belt and rigs as test cases, and one compiled march for many of them."""

from dataclasses import replace
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, Rig, Schedule
from belt_sim.curves import Curves
from belt_sim.effects.base import library
from belt_sim.jax_setup import LEAST_EFFORT, known_options
from belt_sim.line.hooks import as_numpy, indicate
from belt_sim.line.march import march_traced
from belt_sim.line.span import response as span_response
from belt_sim.model import MODELS, AnalyticModel
from belt_sim.units import N_PER_MM2
from studies.paper import case as paper
from studies.paper.case import TEST_RIG as RIG

YAW = -paper.YAW  # [rad], size of the paper's yaw
RECORDS, STRIDE, SLOTS, LANES = 100, 20, 128, 8  # one shape for all marches: one compilation a model
STEPS = RECORDS * STRIDE
BELT, EFFECTS = paper.PAPER_BELT, library()
READ, response = jax.jit(indicate), jax.jit(span_response)


def paper_case(tension: float, yaw: float = YAW, rig: Rig = RIG, **settings) -> Case:
    """The test rig at ``tension`` [N/mm2] after a yaw step [rad] at travel 0; further fields of Settings as named."""
    return paper.paper_case(tension * N_PER_MM2, yaw, rig, **settings)


def steered(case: Case, yaw: Schedule) -> Case:
    """The case with another yaw schedule of the tail pulley."""
    return replace(case, settings=replace(case.settings, yaw=yaw))


def marched(cases: list[Case], model: str, *, travel: float, effects: list[tuple] | None = None) -> list[Curves]:
    """Curves of up to LANES cases (or any number with effects, one tuple of the same kinds for each), in STEPS steps.

    What differs between calls enters as numbers, so that a model is compiled once for all tests.
    """
    longest = max(max(c.rig.wrap_head, c.rig.wrap_tail) for c in cases)
    assert longest * STEPS / travel + 2 < SLOTS, "steps too short for the history of the wrap"
    size = LANES if effects is None else len(cases)
    own = [()] * len(cases) if effects is None else effects
    pairs = [*zip(cases, own, strict=True)]
    pairs += [pairs[0]] * (size - len(pairs))
    curves = _compiled(MODELS[model])(_stacked([_padded(c) for c, _ in pairs]), _stacked([e for _, e in pairs]), travel)
    return [jax.tree.map(lambda x, k=k: np.asarray(x[k]), curves) for k in range(len(cases))]


def only(**numbers):
    """Every effect of the library at null but those named: only(taper={"kappa_t": 1e-5})."""
    return tuple(replace(cls.null(), **numbers.get(name, {})) for name, cls in EFFECTS.items())


def indicated(curves: Curves, case: Case, at, **numbers) -> Curves:
    """Curves as read at encoder travels ``at`` [m]: indicated(c, case, at, encoder_scale={"e": 0.1})."""
    return as_numpy(READ(curves, case, only(**numbers), np.asarray(at)))


def affected(pairs, travel: float) -> list[Curves]:
    """Marches of (case, {effect: numbers}) pairs under beam_th2, batches of eight lanes: one compilation with all
    effects in it."""
    curves = []
    for start in range(0, len(pairs), LANES):
        part = pairs[start : start + LANES]
        part = part + [part[0]] * (LANES - len(part))
        cases, numbers = zip(*part, strict=True)
        curves += marched(list(cases), "beam_th2", travel=travel, effects=[only(**n) for n in numbers])
    return curves[: len(pairs)]


def _padded(case: Case) -> Case:
    """Both schedules with two entries."""
    still = Schedule.step(0.0)
    settings = case.settings
    yaw, head = (s if len(s.at) == 2 else s.then(still) for s in (settings.yaw, settings.yaw_head))
    return replace(case, settings=replace(settings, yaw=yaw, yaw_head=head))


def _stacked(trees):
    return jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(x, float) for x in leaves]), *trees)


@cache
def _compiled(model: AnalyticModel):
    run = partial(march_traced, model=model, plan=(RECORDS, STRIDE, SLOTS))
    return jax.jit(
        jax.vmap(run, in_axes=(0, 0, None)), compiler_options=known_options(LEAST_EFFORT)
    )  # it runs for 0.1 s
