"""belt-sim map: many cases of an analytic model, a row each, in Parquet files of so many cases.

What varies are numbers of the machine, the belt, its settings and its effects. A file that is there is not made again.
"""

import copy
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim import si
from belt_sim.api.resolve import effects_of, fitted_model
from belt_sim.case import Case
from belt_sim.commands.run_dir import RunDir
from belt_sim.config import case_from, model_settings
from belt_sim.curves import Curves, late_rates, late_records
from belt_sim.effects.base import AFTER_ENGINE, Effect, uses
from belt_sim.errors import BeltError, InputError, finite, whole
from belt_sim.files import clear_drafts, read_json, write_json, write_with
from belt_sim.jax_setup import cores, jit_float64, map_in_chunks
from belt_sim.line.march import march_traced, plan_steps
from belt_sim.line.steady import steady_traced
from belt_sim.model import AnalyticModel
from belt_sim.provenance import code_hash, config_hash, input_hashes, provenance

#: setting -> (name of its column, what one unit is in SI)
SETTINGS = {
    "tension": ("tension_n_per_mm2", si.N_PER_MM2),
    "yaw": ("yaw_deg", si.DEGREE),
    "yaw_head": ("yaw_head_deg", si.DEGREE),
    "speed": ("speed_m_per_s", 1.0),
}
GROUPS = {
    "rig": ("centre_distance", "pulley_radius", "head_radius", "tail_radius", "gravity"),
    "belt": ("width", "thickness", "youngs_modulus", "density", "poisson_ratio"),
}
SPACINGS = ("even", "ratio")
POINTS = (1, 2, 3, 4)
CHUNK = 250  # cases marched side by side in one thread; their state stays in a core's cache
MOST = 10**9  # cases
DRAWN = 2_000_000  # cases of a picture, at most
PLACES = (1.0, 10.0)  # [m] of travel
FOLDER, NOTE, SCHEMA = "cases", "map.json", "belt-map/1"
#: settings that change where a map goes and how it is made, not what it says
_MANNER = ("out", "pictures", "workers", "show")


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One number that varies. key: as on the command line (tension, belt.thickness, taper.kappa_t);

    values: what a grid visits, shape (n,), as people write them; ratio: whether a sample spreads evenly over its
    logarithm; listed: whether only ``values`` themselves may be met.
    """

    key: str
    values: np.ndarray
    ratio: bool = False
    listed: bool = False

    @property
    def column(self) -> str:
        return SETTINGS[self.key][0] if self.key in SETTINGS else self.key.replace(".", "_")

    @property
    def unit(self) -> float:
        """One of ``values`` in SI."""
        return SETTINGS[self.key][1] if self.key in SETTINGS else 1.0

    def values_at(self, share: np.ndarray) -> np.ndarray:
        """Values at ``share`` (0..1) of the way from the first to the last."""
        if self.listed:
            return self.values[np.minimum((share * len(self.values)).astype(int), len(self.values) - 1)]
        low, high = self.values[0], self.values[-1]
        return low * (high / low) ** share if self.ratio else low + share * (high - low)


def axes_of(config: Mapping[str, Any], sampled: bool) -> tuple[tuple[Axis, ...], dict[str, Any]]:
    """The axes of a map, and the configuration with the first value of each in its place (of an effect, the last)."""
    plain = copy.deepcopy(dict(config))
    axes: list[Axis] = []
    stated = [(key, plain, key) for key in SETTINGS]
    stated += [(f"{group}.{name}", plain[group], name) for group, names in GROUPS.items() for name in names]
    for key, owner, name in stated:
        if axis := _axis(key, owner.get(name), sampled):
            axes.append(axis)
            owner[name] = float(axis.values[0])
    effects = plain["effects"] if isinstance(plain["effects"], list) else []
    for entry in (e for e in effects if isinstance(e, dict)):
        for name, spec in entry.items():
            if axis := _axis(f"{entry.get('id')}.{name}", spec, sampled):
                axes.append(axis)
                entry[name] = float(axis.values[-1]) or float(axis.values[0])
    if not axes:
        raise InputError("tension", config["tension"], "", "let something vary, e.g. tension=[7,10,20]")
    return tuple(axes), plain


def _axis(key: str, spec: Any, sampled: bool) -> Axis | None:
    """The axis that ``spec`` means; None for a number that does not vary, and for a schedule of yaw."""
    if isinstance(spec, Mapping):
        return Axis(key=key, values=_range(key, spec, sampled), ratio=spec.get("spacing") == "ratio")
    if not isinstance(spec, Sequence) or isinstance(spec, str) or any(isinstance(x, Mapping) for x in spec):
        return None
    if not spec:
        raise InputError(key, "[]", "", "give at least one value")
    return Axis(key=key, values=np.array([finite(key, x) for x in spec]), listed=True)


def _range(key: str, spec: Mapping[str, Any], sampled: bool) -> np.ndarray:
    if not {"from", "to"} <= set(spec) <= {"from", "to", "count", "spacing"} or not (sampled or "count" in spec):
        raise InputError(key, dict(spec), "", "write {from: low, to: high, count: how many, spacing: even or ratio}")
    low, high = finite(f"{key}.from", spec["from"]), finite(f"{key}.to", spec["to"])
    count, spacing = whole(f"{key}.count", spec.get("count", 2)), spec.get("spacing", "even")
    if spacing not in SPACINGS:
        raise InputError(f"{key}.spacing", spacing, "", f"use one of {', '.join(SPACINGS)}")
    if spacing == "ratio" and not low * high > 0:
        raise InputError(f"{key}.from", low, "", "spacing by ratio needs both ends above 0, or both below")
    if sampled:
        return np.array([low, high])
    return np.geomspace(low, high, count) if spacing == "ratio" else np.linspace(low, high, count)


def place_values(
    case: Case, effects: tuple[Effect, ...], keys: Sequence[str], values: Any
) -> tuple[Case, tuple[Effect, ...]]:
    """``case`` and ``effects`` with ``values`` [SI], shape (axes,), in place of what ``keys`` name; may be traced."""
    for key, value in zip(keys, values, strict=True):
        owner, _, name = key.partition(".")
        if key in SETTINGS:
            now = getattr(case.settings, key)
            new = replace(now, change=value[None]) if key.startswith("yaw") else now * 0.0 + value
            case = replace(case, settings=replace(case.settings, **{key: new}))
        elif key == "rig.pulley_radius":
            case = replace(case, rig=replace(case.rig, head_radius=value, tail_radius=value))
        elif owner in GROUPS:
            case = replace(case, **{owner: replace(getattr(case, owner), **{name: value})})
        else:
            effects = tuple(replace(e, **{name: value}) if e.id == owner else e for e in effects)
    return case, effects


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

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of what is told, in the order of ``_row``."""
        names: tuple[str, ...] = ()
        if self.travel is not None:
            names += tuple(f"rate{k}_mm_per_m" for k in POINTS)
            names += tuple(f"y{k}_mm_at_{s:g}_m" for s in self.at for k in POINTS)
            names += ("offset_upper_mm", "offset_lower_mm", "overshoot1_mm", "retreat1_mm", "slackest_edge_n_per_mm2")
        return (*names, "steady_rate_mm_per_m") if self.steady else names


@partial(jit_float64, static_argnames=("task",))
def _rows(case: Case, effects: tuple[Effect, ...], values: Any, *, task: MapTask) -> Any:
    return jax.vmap(lambda own: _row(*place_values(case, effects, task.keys, own), task))(values)


def _row(case: Case, effects: tuple[Effect, ...], task: MapTask) -> Any:
    told = []
    if task.travel is not None:
        curves = march_traced(case, effects, task.travel, model=task.model, plan=task.plan)
        told += _reduce_curves(curves, np.linspace(0.0, task.travel, task.plan[0] + 1), task.at)
    if task.steady:
        told.append(steady_traced(case, task.model)[None] / si.MM_PER_M)
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


@dataclass(frozen=True)
class CaseMap:
    """A map as it was asked for, checked, before any of it is made.

    config: as asked; axes: what varies; cases: how many of them, spread over the box of the axes by Sobol's sequence
    (scrambled by ``seed``), None for the grid of all values, the last axis running fastest; part: cases a file.
    """

    config: Mapping[str, Any]
    axes: tuple[Axis, ...]
    cases: int | None
    seed: int
    case: Case
    effects: tuple[Effect, ...]
    task: MapTask
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
        return (*(a.column for a in self.axes), *self.task.columns)

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(len(a.values) for a in self.axes)

    @property
    def count(self) -> int:
        return int(np.prod(self.shape, dtype=object)) if self.cases is None else self.cases

    def values(self, start: int, stop: int) -> np.ndarray:
        """Values of the axes, as people write them, of the cases from ``start`` up to ``stop``, shape (axes, n)."""
        if self.cases is None:
            where = np.unravel_index(np.arange(start, stop), self.shape)
            return np.stack([a.values[k] for a, k in zip(self.axes, where, strict=True)])
        from scipy.stats import qmc  # slow to import

        engine = qmc.Sobol(len(self.axes), seed=self.seed)
        if start:
            engine.fast_forward(start)
        with warnings.catch_warnings():  # of a count that is no power of two
            warnings.simplefilter("ignore", UserWarning)
            shares = engine.random(stop - start)
        return np.stack([a.values_at(column) for a, column in zip(self.axes, shares.T, strict=True)])

    def stretch(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Columns of the cases from ``start`` up to ``stop``."""
        varied = self.values(start, stop)
        values = varied.T * [a.unit for a in self.axes]

        def rows_of(cases: np.ndarray) -> list[Any]:
            return [_rows(self.case, self.effects, values[cases], task=self.task)]

        told = map_in_chunks(rows_of, len(values), CHUNK, self.workers)[0]
        return dict(zip(self.columns, [*varied, *told.T], strict=True))


def case_map(config: Mapping[str, Any]) -> CaseMap:
    """The map that a configuration (conf/map.yaml) asks for; raises InputError, CannotRepresent."""
    cases = None if config["cases"] is None else whole("cases", config["cases"])
    axes, plain = axes_of(config, sampled=cases is not None)
    seed = whole("seed", config["seed"], least=0)
    closed = plain["travel"] is None
    any_travel = {**plain, "travel": 1.0} if closed else plain
    case = case_from(any_travel)
    model, effects = fitted_model(model_settings(config["model"])), effects_of(plain["effects"])
    model.admit(effects)
    for e in effects:
        if uses((e,), "encoder") or any(uses((e,), hook) for hook in AFTER_ENGINE):
            raise InputError("effects", e.id, "", "acts on what is read; a map tells of the belt's own movement")
    if closed and effects:
        raise InputError("effects", effects[0].id, "", "closed forms read no effects; give a travel in m")
    corners = _corners(axes, any_travel, case, effects)
    keys, steady = tuple(a.key for a in axes), not effects
    task = MapTask(model, keys, None, (), (0, 0, 0), steady)
    if not closed:
        travel = float(plain["travel"])
        plans = [plan_steps(c, travel=travel, step=model.step, keep=model.keep) for c in corners]
        plan = (*plans[0][:2], max(p[2] for p in plans))
        task = MapTask(model, keys, travel, _places(plain["at"], travel), plan, steady)
    if config["show"] not in (None, *task.columns):
        raise InputError("show", config["show"], "", f"use one of {', '.join(task.columns)}")
    part, workers = whole("part", config["part"]), config["workers"]
    workers = cores() if workers is None else whole("workers", workers)
    made = CaseMap(config, axes, cases, seed, case, effects, task, part, workers)
    if made.count > MOST:
        raise InputError("cases", made.count, "", f"at most {MOST}; give axes smaller counts")
    return made


def _corners(axes: Sequence[Axis], plain: Mapping[str, Any], case: Case, effects: tuple[Effect, ...]) -> list[Case]:
    """The cases at the ends of all axes, each checked as a case of its own is."""
    keys, units, found = [a.key for a in axes], [a.unit for a in axes], []
    for corner in product(*((float(a.values.min()), float(a.values.max())) for a in axes)):
        checked = copy.deepcopy(dict(plain))
        for key, value in zip(keys, corner, strict=True):
            group, _, name = key.rpartition(".")
            if group in ("", *GROUPS):
                (checked[group] if group else checked)[name] = value
        case_from(checked)
        found.append(place_values(case, effects, keys, np.array(corner) * units)[0])
    return found


def _places(at: Any, travel: float) -> tuple[float, ...]:
    """Travels [m] at which positions are told."""
    if at is None:
        return tuple(s for s in PLACES if s <= travel)
    if not isinstance(at, Sequence) or isinstance(at, str):
        raise InputError("at", at, "m", "give a list of travels, e.g. at=[1,10]")
    remedy = f"give travels from 0 to {travel:g}"
    return tuple(finite("at", s, "m", remedy, lambda x: 0 <= x <= travel) for s in at)


def write_map(folder: Path, made: CaseMap, provenance: Mapping[str, Any], told: Callable[[int], None]) -> int:
    """Write to ``folder``, file by file, what is missing of the map; returns the number of cases that were made now.

    told: called with the number of cases after each file, those that were there already first. Raises BeltError without
    PyArrow, InputError where the folder holds another map.
    """
    parquet = _parquet()
    import pyarrow

    parts = folder / FOLDER
    parts.mkdir(parents=True, exist_ok=True)
    clear_drafts(parts)
    clear_drafts(folder)
    note = {"schema": SCHEMA, "cases": made.count, "part": made.part, "columns": ["case", *made.columns]}
    note |= {"config": dict(made.config), "config_sha256": made.digest, "provenance": dict(provenance)}
    before = read_json(folder / NOTE) if (folder / NOTE).exists() else note
    if before.get("config_sha256") != note["config_sha256"]:
        remedy = "holds another map, or the same of other effect files or code; choose another folder, or remove it"
        raise InputError("out", folder, "", remedy)
    write_json(folder / NOTE, note)
    starts = range(0, made.count, made.part)
    files = [(parts / f"{k:06d}.parquet", s, min(s + made.part, made.count)) for k, s in enumerate(starts)]
    due = [(path, start, stop) for path, start, stop in files if _cases_in(path) != stop - start]
    left = sum(stop - start for _, start, stop in due)
    told(made.count - left)
    for path, start, stop in due:
        table = pyarrow.table({"case": np.arange(start, stop)} | made.stretch(start, stop))
        write_with(path, partial(parquet.write_table, table, compression="zstd"))
        told(stop - start)
    return left


def _parquet() -> Any:
    """PyArrow's Parquet module; raises BeltError saying how to get it."""
    try:
        import pyarrow.parquet
    except ImportError as missing:
        raise BeltError("a map needs PyArrow: pip install 'belt-sim[sweeps]'") from missing
    return pyarrow.parquet


def _cases_in(path: Path) -> int | None:
    """Cases in a file of a map; None where there is none that can be read."""
    import pyarrow

    try:
        return int(_parquet().read_metadata(path).num_rows)
    except (OSError, pyarrow.ArrowException):
        return None


def map_cases(run_dir: RunDir) -> None:
    """Leave map.json, cases/*.parquet and map.png; the same command goes on where it was stopped."""
    from belt_sim.show.observers import progress

    config = run_dir.config
    made = case_map(config)
    folder = Path(config["out"]) if config["out"] else run_dir.path / f"{config['model']['name']}_{made.digest[:8]}"
    began = time.monotonic()
    with progress(made.count, f"map of {made.count} cases") as done:
        new = write_map(folder, made, provenance(config), done)
    seconds = time.monotonic() - began
    if new:
        print(f"{new} cases in {seconds:.1f} s, {new / seconds:.0f} a second")
    if new < made.count:
        print(f"done before, kept: {made.count - new} cases")
    if config["pictures"] and len(made.axes) <= 2 and made.count <= DRAWN:
        print(_draw(folder, made, config["show"] or made.task.columns[0]))
    print(f"{folder / 'cases'}: a row a case, for pandas.read_parquet")


def _draw(folder: Path, made: CaseMap, shown: str) -> Path:
    """Draw one column of the table over one or two axes as map.png."""
    from belt_sim.show.curves import map_picture

    names = [a.column for a in made.axes]
    table = _parquet().read_table(folder / FOLDER, columns=["case", *names, shown]).to_pandas().sort_values("case")
    columns = {name: table[name].to_numpy() for name in (*names, shown)}
    return map_picture(folder / "map.png", columns, made.shape if made.cases is None else None)
