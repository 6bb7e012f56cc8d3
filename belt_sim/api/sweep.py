"""Many cases at once: ``bs.sweep`` marches a grid of cases side by side and returns a table, a row a case."""

import copy
import os
import re
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd

from belt_sim.api.plot import Picture, plot
from belt_sim.api.simulate import (
    Model,
    effects_of,
    fitted_model,
    limits_of_run,
    model_of,
    simulate,
    states_model,
    validity_limits,
)
from belt_sim.case import Case
from belt_sim.curves import Curves, late_rates, late_records
from belt_sim.effects.base import Effect
from belt_sim.effects.load import check_numbers, load_classes
from belt_sim.errors import InputError, finite, warning, whole
from belt_sim.jax_setup import cores, jit_float64, map_in_threads
from belt_sim.line.hooks import AFTER_ENGINE, uses
from belt_sim.line.march import KEEP, march_traced, plan_steps, refuse_short_waves
from belt_sim.line.spans import steady_traced
from belt_sim.model import AnalyticModel
from belt_sim.results.simulation import POINT_NUMBERS, SHARE_BEFORE, agree, settled_before
from belt_sim.settings import case_from, group_from, make_settings
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2

#: setting -> (name of its column, what one unit is in SI)
SWEPT_SETTINGS = {
    "tension": ("tension_n_per_mm2", N_PER_MM2),
    "yaw": ("yaw_deg", DEGREE),
    "yaw_head": ("yaw_head_deg", DEGREE),
    "speed": ("speed_m_per_s", 1.0),
}
SWEPT_GROUPS = {
    "rig": ("centre_distance", "pulley_radius", "head_radius", "tail_radius", "gravity"),
    "belt": ("width", "thickness", "youngs_modulus", "density", "poisson_ratio"),
}
SPACINGS = ("even", "ratio")
CHUNK_CASES = 250  # cases marched side by side in one thread; their state stays in a core's cache
MOST_SWEPT_CASES = 10**7  # cases
CASES_ASKED = 128  # rows asked for the limits that they leave, as they are and moved to ends, 4 ms each
READ_AT = (1.0, 10.0)  # [m] of travel
#: columns of models that are no march
RUN_COLUMNS = (*(f"rate{k}_mm_per_m" for k in POINT_NUMBERS), "offset_upper_mm", "offset_lower_mm", "settled")


@dataclass(frozen=True)
class Axis:
    """One number that varies: key as on the command line (tension, belt.thickness, taper.kappa_t), values (n,); the
    name of its column; unit: one of ``values`` in SI."""

    key: str
    values: np.ndarray
    column: str
    unit: float


class SweepTable(pd.DataFrame):
    """A table of ``bs.sweep``; what is made of it (parts, copies) is pandas' own."""

    @property
    def _constructor(self) -> type[pd.DataFrame]:
        return pd.DataFrame

    def __repr__(self) -> str:
        """What varies, the late rates (without them the steady one) and whether they have settled, in 80 columns."""
        rates, models = {f"rate{k}_mm_per_m": f"rate{k}" for k in (1, 2, 3, 4)}, self.get("model", pd.Series()).unique()
        there = [*rates, "settled"] if "rate1_mm_per_m" in self else ["steady_rate_mm_per_m"]
        shown = [*self.attrs.get("axes", ()), *["model"] * (len(models) > 1), *there]
        few = self.to_pandas()[[c for c in shown if c in self]].rename(columns=rates)
        with pd.option_context("display.max_columns", None, "display.show_dimensions", False, "display.precision", 4):
            lines = [repr(few), f"{'rates in mm per m of travel; ' * ('rate1' in few)}model {', '.join(models)}"]
        return "\n".join([*lines, f"{len(self)} rows, {len(self.columns)} columns in all: list(table)"])

    def to_pandas(self) -> pd.DataFrame:
        """The whole table as pandas' own DataFrame."""
        return self.copy()

    def plot(  # type: ignore[override]
        self, path: str | os.PathLike[str] | None = None, *, kind: str | None = None, dpi: float | None = None
    ) -> Picture:
        """The picture of ``bs.plot``."""
        return plot(self, path, kind=kind, dpi=dpi)


def sweep(
    *,
    tension: Any = None,
    yaw: Any = None,
    yaw_head: Any = None,
    speed: Any = None,
    direction: float | None = None,
    rig: Any = None,
    belt: Any = None,
    travel: float | None = 60.0,
    model: Any = None,
    effects: Any = None,
    engine: str | None = None,
    at: Sequence[float] | None = None,
    workers: int | None = None,
    tell: Callable[[float], None] = lambda share: None,
) -> SweepTable:
    """A table of the grid of all values, a row a case: late rates, positions, offsets, overshoot, slackest edge,
    whether the rates have settled.

    What varies is a list, ``tension=[7, 10, 20]``, or a range, ``{"from": 5, "to": 60, "count": 100}`` (``"spacing":
    "ratio"``: evenly over its logarithm); so may numbers of ``rig``, ``belt`` and ``effects``. All else as for
    ``bs.simulate``. Analytic models are marched side by side, 3D ones one after another.

    travel [m]: None gives steady rates in closed form alone; at [m]: travels at which positions are told, None for 1
    and 10; workers: threads, None for one a core; tell: hears what share of the cases is newly done.
    ``table.plot()`` draws it, as ``bs.plot``; ``table.attrs["beyond"]``: limits of validity, a sentence each. Raises
    InputError, CannotRepresent.
    """
    if travel is None and at is not None:
        raise InputError("at", at, "m", "steady rates in closed form have no travel; state travel, or leave this out")
    if isinstance(model, list | tuple):
        each = "pandas.concat([bs.sweep(model=name, ...) for name in names])"
        raise InputError("model", model, "", f"a sweep has one model; join several with {each}")
    given = {"tension": tension, "yaw": yaw, "yaw_head": yaw_head, "speed": speed, "direction": direction}
    given |= {"rig": rig, "belt": belt}
    config = make_settings({k: v for k, v in given.items() if v is not None}) | {"travel": travel, "effects": effects}
    axes, plain = sweep_axes({k: group_from(k, v) if k in SWEPT_GROUPS else v for k, v in config.items()})
    if not axes:
        raise InputError("tension", config["tension"], "", "let something vary, e.g. tension=[7,10,20]")
    count = int(np.prod([len(a.values) for a in axes], dtype=object))
    if count > MOST_SWEPT_CASES:
        raise InputError("count", count, "cases", f"at most {MOST_SWEPT_CASES:,}; give the axes smaller counts")
    threads = cores() if workers is None else whole("workers", workers)
    columns = [v.ravel() for v in np.meshgrid(*(a.values for a in axes), indexing="ij")]
    values = np.stack(columns, axis=1) * [a.unit for a in axes]  # SI
    any_case = case_from(plain if travel is not None else {**plain, "travel": 1.0})
    grid = SweepGrid(axes, plain, any_case, effects_of(plain["effects"]))
    grid.corners  # noqa: B018 (raises for what cannot be)
    chosen = grid.models(model, values)
    told: dict[str, np.ndarray] = {}
    for name in dict.fromkeys(chosen.tolist()):
        rows = np.flatnonzero(chosen == name)
        spec = {**model, "name": name} if isinstance(model, Mapping) else (model if isinstance(model, Model) else name)
        one = model_of(spec, engine=engine)
        if isinstance(one, AnalyticModel) or travel is None:
            names, work = grid.marches(one, at)
            found = _in_chunks(work, values[rows], CHUNK_CASES, threads, lambda cases: tell(cases / count))
        else:
            names, work = RUN_COLUMNS, partial(grid.runs, one)
            found = _in_chunks(work, values[rows], 1, 1, lambda cases: tell(cases / count))
        for column, numbers in zip(names, found.T, strict=True):
            told.setdefault(column, np.full(count, np.nan))[rows] = numbers
    if "settled" in told:
        told["settled"] = told["settled"] == 1.0
    table = SweepTable(dict(zip((a.column for a in axes), columns, strict=True)) | {"model": chosen} | told)
    table.attrs["axes"] = {a.column: len(a.values) for a in axes}
    table.attrs["beyond"] = grid.beyond(table, model)
    return table


def _in_chunks(work: Any, values: np.ndarray, size: int, threads: int, tell: Callable[[int], None]) -> np.ndarray:
    """What ``work`` gives for all values (cases, axes), so many cases at once; tell hears how many are newly done."""
    size = min(size, len(values))

    def compute(start: int) -> np.ndarray:  # a last chunk is filled up with the last case: all are compiled once
        some = values[np.minimum(np.arange(start, start + size), len(values) - 1)]
        rows = np.asarray(work(some), float)[: len(values) - start]
        tell(len(rows))
        return rows

    first = compute(0)  # it compiles, before there are several threads
    return np.concatenate([first, *map_in_threads(compute, range(size, len(values), size), threads)])


@dataclass(frozen=True)
class SweepGrid:
    """What varies in a sweep, and the configuration, case and effects at the first values of it."""

    axes: tuple[Axis, ...]
    plain: Mapping[str, Any]
    case: Case
    effects: tuple[Effect, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Of each axis, its group or effects, and the fields there: ``pulley_radius`` is each radius that is not
        stated."""
        stated = self.plain["rig"] if isinstance(self.plain["rig"], Mapping) else {}
        radii = " ".join(name for name in ("head_radius", "tail_radius") if stated.get(name) is None)
        if not radii and any(a.key == "rig.pulley_radius" for a in self.axes):
            remedy = "head_radius and tail_radius are stated, so that this changes nothing: let those vary"
            raise InputError("rig.pulley_radius", stated["pulley_radius"], "m", remedy)
        return tuple(a.key.replace("rig.pulley_radius", f"rig.{radii}") for a in self.axes)

    def models(self, model: Any, values: np.ndarray) -> np.ndarray:
        """The name of the model of every case: where none is stated, by its belt, its machine and its tension."""
        if states_model(model):
            return np.full(len(values), model_of(model).name)
        ids, found = [e.id for e in self.effects], np.full(len(values), "strip_lift_off")
        machine = [k for k, key in enumerate(self.keys) if key.partition(".")[0] in SWEPT_GROUPS]
        tension = np.full(len(values), self.case.settings.tension)
        tension = values[:, self.keys.index("tension")] if "tension" in self.keys else tension
        kinds, kind = np.unique(values[:, machine], axis=0, return_inverse=True)
        for k, own in enumerate(kinds):
            one = place_values(self.case, (), [self.keys[m] for m in machine], own)[0]

            def is_strip(t: float, one: Case = one) -> bool:
                tight = replace(one, settings=replace(one.settings, tension=t))
                return model_of(model, [tight], ids).name == "strip"

            rows = kind.ravel() == k
            tensions = np.unique(tension[rows])
            first = bisect_left(tensions, True, key=is_strip)  # the tighter the belt, the less it lifts off
            if first < len(tensions):
                found[rows & (tension >= tensions[first])] = "strip"
        return found

    @cached_property
    def corners(self) -> set[tuple[float, ...]]:
        """The points at the ends of all axes of the rig, and of each other axis by itself, checked as a case and its
        effects are."""
        ends = [(float(a.values.min()), float(a.values.max())) for a in self.axes]
        first = tuple(float(a.values[0]) for a in self.axes)
        of_rig = [ends[k] if key.startswith("rig.") else (first[k],) for k, key in enumerate(self.keys)]  # may overlap
        found = {first, *product(*of_rig)}
        found |= {(*first[:k], end, *first[k + 1 :]) for k, both in enumerate(ends) for end in both}
        for corner in sorted(found):
            checked = copy.deepcopy(dict(self.plain)) | {"travel": self.plain["travel"] or 1.0}
            for axis, value in zip(self.axes, corner, strict=True):
                group, _, name = axis.key.rpartition(".")
                if group in ("", *SWEPT_GROUPS):
                    (checked[group] if group else checked)[name] = value
                for e in self.effects:
                    if e.id in group.split():
                        check_numbers(type(e), {name: value})
            case_from(checked)
        return found

    def placed(self, point: Sequence[float]) -> tuple[Case, tuple[Effect, ...]]:
        """The case and the effects at a point (axes,), in the units of the axes."""
        return place_values(self.case, self.effects, self.keys, np.array(point) * [a.unit for a in self.axes])

    def beyond(self, table: pd.DataFrame, model: Any) -> list[str]:
        """A sentence for each limit that cases are used beyond, and that rows have left.

        Asked are the corners and ``CASES_ASKED`` rows at random, as they are and with all axes but one at an end: a
        limit is left farthest where most numbers are extreme, or in the middle of one axis, as slip is near 20 N/mm2.
        """
        lots = np.random.default_rng(0)
        points = table[[a.column for a in self.axes]].to_numpy()
        asked = points[lots.choice(len(points), min(CASES_ASKED, len(points)), replace=False)]
        ends = np.where(lots.random(asked.shape) < 0.5, points.min(axis=0), points.max(axis=0))
        ends = np.where(np.arange(asked.shape[1]) == lots.integers(asked.shape[1], size=(len(asked), 1)), asked, ends)
        found = {*self.corners, *map(tuple, [*asked.tolist(), *ends.tolist()])}
        said, ids, travel = dict[str, tuple[float, str]](), [e.id for e in self.effects], self.plain["travel"]
        for point in sorted(found):
            case, effects = self.placed(point)
            one = model_of(model, [case], ids)
            limits = validity_limits(case, one, ids)
            with suppress(InputError):  # of ends together that leave no tension
                if isinstance(one, AnalyticModel):  # of closed forms, too: as simulate and export say it
                    limits = limits_of_run(case, one, effects, travel or 60.0)
            for limit in (x for x in limits if x.load > said.get(x.id, (0.0, ""))[0]):
                said[limit.id] = limit.load, f"{warning(one.name, [limit])} (at the worst of what varies)"

        width, face = table.get("belt_width", float(self.case.belt.width)), self.case.rig.face_width
        half = 1e3 * (width / 2.0 if face is None else np.maximum((face - width) / 2.0, 1e-3))
        left: list[str] = []
        kinds: Any = (
            ("slackest_edge_n_per_mm2", lambda x: x < 0.0, "a belt edge goes slack"),
            ("largest_y_mm", lambda x: ~(x <= half), "the belt leaves its pulleys"),
        )
        for name, there, words in kinds:
            if name in table and (n := int(there(table[name]).sum())):
                left.append(f"in {n} of {len(table)} cases {words}, effects included")
        return [sentence for _, sentence in sorted(said.values(), reverse=True)] + left

    def marches(self, model: Any, at: Any) -> tuple[Sequence[str], Callable[[np.ndarray], Any]]:
        """Names of columns, and the function from values (cases, axes) [SI] to them, (cases, columns), by marches side
        by side; raises InputError."""
        travel = self.plain["travel"]
        chosen: Any = fitted_model(model, curves=travel is not None)
        if not isinstance(chosen, AnalyticModel):
            raise InputError("travel", "null", "m", f"a table of {chosen.name} needs a travel; write travel=60")
        if getattr(chosen, "keep", KEEP) != KEEP:
            raise InputError("model.keep", chosen.keep, "m", "a table keeps no curves; leave it out")
        chosen.admit(self.effects) if self.effects else None
        for e in self.effects:
            if travel is None:
                raise InputError("effects", e.id, "", "closed forms read no effects; give a travel in m")
            if any(uses((e,), hook) for hook in ("encoder", *AFTER_ENGINE)):
                raise InputError("effects", e.id, "", "acts on what is read; a sweep tells of the belt's own movement")
        corners = [self.placed(point)[0] for point in sorted(self.corners)]
        columns, places, plan = sweep_columns(None), tuple[float, ...](), (0, 0, 0)
        if travel is not None:
            plans = [plan_steps(c, travel=travel, step=chosen.step, keep=KEEP) for c in corners]
            for c in corners:
                refuse_short_waves(c, self.effects, chosen.step)
            plan = (*plans[0][:2], max(p[2] for p in plans))
            if at is not None and (not np.iterable(at) or isinstance(at, str)):
                raise InputError("at", at, "m", "give a list of travels, e.g. at=[1,10]")
            remedy = f"give travels from 0 to {travel:g}"
            asked = [s for s in READ_AT if s <= travel] if at is None else at
            places = tuple(finite("at", s, "m", remedy, lambda x: 0 <= x <= travel) for s in asked)
            travel, columns = float(travel), sweep_columns(travel, places)[: -1 if self.effects else None]
        how: dict[str, Any] = {"model": chosen, "keys": self.keys, "travel": travel, "at": places, "plan": plan}
        return columns, partial(_rows, self.case, self.effects, **how)  # in the order of its rows

    def runs(self, model: Any, values: np.ndarray) -> list[list[float]]:
        """RUN_COLUMNS of runs one after another, of models that are no march."""
        rows = []
        for own in values:
            case, effects = place_values(self.case, self.effects, self.keys, own)
            found = simulate(case, model=model, effects=effects, travel=self.plain["travel"])
            offsets = np.array(found.offsets or (np.nan, np.nan)) / MM
            rows.append([*found.rates / MM_PER_M, *offsets, found.is_settled])
        return rows


def sweep_axes(config: Mapping[str, Any]) -> tuple[tuple[Axis, ...], dict[str, Any]]:
    """The axes of a sweep, and the configuration with the first value of each in its place (of an effect, the last)."""
    plain = copy.deepcopy(dict(config))
    axes: list[Axis] = []
    stated = [(key, plain, key) for key in SWEPT_SETTINGS]
    for group, names in SWEPT_GROUPS.items():
        if isinstance(plain[group], Mapping):
            stated += [(f"{group}.{name}", plain[group], name) for name in names]
    for key, owner, name in stated:
        if axis := _axis(key, owner.get(name)):
            axes.append(axis)
            owner[name] = float(axis.values[0])
    effects = plain["effects"] if isinstance(plain.get("effects"), list) else []
    for entry in (e for e in effects if isinstance(e, dict)):
        ids = " ".join(load_classes([entry]))  # of a file, all that it holds
        for name, spec in entry.items():
            if axis := _axis(f"{ids}.{name}", spec):
                axes.append(axis)
                entry[name] = float(axis.values[-1]) or float(axis.values[0])
    return tuple(axes), plain


def _axis(key: str, spec: Any) -> Axis | None:
    """The axis that ``spec`` means; None for a number that does not vary, and for a schedule of yaw."""
    spec = np.asarray(spec).tolist() if getattr(spec, "ndim", 0) else spec
    if isinstance(spec, Mapping) and not {"from", "to", "count"} & set(spec):
        return None  # an adjustment {dx, d}
    told = SWEPT_SETTINGS.get(key, (re.sub(r"\W", "_", key), 1.0))
    if not isinstance(spec, Mapping):
        if not isinstance(spec, Sequence) or isinstance(spec, str) or any(isinstance(x, Mapping) for x in spec):
            return None
        if not spec:
            raise InputError(key, "[]", "", "give at least one value")
        return Axis(key, np.array([finite(key, x) for x in spec]), *told)
    if not {"from", "to"} <= set(spec) <= {"from", "to", "count", "spacing"} or "count" not in spec:
        raise InputError(key, dict(spec), "", "write {from: low, to: high, count: how many, spacing: even or ratio}")
    low, high = finite(f"{key}.from", spec["from"]), finite(f"{key}.to", spec["to"])
    count = whole(f"{key}.count", spec["count"], most=MOST_SWEPT_CASES)
    spacing = spec.get("spacing", "even")
    if spacing not in SPACINGS:
        raise InputError(f"{key}.spacing", spacing, "", f"use one of {', '.join(SPACINGS)}")
    if spacing == "ratio" and not low * high > 0:
        raise InputError(f"{key}.from", low, "", "spacing by ratio needs both ends above 0, or both below")
    return Axis(key, (np.geomspace if spacing == "ratio" else np.linspace)(low, high, count), *told)


def place_values(
    case: Case, effects: tuple[Effect, ...], keys: Sequence[str], values: Any
) -> tuple[Case, tuple[Effect, ...]]:
    """``case`` and ``effects`` with ``values`` [SI], shape (axes,), in place of what ``keys`` name ("rig.gravity",
    "rig.head_radius tail_radius", "taper.kappa_t"); may be traced."""
    for key, value in zip(keys, values, strict=True):
        owner, _, names = key.partition(".")
        if key in SWEPT_SETTINGS:
            now = getattr(case.settings, key)
            new = replace(now, change=value[None]) if key.startswith("yaw") else now * 0.0 + value
            case = replace(case, settings=replace(case.settings, **{key: new}))
        elif owner in SWEPT_GROUPS:
            case = replace(case, **{owner: replace(getattr(case, owner), **dict.fromkeys(names.split(), value))})
        else:
            effects = tuple(replace(e, **{names: value}) if e.id in owner.split() else e for e in effects)
    return case, effects


def sweep_columns(travel: float | None, at: Sequence[float] | None = None) -> tuple[str, ...]:
    """Names of what a sweep over ``travel`` [m] may tell, with positions ``at`` these [m]; the steady rate last."""
    names: tuple[str, ...] = ()
    if travel is not None:
        names += tuple(f"rate{k}_mm_per_m" for k in POINT_NUMBERS)
        names += tuple(f"y{k}_mm_at_{s:g}_m" for s in (READ_AT if at is None else at) for k in POINT_NUMBERS)
        names += ("offset_upper_mm", "offset_lower_mm", "overshoot1_mm", "retreat1_mm", "slackest_edge_n_per_mm2")
        names += ("largest_y_mm", "settled")
    return (*names, "steady_rate_mm_per_m")


@partial(jit_float64, static_argnames=("model", "keys", "travel", "at", "plan"))
def _rows(
    case: Case, effects: tuple[Effect, ...], values: Any, *, model: AnalyticModel, keys: tuple[str, ...],
    travel: float | None, at: tuple[float, ...], plan: tuple[int, int, int],
) -> Any:  # fmt: skip
    """A row a case: late rates, positions, offsets, overshoot and retreat of point 1, slackest edge, largest y, steady
    rate (of no effects), as people write them.

    keys: names of what varies; travel [m], None for closed forms alone; at [m]: travels at which positions are told;
    plan: records, steps a record, slots of the wrap (march.plan_steps).
    """

    def row(own: Any) -> Any:
        one, acting = place_values(case, effects, keys, own)
        told: list[Any] = []
        if travel is not None:
            curves = march_traced(one, acting, travel, model=model, plan=plan)
            s, y = np.linspace(0.0, travel, plan[0] + 1), jnp.asarray(curves.y) / MM
            unit, early = np.eye(len(s)), settled_before(s)  # rates and positions are sums over records
            slopes = late_rates(Curves(travel=s, y=unit))
            before = late_rates(Curves(travel=s[:early], y=unit[:, :early]), SHARE_BEFORE) if early > 2 else None
            weights = np.array([[np.interp(x, s, one) for one in unit] for x in at]).reshape(-1, len(s))
            rates, end, late = y @ slopes, y[:, -1], late_records(s)
            line = y[0, late].mean() + rates[0] * (s - s[late].mean())
            away = jnp.where(end[0] < 0, -1.0, 1.0)
            out, overshoot = y[0] * away, jnp.maximum(jnp.max((y[0] - line) * away), 0.0)
            retreat = jnp.max(jax.lax.cummax(out) - out)
            edge = jnp.min(jnp.asarray(curves.edge_stress)) / N_PER_MM2
            offset = jnp.stack([end[0] - end[3], end[2] - end[1]])
            both = rates if before is None else jnp.concatenate([rates, y @ before])
            is_settled = 0.0 if before is None else 1.0 * agree(both * MM_PER_M)
            largest = jnp.max(jnp.abs(y))
            told += [rates, (weights @ y.T).ravel(), offset, jnp.stack([overshoot, retreat, edge, largest, is_settled])]
        if not effects:
            told.append(steady_traced(one, model)[None] / MM_PER_M)
        return jnp.concatenate(told)

    return jax.vmap(row)(values)
