"""A comma-separated table whose cells remember their lines."""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from belt_sim.campaign.plausible import Range
from belt_sim.campaign.problems import Problem, did_you_mean
from belt_sim.errors import InputError
from belt_sim.si import UNITS


@dataclass(frozen=True)
class Table:
    """columns: name -> text of every row, stripped; lines: the line of every row, from 1, ascending."""

    file: str
    columns: dict[str, list[str]]
    lines: np.ndarray
    problems: list[Problem]

    def __len__(self) -> int:
        return len(self.lines)

    def refuse(self, row: int, name: str, value: object, unit: str, remedy: str) -> None:
        """Note one wrong cell."""
        line = int(self.lines[row])
        self.problems.append(Problem(file=self.file, line=line, name=name, value=value, unit=unit, remedy=remedy))

    def numbers(self, name: str, bounds: Range, *, unit: str | None = None, blank: float | None = None) -> np.ndarray:
        """A column in SI (or as written when ``bounds`` is of a plain number), shape (rows,).

        A blank cell gives ``blank``, or is a problem when that is None; a wrong cell is a problem.
        """
        unit = bounds.unit if unit is None else unit
        cells, shown = self.columns[name], unit or bounds.label
        try:
            written = np.array([float(cell) if cell else math.nan for cell in cells])
        except ValueError:
            written = np.array([_number(cell) for cell in cells])
        empty = np.array([not cell for cell in cells], dtype=bool)
        typed = np.array(["_" in cell for cell in cells], dtype=bool) | (~np.isfinite(written) & ~empty)
        for row in rows_where(typed):
            self.refuse(row, name, cells[row], shown, "must be a finite number, with a decimal point")
        if blank is None:
            for row in rows_where(empty):
                self.refuse(row, name, None, shown, "is blank; state a number")
        factor, (low, high) = UNITS[unit][1], (bounds.low, bounds.high)
        with np.errstate(over="ignore"):  # what overflows is refused as implausible
            si = written * factor
        scale = UNITS[bounds.unit][1]
        inside = (si > low * scale if bounds.open_low else si >= low * scale) & (si <= high * scale)
        outside = ~inside & ~typed & ~empty
        for row in rows_where(outside):
            try:
                bounds.check(float(written[row]), unit, name=name)
            except InputError as error:
                self.refuse(row, name, error.value, shown, error.remedy)
        si[empty] = math.nan if blank is None else blank
        si[typed | outside] = math.nan
        return si


def rows_where(mask: np.ndarray) -> list[int]:
    """Indices of the rows that a mask names."""
    return np.flatnonzero(mask).tolist()


def _number(cell: str) -> float:
    try:
        return float(cell) if cell else math.nan
    except ValueError:
        return math.nan


def parse_table(
    text: str, file: str, required: tuple[str, ...], known: tuple[str, ...] | None, problems: list[Problem]
) -> Table | None:
    """Split a table into columns; None when its header or the shape of its rows cannot be relied on.

    ``known`` are all columns that may stand there (None: not known, any are let through).
    Quotes around cells are dropped; lines without any text are skipped.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").replace('"', "").split("\n")
    header = [cell.strip() for cell in lines[0].split(",")]
    if not text.strip():
        problems.append(Problem(file=file, remedy=f"the file is empty; begin with the line {','.join(required)}"))
        return None
    if not _header_fits(header, file, required, known, problems):
        return None
    commas = len(header) - 1
    numbers = [n for n, line in enumerate(lines[1:], start=2) if line and not line.isspace() and line.strip(", ")]
    ragged = [n for n in numbers if lines[n - 1].count(",") != commas]
    for n in ragged:
        remedy = f"the header has {commas + 1}; end the line with commas for blanks, write decimals with a point"
        problems.append(Problem(file=file, line=n, name="cells", value=lines[n - 1].count(",") + 1, remedy=remedy))
    if ragged:
        return None
    if not numbers:
        problems.append(Problem(file=file, remedy="has a header but no rows; add them"))
        return None
    split = zip(*(lines[n - 1].split(",") for n in numbers), strict=True)
    columns = {name: [cell.strip() for cell in cells] for name, cells in zip(header, split, strict=True)}
    return Table(file, columns, np.array(numbers), problems)


def _header_fits(
    header: list[str],
    file: str,
    required: tuple[str, ...],
    known: tuple[str, ...] | None,
    problems: list[Problem],
) -> bool:
    before = len(problems)

    def refuse(name: str, remedy: str) -> None:
        problems.append(Problem(file=file, line=1, name=name, remedy=remedy))

    for separator, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in header[0]:
            refuse(
                "",
                f"columns are separated by {called}; separate them by commas and write decimals with a point",
            )
            return False
    for name, count in Counter(header).items():
        if not name:
            refuse("", "a column has no name; name it or remove the comma")
        elif count > 1:
            refuse(name, f"column stands there {count} times; keep one")
        elif known is not None and name not in known:
            unused = [k for k in known if k not in header]
            refuse(name, f"unknown column; {did_you_mean(name, unused or known)}")
    for name in required:
        if name not in header:
            refuse(name, "column is missing; add it")
    return len(problems) == before
