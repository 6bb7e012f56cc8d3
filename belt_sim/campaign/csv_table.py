"""A comma-separated table whose every wrong cell becomes a ``Problem`` with file, line and remedy."""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from belt_sim.campaign.plausible import Range
from belt_sim.campaign.problems import Problem, did_you_mean
from belt_sim.errors import InputError
from belt_sim.si import UNITS


@dataclass(frozen=True)
class CsvTable:
    """A table that remembers the line of every row.

    columns: name -> stripped text of every row; lines: line of every row, from 1, ascending; problems: list to which
    wrong cells are appended.
    """

    file: str
    columns: dict[str, list[str]]
    lines: list[int]
    problems: list[Problem]

    def __len__(self) -> int:
        return len(self.lines)

    def texts(self, name: str) -> list[str]:
        """Return the cells of a column, "" where it is blank or left out."""
        return self.columns.get(name, [""] * len(self))

    def numbers(self, name: str, bounds: Range, *, unit: str | None = None, blank: float | None = None) -> np.ndarray:
        """Return a column in SI (as written if ``bounds`` has no unit), shape (rows,).

        A blank cell becomes ``blank``, or a problem if that is None. A wrong cell becomes a problem and nan.
        """
        unit = bounds.unit if unit is None else unit
        cells, shown = self.columns[name], unit or bounds.label
        written = np.array([_number(cell) for cell in cells])
        with np.errstate(over="ignore"):  # what overflows is refused as implausible
            si = written * UNITS[unit][1]
        for row in np.flatnonzero(~bounds.holds(si)).tolist():
            si[row] = math.nan
            if not cells[row] and blank is not None:
                si[row] = blank
            elif not cells[row]:
                self.refuse(row, name, None, shown, "is blank; state a number")
            elif not math.isfinite(written[row]):
                self.refuse(row, name, cells[row], shown, "must be a finite number, with a decimal point")
            else:
                try:
                    bounds.check(float(written[row]), unit, name=name)
                except InputError as error:
                    self.refuse(row, name, error.value, shown, error.remedy)
        return si

    def refuse(self, row: int, name: str, value: object, unit: str, remedy: str) -> None:
        """Append a problem for one wrong cell."""
        line = self.lines[row]
        self.problems.append(Problem(file=self.file, line=line, name=name, value=value, unit=unit, remedy=remedy))


def _number(cell: str) -> float:
    """Return the number that a cell holds; nan where it holds none (or 1_000, which only Python reads)."""
    try:
        return math.nan if not cell or "_" in cell else float(cell)
    except ValueError:
        return math.nan


def parse_table(
    text: str, file: str, required: tuple[str, ...], known: tuple[str, ...] | None, problems: list[Problem]
) -> CsvTable | None:
    """Split a table into columns; return None if the header or the number of cells in a row is wrong.

    known: all allowed columns (None allows any). Quotes around cells are dropped, blank lines skipped.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").replace('"', "").split("\n")
    header, *rows = ([cell.strip() for cell in line.split(",")] for line in lines)
    filled = {line: row for line, row in enumerate(rows, start=2) if any(row)}
    if not text.strip():
        wrong = [Problem(file=file, remedy=f"the file is empty; begin with the line {','.join(required)}")]
    elif remedies := [*_header_remedies(header, required, known)]:
        wrong = [Problem(file=file, line=1, name=name, remedy=remedy) for name, remedy in remedies]
    elif not filled:
        wrong = [Problem(file=file, remedy="has a header but no rows; add them")]
    else:
        remedy = f"the header has {len(header)}; end the line with commas for blanks, write decimals with a point"
        ragged = {line: len(row) for line, row in filled.items() if len(row) != len(header)}
        wrong = [Problem(file=file, line=n, name="cells", value=many, remedy=remedy) for n, many in ragged.items()]
    if wrong:
        problems.extend(wrong)
        return None
    columns = {name: list(cells) for name, cells in zip(header, zip(*filled.values(), strict=True), strict=True)}
    return CsvTable(file, columns, [*filled], problems)


def _header_remedies(
    header: list[str], required: tuple[str, ...], known: tuple[str, ...] | None
) -> Iterator[tuple[str, str]]:
    """Yield the columns of a header that are wrong, each with its remedy."""
    for separator, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(header) == 1 and separator in header[0]:
            yield "", f"columns are separated by {called}; separate them by commas and write decimals with a point"
            return
    for name, count in Counter(header).items():
        if not name:
            yield "", "a column has no name; name it or remove the comma"
        elif count > 1:
            yield name, f"column stands there {count} times; keep one"
        elif known is not None and name not in known:
            unused = [k for k in known if k not in header]
            yield name, f"unknown column; {did_you_mean(name, unused or known)}"
    for name in required:
        if name not in header:
            yield name, "column is missing; add it"
