"""Where the table of a logger's file begins, how its columns are set apart, and what they are called."""

import csv
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count
from typing import Any

from belt_sim.importing.cells import count_readings, has_thousands, is_missing, is_time
from belt_sim.importing.roles import role_named
from belt_sim.importing.units import unit_named

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}


@dataclass(frozen=True, kw_only=True)
class Layout:
    """names: columns, no two alike; units: of a units row ("" where none); first: line of the first data row, from 1;
    header: line of the header (0: none); score: how many rows of data it sees, less where their cells are no numbers
    or times."""

    separator: str
    decimal: str
    thousands: str | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    header: int
    first: int
    score: float

    def __str__(self) -> str:
        header = f"header in line {self.header}" if self.header else "no header"
        return f"{SEPARATORS[self.separator]}, decimal {'comma' if self.decimal == ',' else 'point'}, {header}"


def layout_of(lines: Sequence[str], stated: Mapping[str, Any]) -> Layout | None:
    """The layout of the first lines of a file; None when no table stands there. stated: separator, decimal."""
    separators = [stated["separator"]] if stated.get("separator") else list(SEPARATORS)
    decimals = [stated["decimal"]] if stated.get("decimal") else [".", ","]
    quoted = any('"' in line for line in lines)  # only then may a comma be both
    marks = [(s, d) for s in separators for d in decimals if s != d or quoted]
    tried = (_layout_with(s, d, [split(line, s) for line in lines]) for s, d in marks)
    return max((t for t in tried if t), key=lambda layout: layout.score, default=None)  # of equals the first


def _layout_with(separator: str, decimal: str, rows: Sequence[Sequence[str]]) -> Layout | None:
    """The layout of rows of cells: its table is as wide as most rows of data, and begins with the first of these."""
    of_data = [k for k, row in enumerate(rows) if _is_data(row, decimal)]
    if not of_data:
        return None
    width, height = Counter(len(rows[k]) for k in of_data).most_common(1)[0]
    first = next(k for k in of_data if len(rows[k]) == width)
    header, names, units = _head(rows[:first], width, decimal)
    cells = [c for row in rows if len(row) == width for c in row if c.strip()]
    return Layout(
        separator=separator,
        decimal=decimal,
        thousands=_thousands_mark(rows[first:], decimal, separator),
        names=names,
        units=units,
        header=header,
        first=first + 1,
        score=height * (count_readings(cells, decimal) / len(cells)) ** 3 * (0.6 if separator == " " else 1.0),
    )


def _head(above: Sequence[Sequence[str]], width: int, decimal: str) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Line of the header (0: none), names and units of the columns, from the rows above the data."""
    filled = [k for k, row in enumerate(above) if any(c.strip() for c in row)]
    header, names, units = 0, [""] * width, [""] * width
    if len(filled) > 1 and _is_units(above[filled[-1]], above[filled[-2]]):
        cells = _pad(above[filled.pop()], width)
        units = ["" if is_missing(c) else unit_named(c) or c.strip("[](){}<> ") for c in cells]
    if filled and _is_header(above[filled[-1]], width, decimal):
        header = filled[-1] + 1
        names = [c.strip() for c in _pad(above[filled[-1]], width)]
    names = [name or f"column_{k}" for k, name in enumerate(names, start=1)]
    letters = "abcdefghijklmnopqrstuvwxyz"  # for a second y, as "y (2)" would name a place
    names = unique(names, lambda n: f" ({letters[n - 1] if n <= len(letters) else f'no {n}'})")
    return header, tuple(names), tuple(units)


def _thousands_mark(rows: Sequence[Sequence[str]], decimal: str, separator: str) -> str | None:
    """The mark that sets thousands apart, if every cell that has it is such a number, and some have decimals."""
    mark = "," if decimal == "." else "."
    cells = [c for row in rows for c in row]
    marked = [c for c in cells if mark in c and not is_time(c)]
    if mark == separator or not marked or not any(decimal in c for c in cells):
        return None
    return mark if all(has_thousands(c, decimal) for c in marked) else None


def split(line: str, separator: str) -> list[str]:
    """The cells of a line."""
    if separator == " ":
        return line.split()
    if '"' in line:
        return next(csv.reader([line], delimiter=separator), [])
    return line.split(separator)


def unique(names: Iterable[str], suffix: Callable[[int], str]) -> list[str]:
    """Names, no two alike: one that was there gets the suffix of 2, of 3, ..."""
    found: list[str] = []
    for name in names:
        tried = chain([name], (name + suffix(n) for n in count(2)))
        found.append(next(n for n in tried if n not in found))
    return found


def _is_data(row: Sequence[str], decimal: str) -> bool:
    """Whether half the filled cells of a row are numbers or times."""
    filled = [c for c in row if not is_missing(c)]
    return bool(filled) and len(row) > 1 and count_readings(filled, decimal) >= 0.5 * len(filled)


def _is_units(row: Sequence[str], above: Sequence[str]) -> bool:
    """Whether most cells of a row are units, or some where the row above has the names; above: that row."""
    filled = [c for c in row if c.strip()]
    known = [c for c in filled if unit_named(c) is not None]
    named, spoken = (sum(len(c.strip()) > 1 and role_named(c) != "" for c in cells) for cells in (above, row))
    most = len(known) >= 0.5 * len(filled) or (len(known) > 0 and len(above) == len(row) and named > spoken)
    return bool(filled) and most and all(len(c.strip()) < 12 for c in filled)


def _is_header(row: Sequence[str], width: int, decimal: str) -> bool:
    filled = [c for c in row if c.strip()]
    return len(filled) > 1 and abs(len(row) - width) <= 1 and count_readings(filled, decimal) < 0.5 * len(filled)


def _pad(row: Sequence[str], width: int) -> list[str]:
    return [*row, *[""] * width][:width]
