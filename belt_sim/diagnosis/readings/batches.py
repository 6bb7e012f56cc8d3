"""Runs at points as one list of rows, computed a fixed number at a time, those of several programs side by side."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from itertools import zip_longest
from typing import Any

import jax
import numpy as np

from belt_sim.campaign.types import sensor_place
from belt_sim.diagnosis.readings.samples import MAX_SAMPLES, Samples
from belt_sim.diagnosis.readings.sensor_places import places_of
from belt_sim.jax_setup import WORKERS

COLUMNS = MAX_SAMPLES  # samples of a run are filled up to a multiple of this, so that campaigns share compiled code
ROWS = 8  # runs at points a batch: requests are cut and padded to it, so that one shape is compiled; most are small

PLACES = ("point_1", "point_2", "point_3", "point_4", "upper_mid_span", "lower_mid_span")


@dataclass(frozen=True)
class Work:
    """What a program shows of all runs at points, (C, R, S, n), once its batches are done."""

    found: np.ndarray
    batches: Sequence[Callable[[], None]]


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
