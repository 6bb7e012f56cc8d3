"""One look at every line of a text file: how many rows, which are ragged, empty or a header that stands there again."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from belt_sim.intake.encoding import refuse
from belt_sim.intake.layout import HEAD_LINES, Layout, layout_of, split

#: A line longer than this is no row of a table [characters].
LONGEST = 100_000


@dataclass(frozen=True, kw_only=True)
class Scan:
    """encoding; layout; skip: lines from the first data row on that hold no data; again: those of them that repeat the
    header; rows: data rows; trailing: whether rows end with a separator; notes."""

    encoding: str
    layout: Layout
    skip: tuple[int, ...]
    again: tuple[int, ...]
    rows: int
    trailing: bool
    notes: tuple[str, ...]

    def lines(self, start: int, count: int) -> np.ndarray:
        """Lines in the file of the data rows from ``start`` on."""
        line = np.arange(start, start + count) + self.layout.first
        for skipped in self.skip:
            line += line >= skipped
        return line


def scan(file: Path, encoding: str, asked: dict[str, str] | None = None) -> Scan:
    """Look through a file; raises CampaignError for what is no table or a row that does not fit."""
    try:
        return _scan(file, encoding, asked)
    except UnicodeDecodeError:
        if encoding != "utf-8":
            raise refuse(file, f"is not the {encoding} text that it begins as; save it as UTF-8 text") from None
        return _scan(file, "cp1252", asked)


def _scan(file: Path, encoding: str, asked: dict[str, str] | None) -> Scan:
    errors = "strict" if encoding != "cp1252" else "replace"
    with file.open(encoding=encoding, errors=errors, newline=None) as stream:
        head = list(islice(_bounded(stream, file), HEAD_LINES))
        layout = layout_of(head, asked)
        if layout is None:
            remedy = "no table of numbers is seen in it (columns by tabs, semicolons, commas, bars or blanks)"
            raise refuse(file, f"{remedy}; export it as CSV, or name format: {{separator: ..., decimal: ...}}")
        return _rows(file, encoding, layout, head, _bounded(stream, file))


def _bounded(stream, file: Path) -> Iterator[str]:
    for line in stream:
        if len(line) > LONGEST:
            raise refuse(file, f"has a line of {len(line)} characters; is it a table?")
        yield line


def _rows(file: Path, encoding: str, layout: Layout, head: list[str], rest: Iterator[str]) -> Scan:
    width, header = len(layout.names), head[layout.header - 1].strip() if layout.header else None
    odd: list[tuple[int, int]] = []
    skip, again, trailing, count, number = [], [], 0, 0, layout.first - 1
    for lines in (head[layout.first - 1 :], rest):
        for line in lines:
            number += 1
            if "\0" in line:
                raise refuse(file, "holds binary data from here on; give the text before it", line=number)
            text = line.strip()
            if not text.strip(layout.separator + " "):
                skip.append(number)
            elif text == header:
                skip.append(number)
                again.append(number)
            else:
                cells = _count(line, layout.separator)
                if cells == width + 1 and text.endswith(layout.separator):
                    trailing += 1
                elif cells != width and not odd:
                    odd.append((number, cells))
                elif cells != width:
                    odd = [*odd[:1], (number, cells)]
                count += 1
    notes = _notes(file, layout, odd, number, width, again, trailing)
    if odd:
        skip.append(number)
        count -= 1
    if count <= 0:
        raise refuse(file, "has a header but no rows of numbers; export the log again")
    return Scan(
        encoding=encoding,
        layout=layout,
        skip=tuple(skip),
        again=tuple(n for n in again if n > layout.first),
        rows=count,
        trailing=trailing > 0,
        notes=notes,
    )


def _count(line: str, separator: str) -> int:
    if '"' in line or separator == " ":
        return len(split(line, separator))
    return line.count(separator) + 1


def _notes(file, layout, odd, last, width, again, trailing) -> tuple[str, ...]:
    """Remarks; raises CampaignError for ragged rows, of which only the last may be cut short."""
    found = []
    if odd and not (len(odd) == 1 and odd[0] == (last, odd[0][1]) and odd[0][1] < width):
        line, cells = odd[0]
        remedy = f"the header has {width}; mend this row, or name format: {{separator: ..., decimal: ...}}"
        raise refuse(file, remedy, line=line, name="cells", value=cells)
    if odd:
        found.append(f"line {last} is cut short and was left out")
    if again:
        lines = ", ".join(map(str, again[:5])) + (" ..." if len(again) > 5 else "")
        found.append(f"the header stands there again in line {lines}; what follows counts as a run of its own")
    return tuple(found)
