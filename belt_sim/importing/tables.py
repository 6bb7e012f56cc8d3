"""Logger files (separated text, Excel workbooks) -> tables of numbers."""

import codecs
import csv
import io
import re
import zipfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.errors import InputError
from belt_sim.importing.roles import propose_roles
from belt_sim.importing.types import Column, LoggedTable, LoggedTables, Note
from belt_sim.importing.units import unit_named

#: Bytes by which the encoding is told, lines by which the layout is, cells by which a column's kind is.
HEAD, HEAD_LINES, SAMPLE = 1 << 16, 300, 200
#: Largest text file, and largest workbook when unpacked [bytes]; longest line [characters].
LARGEST, LARGEST_WORKBOOK, LONGEST_LINE = 500_000_000, 2_000_000_000, 100_000
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: first bytes -> what the file is, and what to do
_FORMATS = (
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
#: Words that loggers write where they have no reading.
MISSING = (
    *("nan", "NaN", "NAN", "na", "NA", "N/A", "n/a", "null", "NULL", "None", "-", "--", "---"),
    *("#NV", "#N/A", "#WERT!", "#VALUE!", "#DIV/0!", "#BEZUG!", "#REF!"),
    *("ERR", "Err", "Error", "OVL", "OL", "INVALID", "invalid"),
)
#: Numbers that loggers write where they have no reading; taken as such where they lie FAR ranges off all others.
CODES = (-9999.0, 9999.0, -999.0, 999.0, -99999.0, 99999.0, -32768.0, 32767.0, 65535.0, -1e30, 1e30, 9.9e37)
FAR = 10.0
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}
_NUMBER = {
    ".": re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z"),
    ",": re.compile(r"[+-]?(?:\d+,?\d*|,\d+)(?:[eE][+-]?\d+)?\Z"),
}
_THOUSANDS = {
    ",": re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d*)?\Z"),
    ".": re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?\Z"),
}
_CLOCK = re.compile(r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?\Z")
_DATE = re.compile(
    r"(\d{4}-\d{2}-\d{2}|\d{1,2}[./]\d{1,2}[./]\d{2,4})(?:[T ]+\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?Z?)?\Z"
)


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


def read(files: Sequence[str | Path], form: Mapping[str, Any] | None = None) -> LoggedTables:
    """Read logger files (CSV, TSV, other separated text, xlsx), with a role, a unit and a place proposed per column.

    form: what is known of the files: separator, decimal, encoding, missing (numbers that stand for no reading). Raises
    CampaignError, InputError.
    """
    paths, form = [Path(f) for f in files], form or {}
    if not paths:
        raise InputError(
            "files", "[]", "", "name the files of your logger after the command, as belt-sim import a.csv b.csv"
        )
    twice = next((p for k, p in enumerate(paths) if p in paths[:k]), None)
    if twice is not None:
        raise InputError("files", twice, "", "is named twice; name each file once")
    tables: list[LoggedTable] = []
    for path in paths:
        data = _read_bytes(path)
        tables += _read_workbook(path, form) if data.startswith(b"PK\x03\x04") else [_read_text(path, data, form)]
    return LoggedTables(tables=tuple(propose_roles(t) for t in _rename_twins(tables)))


def refuse(file: Path | str, remedy: str, **more: Any) -> CampaignError:
    """The error of one thing that is wrong with a file."""
    return CampaignError([Problem(file=str(file), remedy=remedy, **more)])


def _rename_twins(tables: list[LoggedTable]) -> list[LoggedTable]:
    """Tables of one name get a number to tell them apart."""
    found: list[LoggedTable] = []
    for table in tables:
        name, n = table.name, 2
        while any(t.name == name for t in found):
            name, n = f"{table.name}_{n}", n + 1
        found.append(replace(table, name=name))
    return found


# ---- text files


def _read_bytes(file: Path) -> bytes:
    """The content of a file that is there and not empty."""
    try:
        if not file.is_file():
            what = "is a folder; name the files in it" if file.is_dir() else "there is no such file; check its path"
            raise refuse(file, what)
        size = file.stat().st_size
        if size > LARGEST:
            raise refuse(file, f"has {size / 1e9:.1f} GB; export it at a lower rate, or cut it")
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise refuse(file, f"cannot be read ({cause}); give a file that can") from None
    if not data[:HEAD].strip(b"\0\xef\xbb\xbf\xff\xfe \t\r\n"):
        raise refuse(file, "is empty; export the log again")
    return data


def _decode(file: Path, data: bytes, stated: str | None) -> tuple[str, str]:
    """(text, encoding): as stated, by its mark, UTF-16 by its zero bytes, else UTF-8, else cp1252 (Windows)."""
    for magic, what in _FORMATS:
        if data.startswith(magic):
            raise refuse(file, f"is {what}")
    encoding = (
        stated or next((name for mark, name in _MARKS if data.startswith(mark)), None) or _guess_encoding(file, data)
    )
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        if encoding != "utf-8":
            raise refuse(file, f"is not the {encoding} text that it begins as; save it as UTF-8 text") from None
        text, encoding = data.decode("cp1252", errors="replace"), "cp1252"
    except LookupError:
        raise refuse(file, f"format.encoding = {encoding} is not known; use utf-8, cp1252, utf-16") from None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise refuse(file, "holds binary data from here on; give the text before it", line=line)
    return text, encoding


def _guess_encoding(file: Path, data: bytes) -> str:
    head = data[:HEAD]
    even, odd, half = head[0::2].count(0), head[1::2].count(0), len(head) / 2.0
    if odd > 0.6 * half and even < 0.05 * half:
        return "utf-16-le"
    if even > 0.6 * half and odd < 0.05 * half:
        return "utf-16-be"
    if even + odd:
        line = head[: head.index(0)].count(b"\n") + 1
        raise refuse(file, "holds binary data; export the log as CSV, TSV or xlsx", line=line)
    control = sum(head.count(bytes([k])) for k in range(32) if k not in (7, 9, 10, 11, 12, 13, 26, 27))
    if control > 0.01 * len(head):
        raise refuse(file, "holds binary data; export the log as CSV, TSV or xlsx")
    return "utf-8"


def _read_text(file: Path, data: bytes, form: Mapping[str, Any]) -> LoggedTable:
    text, encoding = _decode(file, data, form.get("encoding"))
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    longest = max(map(len, lines))
    if longest > LONGEST_LINE:
        raise refuse(file, f"has a line of {longest} characters; is it a table?")
    layout = layout_of(lines[:HEAD_LINES], form)
    if layout is None:
        remedy = "no table of numbers is seen in it (columns by tabs, semicolons, commas, bars or blanks)"
        raise refuse(file, f"{remedy}; export it as CSV, or name format: {{separator: ..., decimal: ...}}")
    kept, numbers, again, notes = _rows(file, lines, layout)
    try:
        frame = pd.read_csv(
            io.StringIO("\n".join(kept)),
            header=None,
            names=layout.names,
            index_col=False,
            sep=r"\s+" if layout.separator == " " else layout.separator,
            decimal=layout.decimal,
            thousands=layout.thousands,
            na_values=list(MISSING),
            skipinitialspace=True,
            skip_blank_lines=False,
            low_memory=False,
        )
    except pd.errors.ParserError as error:
        raise refuse(file, f"is no table that can be read ({' '.join(str(error).split())}); export it again") from None
    if len(frame) != len(kept):
        raise refuse(file, "a quotation mark is opened and not closed; mend it or export the log again")
    columns, of_codes = _columns(frame, layout, np.array(numbers), str(file), form)
    starts = np.searchsorted(numbers, again)
    return LoggedTable(
        name=file.stem,
        file=file,
        columns=columns,
        lines=np.array(numbers),
        starts=tuple(int(k) for k in starts if 0 < k < len(numbers)),
        notes=tuple(Note(file.name, what) for what in (f"{encoding}, {layout}, {len(kept)} rows", *notes, *of_codes)),
    )


def _rows(file: Path, lines: list[str], layout: Layout) -> tuple[list[str], list[int], list[int], list[str]]:
    """Rows of data, their lines, lines where the header stands again, and remarks.

    Raises CampaignError for a row that does not fit, but for a last one that is cut short.
    """
    width, separator = len(layout.names), layout.separator
    header = lines[layout.header - 1].strip() if layout.header else None
    kept: list[str] = []
    numbers: list[int] = []
    again: list[int] = []
    ragged: list[tuple[int, int]] = []
    for number, line in enumerate(lines[layout.first - 1 :], layout.first):
        text = line.strip()
        if not text.strip(separator + " "):
            continue
        if text == header:
            again.append(number)
            continue
        plain = '"' not in line and separator != " "
        cells = line.count(separator) + 1 if plain else len(split(line, separator))
        if cells == width + 1 and text.endswith(separator):
            line = text[: -len(separator)]  # every row ends with a separator
        elif cells != width:
            ragged.append((number, cells))
        kept.append(line)
        numbers.append(number)
    notes = []
    if ragged and (len(ragged) > 1 or ragged[0][0] != numbers[-1] or ragged[0][1] > width):
        remedy = f"the header has {width}; mend this row, or name format: {{separator: ..., decimal: ...}}"
        raise refuse(file, remedy, line=ragged[0][0], name="cells", value=ragged[0][1])
    if ragged:
        notes.append(f"line {numbers.pop()} is cut short and was left out")
        kept.pop()
    if again:
        shown = ", ".join(map(str, again[:5])) + (" ..." if len(again) > 5 else "")
        notes.append(f"the header stands there again in line {shown}; what follows counts as a run of its own")
    if not kept:
        raise refuse(file, "has a header but no rows of numbers; export the log again")
    return kept, numbers, again, notes


# ---- workbooks


def _read_workbook(file: Path, form: Mapping[str, Any]) -> list[LoggedTable]:
    """Every sheet that holds a table of numbers; raises CampaignError without any."""
    try:
        with zipfile.ZipFile(file) as packed:
            size = sum(info.file_size for info in packed.infolist())
        if size > LARGEST_WORKBOOK:
            raise refuse(file, f"unpacks to {size / 1e9:.1f} GB; export the sheet as CSV")
        sheets = pd.read_excel(file, sheet_name=None, header=None, dtype=object, engine="openpyxl")
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise refuse(file, f"is no Excel workbook that can be read ({error}); save it as .xlsx or CSV") from None
    found = []
    for sheet, cells in sheets.items():
        frame = cells.map(_cell_text)
        frame = frame.loc[:, (frame != "").any()]
        layout = of_rows(frame.head(HEAD_LINES).to_numpy().tolist(), ".")
        if layout is None:
            continue
        data = frame.iloc[layout.first - 1 :].set_axis(layout.names, axis=1)
        data = data[(data != "").any(axis=1)]
        lines = data.index.to_numpy() + 1
        place = f"{file.name} [{sheet}]"
        columns, of_codes = _columns(data, layout, lines, f"{file} [{sheet}]", form)
        notes = tuple(Note(place, what) for what in (f"{len(lines)} rows", *of_codes))
        found.append(LoggedTable(name=str(sheet), file=file, columns=columns, lines=lines, notes=notes))
    if not found:
        raise refuse(file, "holds no sheet with a table of numbers; is it the right workbook?")
    return [replace(found[0], name=file.stem)] if len(found) == 1 else found


def _cell_text(value: Any) -> str:
    """A cell of a workbook as text; numbers with a decimal point, dates and clocks as ``seconds`` reads them."""
    if value is None or value != value:
        return ""
    if isinstance(value, datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, time):
        return value.isoformat()
    if isinstance(value, timedelta):
        value = value.total_seconds()
    if isinstance(value, int | float) and not isinstance(value, bool):
        short = f"{value:.15g}"
        return short if float(short) == value else repr(float(value))
    text = str(value).strip()
    return text.replace(",", ".") if is_number(text, ",") else text


# ---- layout


def layout_of(lines: Sequence[str], stated: Mapping[str, Any]) -> Layout | None:
    """The layout of the first lines of a file; None when no table stands there. stated: separator, decimal."""
    separators = [stated["separator"]] if stated.get("separator") else list(SEPARATORS)
    decimals = [stated["decimal"]] if stated.get("decimal") else [".", ","]
    quoted = any('"' in line for line in lines)  # only then may a comma be both
    marks = [(s, d) for s in separators for d in decimals if s != d or quoted]
    tried = (of_rows([split(line, s) for line in lines], d, s) for s, d in marks)
    return max((t for t in tried if t), key=lambda layout: layout.score, default=None)  # of equals the first


def of_rows(rows: Sequence[Sequence[str]], decimal: str, separator: str = ";") -> Layout | None:
    """The layout of rows of cells."""
    counts = Counter(len(row) for row in rows if _is_data(row, decimal))
    if not counts:
        return None
    width, count = counts.most_common(1)[0]
    whole = [row for row in rows if len(row) == width]
    good, filled = sum(_numbers(row, decimal) for row in whole), sum(bool(c.strip()) for row in whole for c in row)
    first = next(k for k, row in enumerate(rows) if len(row) == width and _is_data(row, decimal))
    above = [k for k in range(first) if any(c.strip() for c in rows[k])]
    header, units = 0, ("",) * width
    if len(above) > 1 and _is_units(rows[above[-1]]):
        units = tuple((unit_named(c) or "") for c in _pad(rows[above.pop()], width))
    names = tuple(f"column_{k + 1}" for k in range(width))
    if above and _is_header(rows[above[-1]], width, decimal):
        header = above[-1] + 1
        names = unique([c.strip() for c in _pad(rows[above[-1]], width)])
    cells = [c for row in rows[first:] for c in row if c.strip()]
    thousands = {",": ".", ".": ","}[decimal]
    odd = [c for c in cells if thousands in c and not is_time(c)]
    apart = thousands != separator and bool(odd) and any(decimal in c for c in cells)
    return Layout(
        separator=separator,
        decimal=decimal,
        thousands=thousands if apart and all(has_thousands(c, decimal) for c in odd) else None,
        names=names,
        units=units,
        header=header,
        first=first + 1,
        score=count * (good / filled) ** 3 * (1.0 if separator != " " else 0.6),
    )


def split(line: str, separator: str) -> list[str]:
    """The cells of a line."""
    if separator == " ":
        return line.split()
    if '"' in line:
        return next(csv.reader([line], delimiter=separator), [])
    return line.split(separator)


def unique(names: Sequence[str]) -> tuple[str, ...]:
    """Names of columns, no two alike: a second ``y`` becomes ``y (b)`` (a number would name a place)."""
    found: list[str] = []
    for k, name in enumerate(names):
        name = base = name or f"column_{k + 1}"
        letters = iter("bcdefghijklmnopqrstuvwxyz")
        while name in found:
            name = f"{base} ({next(letters, f'no {k + 1}')})"
        found.append(name)
    return tuple(found)


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


def _pad(row: Sequence[str], width: int) -> list[str]:
    return [*row, *[""] * width][:width]


# ---- cells


def is_missing(cell: str) -> bool:
    return not cell.strip() or cell.strip() in MISSING


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark."""
    return bool(_NUMBER[decimal].match(cell.strip()))


def is_time(cell: str) -> bool:
    """Whether a cell is a date or a time of day."""
    return bool(_CLOCK.match(cell.strip()) or _DATE.match(cell.strip()))


def has_thousands(cell: str, decimal: str) -> bool:
    """Whether a cell has thousands set apart, as 1.234,5."""
    return bool(_THOUSANDS[decimal].match(cell.strip()))


def _numbers(row: Sequence[str], decimal: str) -> int:
    return sum(is_number(c, decimal) or is_time(c) or has_thousands(c, decimal) for c in row)


def seconds(texts: pd.Series) -> np.ndarray:
    """Dates or times of day as seconds, shape (n,); nan where a cell is neither."""
    clean = texts.astype("string").str.strip().str.replace(",", ".", regex=False)
    filled = clean[clean.notna() & (clean != "")]
    if filled.empty:
        return np.full(len(texts), np.nan)
    if _CLOCK.match(str(filled.iloc[0])):
        clean = clean.where(~(clean.str.count(":") == 1).fillna(False), clean + ":00")
        return pd.to_timedelta(clean, errors="coerce").dt.total_seconds().to_numpy(dtype=float)
    iso = bool(re.match(r"\d{4}-", str(filled.iloc[0])))
    found = pd.to_datetime(clean, errors="coerce", format="ISO8601" if iso else "mixed", dayfirst=not iso)
    nanoseconds = found.astype("datetime64[ns]").to_numpy().astype("int64")
    return np.where(found.isna().to_numpy(), np.nan, nanoseconds / 1e9)


def _columns(
    frame: pd.DataFrame, layout: Layout, lines: np.ndarray, place: str, form: Mapping[str, Any]
) -> tuple[tuple[Column, ...], list[str]]:
    """Every column as numbers, seconds or texts, and remarks on numbers that stand for no reading."""
    found, remarks = [], []
    for (name, cells), unit in zip(frame.items(), layout.units, strict=True):
        values, is_stamp = _values(cells, layout.decimal, lines, place)
        if values.dtype != object and not is_stamp:
            mask = _code_mask(values, form.get("missing"))
            if mask.any() and form.get("missing") is None:
                codes, rows = ", ".join(f"{c:g}" for c in np.unique(values[mask])), lines[mask]
                shown = ", ".join(map(str, rows[:5])) + (" ..." if len(rows) > 5 else "")
                text = f"{codes} stands for no reading (line {shown}); format: {{missing: []}} would keep it"
                remarks.append(f"{name}: {text}")
            values = np.where(mask, np.nan, values)
        found.append(Column(name=str(name), values=values, unit="s" if is_stamp else unit, stamp=is_stamp))
    return tuple(found), remarks


def _code_mask(values: np.ndarray, stated: Any) -> np.ndarray:
    """Which numbers stand for no reading: as stated, else of CODES those that lie far off all other numbers."""
    if stated is not None:
        return np.isin(values, [float(c) for c in (stated if isinstance(stated, list | tuple) else [stated])])
    rest = values[np.isfinite(values) & ~np.isin(values, CODES)]
    mask = np.zeros(len(values), dtype=bool)
    for code in CODES if len(rest) > 2 else ():
        there = values == code
        reach = FAR * max(float(np.ptp(rest)), 1e-3 * abs(code))
        if there.sum() < len(rest) and not rest.min() - reach <= code <= rest.max() + reach:
            mask |= there
    return mask


def _values(cells: pd.Series, decimal: str, lines: np.ndarray, place: str) -> tuple[np.ndarray, bool]:
    """Numbers, seconds or texts (object dtype), and whether these are dates or clocks; raises CampaignError."""
    if pd.api.types.is_numeric_dtype(cells):
        return cells.to_numpy(dtype=float), False
    texts = cells.astype("string").str.strip().fillna("")
    filled = ~texts.map(is_missing).to_numpy(dtype=bool)
    sample = [str(c) for c in texts[filled].iloc[:SAMPLE]]
    numbers = sum(is_number(c, ".") or is_number(c, ",") or has_thousands(c, decimal) for c in sample)
    are_times = sum(map(is_time, sample)) > 0.5 * len(sample)
    if are_times:
        values = seconds(texts.where(filled))
        bad, remedy = filled & ~np.isfinite(values), "is neither a date nor a time of day; mend this cell"
    elif numbers > 0.5 * len(sample):
        other = "." if decimal == "," else ","
        pointed = texts.str.replace(decimal, ".", regex=False)
        fits = texts.map(lambda c: is_number(c, decimal)).to_numpy(dtype=bool)
        values = pd.to_numeric(pointed.where(fits), errors="coerce").to_numpy(dtype=float, na_value=np.nan)
        bad, remedy = filled & ~fits, "is no number; mend this cell or leave it blank"
        if any(is_number(str(c), other) for c in texts[bad]):
            remedy = f"decimal marks are mixed: the file has '{decimal}' elsewhere; write one mark throughout"
    else:
        return np.array(["" if m else str(c) for c, m in zip(texts, ~filled, strict=True)], dtype=object), False
    if bad.any():
        k = int(np.argmax(bad))
        raise refuse(place, remedy, line=int(lines[k]), name=str(cells.name), value=str(cells.iloc[k]))
    return values, are_times
