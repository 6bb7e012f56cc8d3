"""Tables of a logger and their columns: what was logged, and its role, unit and place by the mapping or as proposed."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from belt_sim.campaign.plausible import SIGNAL_DIMENSION
from belt_sim.campaign.problems import CampaignError, did_you_mean, refusal
from belt_sim.campaign.sheet import RESERVED, check_signal_name
from belt_sim.campaign.types import ELSEWHERE_EXAMPLE, PLACES, kind_at
from belt_sim.errors import InputError
from belt_sim.importing.mapping import ROLES, ColumnEntry, MappingEntry, Question
from belt_sim.importing.units import NAMES, UNITS, unit_of

#: dimension -> unit of a column where neither file nor mapping states one, and in which a signal is written
USUAL = {"length": "mm", "angle": "mrad", "time": "s", "speed": "m/s", "stress": "N/mm2", "number": "1"}
#: place -> usual name of the signal there
SIGNAL_NAMES = {place: f"y{place[-1]}" for place, kind in PLACES.items() if kind == "lateral"}
SIGNAL_NAMES |= {"upper_mid_span": "tilt", "lower_mid_span": "tilt_lower"}


@dataclass(frozen=True)
class Note:
    """A remark; about: the file, run or column that it is about ("" for all)."""

    about: str
    text: str

    def __str__(self) -> str:
        return f"{self.about}: {self.text}" if self.about else self.text


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column as logged and what it is.

    name, values: its header; numbers (n,), nan where blank, or texts (object dtype). stamp: whether they were dates or
    times of day; stated_unit: what the file states as the unit, known or not; is_certain: whether the file itself says
    what it is; proposed_by: where the proposal comes from, in words. role, unit, at: as proposed, "" where nothing is
    known, until ``resolve_columns`` puts them as the mapping (entry) states them, and with them the name of the table,
    the factor to SI, sign included, and the signal's name in the campaign.
    """

    name: str
    values: np.ndarray
    stamp: bool = False
    stated_unit: str = ""
    is_certain: bool = False
    proposed_by: str = ""
    role: str = ""
    unit: str = ""
    at: str = ""
    table: str = ""
    factor: float = 1.0
    signal: str = ""
    entry: ColumnEntry = field(default_factory=ColumnEntry)

    @property
    def is_text(self) -> bool:
        return self.values.dtype == object

    @property
    def is_stated(self) -> bool:
        """Whether the mapping says what the column is."""
        return bool(self.entry.role or self.entry.unit or self.entry.at)

    @property
    def sure(self) -> bool:
        """Whether the mapping or the file itself says what it is."""
        return (self.is_certain or self.is_stated) and not self.unit_is_guess

    @property
    def unit_is_guess(self) -> bool:
        """Whether neither the mapping nor the file states the unit of what was logged."""
        stated = self.entry.unit or self.entry.axis or self.stated_unit == self.unit
        return bool(ROLES[self.role].units and self.unit) and not stated

    @property
    def why(self) -> str:
        """Where role and unit come from, in words."""
        if self.is_stated:
            return "the mapping" + (f"; {self.unit} is a guess" if self.unit_is_guess else "")
        return self.proposed_by + ("" if self.is_certain else " (a guess)")

    def si(self) -> np.ndarray:
        """Numbers [SI]; of a force [N]; of an axis of a digitised picture, the value at each pixel."""
        values = self.values.astype(float)
        return self.factor * (values if self.entry.axis is None else self.entry.axis.values_at(values))

    @property
    def is_force(self) -> bool:
        """Whether a tension is logged as a force."""
        return self.role == "tension" and UNITS[self.unit][0] == "force"

    @property
    def labels(self) -> list[str]:
        """The cells as texts, "" where blank."""
        if self.is_text:
            return [str(c).strip() for c in self.values]
        return ["" if np.isnan(c) else f"{c:.15g}" for c in self.values]

    @property
    def by_hand(self) -> float | None:
        """One sigma [SI] of reading a digitised picture; None for a column that was logged."""
        if self.entry.axis is None:
            return None
        (p0, p1), (v0, v1) = self.entry.axis.pixel, self.entry.axis.value
        return abs((v1 - v0) / (p1 - p0) * self.factor) * self.entry.axis.u


@dataclass(frozen=True, kw_only=True)
class LoggedTable:
    """One file, one sheet of it, or the rows of one run.

    lines: line in the file of every row that was kept, from 1, shape (n,); starts: rows at which the file begins anew
    (its header stands there again); label: of a run, the text that may state its settings.
    """

    name: str
    file: Path
    columns: tuple[Column, ...]
    lines: np.ndarray
    starts: tuple[int, ...] = ()
    kind: Literal["record", "settings", "rates"] = "record"
    notes: tuple[Note, ...] = ()
    label: str = ""

    def column(self, role: str) -> Column | None:
        """The first column with this role; None where there is none."""
        return next((c for c in self.columns if c.role == role), None)

    def values(self, role: str) -> np.ndarray | None:
        """Numbers [SI] of the column with this role, None where there is none."""
        found = self.column(role)
        return None if found is None else found.si()

    def at(self, rows: np.ndarray) -> "LoggedTable":
        """The table with these rows only."""
        columns = tuple(replace(c, values=c.values[rows]) for c in self.columns)
        return replace(self, columns=columns, lines=self.lines[rows])

    def refuse(self, row: int, name: str, value: object, unit: str, remedy: str) -> CampaignError:
        """The error of a row."""
        return refusal(self.file, remedy, line=int(self.lines[row]), name=name, value=value, unit=unit)


@dataclass(frozen=True, kw_only=True)
class LoggedTables:
    """Everything that was read."""

    tables: tuple[LoggedTable, ...]

    @property
    def columns(self) -> dict[str, Column]:
        """Columns of all tables by name; of one name, the first."""
        found: dict[str, Column] = {}
        for column in (c for table in self.tables for c in table.columns):
            found.setdefault(column.name, column)
        return found


# ---- columns as they are used


def resolve_columns(logged: LoggedTables, mapping: MappingEntry) -> list[LoggedTable]:
    """Tables with every column as the mapping states it, else as proposed; raises InputError for what cannot be."""
    strange = next((name for name in mapping.columns if name not in logged.columns), None)
    if strange is not None:
        remedy = f"no file has such a column; {did_you_mean(strange, logged.columns)}"
        raise InputError(f"columns.{strange}", strange, "", remedy)
    return [_resolve_table(table, mapping) for table in logged.tables]


def _resolve_table(table: LoggedTable, mapping: MappingEntry) -> LoggedTable:
    """A table with its columns as they are used; of a run, no two signals get one name."""
    along = {e.against for e in mapping.columns.values()}
    stated = [e.name for e in mapping.columns.values() if e.name]
    taken: dict[str | None, list[str]] = defaultdict(lambda: [*stated])
    columns = []
    for column in table.columns:
        entry = mapping.columns.get(column.name, ColumnEntry())
        if column.name in along and entry.role is None:
            entry = entry.model_copy(update={"role": "travel"})
        columns.append(_resolve(replace(column, table=table.name, entry=entry), taken[entry.run]))
        taken[entry.run].append(columns[-1].signal)
    return replace(table, columns=tuple(columns))


def _resolve(column: Column, taken: list[str]) -> Column:
    """A column as its entry of the mapping states it, else as proposed; taken: names of other signals."""
    where, entry = f"columns.{column.name}", column.entry
    role = entry.role or ("signal" if entry.at else column.role) or "ignore"
    at = (entry.at or column.at) if role == "signal" else ""
    if entry.at and role == "ignore":
        raise InputError(f"{where}.role", role, "", "leave it out (or role: signal) where at says what it measures")
    if at and kind_at(at) is None:
        raise InputError(f"{where}.at", at, "", f"{did_you_mean(at, PLACES)}, or {ELSEWHERE_EXAMPLE}")
    if column.is_text and role not in ("run", "ignore"):
        raise InputError(f"{where}.role", role, "", "holds text and can only be run or ignore")
    if not ROLES[role].dimensions:
        return replace(column, role=role, unit="", at="")
    unit = _unit(column, _dimensions(role, at))
    signal = ""
    if role == "signal":
        signal = entry.name or _signal_name(column, at, taken)
        try:
            check_signal_name(signal)
        except InputError as error:
            raise InputError(f"{where}.name", signal, "", error.remedy) from None
    scale = UNITS[unit][1] * entry.factor * entry.sign
    return replace(column, role=role, unit=unit, factor=scale, at=at, signal=signal)


def _dimensions(role: str, at: str) -> tuple[str, ...]:
    """Kinds of unit that a column may have: of a signal whose place is known, one."""
    kind = kind_at(at)
    return (SIGNAL_DIMENSION[kind],) if kind else ROLES[role].dimensions


def _unit(column: Column, kinds: tuple[str, ...]) -> str:
    """The unit: as stated; as proposed, when it is of a kind that fits; else the usual one of that kind; "" where the
    file states one that is not known or of another kind."""
    entry = column.entry
    if entry.unit is not None:
        return unit_of(entry.unit, kinds, f"columns.{column.name}.unit")
    for own in (column.stated_unit, column.unit):
        if own and own in UNITS and UNITS[own][0] in kinds and (column.is_certain or entry.axis is None):
            return own  # of pixels no unit can be guessed
    if column.stated_unit and entry.axis is None and kinds != ("number",):
        return ""
    return "m" if entry.role == "travel" else USUAL[kinds[0]]


def _signal_name(column: Column, at: str, taken: list[str]) -> str:
    """y1 to y4 and tilt by place; a second one of a place gets a letter."""
    base = SIGNAL_NAMES.get(at, "y")
    own = [base, *(f"{base}{c}" for c in "bcdefghijk")]
    return next((n for n in own if n not in taken and n not in RESERVED), column.name)


def rises(column: Column) -> bool:
    """Whether the numbers of a column rise throughout, as time and travel do."""
    return not column.is_text and len(column.values) > 10 and bool((np.diff(column.values) > 0).all())


def other_units(tables: Iterable[LoggedTable]) -> list[Note]:
    """Units that the file itself states and the mapping states otherwise."""
    found = []
    for column in (c for table in tables for c in table.columns):
        own, unit = column.stated_unit, column.unit
        if own and unit and column.entry.unit and UNITS.get(own) != UNITS[unit]:
            found.append(Note(column.name, f"the file says {own}, the mapping {unit}; the mapping is taken"))
    return list(dict.fromkeys(found))


# ---- what the mapping must or may still say


#: Where points 1-4 are.
DRAWING = """\
   4 -------- upper span -------- 1
 head pulley         tail pulley (it yaws)
   3 -------- lower span -------- 2
"""


def column_questions(logged: LoggedTables, used: list[LoggedTable]) -> tuple[list[Question], list[Question]]:
    """Questions that must be answered, and those about columns that are left out as long as nobody answers.

    used: the tables of ``logged`` as resolved.
    """
    missing: dict[tuple[str, ...], Question] = {}
    for question in (q for table in used for q in _missing(table)):
        missing.setdefault(question.path, question)
    asked = {path[1] for path in missing}
    unknown: dict[str, Question] = {}
    options = (*PLACES, *(r for r in ROLES if not r.startswith(("signal", "rate", "u_rate"))))
    for table, as_used in zip(logged.tables, used, strict=True):
        for proposed, column in zip(table.columns, as_used.columns, strict=True):
            stated = column.entry.role or proposed.role or column.is_text or column.role != "ignore"
            if table.kind == "record" and not stated and column.name not in asked:
                question = _place_question(column)
                text = f"{question.text}; or which role has it?"
                unknown.setdefault(column.name, replace(question, text=text, options=options, proposed="ignore"))
    return list(missing.values()), list(unknown.values())


def _place_question(column: Column) -> Question:
    return Question(
        path=("columns", column.name, "at"),
        text=f"where does the column {column.name} measure? points 1 and 2: upper and lower end at the tail pulley (the"
        " one that yaws); 3 and 4: lower and upper end at the head pulley",
        example="point_1",
        options=tuple(PLACES),
    )


def _missing(table: LoggedTable) -> Iterator[Question]:
    """Places of signals, units that the file states but that are not known or do not go with the role, and roles that a
    record cannot do without."""
    yield from (_place_question(c) for c in table.columns if c.role == "signal" and not c.at)
    for column in table.columns:
        kinds = _dimensions(column.role, column.at)
        if kinds and not column.unit:
            yield Question(
                path=("columns", column.name, "unit"),
                text=f"the file states {column.stated_unit} as the unit of {column.name}, which is no unit of"
                f" {' or '.join(kinds)} that is known; in which one are its numbers (after a factor, as factor: 0.1)?",
                example=USUAL[kinds[0]],
                options=tuple(name for name in NAMES if UNITS[name][0] in kinds),
            )
    if table.kind != "record":
        return
    roles, file = {c.role for c in table.columns}, table.file.name
    numbers = [c for c in table.columns if not c.is_text and c.role == "ignore"]
    if not roles & {"time", "travel"}:
        likely = next((c.name for c in (*filter(rises, numbers), *numbers)), "...")
        numbers = [c for c in numbers if c.name != likely]
        yield Question(
            path=("columns", likely, "role"),
            text=f"{file} has no column of time or travel that is known by its name; which is it?",
            example="time",
            options=("time", "travel"),
        )
    if "signal" not in roles and numbers:
        question = _place_question(numbers[0])
        yield replace(question, text=f"no column of {file} is known as a signal by its name; {question.text}")
