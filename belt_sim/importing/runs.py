"""Runs with their settings: by the mapping, by columns, by a table of runs, or by the name of the file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from belt_sim.campaign import Run, plausible
from belt_sim.campaign.csv_tables import REPEAT_TOLERANCE
from belt_sim.campaign.types import SteadyRate
from belt_sim.errors import InputError
from belt_sim.importing.mapping import MappingEntry, RunEntry
from belt_sim.importing.roles import Used, settings_in
from belt_sim.importing.travel import FEWEST, Block, Track, Way, blocks_of, merged, run_name, way_of
from belt_sim.importing.types import LoggedTable, Question
from belt_sim.importing.units import UNITS, quantity
from belt_sim.si import DEGREE, N_PER_MM2

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


RATES = ("rate1", "rate2", "rate3", "rate4")


@dataclass(frozen=True, kw_only=True)
class Rated:
    """runs and their rates; names: of the runs in the mapping."""

    runs: tuple[Run, ...] = ()
    steady: tuple[SteadyRate, ...] = ()
    missing: list[Question] = field(default_factory=list)
    names: tuple[str, ...] = ()


def rates_of(tables: list[tuple[LoggedTable, tuple[Used, ...]]], mapping: MappingEntry, section: float | None) -> Rated:
    """Everything that tables of rates state."""
    runs: list[Run] = []
    steady: list[SteadyRate] = []
    missing: list[Question] = []
    keys: list[str] = []
    for table, used in tables:
        stated = of_tables([(table, used)], section)
        u, question = _spread(used)
        missing += [question] if question else []
        for row, key in enumerate(stated):
            entry = mapping.runs.get(key, RunEntry())
            settings = from_entry(entry, f"runs.{key}", section, Settings())
            for name, value in stated[key].items():
                settings = settings.with_(name, value, "", "its column")
            settings = from_entry(mapping.all_runs, "all_runs", section, settings)
            keys.append(key)
            missing += questions(key, settings.numbers, table.file.name)
            if entry.skip or {"tension", "yaw"} - set(settings.numbers):
                continue
            numbers = {k: v for k, v in settings.numbers.items() if k not in ("yaw_at", "yaw_at_u", "yaw_at_time")}
            name = entry.name or run_name(key)
            runs.append(Run(name=name, use=entry.use or "fit", **numbers))  # type: ignore[arg-type]
            rates = np.array([_one(used, rate, row) for rate in RATES])
            steady.append(SteadyRate(run=name, rates=rates, u=float(u[row]) if u is not None else 0.0))
    return Rated(runs=tuple(runs), steady=tuple(steady), missing=missing, names=tuple(keys))


def _one(used: tuple[Used, ...], role: str, row: int) -> float:
    found = next((u for u in used if u.role == role), None)
    return float("nan") if found is None else float(found.si(np.array([row]))[0])


def _spread(used: tuple[Used, ...]) -> tuple[np.ndarray | None, Question | None]:
    """One sigma [m/m] of the rates, row by row."""
    column = next((u for u in used if u.role == "u_rate"), None)
    if column is not None:
        return column.si(np.arange(len(column.column.values))), None
    rate = next(u for u in used if u.role in RATES)
    if rate.entry.white is not None:
        value, _, _ = quantity(rate.entry.white, ("angle",), "mm/m", f"columns.{rate.column.name}.white")
        return np.full(len(rate.column.values), value * 1e-3), None
    if rate.entry.axis is not None:
        (p0, p1), (v0, v1) = rate.entry.axis.pixel, rate.entry.axis.value
        u = abs((v1 - v0) / (p1 - p0)) * rate.entry.axis.u * rate.factor
        return np.full(len(rate.column.values), u), None
    return None, Question(
        path=("columns", rate.column.name, "white"),
        text="how well are the rates known (one sigma)?",
        example="0.002 mm/m",
    )


#: Logged settings within this share of each other are one setting, rounded to so many digits.
ALIKE, SHOWN_DIGITS = 0.01, 3
UNIT = {"tension": N_PER_MM2, "yaw": DEGREE, "yaw_head": DEGREE, "speed": 1.0}


def snapped(runs: list[Run], told: list[dict[str, str]]) -> list[Run]:
    """Runs with settings that were read off columns (told: setting -> where from) brought together."""
    for key, unit in UNIT.items():
        own = [k for k, t in enumerate(told) if "column" in t.get(key, "") or t.get(key) == "travel over time"]
        values = np.array([getattr(runs[k], key) for k in own])
        for k, value in zip(own, _alike(values), strict=True):
            change: dict[str, Any] = {key: _rounded(value / unit) * unit}
            runs = [*runs[:k], replace(runs[k], **change), *runs[k + 1 :]]
    return runs


def _alike(values: np.ndarray) -> np.ndarray:
    """Every value as the mean of those within ALIKE of its neighbours in size, its sign kept."""
    out, order = values.copy(), np.argsort(np.abs(values))
    start = 0
    for k in range(1, len(order) + 1):
        size = np.abs(values[order])
        if k == len(order) or size[k] - size[k - 1] > ALIKE * size[k]:
            group = order[start:k]
            out[group] = np.sign(values[group]) * np.mean(np.abs(values[group]))
            start = k
    return out


def _rounded(x: float) -> float:
    return float(f"{x:.{SHOWN_DIGITS}g}")


def with_repeats(runs: list[Run], stated: list[bool]) -> tuple[list[Run], list[Run]]:
    """Runs at one setting as repeats of the first, with its settings; those that were recognised."""
    out: list[Run] = []
    found: list[Run] = []
    for run, told in zip(runs, stated, strict=True):
        twin = next((f for f in out if not told and f.repeat_of is None and _same(f, run)), None)
        if twin is not None:
            run = replace(run, repeat_of=twin.name, tension=twin.tension, yaw=twin.yaw, yaw_head=twin.yaw_head)
            u = math.hypot(run.yaw_at_u, run.yaw_at - twin.yaw_at)  # taken to be where the first run's was
            run = replace(run, speed=twin.speed, yaw_at=twin.yaw_at, yaw_at_u=u)
            found.append(run)
        out.append(run)
    return out, found


def _same(a: Run, b: Run) -> bool:
    near = all(
        abs(getattr(a, k) - getattr(b, k)) <= 0.5 * REPEAT_TOLERANCE * abs(getattr(a, k))
        for k in ("tension", "yaw", "yaw_head", "speed")
    )
    return near and a.direction == b.direction and abs(a.yaw_at - b.yaw_at) <= 0.05 * max(a.yaw_at, 0.0)


@dataclass(frozen=True, kw_only=True)
class Made:
    """One run as far as it is known: key, its name in the mapping; entry: what the mapping says of it."""

    key: str
    entry: RunEntry
    track: Track
    settings: Settings
    file: str
    notes: tuple[str, ...]


def made_of(
    tables: list[tuple[LoggedTable, tuple[Used, ...]]], mapping: MappingEntry, section: float | None
) -> tuple[list[Made], list[Question], list[str]]:
    """Runs of all tables, questions, and all names that the mapping may speak of."""
    records = [(t, u) for t, u in tables if t.kind == "record"]
    listed = of_tables([(t, u) for t, u in tables if t.kind == "settings"], section)
    questions: list[Question] = []
    found: dict[str, list[Made]] = {}
    for table, used in records:
        for view in _views(table, used):
            for block in _blocks(table, *view, alone=len(records) == 1 and not listed):
                made = _made(block, mapping, listed, section)
                if made is None:
                    questions.append(_speed_question())
                elif not made.entry.skip:
                    found.setdefault(block.name, []).append(made)
    names = [*dict.fromkeys([*found, *mapping.runs])] if questions else [*found]
    return [_together(parts) for parts in found.values()], questions[:1], [*names, *listed]


def _views(table: LoggedTable, used: tuple[Used, ...]) -> list[tuple[tuple[Used, ...], str | None]]:
    """The columns of each run of a table whose columns belong to different runs, or have travels of their own."""
    own = [u for u in used if u.entry.run or u.entry.against]
    if not own:
        return [(used, None)]
    travels = {u.entry.against for u in own if u.entry.against}
    base = tuple(u for u in used if u not in own and u.column.name not in travels)
    found = []
    for u in own:
        along = table.column(u.entry.against) if u.entry.against else None
        if u.entry.against and along is None:
            raise InputError(f"columns.{u.column.name}.against", u.entry.against, "", "names no column of its file")
        shared = tuple(b for b in base if along is None or b.role not in ("time", "travel"))
        if along is not None:
            twin = next(v for v in used if v.column is along)
            shared = (*shared, twin)
        found.append(((*(b for b in shared if b.role != "signal"), u), u.entry.run))
    rest = tuple(b for b in base if b.role == "signal")
    return [*found, (base, None)] if rest else found


def _blocks(table: LoggedTable, used: tuple[Used, ...], run: str | None, *, alone: bool) -> list[Block]:
    if run is None:
        return blocks_of(table, used)
    rows = np.arange(len(table.lines))
    return [Block(table=table, used=used, rows=rows, name=run_name(run), text=run)]


def _made(
    block: Block, mapping: MappingEntry, listed: dict[str, dict[str, float]], section: float | None
) -> Made | None:
    entry = mapping.runs.get(block.name, RunEntry())
    settings = from_entry(entry, f"runs.{block.name}", section, Settings())
    for key, value in listed.get(block.name, {}).items():
        settings = settings.with_(key, value, _written(key, value), "the table of runs")
    given = from_entry(mapping.all_runs, "all_runs", section, settings)
    named = from_name(block.text, section, given)
    way = way_of(block, named.numbers.get("speed"))
    if way is None:
        return None
    if len(way.keep) < FEWEST:
        raise block.refuse(0, "rows", len(way.keep), "", f"run {block.name} has too few rows with time or travel")
    given = from_columns(block, way.keep, way.travel, section, given)
    given = from_name(block.text, section, given)
    given = _of_way(given, way)
    notes = (*way.notes, f"yaw_at is {given.told['yaw_at']}") if "yaw_at" in given.told else way.notes
    signals = {u.name: u.si(block.rows[way.keep]) for u in block.used if u.role == "signal"}
    signals = {n: y for n, y in signals.items() if np.isfinite(y).any()}
    track = Track(name=block.name, travel=way.travel, time=way.time, signals=signals)
    file = block.table.file.name
    return Made(key=block.name, entry=entry, track=track, settings=given, file=file, notes=notes)


def _of_way(settings: Settings, way: Way) -> Settings:
    if way.direction < 0.0:
        settings = settings.with_("direction", -1.0, "-1", "the sign of travel or speed")
    if way.speed > 0.0:
        speed = float(f"{way.speed:.4g}")
        settings = settings.with_("speed", speed, f"{speed:g} m/s", "travel over time")
    at = settings.numbers.get("yaw_at_time")
    if at is not None and way.time is not None:
        where = float(np.interp(at, way.time, way.travel))
        settings = settings.with_("yaw_at", where, f"{where:.6g} m", "the time of the yaw")
    return settings


def _written(key: str, value: float) -> str:
    unit, scale = {
        "tension": ("N/mm2", 1e6),
        "yaw": ("deg", np.pi / 180.0),
        "yaw_head": ("deg", np.pi / 180.0),
        "speed": ("m/s", 1.0),
        "yaw_at": ("m", 1.0),
        "yaw_at_u": ("m", 1.0),
    }.get(key, ("", 1.0))
    return f"{value / scale:.6g} {unit}".strip()


def _together(parts: list[Made]) -> Made:
    """One run from several files: its records on all their travels; settings of the first that has them."""
    if len(parts) == 1:
        return parts[0]
    settings = parts[0].settings
    for other in parts[1:]:
        for key, value in other.settings.numbers.items():
            settings = settings.with_(key, value, other.settings.written[key], other.settings.told[key])
    notes = tuple(dict.fromkeys(n for p in parts for n in p.notes))
    files = ", ".join(dict.fromkeys(p.file for p in parts))
    return replace(parts[0], track=merged([p.track for p in parts]), settings=settings, notes=notes, file=files)


def _speed_question() -> Question:
    return Question(
        path=("all_runs", "speed"),
        text="the files have time but neither travel nor speed; how fast did the belt run?",
        example="0.5 m/s",
    )


__all__ = ["KINDS", "Made", "made_of"]
