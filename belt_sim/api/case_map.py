"""Map: many cases of an analytic model, a row each, streamed to disk."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.analytic.march import plan_steps
from belt_sim.analytic.model import AnalyticModel
from belt_sim.api.resolve import effects_of, fitted_model
from belt_sim.case import Case
from belt_sim.case_map.answers import Asked, answers, columns_of
from belt_sim.case_map.axes import Axis, Plan, axes_of, placed
from belt_sim.case_map.parts import SCHEMA, claim, missing, parquet, stream
from belt_sim.config import case_from, model_settings
from belt_sim.effects.base import AFTER_ENGINE, Effect, uses
from belt_sim.errors import InputError, whole
from belt_sim.inputs import code_hash, input_hashes
from belt_sim.jax_setup import cores
from belt_sim.provenance import config_hash

MOST = 10**9  # cases
PLACES = (1.0, 10.0)  # [m] of travel
#: settings that change where a map goes and how it is made, not what it says
_MANNER = ("out", "pictures", "workers", "show")


@dataclass(frozen=True, kw_only=True)
class CaseMap:
    """A map as it was asked for, checked, before any of it is made. config: as asked; part: cases a file."""

    config: Mapping[str, Any]
    plan: Plan
    case: Case
    effects: tuple[Effect, ...]
    asked: Asked
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
    plan = Plan(axes=axes, cases=cases, seed=whole("seed", config["seed"], least=0))
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
    asked = _asked(model, axes, plain, corners, bool(effects))
    if config["show"] not in (None, *columns_of(asked)):
        raise InputError("show", config["show"], "", f"use one of {', '.join(columns_of(asked))}")
    return CaseMap(
        config=config,
        plan=plan,
        case=case,
        effects=effects,
        asked=asked,
        part=whole("part", config["part"]),
        workers=cores() if config["workers"] is None else whole("workers", config["workers"]),
    )


def _corners(axes: Sequence[Axis], plain: Mapping[str, Any], case: Case, effects: tuple[Effect, ...]) -> list[Case]:
    """The cases at the ends of all axes, each checked as a case of its own is."""
    ends = [(float(a.values.min()), float(a.values.max())) for a in axes]
    keys = [a.key for a in axes]
    for corner in product(*ends):
        case_from({"travel": 1.0, **_written(plain, dict(zip(keys, corner, strict=True)))})
    units = [a.unit for a in axes]
    return [placed(case, effects, keys, np.array(c) * units)[0] for c in product(*ends)]


def _written(plain: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
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


def _asked(
    model: AnalyticModel, axes: Sequence[Axis], plain: Mapping[str, Any], corners: Sequence[Case], effects: bool
) -> Asked:
    travel = plain["travel"]
    plan = (0, 0, 0)
    if travel is not None:
        plans = [plan_steps(c, travel=travel, step=model.step, keep=model.keep) for c in corners]
        plan = (*plans[0][:2], max(p[2] for p in plans))
    return Asked(
        model=model,
        keys=tuple(a.key for a in axes),
        travel=None if travel is None else float(travel),
        at=() if travel is None else _places(plain["at"], float(travel)),
        plan=plan,
        steady=not effects,
    )


def _places(at: Any, travel: float) -> tuple[float, ...]:
    """Travels [m] at which positions are told."""
    if at is None:
        return tuple(s for s in PLACES if s <= travel)
    if not isinstance(at, Sequence) or isinstance(at, str):
        raise InputError("at", at, "m", "give a list of travels, e.g. at=[1,10]")
    for s in at:
        if isinstance(s, bool) or not isinstance(s, int | float) or not 0 <= s <= travel:
            raise InputError("at", s, "m", f"give travels from 0 to {travel:g}")
    return tuple(float(s) for s in at)


def write_map(folder: Path, made: CaseMap, provenance: Mapping[str, Any], told: Callable[[int], None]) -> int:
    """Stream to ``folder`` what is missing of the map; returns the number of cases that were made now.

    told: called with the number of cases after each part, those that were there already first.
    """
    parquet()
    count, size = made.plan.count, made.part
    note = {"schema": SCHEMA, "cases": count, "part": size, "columns": ["case", *made.columns]}
    note |= {"config": dict(made.config), "config_sha256": made.digest, "provenance": dict(provenance)}
    parts = claim(folder, note)
    left = sum(stop - start for _, start, stop in missing(parts, count, size))
    told(count - left)
    for number in stream(parts, count, size, made.stretch):
        told(number)
    return left
