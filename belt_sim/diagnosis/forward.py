"""The model as a function of everything that may be wrong: effect parameters, stiffness, and how runs were set.

A parameter vector is [effect parameters in units of their scale | stiffness | tension | yaw], the last three
relative, relative and in radians, the same for every run (a run's own setting error is small and enters linearly,
through the derivative). Values and directional derivatives are computed for many points at once.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.march import march_traced, plan_steps
from belt_sim.case import Case, Schedule
from belt_sim.diagnosis import linear_readings
from belt_sim.diagnosis.samples import Samples
from belt_sim.effects.around_engine import indicate
from belt_sim.effects.base import Effect
from belt_sim.jax_setup import compiled

STEP = 0.1  # [m] of the march; wobble, the fastest effect, is then right to a few per mille
REACH = 1.12  # predictions reach this much further than the record, which an encoder may have shortened
LANES = 16  # points a batch; larger requests are cut, smaller ones padded, so that one shape is compiled
WORKERS = 2  # batches at once: a march is one long loop, which uses one core
NUISANCES = ("stiffness", "tension", "yaw")


@dataclass(frozen=True)
class Slot:
    """One parameter of one effect in the parameter vector."""

    effect: type[Effect]
    name: str

    @property
    def scale(self) -> float:
        return self.effect.parameters[self.name].scale

    @property
    def null(self) -> float:
        return self.effect.parameters[self.name].null


class Forward:
    """Predictions of ``model`` with every effect of ``classes`` within reach, all null to begin with."""

    def __init__(
        self,
        samples: Samples,
        model: Composition,
        classes: Sequence[type[Effect]],
        terms: Mapping[str, int] | None = None,
    ) -> None:
        """terms: harmonics of linear effects that stand in the parameter vector; by default all that are resolved."""
        self.samples, self.model, self.classes = samples, model, tuple(classes)
        self.terms = linear_readings.terms(classes, samples) if terms is None else dict(terms)
        self.slots = tuple(Slot(c, name) for c in self.classes for name in linear_readings.fitted(c, self.terms))
        self.linear = np.array([s.effect.linear for s in self.slots] + [False] * len(NUISANCES))
        self.size = len(self.slots) + len(NUISANCES)
        travel = float(np.ceil(samples.end * REACH + 0.5))
        plan = plan_steps(samples.cases, travel=travel, step=STEP, keep=STEP)
        places = tuple(_place(s.at) for s in samples.signals)
        self._lanes = _compiled(model, plan, self.slots, travel, places)

    def index(self, effect_id: str) -> list[int]:
        """Positions in the parameter vector of an effect's parameters."""
        return [k for k, s in enumerate(self.slots) if s.effect.id == effect_id]

    def modifiers(self, effect_id: str) -> int:
        """How many of an effect's parameters only shape what its others do."""
        return sum(s.effect.parameters[s.name].modifier for s in self.slots if s.effect.id == effect_id)

    def null(self) -> np.ndarray:
        """q (size,) with nothing wrong."""
        return np.array([s.null / s.scale for s in self.slots] + [0.0] * len(NUISANCES))

    def values(self, vector: np.ndarray, samples: Samples | None = None) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size)."""
        return self.lanes(vector, np.zeros_like(vector), samples)[0]

    def lanes(self, vector: np.ndarray, directions: np.ndarray, samples: Samples | None = None):
        """Predictions and derivatives, both (C, R, S, n), at parameter vectors (C, size) along directions (C, size)."""
        read = np.any(directions[:, self.linear], axis=1) & ~np.any(directions[:, ~self.linear], axis=1)
        if not read.any():
            return self._marched(vector, directions, samples)
        points, of = np.unique(vector[read], axis=0, return_inverse=True)
        still = np.zeros_like(points)
        values, slopes = self._marched(
            np.concatenate([vector[~read], points]), np.concatenate([directions[~read], still]), samples
        )
        order = np.empty(len(vector), dtype=int)
        order[~read], order[read] = np.arange(np.sum(~read)), np.sum(~read) + of.reshape(-1)
        values, slopes = values[order], slopes[order]
        slopes[read] = linear_readings.slopes(self, vector[read], directions[read], samples or self.samples)
        return values, slopes

    def _marched(self, vector: np.ndarray, directions: np.ndarray, samples: Samples | None = None):
        data = _data(samples or self.samples)

        def batch(start: int):
            part, along = vector[start : start + LANES], directions[start : start + LANES]
            values, slopes = self._lanes(_pad(part), _pad(along), data)
            return np.asarray(values)[: len(part)], np.asarray(slopes)[: len(part)]

        first = batch(0)  # compiles, once, before there are several threads
        with ThreadPoolExecutor(WORKERS) as pool:
            pieces = [first, *pool.map(batch, range(LANES, len(vector), LANES))]
        return tuple(np.concatenate(x) for x in zip(*pieces, strict=True))

    def effects_at(self, vector: np.ndarray, ids: Sequence[str]) -> tuple[Effect, ...]:
        """The effects ``ids`` with the numbers of a parameter vector."""
        numbers: dict[str, dict[str, float]] = {c.id: {} for c in self.classes}
        for slot, value in zip(self.slots, vector, strict=False):
            numbers[slot.effect.id][slot.name] = float(value) * slot.scale
        return tuple(c(**numbers[c.id]) for c in self.classes if c.id in ids)


@cache
def _compiled(model: Composition, plan, slots, span: float, places):
    """Values and directional derivatives for a batch of points; one compilation for all campaigns of one shape."""
    one = partial(_one_run, model=model, plan=plan, slots=slots, span=span, places=places)
    axes = (None, Case(rig=None, belt=None, settings=0), 0, 0, 0)  # type: ignore[arg-type]
    runs = jax.vmap(one, in_axes=axes)

    def lane(vector, direction, data):
        return jax.jvp(lambda p: runs(p, *data), (vector,), (direction,))

    return compiled(jax.vmap(lane, in_axes=(0, 0, None)))


def _data(samples: Samples):
    return samples.cases, samples.travel, samples.time, samples.yaw_at


def _pad(rows: np.ndarray) -> np.ndarray:
    missing = -len(rows) % LANES
    return np.concatenate([rows, np.repeat(rows[:1], missing, axis=0)]) if missing else rows


def _place(at: str) -> tuple[str, int]:
    """("y", row) or ("tilt", row) of a signal's place."""
    places = {f"point_{k}": ("y", k - 1) for k in (1, 2, 3, 4)}
    return (places | {"upper_mid_span": ("tilt", 0), "lower_mid_span": ("tilt", 1)})[at]


def _one_run(vector, case: Case, travel, time, yaw_at, *, model, plan, slots, span, places):
    """Readings (S, n) of one run at a parameter vector."""
    numbers: dict[type[Effect], dict] = {}
    for k, slot in enumerate(slots):
        numbers.setdefault(slot.effect, {})[slot.name] = vector[k] * slot.scale
    effects = tuple(cls(**values) for cls, values in numbers.items())
    case = _as_set(case, vector[len(slots) :])
    curves = march_traced(case, effects, span, model=model, plan=plan)
    stated = jnp.append(travel, yaw_at)  # the last sample is where every lateral sensor reads zero
    shown = indicate(curves, case, effects, stated, jnp.append(time, yaw_at / case.settings.speed))
    rows = {"y": shown.y[:, :-1] - shown.y[:, -1:], "tilt": shown.tilt[:, :-1]}
    return jnp.stack([rows[kind][row] for kind, row in places])


def _as_set(case: Case, nuisance) -> Case:
    """The case as it was really set: stiffness, tension and yaw off by what ``nuisance`` says."""
    stiffness, tension, yaw = nuisance
    belt = replace(case.belt, youngs_modulus=case.belt.youngs_modulus * (1.0 + stiffness))
    schedule = case.settings.yaw
    last = jnp.zeros_like(schedule.change).at[-1].set(yaw)
    turned = Schedule(at=schedule.at, over=schedule.over, change=schedule.change + last)
    settings = replace(case.settings, tension=case.settings.tension * (1.0 + tension), yaw=turned)
    return Case(rig=case.rig, belt=belt, settings=settings)
