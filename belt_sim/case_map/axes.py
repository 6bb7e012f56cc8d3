"""What varies over a map (numbers of the machine, the belt, its settings and its effects), and where its cases lie."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.case import Case
from belt_sim.effects.base import Effect
from belt_sim.errors import InputError, finite, whole

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
_KEYS = {"from", "to", "count", "spacing"}


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
        """Name of its column in the table."""
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
    plain: dict[str, Any] = {**config, **{group: dict(config[group]) for group in GROUPS}}
    axes: list[Axis] = []
    stated = [(key, plain, key) for key in SETTINGS]
    stated += [(f"{group}.{name}", plain[group], name) for group, names in GROUPS.items() for name in names]
    for key, owner, name in stated:
        if axis := _axis(key, owner.get(name), sampled):
            axes.append(axis)
            owner[name] = float(axis.values[0])
    if isinstance(config["effects"], Sequence) and not isinstance(config["effects"], str):
        plain["effects"] = [dict(entry) if isinstance(entry, Mapping) else entry for entry in config["effects"]]
        for entry in plain["effects"]:
            for name, spec in entry.items() if isinstance(entry, dict) else ():
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
    if not {"from", "to"} <= set(spec) <= _KEYS or not (sampled or "count" in spec):
        raise InputError(key, dict(spec), "", "write {from: low, to: high, count: how many, spacing: even or ratio}")
    low, high = finite(f"{key}.from", spec["from"]), finite(f"{key}.to", spec["to"])
    count, spacing = spec.get("count", 2), spec.get("spacing", "even")
    whole(f"{key}.count", count)
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
            case = replace(case, settings=replace(case.settings, **{key: _setting(case, key, value)}))
        elif key == "rig.pulley_radius":
            case = replace(case, rig=replace(case.rig, head_radius=value, tail_radius=value))
        elif owner in GROUPS:
            case = replace(case, **{owner: replace(getattr(case, owner), **{name: value})})
        else:
            effects = tuple(replace(e, **{name: value}) if e.id == owner else e for e in effects)
    return case, effects


def _setting(case: Case, key: str, value: Any) -> Any:
    """A number, or for yaw the step to it at travel 0."""
    now = getattr(case.settings, key)
    return replace(now, change=value[None]) if key.startswith("yaw") else now * 0.0 + value


@dataclass(frozen=True, kw_only=True)
class CasePlan:
    """The cases of a map. axes: what varies; cases: how many of them, spread over the box of the axes by Sobol's
    sequence (scrambled by ``seed``), None for the grid of all values, the last axis running fastest."""

    axes: tuple[Axis, ...]
    cases: int | None = None
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of each axis of a grid."""
        return tuple(len(a.values) for a in self.axes)

    @property
    def count(self) -> int:
        """Cases in all."""
        return int(np.prod(self.shape, dtype=object)) if self.cases is None else self.cases

    def stretch(self, start: int, stop: int) -> np.ndarray:
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
