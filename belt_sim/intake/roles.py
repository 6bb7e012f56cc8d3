"""Columns as they are used: what the mapping says of them, else what was proposed."""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.sheet import RESERVED, check_signal_name
from belt_sim.campaign.types import PLACES
from belt_sim.errors import InputError
from belt_sim.intake.mapping import AxisEntry, ColumnEntry, MappingEntry
from belt_sim.intake.nouns import ROLES, Column, Logged, LoggedTable
from belt_sim.intake.proposal import Question
from belt_sim.intake.units import UNITS, factor, unit_named

#: dimension that a place measures
DIMENSION = {"lateral": "length", "tilt": "angle"}
#: unit in which signals are written
WRITTEN = {"lateral": "mm", "tilt": "mrad"}


@dataclass(frozen=True, kw_only=True)
class Used:
    """A column with its role, its factor to SI and its sign; name: of the signal in the campaign."""

    column: Column
    role: str
    unit: str
    factor: float
    at: str = ""
    name: str = ""
    entry: ColumnEntry = field(default_factory=ColumnEntry)

    def si(self, rows: np.ndarray) -> np.ndarray:
        """Numbers [SI]; of a force [N]; of an axis of a digitised picture, the value at each pixel."""
        values = self.column.values[rows].astype(float)
        if self.entry.axis is not None:
            values = on_axis(values, self.entry.axis)
        return self.entry.sign * self.factor * values


def on_axis(pixels: np.ndarray, axis: AxisEntry) -> np.ndarray:
    """Values at pixels of a digitised picture, from two marks of its axis."""
    (p0, p1), (v0, v1) = axis.pixel, axis.value
    if axis.log:
        v0, v1 = np.log(v0), np.log(v1)
    values = v0 + (pixels - p0) * (v1 - v0) / (p1 - p0)
    return np.exp(values) if axis.log else values


def used_columns(logged: Logged, mapping: MappingEntry) -> tuple[dict[str, tuple[Used, ...]], list[Question]]:
    """Table -> its columns as used, and what is not known of them; raises InputError for what cannot be."""
    unknown = [name for name in mapping.columns if name not in logged.columns]
    if unknown:
        remedy = f"no file has such a column; {did_you_mean(unknown[0], logged.columns)}"
        raise InputError(f"columns.{unknown[0]}", unknown[0], "", remedy)
    questions: dict[tuple[str, ...], Question] = {}
    used: dict[str, tuple[Used, ...]] = {}
    for table in logged.tables:
        found = []
        taken: dict[str | None, list[str]] = defaultdict(lambda: [e.name for e in mapping.columns.values() if e.name])
        along = {e.against for e in mapping.columns.values()}
        for column in table.columns:
            entry = mapping.columns.get(column.name, ColumnEntry())
            if column.name in along and entry.role is None:
                entry = entry.model_copy(update={"role": "travel"})
            one = _used(column, entry, taken[entry.run])
            if one.role == "signal" and not one.at:
                question = _place_question(column)
                questions.setdefault(question.path, question)
            found.append(one)
        used[table.name] = tuple(found)
        if table.kind == "record":
            for question in _lacking(table, used[table.name]):
                questions.setdefault(question.path, question)
    return used, list(questions.values())


def _used(column: Column, entry: ColumnEntry, taken: list[str]) -> Used:
    where = f"columns.{column.name}"
    role = entry.role or ("signal" if entry.at else column.role) or "ignore"
    at = (entry.at or column.at) if role == "signal" else ""
    if at and at not in PLACES:
        raise InputError(f"{where}.at", at, "", did_you_mean(at, PLACES))
    if column.is_text and role not in ("run", "ignore"):
        raise InputError(f"{where}.role", role, "", "holds text and can only be run or ignore")
    if not ROLES[role]:
        return Used(column=column, role=role, unit="", factor=1.0, entry=entry)
    kinds = (DIMENSION[PLACES[at]],) if at else ROLES[role]
    unit = _unit(column, entry, kinds, where)
    name = ""
    if role == "signal":
        name = entry.name or _signal_name(column, at, taken)
        taken.append(name)
        try:
            check_signal_name(name)
        except InputError as error:
            raise InputError(f"{where}.name", name, "", error.remedy) from None
    return Used(column=column, role=role, unit=unit, factor=UNITS[unit][1], at=at, name=name, entry=entry)


def _unit(column: Column, entry: ColumnEntry, kinds: tuple[str, ...], where: str) -> str:
    """The unit: as stated; as proposed, when it is of a kind that fits; else the usual one of that kind."""
    if entry.unit is not None:
        unit = unit_named(entry.unit)
        if unit is None or UNITS[unit][0] not in kinds:
            factor(entry.unit, kinds[0], f"{where}.unit")  # raises
            raise InputError(f"{where}.unit", entry.unit, "", f"give a unit of {' or '.join(kinds)}")
        return unit
    if column.unit and UNITS[column.unit][0] in kinds and (column.sure or entry.axis is None):
        return column.unit  # of pixels no unit can be guessed
    if entry.role == "travel":
        return "m"
    return {"length": "mm", "angle": "mrad", "time": "s", "speed": "m/s", "stress": "N/mm2", "number": "1"}[kinds[0]]


def _signal_name(column: Column, at: str, taken: list[str]) -> str:
    """y1 to y4 and tilt by place; a second one of a place gets a letter."""
    base = {"upper_mid_span": "tilt", "lower_mid_span": "tilt_lower"}.get(at, f"y{at[-1:]}" if at else "y")
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


def _lacking(table: LoggedTable, used: tuple[Used, ...]) -> list[Question]:
    """Roles that a record cannot do without."""
    roles, found = {u.role for u in used}, []
    numbers = [u.column.name for u in used if not u.column.is_text and u.role == "ignore"]
    if not roles & {"time", "travel"}:
        name = next((u.column.name for u in used if u.column.why.startswith("it rises")), (numbers or ["..."])[0])
        found.append(
            Question(
                path=("columns", name, "role"),
                text=f"{table.file.name} has no column of time or travel that is known by its name; which is it?",
                example="time",
                options=("time", "travel"),
            )
        )
    if "signal" not in roles:
        left = [n for n in numbers if not found or n != found[0].path[1]]
        found += [
            Question(
                path=("columns", name, "at"),
                text=f"no column of {table.file.name} is known as a signal by its name; where does {name} measure?",
                example="point_1",
                options=tuple(PLACES),
            )
            for name in left[:1]
        ]
    return found
