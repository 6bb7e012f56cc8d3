"""Logger files (separated text, Excel workbooks) -> tables of numbers."""

import codecs
import csv
import io
import re
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, time
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.errors import InputError
from belt_sim.importing.roles import proposed, role_named
from belt_sim.importing.types import Column, Logged, LoggedTable
from belt_sim.importing.units import split_unit, unit_named

#: Bytes looked at to tell what a file is.
HEAD = 1 << 16
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: first bytes -> what the file is, and what to do
_KNOWN = (
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls); save it as .xlsx or CSV"),
    (b"\x1f\x8b", "compressed (gzip); unpack it first"),
    (b"7z\xbc\xaf", "compressed (7z); unpack it first"),
    (b"%PDF", "a PDF; export the table as CSV"),
    (b"\x89PNG", "a picture; digitise its curves and give their table"),
    (b"\xff\xd8\xff", "a picture; digitise its curves and give their table"),
    (b"PAR1", "a Parquet file; export it as CSV"),
    (b"\x89HDF", "an HDF5 file; export the table as CSV"),
    (b"MATLAB 5.0", "a MATLAB file; export the table as CSV"),
    (b"TDSm", "a TDMS file; export the table as CSV or xlsx"),
)


def refuse(file: Path, remedy: str, **more) -> CampaignError:
    """The error of one thing that is wrong with a file."""
    return CampaignError([Problem(file=str(file), remedy=remedy, **more)])


def head_of(file: Path) -> bytes:
    """The first bytes of a file that is there and not empty; raises CampaignError otherwise."""
    try:
        if not file.is_file():
            what = "is a folder; name the files in it" if file.is_dir() else "there is no such file; check its path"
            raise refuse(file, what)
        with file.open("rb") as stream:
            head = stream.read(HEAD)
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise refuse(file, f"cannot be read ({cause}); give a file that can") from None
    if not head.strip(b"\0\xef\xbb\xbf\xff\xfe \t\r\n"):
        raise refuse(file, "is empty; export the log again")
    return head


def is_workbook(head: bytes) -> bool:
    """Whether the bytes begin a zip archive, as xlsx files are."""
    return head.startswith(b"PK\x03\x04")


def encoding_of(file: Path, head: bytes) -> str:
    """The encoding of a text file by its mark or its first bytes; raises CampaignError for what is no text.

    utf-8 is a guess that the whole file must confirm; where it does not, it is cp1252, what Windows writes.
    """
    for magic, what in _KNOWN:
        if head.startswith(magic):
            raise refuse(file, f"is {what}")
    for mark, name in _MARKS:
        if head.startswith(mark):
            return name
    even, odd = head[0::2].count(0), head[1::2].count(0)
    if even + odd:
        half = len(head) / 2.0
        if odd > 0.6 * half and even < 0.05 * half:
            return "utf-16-le"
        if even > 0.6 * half and odd < 0.05 * half:
            return "utf-16-be"
        line = head[: head.index(0)].count(b"\n") + 1
        raise refuse(file, "holds binary data; export the log as CSV, TSV or xlsx", line=line)
    control = sum(head.count(bytes([k])) for k in range(32) if k not in (7, 9, 10, 11, 12, 13, 26, 27))
    if control > 0.01 * len(head):
        raise refuse(file, "holds binary data; export the log as CSV, TSV or xlsx")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


#: What loggers write where they have nothing to say.
MISSING = (
    *("nan", "NaN", "NAN", "na", "NA", "N/A", "n/a", "null", "NULL", "None", "-", "--", "---"),
    *("#NV", "#N/A", "#WERT!", "#VALUE!", "#DIV/0!", "#BEZUG!", "#REF!"),
    *("ERR", "Err", "Error", "OVL", "OL", "INVALID", "invalid"),
)
_MISSING = frozenset(["", *MISSING])
_POINT = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
_COMMA = re.compile(r"[+-]?(?:\d+,?\d*|,\d+)(?:[eE][+-]?\d+)?\Z")
_THOUSANDS = {
    ",": re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d*)?\Z"),
    ".": re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?\Z"),
}
_CLOCK = re.compile(r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?\Z")
_DATE = re.compile(
    r"(\d{4}-\d{2}-\d{2}|\d{1,2}[./]\d{1,2}[./]\d{2,4})(?:[T ]+\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?Z?)?\Z"
)


def is_missing(cell: str) -> bool:
    return cell.strip() in _MISSING


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark."""
    return bool((_COMMA if decimal == "," else _POINT).match(cell.strip()))


def is_time(cell: str) -> bool:
    """Whether a cell is a date or a time of day."""
    cell = cell.strip()
    return bool(_CLOCK.match(cell) or _DATE.match(cell))


def has_thousands(cell: str, decimal: str) -> bool:
    """Whether a cell has thousands set apart, as 1.234,5."""
    return bool(_THOUSANDS[decimal].match(cell.strip()))


def seconds(texts: pd.Series) -> np.ndarray:
    """Dates or times of day as seconds, shape (n,); nan where a cell is neither."""
    clean = texts.astype("string").str.strip().str.replace(",", ".", regex=False)
    filled = clean.dropna()
    if filled.empty:
        return np.full(len(texts), np.nan)
    if _CLOCK.match(str(filled.iloc[0])):
        short = clean.str.count(":") == 1
        clean = clean.where(~short.fillna(False), clean + ":00")
        return pd.to_timedelta(clean, errors="coerce").dt.total_seconds().to_numpy(dtype=float)
    iso = bool(re.match(r"\d{4}-", str(filled.iloc[0])))
    found = pd.to_datetime(clean, errors="coerce", format="ISO8601" if iso else "mixed", dayfirst=not iso)
    nanoseconds = found.astype("datetime64[ns]").to_numpy().astype("int64")
    return np.where(found.isna().to_numpy(), np.nan, nanoseconds / 1e9)


def of_cell(value: object) -> object:
    """A cell of a workbook as number, text or None; dates and times of day as text that ``seconds`` reads."""
    if value is None or isinstance(value, bool):
        return None if value is None else str(value)
    if isinstance(value, int | float):
        return float(value)
    if isinstance(value, datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, time):
        return value.isoformat()
    if hasattr(value, "total_seconds"):
        return float(value.total_seconds())
    return str(value).strip()


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


#: Rows that are read at a time, and kept in all: what is beyond is averaged.
PIECE, KEPT = 100_000, 400_000
#: What tells columns of one name apart.
LETTERS = "bcdefghijklmnopqrstuvwxyz"
#: Rows by which it is decided what a column holds.
SAMPLE = 200


Read = tuple[dict[str, np.ndarray], np.ndarray, int, set[str]]


def read_text(file: Path, scan: Scan, key: int | None = None) -> Read:
    """Columns by name, line of each row, how many rows each stands for, and which columns were dates or clocks [s].

    key: position of the column (time or travel) that must not be averaged across a place where it falls back.
    """
    every = -(-scan.rows // KEPT)
    names = unique(scan.layout.names)
    pieces: list[pd.DataFrame] = []
    lines: list[np.ndarray] = []
    kinds: list[str] = []
    start = 0
    for raw in _pieces(file, scan, names):
        kinds = kinds or [_kind(raw[n], scan) for n in names]
        own = scan.lines(start, len(raw))
        frame = pd.DataFrame({n: _converted(raw[n], k, scan, own, file) for n, k in zip(names, kinds, strict=True)})
        if every > 1:
            group = _groups(frame, names, kinds, key, every)
            frame, own = _averaged(frame, group), own[np.flatnonzero(np.diff(group, prepend=-1))]
        pieces.append(frame)
        lines.append(own)
        start += len(raw)
    whole = pd.concat(pieces, ignore_index=True)
    columns = {n: _array(whole[n], kind) for n, kind in zip(names, kinds, strict=True)}
    stamps = {n for n, kind in zip(names, kinds, strict=True) if kind == "time"}
    return columns, np.concatenate(lines), every, stamps


def unique(names: tuple[str, ...]) -> list[str]:
    """Names of columns, no two alike: a second ``y`` becomes ``y (b)`` (a number would name a place)."""
    found: list[str] = []
    for k, name in enumerate(names):
        name = base = name or f"column_{k + 1}"
        letters = iter(LETTERS)
        while name in found:
            name = f"{base} ({next(letters, f'no {k + 1}')})"
        found.append(name)
    return found


def _pieces(file: Path, scan: Scan, names: list[str]) -> Iterator[pd.DataFrame]:
    layout = scan.layout
    common: dict[str, Any] = {
        "header": None,
        "names": [*names, "_end"] if scan.trailing else names,
        "usecols": names,
        "index_col": False,
        "skiprows": [*range(layout.first - 1), *(n - 1 for n in scan.skip)],
        "encoding": scan.encoding,
        "encoding_errors": "replace" if scan.encoding == "cp1252" else "strict",
        "decimal": layout.decimal,
        "thousands": layout.thousands,
        "na_values": list(MISSING),
        "skipinitialspace": True,
        "skip_blank_lines": False,
        "chunksize": PIECE,
        "engine": "c",
    }
    common["sep"] = r"\s+" if layout.separator == " " else layout.separator
    try:
        with pd.read_csv(file, **common) as reader:
            yield from reader
    except (pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise refuse(file, f"is no table that can be read ({' '.join(str(error).split())}); export it again") from None


def _kind(column: pd.Series, scan: Scan) -> str:
    """number, time or text, by the first filled cells."""
    if pd.api.types.is_numeric_dtype(column):
        return "number"
    cells = [str(c).strip() for c in column.dropna().iloc[:SAMPLE]]
    numbers = sum(is_number(c, ".") or is_number(c, ",") or has_thousands(c, scan.layout.decimal) for c in cells)
    if sum(map(is_time, cells)) > 0.5 * len(cells) > numbers:
        return "time"
    return "number" if numbers > 0.5 * len(cells) else "text"


def _converted(column: pd.Series, kind: str, scan: Scan, lines: np.ndarray, file: Path) -> Any:
    if kind == "text":
        return column.astype("string").str.strip().astype(object)
    if kind == "time":
        found = seconds(column)
        _refuse_first(file, column, ~np.isfinite(found), lines, "is neither a date nor a time of day; mend this cell")
        return found
    if pd.api.types.is_numeric_dtype(column):
        return column.astype(float)
    decimal, other = scan.layout.decimal, "." if scan.layout.decimal == "," else ","
    cells = column.astype("string").str.strip()
    bad = np.array([not pd.isna(c) and not is_missing(c) and not is_number(c, decimal) for c in cells])
    mixed = [str(c) for c in cells[bad] if is_number(str(c), other)] if bad.any() else []
    remedy = "is no number; mend this cell or leave it blank"
    if mixed:
        remedy = f"decimal marks are mixed: the file has '{decimal}' elsewhere; write one mark throughout"
    _refuse_first(file, column, bad, lines, remedy)
    return pd.to_numeric(cells.str.replace(decimal, ".", regex=False), errors="coerce").astype(float)


def _refuse_first(file: Path, column: pd.Series, bad: np.ndarray, lines: np.ndarray, remedy: str) -> None:
    bad = bad & column.notna().to_numpy()
    if bad.any():
        k = int(np.flatnonzero(bad)[0])
        name, value = str(column.name), str(column.iloc[k])
        problem = Problem(file=str(file), line=int(lines[k]), name=name, value=value, remedy=remedy)
        raise CampaignError([problem])


def _groups(frame: pd.DataFrame, names: list[str], kinds: list[str], key: int | None, every: int) -> np.ndarray:
    """Number of the group that each row is averaged in: ``every`` rows, none across a new text or a fall of ``key``."""
    cut = np.zeros(len(frame), dtype=bool)
    for name, kind in zip(names, kinds, strict=True):
        if kind == "text":
            cut |= (frame[name] != frame[name].shift()).to_numpy(dtype=bool, na_value=False)
    if key is not None and kinds[key] != "text":
        cut |= np.diff(frame[names[key]].to_numpy(), prepend=-np.inf) < 0.0
    cut[0] = True
    begin = np.flatnonzero(cut)
    since = np.arange(len(frame)) - np.repeat(begin, np.diff(np.append(begin, len(frame))))
    return np.cumsum(cut | (since % every == 0)) - 1


def _averaged(frame: pd.DataFrame, group: np.ndarray) -> pd.DataFrame:
    how = {n: "mean" if pd.api.types.is_numeric_dtype(frame[n]) else "first" for n in frame.columns}
    return frame.groupby(group, sort=False).agg(how)


def _array(column: pd.Series, kind: str) -> np.ndarray:
    if kind != "text":
        return column.to_numpy(dtype=float)
    return np.array(["" if pd.isna(c) else str(c) for c in column], dtype=object)


#: Unpacked bytes of a workbook that are read; a sheet is at most a million rows.
LARGEST = 2_000_000_000


Sheet = tuple[Layout, dict[str, np.ndarray], np.ndarray, set[str]]


def sheets(file: Path) -> Iterator[tuple[str, Layout, dict[str, np.ndarray], np.ndarray, set[str]]]:
    """(sheet, layout, columns, line of each row, columns that were dates or clocks [s]) of every sheet with a table;
    raises CampaignError without any."""
    import openpyxl

    try:
        with zipfile.ZipFile(file) as packed:
            size = sum(info.file_size for info in packed.infolist())
        if size > LARGEST:
            raise refuse(file, f"unpacks to {size / 1e9:.1f} GB; export the sheet as CSV")
        book = openpyxl.load_workbook(file, read_only=True, data_only=True)
    except (OSError, KeyError, ValueError, zipfile.BadZipFile, openpyxl.utils.exceptions.InvalidFileException) as error:
        raise refuse(file, f"is no Excel workbook that can be read ({error}); save it as .xlsx or CSV") from None
    found = 0
    try:
        for sheet in book.worksheets:
            rows = [[of_cell(v) for v in row] for row in sheet.iter_rows(values_only=True)]
            table = _table(file, sheet.title, _trimmed(rows))
            if table is not None:
                found += 1
                yield sheet.title, *table
    finally:
        book.close()
    if not found:
        raise refuse(file, "holds no sheet with a table of numbers; is it the right workbook?")


def _trimmed(rows: list[list[object]]) -> list[list[object]]:
    """Rows without the empty columns at their right."""
    width = max((max((k + 1 for k, v in enumerate(row) if v not in (None, "")), default=0) for row in rows), default=0)
    return [[*row, *[None] * width][:width] for row in rows]


def _table(file: Path, sheet: str, rows: list[list[object]]) -> Sheet | None:
    head = [[_cell_text(v) for v in row] for row in rows[:HEAD_LINES]]
    layout = max((of_rows(head, d) for d in (".", ",")), key=lambda x: x is not None)
    if layout is None or len(layout.names) < 2:
        return None
    lines = [n for n, row in enumerate(rows, start=1) if n >= layout.first and any(v not in (None, "") for v in row)]
    columns, stamps = {}, set()
    for k, name in enumerate(unique(layout.names)):
        cells = [rows[n - 1][k] for n in lines]
        columns[name] = _column(file, sheet, name, cells, lines)
        if _are_times(cells):
            stamps.add(name)
    return layout, columns, np.array(lines), stamps


def _cell_text(value: object) -> str:
    return "" if value is None else f"{value:.15g}" if isinstance(value, float) else str(value)


def _are_times(cells: list[object]) -> bool:
    """Whether most cells are dates or times of day."""
    filled = [c for c in cells if c is not None and not is_missing(_cell_text(c))]
    return sum(isinstance(c, str) and is_time(c) for c in filled) > 0.5 * len(filled)


def _column(file: Path, sheet: str, name: str, cells: list[object], lines: list[int]) -> np.ndarray:
    """A column as numbers, or as texts when most of its cells are."""
    filled = [c for c in cells if c is not None and not is_missing(_cell_text(c))]
    texts = [c for c in filled if isinstance(c, str)]
    numeric = len(filled) - len(texts) + sum(is_number(c, ".") or is_number(c, ",") for c in texts)
    if _are_times(cells):
        return seconds(pd.Series([_cell_text(c) for c in cells]))
    if numeric <= 0.5 * len(filled):
        return np.array([_cell_text(c) for c in cells], dtype=object)
    found = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if isinstance(cell, float):
            found[k] = cell
        elif cell is not None and not is_missing(_cell_text(cell)):
            text = _cell_text(cell).replace(",", ".")
            if not is_number(text, "."):
                remedy = "is no number; mend this cell or leave it blank"
                problem = Problem(file=f"{file} [{sheet}]", line=lines[k], name=name, value=cell, remedy=remedy)
                raise CampaignError([problem])
            found[k] = float(text)
    return found


def read(files: Sequence[str | Path], form: Mapping[str, str] | None = None) -> Logged:
    """Read logger files (CSV, TSV, other separated text, xlsx), with a role, a unit and a place proposed per column.

    form: what is known of the format of text files: separator, decimal, encoding. Raises CampaignError, InputError.
    """
    paths = [Path(f) for f in files]
    if not paths:
        raise InputError(
            "files", "[]", "", "name the files of your logger after the command, as belt-sim import a.csv b.csv"
        )
    twice = next((p for k, p in enumerate(paths) if p in paths[:k]), None)
    if twice is not None:
        raise InputError("files", twice, "", "is named twice; name each file once")
    tables: list[LoggedTable] = []
    for path in paths:
        head = head_of(path)
        tables += _workbook(path) if is_workbook(head) else [_text(path, head, form or {})]
    return Logged(tables=tuple(proposed(t) for t in _named_apart(tables)))


def _text(path: Path, head: bytes, form: Mapping[str, str]) -> LoggedTable:
    encoding = form.get("encoding") or encoding_of(path, head)
    seen = scan(path, encoding, dict(form))
    roles = [role_named(split_unit(n)[0]) for n in seen.layout.names]
    key = next((roles.index(role) for role in ("travel", "time") if role in roles), None)
    columns, lines, every, stamps = read_text(path, seen, key)
    notes = [f"{path.name}: {seen.encoding}, {seen.layout.words}, {seen.rows} rows"]
    notes += [f"{path.name}: {note}" for note in seen.notes]
    if every > 1:
        notes.append(f"{path.name}: every {every} rows were averaged while reading")
    starts = np.searchsorted(lines, seen.again)
    return LoggedTable(
        name=path.stem,
        file=path,
        columns=_columns(columns, seen.layout, stamps),
        lines=lines,
        starts=tuple(int(k) for k in starts if 0 < k < len(lines)),
        averaged=every,
        notes=tuple(notes),
    )


def _workbook(path: Path) -> list[LoggedTable]:
    found = []
    for sheet, layout, columns, lines, stamps in sheets(path):
        notes = (f"{path.name} [{sheet}]: {len(lines)} rows",)
        found.append(
            LoggedTable(name=sheet, file=path, columns=_columns(columns, layout, stamps), lines=lines, notes=notes)
        )
    if len(found) == 1:
        found = [replace(found[0], name=path.stem)]
    return found


def _columns(values: Mapping[str, np.ndarray], layout: Layout, stamps: set[str]) -> tuple[Column, ...]:
    stated = [unit_named(u) or "" if u else "" for u in layout.units]
    units = ["s" if n in stamps else u for n, u in zip(values, stated, strict=True)]
    return tuple(Column(name=n, values=v, unit=u) for (n, v), u in zip(values.items(), units, strict=True))


def _named_apart(tables: list[LoggedTable]) -> list[LoggedTable]:
    """Tables of one name get their file's, or a number, to tell them apart."""
    found: list[LoggedTable] = []
    for table in tables:
        name, n = table.name, 2
        while any(t.name == name for t in found):
            name, n = f"{table.name}_{n}", n + 1
        found.append(replace(table, name=name))
    return found
