"""Responses of every run to a short pulse at every channel, and the state that the laws read.

At fixed tension the march is linear in small inputs and does not change with travel, so one pulse a run and channel
gives the whole operator.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.march import march_open, plan_steps
from belt_sim.case import Case
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.batches import ROWS
from belt_sim.diagnosis.readings.forward import room_for
from belt_sim.discovery.channels import CHANNELS, Pulse
from belt_sim.effects.base import Effect, apply_hook, overrides
from belt_sim.effects.law_terms import RELATIVE
from belt_sim.effects.pipeline import as_driven, true_travel
from belt_sim.jax_setup import PROGRAMS, in_float64, jit_float64
from belt_sim.laws.span import CHANGES, changed, log_of_change, response

RUNS = 8  # a batch, so that campaigns share compiled code
CELLS = 240  # of the input along the longest run, at most
NO_HAND = {"encoder", "seen", "sensor", "scene"}  # hooks by which an effect has no hand in the march
Y, MOMENT, TILT = 0, 8, 10  # first rows of what is kept, see Responses


@dataclass(frozen=True, kw_only=True)
class Responses:
    """What the march does with an input.

    grid (J,): travels [m] at which an input is given, linear in between; fine (n,): travels of the records;
    curves (R, 12, n): y and angle at run-up tail, run-up head, run-off tail, run-off head, then moment and tilt of the
    span up the tail and up the head; pulses (R, channels, 12, n): what a pulse of height 1 at grid[1] adds.
    """

    grid: np.ndarray
    fine: np.ndarray
    curves: np.ndarray
    pulses: np.ndarray

    def at(self, rows: np.ndarray, where: np.ndarray) -> np.ndarray:
        """Answers to inputs in every cell: rows (..., n) of pulses -> (..., len(where), J) at travels ``where``."""
        step = self.grid[1] - self.grid[0]
        back = where[:, None] - self.grid[None, :] + step  # travel since the pulse's foot
        return _looked_up(rows, self.fine[1] - self.fine[0], back)


def _looked_up(rows: np.ndarray, spacing: float, where: np.ndarray) -> np.ndarray:
    """Rows (..., n), zero before their start, at ``where`` (a, J); the first cell is half a pulse."""
    place = np.clip(where / spacing, 0.0, rows.shape[-1] - 1.001)
    low = place.astype(int)
    part = (place - low).astype(rows.dtype)
    found = rows[..., low] * (1.0 - part) + rows[..., low + 1] * part
    found[..., 0] *= 0.5
    return found


def responses(bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> Responses:
    """Responses with the effects of a fit at work; among: ids of all that are at work in any of several fits, which
    then share compiled code."""
    forward = bench.forward
    samples, effects = forward.samples, forward.effects_at(fit.vector, (*fit.ids, *among))
    far = _far(bench, fit)
    step = forward.step * max(2, int(np.ceil(far / CELLS / forward.step)))
    cells = int(np.ceil(far / step)) + 1
    travel = step * (cells + 1)
    steps, _, slots = plan_steps(samples.cases, travel=travel, step=forward.step, keep=forward.step)
    acting = tuple(e for e in effects if overrides(e) - NO_HAND)
    march = _compiled(forward.model, tuple(map(type, acting)), *room_for(steps, slots))
    runs = np.arange(-(-len(samples.runs) // RUNS) * RUNS).clip(max=len(samples.runs) - 1)
    found = []
    for rows in runs.reshape(-1, RUNS):
        settings = jax.tree.map(lambda x, rows=rows: np.asarray(x)[rows], samples.cases.settings)
        found.append(march(acting, replace(samples.cases, settings=settings), step, travel / steps, steps))
    curves, pulses = (np.concatenate(rows)[: len(samples.runs), ..., : steps + 1] for rows in zip(*found, strict=True))
    return Responses(
        grid=step * np.arange(cells), fine=np.linspace(0.0, travel, steps + 1), curves=curves, pulses=pulses
    )


def _far(bench: Workbench, fit: Fit) -> float:
    """How far a belt goes in truth, whatever its encoder says [m]."""
    samples, effects = bench.forward.samples, bench.forward.effects_at(fit.vector, fit.ids)
    return max(float(np.max(in_float64(true_travel)(effects, samples.cases, samples.end))), samples.end)


@lru_cache(PROGRAMS)
def _compiled(model, classes, room: int, history: int):
    one = partial(_respond, model=model, room=room, history=history)
    axes = (None, Case(rig=None, belt=None, settings=0), None, None, None)  # type: ignore[arg-type]
    return jit_float64(jax.vmap(one, in_axes=axes), brief=True)


def _respond(effects: tuple[Effect, ...], case: Case, step, spacing, steps, *, model, room, history):
    """Rows (12, n) of one run, and what a pulse at each channel adds (channels, 12, n)."""

    def rows(heights):
        pulse = Pulse(**dict(zip(CHANNELS, heights, strict=True)), middle=step, half=step)
        march = partial(march_open, model=model, room=room, slots=history, only=("y", "angle", "moment", "tilt"))
        return _sorted(march(case, (*effects, pulse), spacing, steps), case)

    none = jnp.zeros(len(CHANNELS))
    along = jax.vmap(lambda d: jax.jvp(rows, (none,), (d,)))(jnp.eye(len(CHANNELS)))
    return along[0][0], along[1]


def _sorted(curves, case):
    """Rows (12, n): from points 1-4 back to run-up tail, run-up head, run-off tail, run-off head."""
    forward = case.settings.direction > 0
    places = jnp.where(forward, jnp.array([0, 2, 1, 3]), jnp.array([1, 3, 0, 2]))
    spans = jnp.where(forward, jnp.array([0, 1]), jnp.array([1, 0]))
    return jnp.concatenate([curves.y[places], curves.angle[places], curves.moment[spans], curves.tilt[spans]])


@dataclass(frozen=True)
class Relative:
    """What a relative change of tension or of a stiffness adds to the curvature at the run-up of a span.

    per_end (R, 5): per unit of the span's boundary values, at first order; growth (R, 7): coefficients of powers 1 to 7
    of log(1 + change), by which that grows with a change that is not small.
    """

    per_end: np.ndarray
    growth: np.ndarray

    def grown(self, change: np.ndarray) -> np.ndarray:
        """The change (R, ...) of first order that adds as much as ``change`` does."""
        x = log_of_change(change, np)
        found = np.zeros_like(x)
        for c in self.growth.T[::-1]:
            found = (found + c.reshape(-1, *[1] * (x.ndim - 1))) * x
        return found


def relative_answers(bench: Workbench, fit: Fit) -> dict[str, Relative]:
    """What relative changes of tension, bending and torsion do, with the effects of a fit at work."""
    forward = bench.forward
    effects = tuple(e for e in forward.effects_at(fit.vector, fit.ids) if overrides(e) & {"settings", "span"})
    runs = len(bench.samples.runs)
    rows = np.arange(-(-runs // ROWS) * ROWS).clip(max=runs - 1)
    settings = jax.tree.map(lambda x: np.asarray(x)[rows], forward.samples.cases.settings)
    cases = replace(forward.samples.cases, settings=settings)
    made = _changed(forward.model, tuple(map(type, effects)))(effects, cases)
    return {kind: Relative(*(np.asarray(x)[:runs] for x in both)) for kind, both in made.items()}


@lru_cache(PROGRAMS)
def _changed(model, classes):
    def one(effects, case):
        case = as_driven(case, effects)
        span = apply_hook((*model.built_in, *effects), "span", model.span(case), case)
        size = jnp.array([span.length, 1.0, 1.0, 0.0, 0.0])  # of boundary values beside one another

        def grows(kind):
            def curvature(logarithm):
                return response(changed(span, case, kind, jnp.expm1(logarithm))).runup

            at = jnp.array(CHANGES)
            none, slope = jax.jvp(curvature, (0.0,), (1.0,))
            along = (jax.vmap(curvature)(at) - none) @ (slope * size**2)
            whole = jnp.sum((slope * size) ** 2)
            bent = along / jnp.where(whole > 0.0, whole, 1.0) - at
            return slope, jnp.concatenate([jnp.ones(1), jnp.linalg.solve(at[:, None] ** jnp.arange(2, 8), bent)])

        return {kind: grows(kind) for kind in dict.fromkeys(RELATIVE.values())}

    many = jax.vmap(one, in_axes=(None, Case(rig=None, belt=None, settings=0)))  # type: ignore[arg-type]
    return jit_float64(many)
