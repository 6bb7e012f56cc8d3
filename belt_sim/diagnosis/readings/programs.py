"""The programs that predict readings: marches, each compiled with the effects that act.

Few rows pay for effects that are null in them, and few programs serve all rows. Effects stand in groups: those that a
march does not ask at its steps are always compiled in; of the others the slow ones are one group, and the rest another,
each compiled in where any of it acts. A program has room for more steps than the campaign needs: one compilation serves
campaigns of any number of runs, samples, travel and step. Runs at points are one list of rows, computed a fixed number
at a time, those of several programs side by side.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import zip_longest

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.analytic.march import march_open, plan_steps
from belt_sim.campaign.types import sensor_place
from belt_sim.case import Case, Settings
from belt_sim.curves import SensorPlace
from belt_sim.diagnosis.readings.additive_effects import bin_attenuation
from belt_sim.diagnosis.readings.candidates import SLOW
from belt_sim.diagnosis.readings.parameter_vector import NUISANCES, Slot, effects_and_case
from belt_sim.diagnosis.readings.samples import MAX_SAMPLES, Samples
from belt_sim.diagnosis.readings.sensor_places import places_of, reading_at
from belt_sim.effects.base import Effect, overrides
from belt_sim.effects.generic_law import GenericLaw
from belt_sim.effects.pipeline import indicate
from belt_sim.jax_setup import PROGRAMS, WORKERS, jit_float64

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


REACH = 1.12  # predictions reach this much further than the record, which an encoder may have shortened


class Programs:
    """Programs of a model with effects, for runs no longer than those of some samples."""

    def __init__(
        self,
        samples: Samples,
        model: Composition,
        slots: tuple[Slot, ...],
        apart: Sequence[type[Effect]],
        step: float,
    ) -> None:
        """slots: what stands in a parameter vector; apart: effects that no march has; step [m]: of the march."""
        self.model, self.slots = model, slots
        self.null = np.array([s.null / s.scale for s in slots] + [0.0] * len(NUISANCES))
        self._groups, self._apart = [group_of(s.effect) for s in slots], {group_of(c) for c in apart}
        travel = samples.end * REACH + 0.5
        steps, _, history = plan_steps(samples.cases, travel=travel, step=step, keep=step)
        self._steps, self._room = (travel / steps, steps), room_for(steps, history)

    def active_groups(self, vector: np.ndarray) -> list[Groups]:
        """Groups of effects that are not null at each of (C, size), as far as that makes a difference to a march."""
        off = (vector != self.null)[:, : len(self.slots)]
        return [frozenset(self._groups[k] for k in np.flatnonzero(row)) - {READ, *self._apart} for row in off]

    def groups_of_derivatives(self, points: np.ndarray, of: np.ndarray, along: np.ndarray) -> list[Groups]:
        """Groups that each derivative (C,) is taken with: all cheap ones of a point together, and what is dear by
        itself; points (P, size), of (C,): at which of them; along (C, size)."""
        there, moved = self.active_groups(points), self.active_groups(self.null + along)
        shared = [
            groups.union(*(moved[k] & {LIGHT} for k in np.flatnonzero(of == p))) for p, groups in enumerate(there)
        ]
        return [(there if groups - {LIGHT} else shared)[p] | groups for p, groups in zip(of, moved, strict=True)]

    def predict(self, vector: np.ndarray, groups: Sequence[Groups], samples: Samples) -> np.ndarray:
        """Predictions (C, R, S, n) at parameter vectors (C, size), each by the program of some groups of effects."""
        places = {code: np.flatnonzero([c == code for c in groups]) for code in dict.fromkeys(groups)}
        works = [self._march(vector[rows], code, samples) for code, rows in places.items()]
        finish(works)
        found = np.empty((len(vector), *samples.y.shape))
        for rows, work in zip(places.values(), works, strict=True):
            found[rows] = work.found
        return found

    def _march(self, vector: np.ndarray, groups: Groups, samples: Samples) -> "Work":
        """Predictions (C, R, S, n) with the effects of some groups, which are all that is not null."""
        kept = [k for k, group in enumerate(self._groups) if group in {READ, *groups}]
        others = places_of(samples)
        tilts = bool(others) or any(s.at.endswith("mid_span") for s in samples.signals)
        slots = tuple(self.slots[k] for k in kept)
        march = _compile_march(self.model, slots, *self._room, tilts, others)
        scales = [s.scale for s in slots] + [1.0] * len(NUISANCES)  # those of found laws are no two alike
        vector = vector[:, [*kept, *range(len(self.slots), vector.shape[1])]] * scales
        return plan_batches(march, vector, bin_attenuation(slots, samples, len(NUISANCES)), samples, self._steps)


ROOM = 2048  # records that compiled code has room for; where that is too little, twice as many, and so on
SLOTS = 16  # the same of the wrap's history


def room_for(steps: int, slots: int) -> tuple[int, int]:
    """Records and slots of the wrap's history that compiled code has, for so many."""
    first, second = (2 ** math.ceil(math.log2(max(x, 1.0))) for x in ((steps + 2) / ROOM, slots / SLOTS))
    return ROOM * first, SLOTS * second


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


COLUMNS = MAX_SAMPLES  # samples of a run are filled up to a multiple of this, so that campaigns share compiled code
ROWS = 8  # runs at points a batch: requests are cut and padded to it, so that one shape is compiled; most are small

PLACES = ("point_1", "point_2", "point_3", "point_4", "upper_mid_span", "lower_mid_span")


@dataclass(frozen=True)
class Work:
    """What a program shows of all runs at points, (C, R, S, n), once its batches are done."""

    found: np.ndarray
    batches: Sequence[Callable[[], None]]


def plan_batches(
    program: Callable[..., jax.Array], vector: np.ndarray, shown: np.ndarray, samples: Samples, more: tuple
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
