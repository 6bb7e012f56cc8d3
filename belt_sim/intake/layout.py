"""How a text file is laid out: separator, decimal mark, header, units row, where the data begin."""

import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from belt_sim.intake.cells import has_thousands, is_missing, is_number, is_time
from belt_sim.intake.units import unit_named

#: Lines looked at.
HEAD_LINES = 300
SEPARATORS = ("\t", ";", ",", "|", " ")
CALLED = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}


@dataclass(frozen=True, kw_only=True)
class Layout:
    """names: columns, as written; units: of a units row ("" where none); first: line of the first data row, from 1;
    header: line of the header (0: none)."""

    separator: str
    decimal: str
    thousands: str | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    header: int
    first: int

    @property
    def words(self) -> str:
        header = f"header in line {self.header}" if self.header else "no header"
        return f"{CALLED[self.separator]}, decimal {'comma' if self.decimal == ',' else 'point'}, {header}"


def layout_of(lines: Sequence[str], asked: dict[str, str] | None = None) -> Layout | None:
    """The layout of the first lines of a file; None when no table stands there.

    asked: what is known already: separator, decimal.
    """
    asked = asked or {}
    separators = [asked["separator"]] if asked.get("separator") else SEPARATORS
    decimals = [asked["decimal"]] if asked.get("decimal") else (".", ",")
    quoted = any('"' in line for line in lines)  # only then may a comma be both
    tried = [(_score(lines, s, d), s, d) for s in separators for d in decimals if s != d or quoted]
    score, separator, decimal = max(tried, key=lambda t: t[0])  # of equals the first
    if score <= 0.0:
        return None
    rows = [split(line, separator) for line in lines]
    return of_rows(rows, decimal, separator)


def of_rows(rows: Sequence[Sequence[str]], decimal: str, separator: str = ";") -> Layout | None:
    """The layout of rows of cells."""
    counts = Counter(len(row) for row in rows if _is_data(row, decimal))
    if not counts:
        return None
    width = counts.most_common(1)[0][0]
    first = next(k for k, row in enumerate(rows) if len(row) == width and _is_data(row, decimal))
    above = [k for k in range(first) if any(c.strip() for c in rows[k])]
    header, units = 0, ("",) * width
    if above and _is_units(rows[above[-1]]) and len(above) > 1:
        units = tuple((unit_named(c) or "") for c in _padded(rows[above[-1]], width))
        above.pop()
    names = tuple(f"column_{k + 1}" for k in range(width))
    if above and _is_header(rows[above[-1]], width, decimal):
        header = above[-1] + 1
        while len(above) > 1 and list(rows[above[-2]]) == list(rows[above[-1]]):
            above.pop()  # the header stands there twice
        names = tuple(c.strip() for c in _padded(rows[above[-1]], width))
    cells = [c for row in rows[first:] for c in row if c.strip()]
    thousands = {",": ".", ".": ","}[decimal]
    apart = thousands != separator and any(has_thousands(c, decimal) for c in cells) and _all_fit(cells, decimal)
    return Layout(
        separator=separator,
        decimal=decimal,
        thousands=thousands if apart else None,
        names=names,
        units=units,
        header=header,
        first=first + 1,
    )


def split(line: str, separator: str) -> list[str]:
    """The cells of a line."""
    line = line.rstrip("\r\n")
    if separator == " ":
        return line.split()
    if '"' in line:
        return next(csv.reader(io.StringIO(line), delimiter=separator), [])
    return line.split(separator)


def _score(lines: Sequence[str], separator: str, decimal: str) -> float:
    """How many cells of data rows are numbers or times: 0 when rows do not hang together."""
    rows = [split(line, separator) for line in lines if line.strip()]
    widths = Counter(len(row) for row in rows if _is_data(row, decimal))
    if not widths:
        return 0.0
    width, count = widths.most_common(1)[0]
    if width < 2:
        return 0.0
    good = sum(_numbers(row, decimal) for row in rows if len(row) == width)
    cells = sum(sum(bool(c.strip()) for c in row) for row in rows if len(row) == width)
    return count * (good / max(cells, 1)) ** 3 * (1.0 if separator != " " else 0.6)


def _numbers(row: Sequence[str], decimal: str) -> int:
    return sum(is_number(c, decimal) or is_time(c) or has_thousands(c, decimal) for c in row)


def _is_data(row: Sequence[str], decimal: str) -> bool:
    """Whether half the filled cells of a row are numbers or times."""
    filled = [c for c in row if c.strip() and not is_missing(c)]
    return bool(filled) and len(row) > 1 and _numbers(filled, decimal) >= 0.5 * len(filled)


def _is_units(row: Sequence[str]) -> bool:
    filled = [c for c in row if c.strip()]
    known = [c for c in filled if unit_named(c) is not None]
    return bool(filled) and len(known) >= 0.5 * len(filled) and all(len(c.strip()) < 12 for c in filled)


def _is_header(row: Sequence[str], width: int, decimal: str) -> bool:
    filled = [c for c in row if c.strip()]
    return len(filled) > 1 and abs(len(row) - width) <= 1 and _numbers(filled, decimal) < 0.5 * len(filled)


def _padded(row: Sequence[str], width: int) -> list[str]:
    return [*row, *[""] * width][:width]


def _all_fit(cells: Sequence[str], decimal: str) -> bool:
    """Whether every cell that looks like a number has thousands set apart in the right places."""
    other = "." if decimal == "," else ","
    odd = [c for c in cells if other in c and not is_time(c)]
    return all(has_thousands(c, decimal) for c in odd) and any(decimal in c for c in cells)
