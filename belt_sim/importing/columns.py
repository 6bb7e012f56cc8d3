"""Role, unit and place of every column as they are used: stated by the mapping, else as proposed."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.campaign.plausible import SIGNAL_DIMENSION
from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.sheet import RESERVED, check_signal_name
from belt_sim.campaign.types import ELSEWHERE_EXAMPLE, PLACES, kind_at
from belt_sim.errors import InputError
from belt_sim.importing.mapping import ColumnEntry, MappingEntry
from belt_sim.importing.roles import rises
from belt_sim.importing.types import ROLES, SIGNAL_NAMES, Column, LoggedTable, LoggedTables, Note, Question
from belt_sim.importing.units import NAMES, UNITS, unit_of

#: dimension -> unit of a column where neither file nor mapping states one, and in which a signal is written
USUAL = {"length": "mm", "angle": "mrad", "time": "s", "speed": "m/s", "stress": "N/mm2", "number": "1"}


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
        return (self.column.sure or self.is_stated) and not self.unit_is_guess

    @property
    def unit_is_guess(self) -> bool:
        """Whether neither the mapping nor the file states the unit of what was logged."""
        stated = self.entry.unit or self.entry.axis or self.column.stated_unit == self.unit
        return bool(ROLES[self.role].units and self.unit) and not stated

    @property
    def why(self) -> str:
        """Where role and unit come from, in words."""
        if self.is_stated:
            return "the mapping" + (f"; {self.unit} is a guess" if self.unit_is_guess else "")
        return self.column.why + ("" if self.column.sure else " (a guess)")

    def si(self, rows: np.ndarray | slice = slice(None)) -> np.ndarray:
        """Numbers [SI]; of a force [N]; of an axis of a digitised picture, the value at each pixel."""
        values = self.column.values[rows].astype(float)
        return self.factor * (values if self.entry.axis is None else self.entry.axis.values_at(values))

    @property
    def is_force(self) -> bool:
        """Whether a tension is logged as a force."""
        return self.role == "tension" and UNITS[self.unit][0] == "force"

    @property
    def labels(self) -> list[str]:
        """The cells as texts, "" where blank."""
        if self.column.is_text:
            return [str(c).strip() for c in self.column.values]
        return ["" if np.isnan(c) else f"{c:.15g}" for c in self.column.values]

    @property
    def by_hand(self) -> float | None:
        """One sigma [SI] of reading a digitised picture; None for a column that was logged."""
        if self.entry.axis is None:
            return None
        (p0, p1), (v0, v1) = self.entry.axis.pixel, self.entry.axis.value
        return abs((v1 - v0) / (p1 - p0) * self.factor) * self.entry.axis.u


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
    tables = [_resolve_table(table, mapping) for table in logged.tables]
    missing = _first_of_each(q for t in tables for q in (*_missing_places(t), *_missing_units(t), *_missing_roles(t)))
    asked = {q.path[1] for q in missing}
    unknown = _first_of_each(q for t in tables for q in _unknown_roles(t) if q.path[1] not in asked)
    notes = dict.fromkeys(note for t in tables for note in _other_units(t))
    return Columns(tables=tables, missing=missing, unknown=unknown, notes=list(notes))


def _resolve_table(table: LoggedTable, mapping: MappingEntry) -> UsedTable:
    """A table with its columns as they are used; of a run, no two signals get one name."""
    along = {e.against for e in mapping.columns.values()}
    stated = [e.name for e in mapping.columns.values() if e.name]
    taken: dict[str | None, list[str]] = defaultdict(lambda: [*stated])
    columns = []
    for column in table.columns:
        entry = mapping.columns.get(column.name, ColumnEntry())
        if column.name in along and entry.role is None:
            entry = entry.model_copy(update={"role": "travel"})
        columns.append(_resolve(table.name, column, entry, taken[entry.run]))
        taken[entry.run].append(columns[-1].name)
    return UsedTable(table, tuple(columns))


def _resolve(table: str, column: Column, entry: ColumnEntry, taken: list[str]) -> UsedColumn:
    """A column as its entry of the mapping states it, else as proposed; taken: names of other signals."""
    where = f"columns.{column.name}"
    role = entry.role or ("signal" if entry.at else column.role) or "ignore"
    at = (entry.at or column.at) if role == "signal" else ""
    if entry.at and role == "ignore":
        raise InputError(f"{where}.role", role, "", "leave it out (or role: signal) where at says what it measures")
    if at and kind_at(at) is None:
        raise InputError(f"{where}.at", at, "", f"{did_you_mean(at, PLACES)}, or {ELSEWHERE_EXAMPLE}")
    if column.is_text and role not in ("run", "ignore"):
        raise InputError(f"{where}.role", role, "", "holds text and can only be run or ignore")
    if not ROLES[role].dimensions:
        return UsedColumn(table=table, column=column, role=role, unit="", factor=1.0, entry=entry)
    unit = _unit(column, entry, _dimensions(role, at), where)
    name = ""
    if role == "signal":
        name = entry.name or _signal_name(column, at, taken)
        try:
            check_signal_name(name)
        except InputError as error:
            raise InputError(f"{where}.name", name, "", error.remedy) from None
    scale = UNITS[unit][1] * entry.factor * entry.sign
    return UsedColumn(table=table, column=column, role=role, unit=unit, factor=scale, at=at, name=name, entry=entry)


def _dimensions(role: str, at: str) -> tuple[str, ...]:
    """Kinds of unit that a column may have: of a signal whose place is known, one."""
    kind = kind_at(at)
    return (SIGNAL_DIMENSION[kind],) if kind else ROLES[role].dimensions


def _unit(column: Column, entry: ColumnEntry, kinds: tuple[str, ...], where: str) -> str:
    """The unit: as stated; as proposed, when it is of a kind that fits; else the usual one of that kind; "" where the
    file states one that is not known or of another kind."""
    if entry.unit is not None:
        return unit_of(entry.unit, kinds, f"{where}.unit")
    for own in (column.stated_unit, column.unit):
        if own and own in UNITS and UNITS[own][0] in kinds and (column.sure or entry.axis is None):
            return own  # of pixels no unit can be guessed
    if column.stated_unit and entry.axis is None and kinds != ("number",):
        return ""
    return "m" if entry.role == "travel" else USUAL[kinds[0]]


def _signal_name(column: Column, at: str, taken: list[str]) -> str:
    """y1 to y4 and tilt by place; a second one of a place gets a letter."""
    base = SIGNAL_NAMES.get(at, "y")
    own = [base, *(f"{base}{c}" for c in "bcdefghijk")]
    return next((n for n in own if n not in taken and n not in RESERVED), column.name)


# ---- what the mapping must or may still say


#: Where points 1-4 are.
DRAWING = """\
   4 -------- upper span -------- 1
 head pulley         tail pulley (it yaws)
   3 -------- lower span -------- 2
"""


def _first_of_each(questions: Iterable[Question]) -> list[Question]:
    """Questions, of those with one path the first."""
    found: dict[tuple[str, ...], Question] = {}
    for question in questions:
        found.setdefault(question.path, question)
    return list(found.values())


def _missing_places(table: UsedTable) -> list[Question]:
    return [_place_question(u.column) for u in table.columns if u.role == "signal" and not u.at]


def _place_question(column: Column) -> Question:
    return Question(
        path=("columns", column.name, "at"),
        text=f"where does the column {column.name} measure? points 1 and 2: upper and lower end at the tail pulley (the"
        " one that yaws); 3 and 4: lower and upper end at the head pulley",
        example="point_1",
        options=tuple(PLACES),
    )


def _missing_units(table: UsedTable) -> Iterator[Question]:
    """Columns whose unit the file states, but as one that is not known or does not go with their role."""
    for u in table.columns:
        kinds = _dimensions(u.role, u.at)
        if kinds and not u.unit:
            yield Question(
                path=("columns", u.column.name, "unit"),
                text=f"the file states {u.column.stated_unit} as the unit of {u.column.name}, which is no unit of"
                f" {' or '.join(kinds)} that is known; in which one are its numbers (after a factor, as factor: 0.1)?",
                example=USUAL[kinds[0]],
                options=tuple(name for name in NAMES if UNITS[name][0] in kinds),
            )


def _missing_roles(table: UsedTable) -> list[Question]:
    """Roles that a record cannot do without."""
    if table.logged.kind != "record":
        return []
    roles, found, file = {u.role for u in table.columns}, [], table.logged.file.name
    numbers = [u.column for u in table.columns if not u.column.is_text and u.role == "ignore"]
    if not roles & {"time", "travel"}:
        likely = next((c.name for c in (*filter(rises, numbers), *numbers)), "...")
        numbers = [c for c in numbers if c.name != likely]
        found.append(
            Question(
                path=("columns", likely, "role"),
                text=f"{file} has no column of time or travel that is known by its name; which is it?",
                example="time",
                options=("time", "travel"),
            )
        )
    if "signal" not in roles and numbers:
        question = _place_question(numbers[0])
        text = f"no column of {file} is known as a signal by its name; {question.text}"
        found.append(replace(question, text=text))
    return found


def _unknown_roles(table: UsedTable) -> Iterator[Question]:
    """Columns of a record of which nothing is known."""
    options = (*PLACES, *(r for r in ROLES if not r.startswith(("signal", "rate", "u_rate"))))
    for u in table.columns if table.logged.kind == "record" else ():
        if u.role == "ignore" and not (u.entry.role or u.column.role or u.column.is_text):
            question = _place_question(u.column)
            text = f"{question.text}; or which role has it?"
            yield replace(question, text=text, options=options, proposed="ignore")


def _other_units(table: UsedTable) -> Iterator[Note]:
    """Units that the file itself states and the mapping states otherwise."""
    for u in table.columns:
        own = u.column.stated_unit
        if own and u.unit and u.entry.unit and UNITS.get(own) != UNITS[u.unit]:
            yield Note(u.column.name, f"the file says {own}, the mapping {u.unit}; the mapping is taken")
