"""What a column seems to be: its role, unit and place, proposed by its name, its unit and its numbers."""

import re
import unicodedata
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml

from belt_sim.importing.columns import Column, LoggedTable, rises
from belt_sim.importing.mapping import ROLES, TILT, Role
from belt_sim.importing.units import UNITS, split_unit

DAY = 86400.0  # [s]
#: Rows of a record are closer in time than this [s]; runs of a table are not.
SPARSE = 60.0
#: Columns that a table has once.
ONCE = ("run", "time", "travel", "speed", "tension", "yaw", "yaw_head", "direction", "yaw_at", "start", "u_rate")
_NUMBERED = re.compile(
    r"^(?:y|kante|edge|bandkante|lateral|pos|position|point|punkt|ablage|sensor|laser|p)[ _]*([1-4])\b"
)
#: What tells a second column of one name from the first.
_COUNT = re.compile(r" \((?:[a-z]|no \d+)\)$")
#: Where a header states its unit.
_STATED = re.compile(r"\[\s*([^\]]+?)\s*\]|\(\s*(\S{2,8}|[A-Z])\s*\)|(?:\s+in\s+|\s*/\s*)(\S{1,8})$")
_RATE = re.compile(r"^(?:rate|drift|driftrate|laufrate)[ _]*([1-4])?$")


# ---- names


@cache
def synonyms() -> dict[str, dict[str, list[str]]]:
    """What people call roles, places and directions, and what they remark."""
    found: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("synonyms.yaml").read_text(encoding="utf-8"))
    return found


def plain(name: str) -> str:
    """A name in lower case, umlauts written out, words apart, all but letters and digits blank."""
    name = re.sub(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ][a-zäöü])", " ", name).lower()
    for mark, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss")):
        name = name.replace(mark, letters)
    name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return " ".join(re.sub(r"[^a-z0-9]+", " ", name).split())


def role_named(name: str) -> str:
    """The role that a column's name speaks of; "" where it says nothing."""
    words = plain(name)
    rate = _RATE.match(words)
    if rate:
        return f"rate{rate.group(1) or 1}"
    if _NUMBERED.match(words) or re.fullmatch(r"y[ _]?\w?", words):
        return "signal"
    spoken = {known: role for role, names in synonyms()["roles"].items() for known in names if _speaks_of(words, known)}
    return spoken[max(spoken, key=len)] if spoken else ""


def _speaks_of(words: str, known: str) -> bool:
    """Whether words hold a known name: as a word of its own, or, if it is long, as a part of one."""
    return bool(re.search(rf"(?:^| ){re.escape(known)}(?: |\d|$)", words)) or (len(known) > 4 and known in words)


def place_named(name: str) -> str:
    """The place that a signal's name speaks of; "" where it says none, or not enough."""
    words = plain(name)
    says = {part: any(w in words for w in names) for part, names in synonyms()["places"].items()}
    if says["tilt"]:
        return "lower_mid_span" if says["lower"] else "upper_mid_span"
    numbered = _NUMBERED.match(words)
    if numbered:
        return f"point_{numbered.group(1)}"
    if says["tail"] != says["head"] and says["upper"] != says["lower"]:
        return f"point_{(1 if says['upper'] else 2) if says['tail'] else (4 if says['upper'] else 3)}"
    return ""


# ---- proposals


def propose_roles(table: LoggedTable) -> LoggedTable:
    """The table with a role, a unit and a place proposed for every column, and its kind."""
    columns = _join_dates([_propose(column) for column in table.columns])
    for role in ONCE:
        same = [k for k, c in enumerate(columns) if c.role == role]
        keep = max(same, key=lambda k: (not columns[k].is_text, columns[k].is_certain, -k), default=None)
        for k in same:
            if k != keep:
                columns[k] = replace(columns[k], role="ignore", unit="", proposed_by=f"another column is the {role}")
    if not any(c.role in ("time", "travel") for c in columns):
        rising = next((k for k, c in enumerate(columns) if c.role == "" and rises(c)), None)
        if rising is not None:
            columns[rising] = replace(columns[rising], proposed_by="it rises throughout: time or travel?")
    return replace(table, columns=tuple(columns), kind=_kind(columns))


def _propose(column: Column) -> Column:
    """Role by the name and the unit; unit by the name or by magnitude."""
    header = _COUNT.sub("", column.name)
    name, unit = split_unit(header)
    unit = column.unit or unit or _other_unit(header)
    column, unit = replace(column, unit="", stated_unit=unit), unit if unit in UNITS else ""
    role = role_named(name)
    if column.is_text:
        return _propose_text(column, role)
    if not np.isfinite(column.values).any():
        return replace(column, role="ignore", unit="", proposed_by="holds no numbers")
    fits = bool(role) and (not ROLES[role].dimensions or UNITS[unit][0] in ROLES[role].dimensions)
    if unit and not fits:
        role = _role_by_unit(unit, name)
    if not role:
        return replace(column, role="", unit=unit, proposed_by="nothing is known of it")
    at = place_named(name) if role == "signal" else ""
    is_certain, why = bool(unit), "its name"
    if column.stated_unit and not unit:
        why = f"its name; its unit {column.stated_unit} is not known"
    elif role.startswith(("rate", "u_rate")):
        unit = unit or "mm/m"
    elif ROLES[role].units and not unit:
        is_tilt = role == "signal" and any(w in plain(name) for w in synonyms()["places"]["tilt"])
        unit, guess = _unit_by_size(column, TILT if is_tilt else ROLES[role])
        why = f"its name; {guess}"
    return replace(column, role=role, unit=unit, at=at, is_certain=is_certain, proposed_by=why)


def _other_unit(header: str) -> str:
    """What a header states in the place of a unit, as [V], (kgf) or in furlongs; "" where it states nothing."""
    groups = (synonyms()[group].values() for group in ("roles", "places", "remarks"))
    words = [word for group in groups for names in group for word in names if len(word) > 1]
    for found in _STATED.finditer(header):
        text = next(part for part in found.groups() if part)
        if re.search(r"[^\W\d_]|[%‰°]", text) and not any(_speaks_of(plain(text), word) for word in words):
            return text
    return ""


def _propose_text(column: Column, role: str) -> Column:
    """Words are names of runs or directions, or of no use."""
    signs = _directions(column.values) if role == "direction" else None
    if signs is not None:
        return replace(column, values=signs, role=role, unit="1", is_certain=True, proposed_by="its name and words")
    return replace(column, role="run" if role == "run" else "ignore", unit="", proposed_by="text")


def _role_by_unit(unit: str, name: str) -> str:
    """The role of a column whose name says nothing, or nothing that has this unit; "" where the unit tells none."""
    dimension = UNITS[unit][0]
    if dimension == "length" and place_named(name):
        return "signal"
    return {"time": "time", "speed": "speed", "stress": "tension", "force": "tension"}.get(dimension, "")


def _directions(values: np.ndarray) -> np.ndarray | None:
    """1 and -1 of words as forward and reverse, nan where blank; None where a word is neither."""
    known = synonyms()["directions"]
    signs = {"": np.nan} | dict.fromkeys(known["forward"], 1.0) | dict.fromkeys(known["reverse"], -1.0)
    words = [plain(v) for v in values]
    if not any(words) or not signs.keys() >= {*words}:
        return None
    return np.array([signs[w] for w in words])


def _join_dates(columns: list[Column]) -> list[Column]:
    """A column of dates and one of times of day as one time, so that a night does not begin a new run."""
    times = [k for k, c in enumerate(columns) if c.role == "time" and not c.is_text]
    there = {k: columns[k].values[np.isfinite(columns[k].values)] for k in times}
    dates = [k for k, s in there.items() if len(s) and np.all((s > DAY) & (s % DAY == 0.0))]
    clocks = [k for k in times if k not in dates and np.nanmax(columns[k].values) < DAY]
    if not dates or not clocks:
        return columns
    date, clock = columns[dates[0]], columns[clocks[0]]
    columns[dates[0]] = replace(date, role="ignore", unit="", proposed_by=f"in {clock.name} with the time of day")
    columns[clocks[0]] = replace(clock, values=date.values + clock.values, proposed_by=f"its name, with {date.name}")
    return columns


def _unit_by_size(column: Column, role: Role) -> tuple[str, str]:
    """The first unit in which the numbers are what a machine has, and that in words."""
    values = column.values[np.isfinite(column.values)]
    size = float(np.ptp(values)) if role.by_range else float(np.abs(values).max())
    if role is ROLES["time"] and len(values) > 2:
        step = float(np.median(np.abs(np.diff(values))))
        if step >= 1.0 and step == round(step) and size > 2e5:
            return "ms", f"steps of {step:g} in ms"
    for unit in role.units:
        if role.low <= size * UNITS[unit][1] <= role.high:
            return unit, f"{size:.3g} would be likely in {unit}"
    return role.units[0], f"{size:.3g}, unlikely in any unit" if size else "it does not change"


def _kind(columns: list[Column]) -> Literal["record", "settings", "rates"]:
    roles = {c.role for c in columns}
    if any(role.startswith("rate") for role in roles):
        return "rates"
    run = next((c for c in columns if c.role == "run"), None)
    a_row_a_run = run is not None and len(set(run.values.tolist())) == len(run.values)
    timed = any(c.role == "time" and _is_time_axis(c) for c in columns)
    if a_row_a_run and roles & {"tension", "yaw"} and not (timed or roles & {"signal", "travel"}):
        return "settings"
    return "record"


def _is_time_axis(column: Column) -> bool:
    """Whether the times of a column are as close as rows of a record, unlike the dates of runs."""
    steps = np.diff(np.unique(column.values[np.isfinite(column.values)]))
    return bool(len(steps)) and float(np.median(steps)) < SPARSE
