"""belt-sim map: many cases of an analytic model, a row each, on disk."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim import si
from belt_sim.analytic.march import march_traced, plan_steps
from belt_sim.analytic.model import AnalyticModel
from belt_sim.analytic.steady import steady_traced
from belt_sim.api.resolve import effects_of, fitted_model
from belt_sim.case import Case
from belt_sim.case_map.axes import Axis, CasePlan, axes_of, place_values
from belt_sim.case_map.parts import SCHEMA, claim, missing_parts, parquet, stream
from belt_sim.commands.run_dir import RunDir
from belt_sim.config import case_from, model_settings
from belt_sim.curves import Curves, late_rates, late_records
from belt_sim.effects.base import AFTER_ENGINE, Effect, uses
from belt_sim.errors import InputError, finite, whole
from belt_sim.jax_setup import cores, jit_float64, map_in_chunks
from belt_sim.provenance import code_hash, config_hash, input_hashes, provenance

POINTS = (1, 2, 3, 4)
CHUNK = 250  # cases marched side by side in one thread; their state stays in a core's cache


@dataclass(frozen=True)
class MapTask:
    """What all cases share. keys: names of what varies; travel [m], None for closed forms alone; at [m]: travels at
    which positions are told; plan: records, steps a record, slots of the wrap (march.plan_steps)."""

    model: AnalyticModel
    keys: tuple[str, ...]
    travel: float | None
    at: tuple[float, ...]
    plan: tuple[int, int, int]
    steady: bool


def columns_of(asked: MapTask) -> tuple[str, ...]:
    """Names of what is told, in the order of ``answers``."""
    names: tuple[str, ...] = ()
    if asked.travel is not None:
        names += tuple(f"rate{k}_mm_per_m" for k in POINTS)
        names += tuple(f"y{k}_mm_at_{s:g}_m" for s in asked.at for k in POINTS)
        names += ("offset_upper_mm", "offset_lower_mm", "overshoot1_mm", "retreat1_mm", "slackest_edge_n_per_mm2")
    return (*names, "steady_rate_mm_per_m") if asked.steady else names


def answers(case: Case, effects: tuple[Effect, ...], asked: MapTask, values: np.ndarray, workers: int) -> np.ndarray:
    """A row a case, shape (n, columns), for ``values`` [SI] of what varies, shape (axes, n)."""

    def rows_of(cases: np.ndarray) -> list[Any]:
        return [_rows(case, effects, values.T[cases], asked=asked)]

    return map_in_chunks(rows_of, values.shape[1], CHUNK, workers)[0]


@partial(jit_float64, static_argnames=("asked",))
def _rows(case: Case, effects: tuple[Effect, ...], values: Any, *, asked: MapTask) -> Any:
    return jax.vmap(lambda own: _row(*place_values(case, effects, asked.keys, own), asked))(values)


def _row(case: Case, effects: tuple[Effect, ...], asked: MapTask) -> Any:
    told = []
    if asked.travel is not None:
        curves = march_traced(case, effects, asked.travel, model=asked.model, plan=asked.plan)
        told += _reduce_curves(curves, np.linspace(0.0, asked.travel, asked.plan[0] + 1), asked.at)
    if asked.steady:
        told.append(steady_traced(case, asked.model)[None] / si.MM_PER_M)
    return jnp.concatenate(told)


def _reduce_curves(curves: Curves, travel: np.ndarray, at: tuple[float, ...]) -> list[Any]:
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


MOST = 10**9  # cases
PLACES = (1.0, 10.0)  # [m] of travel
#: settings that change where a map goes and how it is made, not what it says
_MANNER = ("out", "pictures", "workers", "show")


@dataclass(frozen=True)
class CaseMap:
    """A map as it was asked for, checked, before any of it is made. config: as asked; part: cases a file."""

    config: Mapping[str, Any]
    plan: CasePlan
    case: Case
    effects: tuple[Effect, ...]
    asked: MapTask
    part: int
    workers: int

    @property
    def digest(self) -> str:
        """Names this map among others: the same for the same cases, of the same effect files, by the same code."""
        said = {k: v for k, v in self.config.items() if k not in _MANNER}
        return config_hash([said, input_hashes(said), code_hash()])

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the table beside the number of the case."""
        return (*(a.column for a in self.plan.axes), *columns_of(self.asked))

    def stretch(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Columns of the cases from ``start`` up to ``stop``."""
        varied = self.plan.stretch(start, stop)
        values = varied * np.array([[a.unit] for a in self.plan.axes])
        told = answers(self.case, self.effects, self.asked, values, self.workers)
        return dict(zip(self.columns, [*varied, *told.T], strict=True))


def case_map(config: Mapping[str, Any]) -> CaseMap:
    """The map that a configuration (conf/map.yaml) asks for; raises InputError, CannotRepresent."""
    cases = None if config["cases"] is None else whole("cases", config["cases"])
    axes, plain = axes_of(config, sampled=cases is not None)
    plan = CasePlan(axes=axes, cases=cases, seed=whole("seed", config["seed"], least=0))
    if plan.count > MOST:
        raise InputError("cases", plan.count, "", f"at most {MOST}; give axes smaller counts")
    closed = plain["travel"] is None
    case = case_from({**plain, "travel": 1.0} if closed else plain)
    model, effects = fitted_model(model_settings(config["model"])), effects_of(plain["effects"])
    model.admit(effects)
    for e in effects:
        if uses((e,), "encoder") or any(uses((e,), hook) for hook in AFTER_ENGINE):
            raise InputError("effects", e.id, "", "acts on what is read; a map tells of the belt's own movement")
    if closed and effects:
        raise InputError("effects", effects[0].id, "", "closed forms read no effects; give a travel in m")
    corners = _corners(axes, plain, case, effects)
    asked = _map_task(model, axes, plain, corners, bool(effects))
    if config["show"] not in (None, *columns_of(asked)):
        raise InputError("show", config["show"], "", f"use one of {', '.join(columns_of(asked))}")
    part, workers = whole("part", config["part"]), config["workers"]
    workers = cores() if workers is None else whole("workers", workers)
    return CaseMap(config, plan, case, effects, asked, part, workers)


def _corners(axes: Sequence[Axis], plain: Mapping[str, Any], case: Case, effects: tuple[Effect, ...]) -> list[Case]:
    """The cases at the ends of all axes, each checked as a case of its own is."""
    ends = [(float(a.values.min()), float(a.values.max())) for a in axes]
    keys = [a.key for a in axes]
    for corner in product(*ends):
        case_from(_with_values(plain, dict(zip(keys, corner, strict=True))))
    units = [a.unit for a in axes]
    return [place_values(case, effects, keys, np.array(c) * units)[0] for c in product(*ends)]


def _with_values(plain: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """The configuration with ``values`` in it."""
    new = {k: dict(v) if isinstance(v, Mapping) else v for k, v in plain.items()}
    new["travel"] = 1.0 if plain["travel"] is None else plain["travel"]
    for key, value in values.items():
        group, _, name = key.partition(".")
        if not name:
            new[key] = value
        elif group in ("rig", "belt"):
            new[group][name] = value
    return new


def _map_task(
    model: AnalyticModel, axes: Sequence[Axis], plain: Mapping[str, Any], corners: Sequence[Case], effects: bool
) -> MapTask:
    keys = tuple(a.key for a in axes)
    if plain["travel"] is None:
        return MapTask(model, keys, None, (), (0, 0, 0), steady=not effects)
    travel = float(plain["travel"])
    plans = [plan_steps(c, travel=travel, step=model.step, keep=model.keep) for c in corners]
    plan = (*plans[0][:2], max(p[2] for p in plans))
    return MapTask(model, keys, travel, _places(plain["at"], travel), plan, steady=not effects)


def _places(at: Any, travel: float) -> tuple[float, ...]:
    """Travels [m] at which positions are told."""
    if at is None:
        return tuple(s for s in PLACES if s <= travel)
    if not isinstance(at, Sequence) or isinstance(at, str):
        raise InputError("at", at, "m", "give a list of travels, e.g. at=[1,10]")
    remedy = f"give travels from 0 to {travel:g}"
    return tuple(finite("at", s, "m", remedy, lambda x: 0 <= x <= travel) for s in at)


def write_map(folder: Path, made: CaseMap, provenance: Mapping[str, Any], told: Callable[[int], None]) -> int:
    """Stream to ``folder`` what is missing of the map; returns the number of cases that were made now.

    told: called with the number of cases after each part, those that were there already first.
    """
    parquet()
    count, size = made.plan.count, made.part
    note = {"schema": SCHEMA, "cases": count, "part": size, "columns": ["case", *made.columns]}
    note |= {"config": dict(made.config), "config_sha256": made.digest, "provenance": dict(provenance)}
    parts = claim(folder, note)
    left = sum(stop - start for _, start, stop in missing_parts(parts, count, size))
    told(count - left)
    for number in stream(parts, count, size, made.stretch):
        told(number)
    return left


def map_cases(run_dir: RunDir) -> None:
    """Leave map.json, cases/*.parquet and map.png; the same command goes on where it was stopped."""
    from belt_sim.pictures.case_map import draw_map
    from belt_sim.watch.observers import progress

    config = run_dir.config
    made = case_map(config)
    folder = Path(config["out"]) if config["out"] else run_dir.path / f"{config['model']['name']}_{made.digest[:8]}"
    began = time.monotonic()
    with progress(made.plan.count, f"map of {made.plan.count} cases") as done:
        new = write_map(folder, made, provenance(config), done)
    seconds = time.monotonic() - began
    if new:
        print(f"{new} cases in {seconds:.1f} s, {new / seconds:.0f} a second")
    if new < made.plan.count:
        print(f"done before, kept: {made.plan.count - new} cases")
    if config["pictures"]:
        for path in draw_map(folder, made.plan, made.columns, config["show"]):
            print(path)
    print(f"{folder / 'cases'}: a row a case, for pandas.read_parquet")
