"""What is told of each case of a map: many marches at once, each reduced to a row inside the compiled code."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim import si
from belt_sim.analytic.march import march_traced
from belt_sim.analytic.model import AnalyticModel
from belt_sim.analytic.steady import steady_traced
from belt_sim.case import Case
from belt_sim.case_map.axes import placed
from belt_sim.curves import Curves, late_rates, late_records
from belt_sim.effects.base import Effect
from belt_sim.jax_setup import compiled, map_in_threads

POINTS = (1, 2, 3, 4)
CHUNK = 250  # cases marched side by side in one thread; their state stays in a core's cache


@dataclass(frozen=True)
class Asked:
    """What all cases share. keys: names of what varies; travel [m], None for closed forms alone; at [m]: travels at
    which positions are told; plan: records, steps a record, slots of the wrap (march.plan_steps)."""

    model: AnalyticModel
    keys: tuple[str, ...]
    travel: float | None
    at: tuple[float, ...]
    plan: tuple[int, int, int]
    steady: bool


def columns_of(asked: Asked) -> tuple[str, ...]:
    """Names of what is told, in the order of ``answers``."""
    names: tuple[str, ...] = ()
    if asked.travel is not None:
        names += tuple(f"rate{k}_mm_per_m" for k in POINTS)
        names += tuple(f"y{k}_mm_at_{s:g}_m" for s in asked.at for k in POINTS)
        names += ("offset_upper_mm", "offset_lower_mm", "overshoot1_mm", "retreat1_mm", "slackest_edge_n_per_mm2")
    return (*names, "steady_rate_mm_per_m") if asked.steady else names


def answers(case: Case, effects: tuple[Effect, ...], asked: Asked, values: np.ndarray, workers: int) -> np.ndarray:
    """A row a case, shape (n, columns), for ``values`` [SI] of what varies, shape (axes, n)."""
    number = values.shape[1]
    chunk = min(CHUNK, number)
    told = np.empty((number, len(columns_of(asked))))

    def lay(start: int) -> None:
        rows = np.minimum(np.arange(start, start + chunk), number - 1)
        stop = min(start + chunk, number)
        told[start:stop] = np.asarray(_rows(case, effects, values.T[rows], asked=asked))[: stop - start]

    lay(0)  # compiles, once, before there are several threads
    map_in_threads(lay, range(chunk, number, chunk), workers)
    return told


@partial(compiled, static_argnames=("asked",))
def _rows(case: Case, effects: tuple[Effect, ...], values: Any, *, asked: Asked) -> Any:
    return jax.vmap(lambda own: _row(*placed(case, effects, asked.keys, own), asked))(values)


def _row(case: Case, effects: tuple[Effect, ...], asked: Asked) -> Any:
    told = []
    if asked.travel is not None:
        curves = march_traced(case, effects, asked.travel, model=asked.model, plan=asked.plan)
        told += _told(curves, _travel(asked), asked.at)
    if asked.steady:
        told.append(steady_traced(case, asked.model)[None] / si.MM_PER_M)
    return jnp.concatenate(told)


def _travel(asked: Asked) -> np.ndarray:
    assert asked.travel is not None
    return np.linspace(0.0, asked.travel, asked.plan[0] + 1)


def _told(curves: Curves, travel: np.ndarray, at: tuple[float, ...]) -> list[Any]:
    """Late rates, positions, offsets, overshoot and retreat of point 1, slackest edge; as people write them."""
    y = jnp.asarray(curves.y) / si.MM
    unit = np.eye(len(travel))  # rates and positions are sums over records: their weights
    slopes = late_rates(Curves(travel=travel, y=unit))
    positions = np.array([[np.interp(s, travel, row) for row in unit] for s in at]).reshape(len(at), len(travel))
    rates, end = y @ slopes, y[:, -1]
    late = late_records(travel)
    line = y[0, late].mean() + rates[0] * (travel - travel[late].mean())
    away = jnp.where(end[0] < 0, -1.0, 1.0)
    overshoot = jnp.maximum(jnp.max((y[0] - line) * away), 0.0)
    out = y[0] * away
    retreat = jnp.max(jax.lax.cummax(out) - out)
    edge = jnp.min(jnp.asarray(curves.edge_stress)) / si.N_PER_MM2
    offset = jnp.stack([end[0] - end[3], end[2] - end[1]])
    return [rates, (positions @ y.T).ravel(), offset, jnp.stack([overshoot, retreat, edge])]
