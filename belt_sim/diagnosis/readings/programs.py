"""Compiled marches that predict readings.

A program has room for more steps than a campaign needs: one compilation serves campaigns of any number of runs,
samples, travel and step. Runs at points are one list of rows, computed a fixed number at a time, those of several
programs side by side.
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

from belt_sim.campaign.types import sensor_place
from belt_sim.case import Case, Settings
from belt_sim.curves import SensorPlace
from belt_sim.diagnosis.readings.parameter_vector import Slot, effects_and_case
from belt_sim.diagnosis.readings.samples import MAX_SAMPLES, Samples
from belt_sim.diagnosis.readings.sensor_places import places_of, reading_at
from belt_sim.effects.law import GenericLaw
from belt_sim.jax_setup import PROGRAMS, WORKERS, StoredProgram, program_key
from belt_sim.line.hooks import indicate
from belt_sim.line.march import march_open
from belt_sim.line.spans import Composition

ROOM = 2048  # records that compiled code has room for; where that is too little, twice as many, and so on
SLOTS = 16  # the same of the wrap's history


def room_for(steps: int, slots: int) -> tuple[int, int]:
    """Records and slots of the wrap's history that compiled code has, for so many."""
    first, second = (2 ** math.ceil(math.log2(max(x, 1.0))) for x in ((steps + 2) / ROOM, slots / SLOTS))
    return ROOM * first, SLOTS * second


@lru_cache(PROGRAMS)
def compile_march(
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
    many = jax.vmap(one, in_axes=(0, 0, 0, 0, 0, 0, None, None, None, None))
    names = [s.name for s in slots]
    key = program_key("readings", model, [s.effect for s in slots], names, room, history, tilts, others)
    return StoredProgram(many, key, brief=seldom)


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
    program: Callable[..., jax.Array],
    vector: np.ndarray,
    shown: np.ndarray,
    samples: Samples,
    spacing: float,
    steps: np.ndarray,
) -> Work:
    """What a ``program`` of one run is to show of all runs at points (C, k); shown (R, k): how much of each number the
    readings of a run show; spacing [m], steps (R,): of the march, which goes as far as a batch asks for."""
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
        predicted = program(*of_rows, cases.rig, cases.belt, spacing, int(steps[r].max()))
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
