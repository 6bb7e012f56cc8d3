"""The model as a function of everything that may be wrong: effect parameters, stiffness, and how runs were set.

A parameter vector is [effect parameters in units of their scale | stiffness | tension | yaw | place of the yaw | length
of the belt | start on the belt], the last six relative, relative, in radians, in metres, relative and in metres, the
same for every run (a run's own setting error is small and enters linearly, through the derivative). Many points are
computed at once; derivatives are differences of neighbouring points, which share the point they start from. What is
null is not compiled in (``compositions``); both points of a difference are marched by the same code, so that its
rounding is not taken for a derivative.

Points and runs are marched as one list of rows, a fixed number at a time, over as many steps as the campaign needs: one
compilation serves campaigns of any number of runs, samples, travel and step.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from itertools import zip_longest
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.march import march_open, plan_steps
from belt_sim.campaign.types import sensor_place
from belt_sim.case import Case, Settings
from belt_sim.curves import SensorPlace
from belt_sim.diagnosis.readings.additive_effects import (
    READ_BY,
    bin_attenuation,
    compile_additions,
    harmonics_of,
    select_addable,
    slopes_of_additive,
)
from belt_sim.diagnosis.readings.candidates import SLOW
from belt_sim.diagnosis.readings.parameter_vector import NUISANCES, Slot, effects_and_case, lengthen_belt
from belt_sim.diagnosis.readings.samples import MAX_SAMPLES, Samples
from belt_sim.diagnosis.readings.sensor_places import check_places, places_of, reading_at
from belt_sim.effects.base import Effect, overrides
from belt_sim.effects.generic_law import GenericLaw
from belt_sim.effects.pipeline import indicate
from belt_sim.jax_setup import PROGRAMS, WORKERS, jit_float64

# Which effects are compiled into a march: few rows pay for what is null in them, and few programs serve all rows.
#
# Effects stand in groups: those that a march does not ask at its steps are always there; of the others the slow ones
# are one group, and the rest another, each compiled where any of it acts.

READ, LIGHT, HEAVY = "read", "light", "heavy"
_AT_STEPS = ("yaw", "runup", "bend", "slide", "wrap")
Groups = frozenset[str]


def group_of(cls: type[Effect]) -> str:
    """The group of an effect: its own id where it need not be compiled at all."""
    if cls.is_additive():
        return cls.id
    if cls.id in SLOW:
        return HEAVY
    return LIGHT if overrides(cls, _AT_STEPS) else READ


# Runs at points as one list of rows, computed a fixed number at a time, those of several programs side by side.

COLUMNS = MAX_SAMPLES  # samples of a run are filled up to a multiple of this, so that campaigns share compiled code
ROWS = 8  # runs at points a batch: requests are cut and padded to it, so that one shape is compiled; most are small

PLACES = ("point_1", "point_2", "point_3", "point_4", "upper_mid_span", "lower_mid_span")


@dataclass(frozen=True)
class Work:
    """What a program shows of all runs at points, (C, R, S, n), once its batches are done."""

    found: np.ndarray
    batches: Sequence[Callable[[], None]]


def finish(works: Sequence[Work]) -> None:
    """Do all batches: first one of each program, so that each is compiled once and several side by side."""
    turns = [[batch for batch in turn if batch is not None] for turn in zip_longest(*(w.batches for w in works))]
    for batches in (turns[:1], turns[1:]):
        here = [batch for turn in batches for batch in turn]
        if len(here) == 1:
            here[0]()
        else:
            for done in [_pool().submit(batch) for batch in here]:
                done.result()


@cache
def _pool() -> ThreadPoolExecutor:
    """The threads that batches run in, those of all requests: to begin and end two for each takes half as long as a
    batch."""
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="batches")


def plan_batches(
    program: Callable[..., Any], vector: np.ndarray, shown: np.ndarray, samples: Samples, more: tuple = ()
) -> Work:
    """What a ``program`` of one run is to show of all runs at points (C, k); shown (R, k): how much of each number the
    readings of a run show; more: arguments that all runs share."""
    stand = [*PLACES, *places_of(samples)]  # rows of what a program shows
    places = [stand.index(sensor_place(s.at) or s.at) for s in samples.signals]
    runs, _, n = samples.y.shape
    points, run = (x.ravel() for x in np.meshgrid(np.arange(len(vector)), np.arange(runs), indexing="ij"))
    cases, columns = samples.cases, np.minimum(np.arange(-(-n // COLUMNS) * COLUMNS), n - 1)
    travel, time = samples.travel[:, columns], samples.time[:, columns]
    found = np.empty((len(points), len(places), n))

    def batch(start: int) -> None:
        rows = np.minimum(np.arange(start, start + ROWS), len(points) - 1)
        r = run[rows]
        settings = jax.tree.map(lambda x: x[r], cases.settings)
        of_rows = vector[points[rows]], shown[r], settings, travel[r], time[r], samples.yaw_at[r]
        predicted = program(*of_rows, cases.rig, cases.belt, *more)
        part = found[start : start + ROWS]
        part[:] = np.asarray(predicted)[: len(part), places, :n]

    batches = [partial(batch, start) for start in range(0, len(points), ROWS)]
    return Work(found.reshape(len(vector), *samples.y.shape), batches)


STEP = 0.1  # [m] of the march, where nothing asks for a shorter one (``choose_step``)
REACH = 1.12  # predictions reach this much further than the record, which an encoder may have shortened
ROOM = 2048  # records that compiled code has room for; where that is too little, twice as many, and so on
SLOTS = 16  # the same of the wrap's history
DIFFERENCE = 1e-5  # of a parameter's scale, over which derivatives are taken
#: of stiffness, tension, yaw [rad], its place [m] (half a step), length, start [m]
DIFFERENCES = (1e-5, 1e-5, 1e-8, 0.05, 1e-6, 1e-3)


class Forward:
    """Predictions of ``model`` with every effect of ``classes`` within reach, all null to begin with."""

    def __init__(
        self,
        samples: Samples,
        model: Composition,
        classes: Sequence[type[Effect]],
        step: float = STEP,
        terms: Mapping[str, int] | None = None,
    ) -> None:
        """terms: harmonics of linear effects that stand in the parameter vector; by default all that are resolved."""
        self.samples, self.model, self.classes, self.step = samples, model, tuple(classes), step
        check_places(samples, model, self.classes)
        self.terms = harmonics_of(classes, samples) if terms is None else dict(terms)
        names = {c: list(c.parameters)[: 2 * self.terms[c.id] if c.id in self.terms else None] for c in self.classes}
        self.slots = tuple(Slot(c, name) for c in self.classes for name in names[c])
        self.linear = np.array([s.effect.is_additive() for s in self.slots] + [False] * len(NUISANCES))
        self.size = len(self.slots) + len(NUISANCES)
        self.nuisances = range(len(self.slots), self.size)
        self._null = np.array([s.null / s.scale for s in self.slots] + [0.0] * len(NUISANCES))
        ends = [s.side for s in self.slots] + [(-np.inf, np.inf)] * len(NUISANCES)
        self.sides = np.array([low for low, _ in ends]), np.array([high for _, high in ends])
        self._groups = [group_of(s.effect) for s in self.slots]
        self._added = select_addable(self.classes)
        travel = samples.end * REACH + 0.5
        steps, _, slots = plan_steps(samples.cases, travel=travel, step=step, keep=step)
        self._march = travel / steps, steps
        self._room = room_for(steps, slots)
        self.tension, self.yaw = np.zeros((2, len(samples.runs)))
        self.longer = 0.0
        self.offset: np.ndarray | float = 0.0
        self.columns: dict[tuple, np.ndarray] = {}  # of linear effects, as far as they are known (additive_effects)

    def set_to(self, tension: np.ndarray, yaw: np.ndarray, longer: float = 0.0) -> "Forward":
        """The same with every run (R,) set off by these [relative, rad], and a belt that is so much longer [1]."""
        settings = self.samples.cases.settings
        change = np.array(settings.yaw.change)
        change[:, -1] += yaw - self.yaw
        settings = replace(
            settings,
            tension=settings.tension * (1.0 + tension) / (1.0 + self.tension),
            yaw=replace(settings.yaw, change=change),
        )
        found = copy(self)
        rig = lengthen_belt(self.samples.cases.rig, (1.0 + longer) / (1.0 + self.longer) - 1.0)
        found.samples = replace(self.samples, cases=replace(self.samples.cases, settings=settings, rig=rig))
        found.tension, found.yaw, found.longer, found.offset = tension, yaw, longer, 0.0
        found.columns = {}
        return found

    def subtract(self, offset: np.ndarray) -> "Forward":
        """The same with ``offset`` (R, S, n) taken off all predictions of its own runs."""
        found = copy(self)
        found.offset = offset
        return found

    def index(self, effect_id: str) -> list[int]:
        """Positions in the parameter vector of an effect's parameters."""
        return [k for k, s in enumerate(self.slots) if s.effect.id == effect_id]

    def grids(self, effect_id: str) -> dict[int, tuple[float, ...]]:
        """Positions of an effect's parameters that are tried on a grid, and the values there."""
        declared = {k: self.slots[k].parameter for k in self.index(effect_id)}
        belt = float(self.samples.cases.rig.belt_length)
        units = {k: (belt if p.of_belt else 1.0) / p.scale for k, p in declared.items()}
        return {k: tuple(v * units[k] for v in p.grid) for k, p in declared.items() if p.grid}

    def null(self) -> np.ndarray:
        """q (size,) with nothing wrong."""
        return self._null.copy()

    def values(self, vector: np.ndarray, samples: Samples | None = None) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size)."""
        return self._compose(vector, self._active_groups(vector), samples)

    def _compose(self, vector: np.ndarray, codes: Sequence[Groups], samples: Samples | None) -> np.ndarray:
        """The same by the code of some groups of effects each."""
        samples = samples or self.samples
        places = {code: np.flatnonzero([c == code for c in codes]) for code in dict.fromkeys(codes)}
        marched = [(rows, self._march_groups(vector[rows], code, samples)) for code, rows in places.items()]
        own = [k for k, s in enumerate(self.slots) if s.effect in self._added]
        rows = np.flatnonzero(np.any(vector[:, own] != self._null[own], axis=1))
        of, shown = self._add_readings(vector[rows], samples) if len(rows) else (rows, None)
        finish([*(work for _, work in marched), *([shown] if shown else [])])
        found = np.empty((len(vector), *samples.y.shape))
        for here, work in marched:
            found[here] = work.found
        if shown:
            found[rows] += shown.found[of]
        return found - self.offset if samples is self.samples else found

    def values_and_slopes(self, vector: np.ndarray, directions: np.ndarray, samples: Samples | None = None):
        """Predictions and derivatives, both (C, R, S, n), at parameter vectors (C, size) along directions (C, size)."""
        points, of = np.unique(vector, axis=0, return_inverse=True)
        read = np.any(directions[:, self.linear], axis=1) & ~np.any(directions[:, ~self.linear], axis=1)
        along = np.where(read[:, None], 0.0, directions)
        codes = self._groups_of_derivatives(points, of.reshape(-1), along)
        starts = list(dict.fromkeys(zip(of.reshape(-1).tolist(), codes, strict=True)))
        start = [starts.index(key) for key in zip(of.reshape(-1).tolist(), codes, strict=True)]
        moving = np.flatnonzero(np.any(along, axis=1))
        least = np.array([DIFFERENCE] * len(self.slots) + list(DIFFERENCES))
        step = np.min(least / np.maximum(np.abs(along[moving]), 1e-30), axis=1, initial=np.inf)[:, None]
        asked = np.concatenate([points[[k for k, _ in starts]], vector[moving] + step * along[moving]])
        found = self._compose(asked, [c for _, c in starts] + [codes[k] for k in moving], samples)
        values = found[start]
        slopes = np.zeros_like(values)
        slopes[moving] = (found[len(starts) :] - values[moving]) / step[..., None, None]
        if read.any():
            slopes[read] = slopes_of_additive(self, vector[read], directions[read], samples or self.samples)
        return values, slopes

    def expand(self, vector: np.ndarray, positions: Sequence[int], samples: Samples | None = None):
        """Predictions (R, S, n) at a parameter vector (size,), and derivatives (k, R, S, n) along some positions."""
        directions = np.zeros((max(1, len(positions)), self.size))
        directions[np.arange(len(positions)), np.array(positions, dtype=int)] = 1.0
        points = np.repeat(vector[None], len(directions), axis=0)
        values, slopes = self.values_and_slopes(points, directions, samples)
        return values[0], slopes[: len(positions)]

    def _active_groups(self, vector: np.ndarray) -> list[Groups]:
        """Groups of effects that are not null at each of (C, size), as far as that makes a difference to a march."""
        off = vector[:, : len(self.slots)] != self._null[: len(self.slots)]
        out = {READ, *map(group_of, self._added)}
        return [frozenset(self._groups[k] for k in np.flatnonzero(row)) - out for row in off]

    def _groups_of_derivatives(self, points: np.ndarray, of: np.ndarray, along: np.ndarray) -> list[Groups]:
        """By which code each derivative is taken: one for all cheap ones of a point, and what is dear by itself."""
        there, moved = self._active_groups(points), self._active_groups(self._null + along)
        shared = [
            groups.union(*(moved[k] & {LIGHT} for k in np.flatnonzero(of == p))) for p, groups in enumerate(there)
        ]
        return [(there if groups - {LIGHT} else shared)[p] | groups for p, groups in zip(of, moved, strict=True)]

    def _march_groups(self, vector: np.ndarray, groups: Groups, samples: Samples) -> Work:
        """Predictions (C, R, S, n) with the effects of some groups, which are all that is not null."""
        kept = [k for k, group in enumerate(self._groups) if group in {READ, *groups}]
        others = places_of(samples)
        tilts = bool(others) or any(s.at.endswith("mid_span") for s in samples.signals)
        slots = tuple(self.slots[k] for k in kept)
        march = _compile_march(self.model, slots, *self._room, tilts, others)
        scales = [s.scale for s in slots] + [1.0] * len(NUISANCES)  # those of found laws are no two alike
        vector = vector[:, [*kept, *range(len(self.slots), self.size)]] * scales
        shown = bin_attenuation(slots, samples, len(NUISANCES))
        return plan_batches(march, vector, shown, samples, self._march)

    def _add_readings(self, vector: np.ndarray, samples: Samples) -> tuple[np.ndarray, Work]:
        """What effects that only add to the readings add to them, by one program for any harmonics: of each of (C,)
        where it stands in what is found."""
        acting = [c for c in self.classes if c in self._added or overrides(c, READ_BY)]
        slots = tuple(Slot(c, name) for c in acting for name in c.parameters)
        numbers = np.tile([*(s.null for s in slots), *np.zeros(len(NUISANCES))], (len(vector), 1))
        numbers[:, len(slots) :] = vector[:, len(self.slots) :]
        place = {slot: k for k, slot in enumerate(slots)}
        for k, slot in enumerate(self.slots):
            if slot in place:
                numbers[:, place[slot]] = vector[:, k] * slot.scale
        different, of = np.unique(numbers, axis=0, return_inverse=True)
        program = compile_additions(slots, self._added, places_of(samples))
        shown = bin_attenuation(slots, samples, len(NUISANCES))
        return of.reshape(-1), plan_batches(program, different, shown, samples)

    def effects_at(self, vector: np.ndarray, ids: Sequence[str]) -> tuple[Effect, ...]:
        """The effects ``ids`` with the numbers of a parameter vector."""
        numbers: dict[str, dict[str, float]] = {c.id: {} for c in self.classes}
        for slot, value in zip(self.slots, vector, strict=False):
            numbers[slot.effect.id][slot.name] = float(value) * slot.scale
        return tuple(c(**numbers[c.id]) for c in self.classes if c.id in ids)


@lru_cache(PROGRAMS)
def _compile_march(
    model: Composition,
    slots: tuple[Slot, ...],
    room: int,
    history: int,
    tilts: bool,
    others: tuple[SensorPlace, ...] = (),
):
    """Predictions at a batch of points and runs; tilts: of roll as well, which a march feels; others: places of sensors
    beside the points."""
    only = ("y", "tilt") if tilts else ("y",)
    one = partial(_one_run, model=model, slots=slots, room=room, history=history, only=only, others=others)
    seldom = any(issubclass(s.effect, GenericLaw) for s in slots)  # a program of this campaign alone
    return jit_float64(jax.vmap(one, in_axes=(0, 0, 0, 0, 0, 0, None, None, None, None)), brief=seldom)


def room_for(steps: int, slots: int) -> tuple[int, int]:
    """Records and slots of the wrap's history that compiled code has, for so many."""
    first, second = (2 ** math.ceil(math.log2(max(x, 1.0))) for x in ((steps + 2) / ROOM, slots / SLOTS))
    return ROOM * first, SLOTS * second


def _one_run(
    vector, shown, settings: Settings, travel, time, yaw_at, rig, belt, spacing, steps, *,
    model, slots, room, history, only, others,
):  # fmt: skip
    """Readings (6, n) of one run at every place, and (k, n) at the ``others``; (4, n) where ``only`` has no tilt."""
    effects, case = effects_and_case(vector * shown, slots, Case(rig=rig, belt=belt, settings=settings))
    curves = march_open(case, effects, spacing, steps, model=model, room=room, slots=history, only=only, inside=others)
    stated = jnp.append(travel, yaw_at)  # the last sample is where every lateral sensor reads zero
    clock = jnp.append(time, yaw_at / case.settings.speed)
    read = indicate(curves, case, effects, stated, clock)
    rows = [read.y[:, :-1] - read.y[:, -1:], *([read.tilt[:, :-1]] if "tilt" in only else [])]
    before = yaw_at - 2.0 * spacing  # of the yaw, with which these move at once
    stated, clock = stated.at[-1].set(before), clock.at[-1].set(before / case.settings.speed)
    for place in others:
        y = reading_at(place, curves, case, effects, stated, clock)
        rows.append((y[:-1] - y[-1])[None])
    return jnp.concatenate(rows) if len(rows) > 1 else rows[0]


# The step of the march: as short as its own error asks for, by halving it on the campaign's own runs.

WANTED = 0.1  # length of the march's error, whitened over the whole campaign: noise alone has one per reading
HALVINGS = 3
ORDER = 4.0  # error of a step over that of half the step: the march is of second order


def choose_step(samples: Samples, model: Composition, whiten) -> tuple[float, np.ndarray]:
    """The longest step [m], of STEP and its halves, whose error is no longer than WANTED, and that error (R, S, n)
    [m or rad]; ``whiten`` as in ``Metric``.
    """
    both = (Forward(samples, model, (), step) for step in (STEP, STEP / 2))
    coarse, fine = (f.values(f.null()[None])[0] for f in both)
    error = (coarse - fine) * ORDER / (ORDER - 1.0)
    size = float(np.linalg.norm(whiten(error)))
    halvings = 0 if size <= WANTED else min(int(np.ceil(np.log(size / WANTED) / np.log(ORDER))), HALVINGS)
    return STEP / 2**halvings, ORDER**-halvings * error
