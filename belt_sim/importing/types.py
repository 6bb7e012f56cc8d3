"""What a logger's files hold, and what an import asks and reads off them: tables, columns, questions."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from belt_sim.campaign.problems import Problem
from belt_sim.campaign.types import PLACES

TableKind = Literal["record", "settings", "rates"]


class Role(NamedTuple):
    """What a column may be. dimensions: that its unit may have; units: tried in this order where the file states none,
    until the largest of the numbers (or their range, if by_range) lies between low and high [SI]."""

    dimensions: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    low: float = 0.0
    high: float = 0.0
    by_range: bool = False


_YAW = Role(("angle",), ("deg", "mrad", "rad", "urad"), 2e-5, 0.02)
_PLACE = Role(("length",), ("m", "mm"), 0.1, 1e3)
ROLES = {
    "run": Role(),
    "time": Role(("time",), ("s", "ms", "min", "h"), 5.0, 2e5, by_range=True),
    "travel": Role(("length",), ("m", "mm"), 2.0, 2e4, by_range=True),
    "speed": Role(("speed",), ("m/s", "m/min", "mm/s"), 0.02, 12.0),
    "tension": Role(("stress", "force"), ("N/mm2", "N", "kN"), 1e6, 4e8),
    "yaw": _YAW,
    "yaw_head": _YAW,
    "direction": Role(("number",)),
    "yaw_at": _PLACE,
    "start": _PLACE,
    "signal": Role(("length", "angle"), ("mm", "m", "um"), 2e-5, 0.2, by_range=True),
    **dict.fromkeys(("rate1", "rate2", "rate3", "rate4", "u_rate"), Role(("angle",))),
    "ignore": Role(),
}
#: place -> usual name of the signal there
SIGNAL_NAMES = {place: f"y{place[-1]}" for place, kind in PLACES.items() if kind == "lateral"}
SIGNAL_NAMES |= {"upper_mid_span": "tilt", "lower_mid_span": "tilt_lower"}
#: a signal that is an angle
TILT = Role(("angle",), ("mrad", "deg", "rad"), 2e-5, 0.5)


@dataclass(frozen=True)
class Note:
    """A remark; about: the file, run or column that it is about ("" for all)."""

    about: str
    text: str

    def __str__(self) -> str:
        return f"{self.about}: {self.text}" if self.about else self.text


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column as logged and what it seems to be.

    values: numbers (n,), nan where blank, or texts (object dtype); stamp: whether they were dates or times of day;
    role, unit, at: proposals, "" where nothing is known; stated_unit: what the file states as the unit, known or not;
    sure: whether the file says so itself; why: where the proposal comes from, in words.
    """

    name: str
    values: np.ndarray
    role: str = ""
    unit: str = ""
    stated_unit: str = ""
    at: str = ""
    stamp: bool = False
    sure: bool = False
    why: str = ""

    @property
    def is_text(self) -> bool:
        return self.values.dtype == object


@dataclass(frozen=True, kw_only=True)
class LoggedTable:
    """One file, or one sheet of it.

    lines: line in the file of every row that was kept, from 1, shape (n,); starts: rows at which the file begins anew
    (its header stands there again).
    """

    name: str
    file: Path
    columns: tuple[Column, ...]
    lines: np.ndarray
    starts: tuple[int, ...] = ()
    kind: TableKind = "record"
    notes: tuple[Note, ...] = ()


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


@dataclass(frozen=True, kw_only=True)
class Question:
    """Something that the files cannot say.

    path: keys in the mapping under which the answer stands; text: the question; example: how an answer looks; options:
    all possible answers, where there are few; proposed: a likely answer.
    """

    path: tuple[str, ...]
    text: str
    example: str
    options: tuple[str, ...] = ()
    proposed: str = ""

    @property
    def key(self) -> str:
        return ".".join(self.path)

    def put(self, mapping: dict[str, Any], answer: str | None) -> None:
        """Write an answer into the mapping; of a place, a role may be given instead."""
        key = "role" if self.path[-1] == "at" and answer in ROLES else self.path[-1]
        inner = inner_mapping(mapping, self.path[:-1])
        if key == "at" and inner.get("role") == "ignore":
            del inner["role"]  # where it measures says what it is
        inner[key] = answer

    @property
    def problem(self) -> Problem:
        """The question as one line: what is missing and how to give it."""
        written = self.example
        for key in reversed(self.path):
            written = f"{_key(key)}: {written}" if key is self.path[-1] else f"{_key(key)}: {{{written}}}"
        choice = f" (one of {', '.join(self.options)})" if self.options else ""
        return Problem(file="mapping", name=self.key, remedy=f"{self.text}{choice}; give it as  {written}")


def inner_mapping(mapping: dict[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    """The mapping at a path of keys, put there where none is."""
    for key in path:
        if not isinstance(mapping.get(key), dict):
            mapping[key] = {}
        mapping = mapping[key]
    return mapping


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and not key.isdigit() else f'"{key}"'
