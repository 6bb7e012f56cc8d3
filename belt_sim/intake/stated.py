"""How each run was set: by the mapping, by columns, by a table of runs, or by the name of its file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from belt_sim.campaign import plausible
from belt_sim.errors import InputError
from belt_sim.intake.mapping import MappingEntry, RunEntry
from belt_sim.intake.nouns import LoggedTable
from belt_sim.intake.proposal import Question
from belt_sim.intake.roles import Used
from belt_sim.intake.split import Block, run_name
from belt_sim.intake.units import UNITS, quantity
from belt_sim.intake.words import settings_in

#: setting -> dimensions of its unit, unit when none is written, range
KINDS: dict[str, tuple[tuple[str, ...], str, plausible.Range]] = {
    "tension": (("stress", "force"), "N/mm2", plausible.TENSION),
    "yaw": (("angle",), "deg", plausible.YAW),
    "yaw_head": (("angle",), "deg", plausible.YAW),
    "speed": (("speed",), "m/s", plausible.SPEED),
    "direction": (("number",), "1", plausible.DIRECTION),
    "yaw_at": (("length",), "m", plausible.TRAVEL),
    "yaw_at_u": (("length",), "m", plausible.YAW_AT_U),
    "yaw_at_time": (("time",), "s", plausible.TIME),
}
#: A yaw that moves by less than this share of its largest value stands still.
STILL = 0.05
#: Digits that a logged setting is rounded to.
DIGITS = 4


@dataclass(frozen=True, kw_only=True)
class Settings:
    """numbers [SI] by the name of the setting; written: as they go into the mapping; told: where each comes from."""

    numbers: dict[str, float] = field(default_factory=dict)
    written: dict[str, str] = field(default_factory=dict)
    told: dict[str, str] = field(default_factory=dict)

    def with_(self, key: str, value: float, written: str, told: str) -> "Settings":
        if key in self.numbers:
            return self
        return Settings(
            numbers=self.numbers | {key: value}, written=self.written | {key: written}, told=self.told | {key: told}
        )


def from_entry(entry: RunEntry, where: str, section: float | None, so_far: Settings) -> Settings:
    """Settings that the mapping states; section [m2]: of the belt, for a tension given as a force."""
    for key in KINDS:
        text = getattr(entry, key)
        if text is not None:
            so_far = so_far.with_(key, number(text, key, f"{where}.{key}", section), text, "the mapping")
    return so_far


def from_name(text: str, section: float | None, so_far: Settings) -> Settings:
    """Settings that the name of a file or run speaks of."""
    for key, written in settings_in(text).items():
        so_far = so_far.with_(key, number(written, key, key, section), written, f"the name {text}")
    return so_far


def number(text: str, key: str, where: str, section: float | None) -> float:
    """A setting [SI]; raises InputError for what cannot be."""
    kinds, default, bounds = KINDS[key]
    value, _, unit = quantity(text, kinds, default, where)
    dimension, scale = UNITS[unit]
    if dimension == "force":
        return stress(value * scale, section, where)
    si = value * scale
    if not bounds.holds(si):
        shown = bounds.unit or "1"
        remedy = f"must be {bounds.low:g} to {bounds.high:g} {shown}; check the value and its unit"
        raise InputError(where, f"{value:g}", unit if unit != "1" else "", remedy)
    if key == "direction" and abs(si) != 1.0:
        raise InputError(where, f"{value:g}", "", "must be 1 (upper span runs from head to tail) or -1")
    return si


def stress(force: float, section: float | None, where: str) -> float:
    """Tension [Pa] of a force [N] in one strand."""
    if not section:
        raise InputError(where, f"{force:g}", "N", "a force needs the belt's width and thickness; state belt")
    return force / section


def of_tables(tables: list[tuple[LoggedTable, tuple[Used, ...]]], section: float | None) -> dict[str, dict[str, float]]:
    """Run -> settings [SI] that tables of runs state."""
    found: dict[str, dict[str, float]] = {}
    for table, used in tables:
        run = next((u for u in used if u.role == "run"), None)
        labels = [f"r{k}" for k in range(1, len(table.lines) + 1)] if run is None else _labels(run)
        for row, label in enumerate(labels):
            own = found.setdefault(run_name(label), {})
            for u in used:
                if u.role in KINDS:
                    value = float(u.si(np.array([row]))[0])
                    if np.isfinite(value):
                        own[u.role] = stress(value, section, u.column.name) if UNITS[u.unit][0] == "force" else value
    return found


def _labels(run: Used) -> list[str]:
    return [f"{v:.15g}" if isinstance(v, float) else str(v).strip() for v in run.column.values.tolist()]


def from_columns(
    block: Block, keep: np.ndarray, travel: np.ndarray, section: float | None, so_far: Settings
) -> Settings:
    """Settings that columns of the record itself hold: the mean tension, and the yaw with the place of its step."""
    for key in ("yaw", "yaw_head"):
        values = block.values(key)
        if values is not None and np.isfinite(values[keep]).any():
            level, at = _step(block, key, values[keep], keep, key in so_far.numbers)
            so_far = so_far.with_(key, _round(level), f"{_round(level / UNITS['deg'][1]):g} deg", "its column")
            if at and "yaw_at" not in so_far.numbers and "yaw_at_time" not in so_far.numbers:
                where, apart = 0.5 * (travel[at - 1] + travel[at]), travel[at] - travel[at - 1]
                told = f"the step of {key}, somewhere within {apart:.2g} m"
                so_far = so_far.with_("yaw_at", where, f"{where:.6g} m", told)
                u = _round(apart / np.sqrt(12.0))  # anywhere between two rows
                so_far = so_far.with_("yaw_at_u", u, f"{u:g} m", told)
    values = block.values("tension")
    if values is not None and np.isfinite(values[keep]).any():
        mean = float(np.nanmean(values[keep]))
        force = next(UNITS[u.unit][0] == "force" for u in block.used if u.role == "tension")
        mean = _round(stress(mean, section, "tension") if force else mean)
        so_far = so_far.with_("tension", mean, f"{mean / 1e6:g} N/mm2", "the mean of its column")
    direction = block.values("direction")
    if direction is not None and np.isfinite(direction[keep]).any():
        sign = float(np.sign(np.nanmedian(direction[keep]))) or 1.0
        so_far = so_far.with_("direction", sign, f"{sign:g}", "its column")
    return so_far


def _step(block: Block, key: str, values: np.ndarray, keep: np.ndarray, told: bool) -> tuple[float, int]:
    """Level of a yaw after its step, and the row of the step (0: it stood there from the beginning)."""
    there = np.flatnonzero(np.isfinite(values))
    y = values[there]
    ends = max(1, len(y) // 50)
    before, after = float(np.median(y[:ends])), float(np.median(y[-ends:]))
    change = after - before
    if abs(change) <= STILL * np.abs(y).max():
        return float(np.median(y)), 0
    beyond = (y - before) / change > 0.5
    at = int(np.argmax(beyond))
    if not told and np.mean(beyond[at:]) < 0.98:
        again = at + int(np.argmin(beyond[at:]))
        remedy = "the yaw moves more than once; cut the record into runs, one yaw step each"
        raise block.refuse(int(keep[there[again]]), key, float(y[again] / UNITS["deg"][1]), "deg", remedy)
    if not told and abs(before) > STILL * abs(after):
        given = f"runs: {{{block.name}: {{{key}: ...}}}}"
        remedy = f"the yaw is not zero before its step; begin a run at zero yaw, or state {given}"
        raise block.refuse(int(keep[there[0]]), key, float(before / UNITS["deg"][1]), "deg", remedy)
    return after, int(there[at])


def _round(x: float) -> float:
    return float(f"{x:.{DIGITS}g}")


def questions(name: str, settings: Mapping[str, Any], file: str) -> list[Question]:
    """What is still not known of a run."""
    found = []
    if "tension" not in settings:
        found.append(
            Question(
                path=("runs", name, "tension"),
                text=f"at which tension was run {name} ({file})?",
                example="10 N/mm2",
            )
        )
    if "yaw" not in settings:
        found.append(
            Question(
                path=("runs", name, "yaw"),
                text=f"to which yaw was the tail pulley turned in run {name} ({file}; 0 for a run without yaw)?",
                example="-0.042 deg",
            )
        )
    return found


def unknown_runs(mapping: MappingEntry, names: list[str]) -> None:
    """Raises InputError for a run of the mapping that no file has."""
    from belt_sim.campaign.problems import did_you_mean

    for name in mapping.runs:
        if name not in names:
            raise InputError(f"runs.{name}", name, "", f"no file has such a run; {did_you_mean(name, names)}")
