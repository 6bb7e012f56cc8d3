"""What a logger's files hold, as far as it can be told from the files alone."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

TableKind = Literal["record", "settings", "rates"]

#: role of a column -> dimensions that its unit may have
ROLES: dict[str, tuple[str, ...]] = {
    "run": (),
    "time": ("time",),
    "travel": ("length",),
    "speed": ("speed",),
    "tension": ("stress", "force"),
    "yaw": ("angle",),
    "yaw_head": ("angle",),
    "direction": ("number",),
    "signal": ("length", "angle"),
    "rate1": ("angle",),
    "rate2": ("angle",),
    "rate3": ("angle",),
    "rate4": ("angle",),
    "u_rate": ("angle",),
    "ignore": (),
}


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column as logged and what it seems to be.

    values: numbers (n,), nan where blank, or texts (object dtype); role, unit, at: proposals, "" where nothing is
    known; sure: whether the file says so itself; why: where the proposal comes from, in words.
    """

    name: str
    values: np.ndarray
    role: str = ""
    unit: str = ""
    at: str = ""
    sure: bool = False
    why: str = ""

    @property
    def is_text(self) -> bool:
        return self.values.dtype == object


@dataclass(frozen=True, kw_only=True)
class LoggedTable:
    """One file, or one sheet of it.

    lines: line in the file of every row that was kept, from 1, shape (n,); starts: rows at which the file begins anew
    (its header stands there again); averaged: how many rows of the file each kept row stands for.
    """

    name: str
    file: Path
    columns: tuple[Column, ...]
    lines: np.ndarray
    starts: tuple[int, ...] = ()
    averaged: int = 1
    kind: TableKind = "record"
    notes: tuple[str, ...] = ()

    def column(self, name: str) -> Column | None:
        """The column of that name."""
        return next((c for c in self.columns if c.name == name), None)

    def with_columns(self, columns: tuple[Column, ...]) -> "LoggedTable":
        return replace(self, columns=columns)


@dataclass(frozen=True, kw_only=True)
class Logged:
    """Everything that was read, with remarks on how."""

    tables: tuple[LoggedTable, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def columns(self) -> dict[str, Column]:
        """Columns of all tables by name; of one name, the first."""
        found: dict[str, Column] = {}
        for table in self.tables:
            for column in table.columns:
                found.setdefault(column.name, column)
        return found
