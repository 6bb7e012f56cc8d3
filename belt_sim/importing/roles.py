"""Role, unit and place of every column: proposed by names, units and numbers, or stated by the mapping."""

import re
import unicodedata
from collections import defaultdict
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from belt_sim.campaign.plausible import SIGNAL_DIMENSION
from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.sheet import RESERVED, check_signal_name
from belt_sim.campaign.types import ELSEWHERE_EXAMPLE, PLACES, kind_at
from belt_sim.errors import InputError
from belt_sim.importing.mapping import AxisEntry, ColumnEntry, MappingEntry
from belt_sim.importing.types import ROLES, TILT, Column, LoggedTable, LoggedTables, Note, Question, Role, TableKind
from belt_sim.importing.units import UNITS, split_unit, unit_of

#: Where points 1-4 are.
DRAWING = """\
   1 -------- upper span -------- 4
 tail pulley (it yaws)      head pulley
   2 -------- lower span -------- 3
"""
DAY = 86400.0  # [s]
#: Columns that a table has once.
ONCE = ("run", "time", "travel", "speed", "tension", "yaw", "yaw_head", "direction", "yaw_at", "start", "u_rate")
#: dimension -> unit of a column where neither file nor mapping states one, and in which a signal is written
USUAL = {"length": "mm", "angle": "mrad", "time": "s", "speed": "m/s", "stress": "N/mm2", "number": "1"}
_NUMBERED = re.compile(
    r"^(?:y|kante|edge|bandkante|lateral|pos|position|point|punkt|ablage|sensor|laser|p)[ _]*([1-4])\b"
)
_RATE = re.compile(r"^(?:rate|drift|driftrate|laufrate)[ _]*([1-4])?$")


# ---- names


@cache
def synonyms() -> dict[str, dict[str, list[str]]]:
    """What people call roles, places and directions."""
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
    best = ("", 0)
    for role, names in synonyms()["roles"].items():
        for known in names:
            whole = re.search(rf"(?:^| ){re.escape(known)}(?: |\d|$)", words)
            if (whole or (len(known) > 4 and known in words)) and len(known) > best[1]:
                best = (role, len(known))
    return best[0]


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
        keep = max(same, key=lambda k: (not columns[k].is_text, columns[k].sure, -k), default=None)
        for k in same:
            if k != keep:
                columns[k] = replace(columns[k], role="ignore", unit="", why=f"another column is the {role}")
    if not any(c.role in ("time", "travel") for c in columns):
        rising = (k for k, c in enumerate(columns) if c.role == "" and _rises(c))
        for k in list(rising)[:1]:
            columns[k] = replace(columns[k], why="it rises throughout: time or travel?")
    return replace(table, columns=tuple(columns), kind=_kind(columns))


def _propose(column: Column) -> Column:
    """Role by the name and the unit; unit by the name or by magnitude."""
    name, unit = split_unit(column.name)
    unit = column.unit or unit or ""
    role = role_named(name)
    if column.is_text:
        signs = _directions(column.values) if role == "direction" else None
        if signs is not None:
            return replace(column, values=signs, role=role, unit="1", sure=True, why="its name and words")
        return replace(column, role="run" if role == "run" else "ignore", unit="", sure=False, why="text")
    if not np.isfinite(column.values).any():
        return replace(column, role="ignore", unit="", why="holds no numbers")
    dimension = UNITS[unit][0] if unit else ""
    if dimension and (not role or (ROLES[role].dimensions and dimension not in ROLES[role].dimensions)):
        role = {"time": "time", "speed": "speed", "stress": "tension", "force": "tension"}.get(dimension, "")
        role = "signal" if dimension == "length" and place_named(name) else role
    if role.startswith(("rate", "u_rate")):
        return replace(column, role=role, unit=unit or "mm/m", sure=bool(unit), why="its name")
    if not role:
        return replace(column, role="", unit=unit, why="nothing is known of it")
    at = place_named(name) if role == "signal" else ""
    if role in ("run", "direction") or unit:
        return replace(column, role=role, unit=unit, at=at, sure=bool(unit), why="its name")
    is_tilt = role == "signal" and any(w in plain(name) for w in synonyms()["places"]["tilt"])
    guess, why = _unit_by_size(column, TILT if is_tilt else ROLES[role])
    return replace(column, role=role, unit=guess, at=at, why=f"its name; {why}")


def _directions(values: np.ndarray) -> np.ndarray | None:
    """1 and -1 of words as forward and reverse, nan where blank; None where a word is neither."""
    signs = dict.fromkeys(synonyms()["directions"]["forward"], 1.0) | dict.fromkeys(
        synonyms()["directions"]["reverse"], -1.0
    )
    words = [plain(v) for v in values]
    if not any(words) or any(w and w not in signs for w in words):
        return None
    return np.array([signs.get(w, np.nan) for w in words])


def _join_dates(columns: list[Column]) -> list[Column]:
    """A column of dates and one of times of day as one time, so that a night does not begin a new run."""
    times = [k for k, c in enumerate(columns) if c.role == "time" and not c.is_text]
    there = {k: columns[k].values[np.isfinite(columns[k].values)] for k in times}
    dates = [k for k, s in there.items() if len(s) and np.all((s > DAY) & (s % DAY == 0.0))]
    clocks = [k for k in times if k not in dates and np.nanmax(columns[k].values) < DAY]
    if not dates or not clocks:
        return columns
    date, clock = columns[dates[0]], columns[clocks[0]]
    columns[dates[0]] = replace(date, role="ignore", unit="", why=f"in {clock.name} with the time of day")
    columns[clocks[0]] = replace(clock, values=date.values + clock.values, why=f"its name, with {date.name}")
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


def _rises(column: Column) -> bool:
    return not column.is_text and len(column.values) > 10 and bool((np.diff(column.values) > 0).all())


def _kind(columns: list[Column]) -> TableKind:
    roles = {c.role for c in columns}
    if any(role.startswith("rate") for role in roles):
        return "rates"
    run = next((c for c in columns if c.role == "run"), None)
    if run is not None and len(set(run.values.tolist())) == len(run.values) and roles & {"tension", "yaw"}:
        return "settings" if not roles & {"signal", "time", "travel"} else "record"
    return "record"


# ---- columns as they are used


@dataclass(frozen=True, kw_only=True)
class UsedColumn:
    """A column of a table with its role, and its factor to SI, sign included; name: of the signal in the campaign."""

    table: str
    column: Column
    role: str
    unit: str
    factor: float
    at: str = ""
    name: str = ""
    entry: ColumnEntry = field(default_factory=ColumnEntry)

    @property
    def is_stated(self) -> bool:
        """Whether the mapping says what the column is."""
        return bool(self.entry.role or self.entry.unit or self.entry.at)

    @property
    def sure(self) -> bool:
        """Whether the mapping or the file itself says what it is."""
        return self.column.sure or self.is_stated

    @property
    def why(self) -> str:
        """Where role and unit come from, in words."""
        return "the mapping" if self.is_stated else self.column.why + ("" if self.column.sure else " (a guess)")

    def si(self, rows: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Numbers [SI]; of a force [N]; of an axis of a digitised picture, the value at each pixel."""
        values = self.column.values[rows].astype(float)
        return self.factor * (values if self.entry.axis is None else _on_axis(values, self.entry.axis))

    @property
    def is_force(self) -> bool:
        """Whether a tension is logged as a force."""
        return self.role == "tension" and UNITS[self.unit][0] == "force"

    @property
    def labels(self) -> list[str]:
        """The cells as texts, "" where blank."""
        cells = self.column.values.tolist()
        return [str(c).strip() if not isinstance(c, float) else "" if c != c else f"{c:.15g}" for c in cells]

    @property
    def by_hand(self) -> float | None:
        """One sigma [SI] of reading a digitised picture; None for a column that was logged."""
        if self.entry.axis is None:
            return None
        (p0, p1), (v0, v1) = self.entry.axis.pixel, self.entry.axis.value
        return abs((v1 - v0) / (p1 - p0) * self.factor) * self.entry.axis.u


def _on_axis(pixels: np.ndarray, axis: AxisEntry) -> np.ndarray:
    """Values at pixels of a digitised picture, from two marks of its axis."""
    (p0, p1), (v0, v1) = axis.pixel, axis.value
    if axis.log:
        v0, v1 = np.log(v0), np.log(v1)
    values = v0 + (pixels - p0) * (v1 - v0) / (p1 - p0)
    return np.exp(values) if axis.log else values


@dataclass(frozen=True)
class UsedTable:
    """A table, and its columns as they are used."""

    logged: LoggedTable
    columns: tuple[UsedColumn, ...]

    def column(self, role: str) -> UsedColumn | None:
        """The first column with this role; None where there is none."""
        return next((u for u in self.columns if u.role == role), None)


@dataclass(frozen=True, kw_only=True)
class Columns:
    """missing: questions that must be answered; unknown: of columns that are left out."""

    tables: list[UsedTable]
    missing: list[Question]
    unknown: list[Question]
    notes: list[Note]


def resolve_columns(logged: LoggedTables, mapping: MappingEntry) -> Columns:
    """Every column as the mapping states it, else as proposed; raises InputError for what cannot be."""
    strange = next((name for name in mapping.columns if name not in logged.columns), None)
    if strange is not None:
        remedy = f"no file has such a column; {did_you_mean(strange, logged.columns)}"
        raise InputError(f"columns.{strange}", strange, "", remedy)
    along = {e.against for e in mapping.columns.values()}
    missing: dict[tuple[str, ...], Question] = {}
    unknown: dict[tuple[str, ...], Question] = {}
    notes: dict[str, Note] = {}
    tables: list[UsedTable] = []
    for table in logged.tables:
        found: list[UsedColumn] = []
        taken: dict[str | None, list[str]] = defaultdict(lambda: [e.name for e in mapping.columns.values() if e.name])
        for column in table.columns:
            entry = mapping.columns.get(column.name, ColumnEntry())
            if column.name in along and entry.role is None:
                entry = entry.model_copy(update={"role": "travel"})
            one = _resolve(table.name, column, entry, taken[entry.run])
            found.append(one)
            question = _place_question(column)
            if one.role == "signal" and not one.at:
                missing.setdefault(question.path, question)
            elif table.kind == "record" and one.role == "ignore" and not (entry.role or column.role or column.is_text):
                options = (*PLACES, *(r for r in ROLES if not r.startswith(("signal", "rate", "u_rate"))))
                text = f"{question.text}; or which role has it?"
                unknown.setdefault(question.path, replace(question, text=text, options=options, proposed="ignore"))
            if one.unit and column.sure and column.unit and UNITS[column.unit] != UNITS[one.unit] and entry.unit:
                text = f"the file says {column.unit}, the mapping {one.unit}; the mapping is taken"
                notes.setdefault(column.name, Note(column.name, text))
        tables.append(UsedTable(table, tuple(found)))
        if table.kind == "record":
            for question in _missing_roles(table, found):
                missing.setdefault(question.path, question)
    asked = {q.path[1] for q in missing.values()}
    left = [q for q in unknown.values() if q.path[1] not in asked]
    return Columns(tables=tables, missing=list(missing.values()), unknown=left, notes=list(notes.values()))


def _resolve(table: str, column: Column, entry: ColumnEntry, taken: list[str]) -> UsedColumn:
    where = f"columns.{column.name}"
    role = entry.role or ("signal" if entry.at else column.role) or "ignore"
    at = (entry.at or column.at) if role == "signal" else ""
    if entry.at and role == "ignore":
        raise InputError(f"{where}.role", role, "", "leave it out (or role: signal) where at says what it measures")
    kind = kind_at(at)
    if at and kind is None:
        raise InputError(f"{where}.at", at, "", f"{did_you_mean(at, PLACES)}, or {ELSEWHERE_EXAMPLE}")
    if column.is_text and role not in ("run", "ignore"):
        raise InputError(f"{where}.role", role, "", "holds text and can only be run or ignore")
    if not ROLES[role].dimensions:
        return UsedColumn(table=table, column=column, role=role, unit="", factor=1.0, entry=entry)
    unit = _unit(column, entry, (SIGNAL_DIMENSION[kind],) if kind else ROLES[role].dimensions, where)
    name = ""
    if role == "signal":
        name = entry.name or _signal_name(column, at, taken)
        taken.append(name)
        try:
            check_signal_name(name)
        except InputError as error:
            raise InputError(f"{where}.name", name, "", error.remedy) from None
    scale = UNITS[unit][1] * entry.factor * entry.sign
    return UsedColumn(table=table, column=column, role=role, unit=unit, factor=scale, at=at, name=name, entry=entry)


def _unit(column: Column, entry: ColumnEntry, kinds: tuple[str, ...], where: str) -> str:
    """The unit: as stated; as proposed, when it is of a kind that fits; else the usual one of that kind."""
    if entry.unit is not None:
        return unit_of(entry.unit, kinds, f"{where}.unit")
    if column.unit and UNITS[column.unit][0] in kinds and (column.sure or entry.axis is None):
        return column.unit  # of pixels no unit can be guessed
    return "m" if entry.role == "travel" else USUAL[kinds[0]]


def _signal_name(column: Column, at: str, taken: list[str]) -> str:
    """y1 to y4 and tilt by place; a second one of a place gets a letter."""
    base = {"upper_mid_span": "tilt", "lower_mid_span": "tilt_lower"}.get(at, f"y{at[-1:]}" if at in PLACES else "y")
    own = [base, *(f"{base}{c}" for c in "bcdefghijk")]
    return next((n for n in own if n not in taken and n not in RESERVED), column.name)


def _place_question(column: Column) -> Question:
    return Question(
        path=("columns", column.name, "at"),
        text=f"where does the column {column.name} measure? points 1 and 2: upper and lower end at the tail pulley (the"
        " one that yaws); 3 and 4: lower and upper end at the head pulley",
        example="point_1",
        options=tuple(PLACES),
    )


def _missing_roles(table: LoggedTable, used: list[UsedColumn]) -> list[Question]:
    """Roles that a record cannot do without."""
    roles, found = {u.role for u in used}, []
    numbers = [u.column for u in used if not u.column.is_text and u.role == "ignore"]
    if not roles & {"time", "travel"}:
        rising = [c.name for c in numbers if _rises(c)]
        found.append(
            Question(
                path=("columns", (rising or [c.name for c in numbers] or ["..."])[0], "role"),
                text=f"{table.file.name} has no column of time or travel that is known by its name; which is it?",
                example="time",
                options=("time", "travel"),
            )
        )
    if "signal" not in roles:
        left = [c for c in numbers if not found or c.name != found[0].path[1]]
        text = f"no column of {table.file.name} is known as a signal by its name; "
        found += [replace(q, text=text + q.text) for q in map(_place_question, left[:1])]
    return found
