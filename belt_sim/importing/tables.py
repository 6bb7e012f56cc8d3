"""Read logger files (separated text, Excel workbooks) as tables of numbers.

A file is decoded to lines of text; the layout of its table is found; the rows become columns of numbers, seconds or
words, in every reading that their marks allow. ``1,500`` is 1.5 or 1500, ``05/12/2024`` a day of May or of December,
``00:02`` two minutes or two seconds: where the rest of the file does not settle it, a column keeps all readings and the
mapping says which (format: {decimal, date, time}).
"""

import codecs
import csv
import io
import re
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, time, timedelta
from itertools import chain, count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from belt_sim.campaign.types import refusal, shortlist
from belt_sim.errors import BeltError, InputError
from belt_sim.importing.columns import Column, LoggedTable, LoggedTables, Note, propose_roles, roles_named
from belt_sim.importing.mapping import zone_seconds
from belt_sim.units import OTHER, plain_minus, readings_of, unit_named

#: Words that loggers write where they have no reading.
MISSING = (
    *("nan", "NaN", "NAN", "na", "NA", "N/A", "n/a", "null", "NULL", "None", "-", "--", "---"),
    *("#NV", "#N/A", "#WERT!", "#VALUE!", "#DIV/0!", "#BEZUG!", "#REF!"),
    *("ERR", "Err", "Error", "OVL", "OL", "INVALID", "invalid"),
)
#: Numbers that loggers write where they have no reading; taken as such where they lie FAR ranges off all others.
CODES = (-9999.0, 9999.0, -999.0, 999.0, -99999.0, 99999.0, -32768.0, 32767.0, 65535.0, -1e30, 1e30, 9.9e37)
FAR = 10.0
#: Cells by which the kind of a column is told.
SAMPLE = 200

#: full-width letters and digits of East Asian text
_WIDE = str.maketrans({0xFF01 + k: 0x21 + k for k in range(94)})


def is_missing(cell: str) -> bool:
    return not cell.strip() or cell.strip() in MISSING


def is_doubtful(cell: str) -> bool:
    """Whether a cell is one number or another by its decimal mark, as 1,500."""
    return len({*readings_of(cell).values()}) == 2


# ---- dates and times of day

_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
MONTHS = {name: k for k, name in enumerate(_MONTHS, start=1)} | {"mär": 3, "mai": 5, "okt": 10, "dez": 12}
_MONTH = rf"(?P<mon>{'|'.join(MONTHS)})[a-zä]*\.?"
_ZONE = r"(?:\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2}))?"
_CLOCK = (
    r"(?P<h>\d{1,3}):(?P<min>\d{2})(?::(?P<s>\d{2}(?:[.,:]\d+)?)|(?P<part>[.,]\d+))?"
    r"(?:\s*(?P<half>[ap])\.?m\.?)?(?:\s*(?:Uhr|h))?"
)
_DATES = (
    r"(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})",
    r"(?P<a>\d{1,2})(?P<mark>[-/.])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{4}|\d{2})",
    rf"(?P<d>\d{{1,2}})[-. ]*{_MONTH}[-., ]*(?P<y>\d{{4}}|\d{{2}})",
    rf"{_MONTH}[- ]*(?P<d>\d{{1,2}}),?[- ]*(?P<y>\d{{4}})",
)
_DENSE = r"(?P<y>\d{4})(?P<m>\d{2})(?P<d>\d{2})[T _](?P<h>\d{2})(?P<min>\d{2})(?P<s>\d{2}(?:[.,]\d+)?)"
_STAMPS = [
    re.compile(rf"(?:{p}){_ZONE}\Z", re.IGNORECASE)
    for p in (_CLOCK, _DENSE, *(f"{date}(?:[T, ]+{_CLOCK})?" for date in _DATES))
]
_PARTS = ("y", "m", "d", "mon", "a", "b", "c", "mark", "h", "min", "s", "part", "half", "zone")  # names of groups


def is_time(cell: str) -> bool:
    """Whether a cell is a date or a time of day."""
    return any(pattern.match(cell.strip()) for pattern in _STAMPS)


def stamps_of(texts: pd.Series, first: str) -> tuple[str, dict[str, np.ndarray], str]:
    """Dates or times of day as seconds (n,), in every reading that all cells allow: (key of ``format``, reading ->
    seconds, zone of the first); nan where a cell is not of the form of ``first``."""
    pattern = next(p for p in _STAMPS if p.match(first))
    parts = texts.str.extract(pattern).reindex(columns=_PARTS).astype("string")
    there, has = parts.notna().any(axis=1).to_numpy(), parts.notna().any()

    def number(name: str) -> np.ndarray:
        text = parts[name].str.replace(",", ".").str.replace(r":(?=\d+$)", ".", regex=True)
        return pd.to_numeric(text).to_numpy(dtype=float, na_value=np.nan)

    hours, minutes, clock = number("h"), number("min"), np.zeros(len(texts))
    if has["half"]:
        hours = hours % 12 + 12.0 * (parts["half"].str.lower() == "p").to_numpy(dtype=float, na_value=0.0)
    if has["h"]:
        clock = 3600.0 * hours + 60.0 * minutes + np.nan_to_num(number("s"))
    if not (has["y"] or has["c"]):
        # 0:00:01:30 is days to seconds, or hours to hundredths
        last = parts["s"].str.extract(r"(\d+):(\d{1,2})\Z").astype("Float64").to_numpy(dtype=float, na_value=np.nan).T
        by_minute = not (has["half"] or has["s"])
        fit = {"": (clock, there)}
        if np.isfinite(last[1][there]).all():
            days_on = 86400.0 * hours + 3600.0 * minutes + 60.0 * last[0] + last[1]
            fit = {"hh:mm:ss:cc": (clock, hours < 24), "d:hh:mm:ss": (days_on, (minutes < 24) & (last[1] < 60))}
        elif by_minute:
            fit = {"hh:mm": (clock, (hours <= 23) & (not has["part"]))}
            fit["mm:ss"] = 60.0 * hours + minutes + np.nan_to_num(number("part")), there
        found = {k: np.where(there, v, np.nan) for k, (v, fits) in fit.items() if fits[there].all()}
        return "time" * (by_minute or len(found) > 1), found or {"": np.full(len(texts), np.nan)}, ""
    zones = parts["zone"].fillna("")
    shift = zones.map({z: zone_seconds(z) for z in zones.unique()}).to_numpy(dtype=float)
    numbers = {"": (number("y"), number("m"), number("d"))}
    if has["mon"]:
        month = parts["mon"].str.lower().map(MONTHS).to_numpy(dtype=float, na_value=np.nan)
        numbers = {"": (number("y"), month, number("d"))}
    elif has["c"]:  # 12.05.2024 is German
        a, b, c = map(number, "abc")
        numbers = {"dmy": (c, b, a), "mdy": (c, a, b), "ymd": (a, b, c)}
        possible = ["dmy"] if (parts["mark"] == ".").any() else [*numbers]
        possible = possible[:2] if (parts["c"].str.len() == 4).any() else possible
        numbers = {order: numbers[order] for order in possible}
    found = {}
    for order, (year, month, day) in numbers.items():
        ymd = {"year": np.where(year < 100, year + 2000, year), "month": month, "day": day}
        date = pd.to_datetime(pd.DataFrame(ymd), errors="coerce")
        if not order or date[there].notna().all():
            days = (date - pd.Timestamp(1970, 1, 1)).dt.total_seconds().to_numpy()
            found[order] = np.where(there, days + clock - shift, np.nan)
    zone = next((z for z in zones[there] if z), "")
    return "date" * (len(found) > 1), found or {"": np.full(len(texts), np.nan)}, zone


# ---- a column


def column_of(cells: pd.Series, unit: str, decimal: str, is_open: bool, lines: np.ndarray, file: str) -> Column:
    """A column by its cells; unit: of a units row; is_open: whether the file leaves its decimal mark open; lines: of
    each cell. Raises CampaignError for a cell that is not of its column's kind."""
    name = str(cells.name)
    if pd.api.types.is_numeric_dtype(cells):
        return Column(name=name, values=cells.to_numpy(dtype=float), unit=unit)
    texts = cells.astype("string").str.strip().fillna("").astype(object)
    filled = ~texts.map(is_missing).to_numpy(dtype=bool)
    sample = [str(c) for c in texts[filled].iloc[:SAMPLE]]
    are_times = sum(map(is_time, sample)) > 0.5 * len(sample)
    if not are_times and sum(map(bool, map(readings_of, sample))) <= 0.5 * len(sample):
        return Column(name=name, values=texts.where(filled, "").to_numpy(dtype=object), unit=unit)
    known, zone = texts.where(filled), ""
    if are_times:
        key, readings, zone = stamps_of(known, next(c for c in texts[filled] if is_time(c)))
    else:
        numbers, readings = [readings_of(c) if there else {} for c, there in zip(texts, filled, strict=True)], {}
        for mark in (decimal, OTHER[decimal]) if is_open else (decimal,):
            readings[mark] = np.array([own.get(mark, np.nan) for own in numbers])
        complete = {d: v for d, v in readings.items() if not (filled & np.isnan(v)).any()}
        key, readings = "decimal" * (len(complete) == 2), complete or {decimal: readings[decimal]}
    wrong = filled & np.isnan(next(iter(readings.values())))
    if wrong.any():
        remedy = "is no number; mend this cell or leave it blank"
        if are_times:
            remedy = "is neither a date nor a time of day like those before it; mend this cell"
        elif any(map(readings_of, texts[wrong])):
            remedy = f"decimal marks are mixed: the file has '{decimal}' elsewhere; write one mark throughout"
        k = int(np.argmax(wrong))
        raise refusal(file, remedy, line=int(lines[k]), name=name, value=str(cells.iloc[k]))
    first = next((c for c in texts[filled] if key and (key != "decimal" or is_doubtful(c))), "")
    return Column(
        name=name, values=next(iter(readings.values())), unit="s" if are_times else unit, stamp=are_times, zone=zone,
        asked=key, readings=readings if key else {}, first_cell=first,
    )  # fmt: skip


#: Bytes by which the encoding is told, lines by which the layout is.
HEAD_BYTES, HEAD_LINES = 1 << 16, 300
#: Rows whose decimal marks are looked at.
MARKS = 2000
#: Largest text file, and largest workbook when unpacked [bytes]; longest line [characters].
LARGEST_TEXT, LARGEST_WORKBOOK, LONGEST_LINE, LONGEST_NAME = 500_000_000, 200_000_000, 100_000, 500
#: How every xlsx file begins.
ZIP = b"PK\x03\x04"
_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
#: first bytes of files that hold tables, or pictures of them, and are no text
_FORMATS = {b"\xd0\xcf\x11\xe0": "old Excel (.xls)", b"\x1f\x8b": "gzip", b"%PDF": "PDF", b"\x89PNG": "a picture"}
_FORMATS |= {b"PAR1": "Parquet", b"\x89HDF": "HDF5", b"MATLAB 5.0": "MATLAB", b"TDSm": "TDMS"}


def read(files: Sequence[str | Path], form: Mapping[str, Any] | None = None) -> LoggedTables:
    """Read logger files (CSV, TSV, other separated text, xlsx), with a role, a unit and a place proposed per column.

    form: what is known of the files: separator, decimal, encoding, missing (numbers that stand for no reading). Raises
    CampaignError, InputError.
    """
    paths = [Path(f) for f in files]
    if not paths:
        remedy = "name the files of your logger after the command, as belt-sim import a.csv b.csv"
        raise InputError("files", "[]", "", remedy)
    twice = next((p for k, p in enumerate(paths) if p in paths[:k]), None)
    if twice is not None:
        raise InputError("files", twice, "", "is named twice; name each file once")
    form = dict(form or {})
    form["decimal"] = form.get("decimal") or OTHER.get(form.get("thousands") or "", "")
    tables = [propose_roles(table) for path in paths for table in _read_file(path, form)]
    names = unique((table.name for table in tables), lambda n: f"_{n}")
    return tuple(replace(t, name=name) for t, name in zip(tables, names, strict=True))


def _read_file(file: Path, form: Mapping[str, Any]) -> list[LoggedTable]:
    """The table of a text file, or every sheet of a workbook that holds one."""
    try:
        if not file.is_file():
            what = "is a folder; name the files in it" if file.is_dir() else "there is no such file; check its path"
            raise refusal(file, what)
        if (size := file.stat().st_size) > LARGEST_TEXT:
            raise refusal(file, f"has {size / 1e9:.1f} GB; export it at a lower rate, or cut it")
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise refusal(file, f"cannot be read ({cause}); give a file that can") from None
    if not data[:HEAD_BYTES].strip(b"\0\xef\xbb\xbf\xff\xfe \t\r\n"):
        raise refusal(file, "is empty; export the log again")
    if not data.startswith(ZIP):
        lines, encoding = _text_lines(file, data, form.get("encoding"))
        layout = layout_of(lines[:HEAD_LINES], [form["separator"]] if form.get("separator") else SEPARATORS)
        if layout is None:
            remedy = "no table of numbers is seen in it (columns by tabs, semicolons, commas, bars or blanks)"
            raise refusal(file, f"{remedy}; export it as CSV, or name format: {{separator: ..., decimal: ...}}")
        header = f"header in line {layout.header}" if layout.header else "no header"
        return [_table(file, "", lines, layout, f"{encoding}, {SEPARATORS[layout.separator]}, {header}, ", form)]
    try:
        with zipfile.ZipFile(file) as packed:
            size = sum(info.file_size for info in packed.infolist())
        if size > LARGEST_WORKBOOK:
            raise refusal(file, f"unpacks to {size / 1e9:.1f} GB; export the sheet as CSV")
        sheets = pd.read_excel(file, sheet_name=None, header=None, dtype=object, engine="openpyxl")
    except (BeltError, MemoryError):
        raise
    except Exception as error:  # whatever its reader finds in XML that is cut, swollen or overflows
        cause = " ".join(str(error).split())[:120]
        raise refusal(file, f"is no Excel workbook that can be read ({cause}); save it as .xlsx or CSV") from None
    found = []
    for sheet, cells in sheets.items():
        texts = cells.map(_cell_text)
        texts = texts.loc[:, (texts != "").any()]
        written = io.StringIO()  # its rows as lines of cells that are separated by tabs
        csv.writer(written, delimiter="\t", lineterminator="\n").writerows(texts.to_numpy().tolist())
        lines = written.getvalue().split("\n")
        layout = layout_of(lines[:HEAD_LINES], ["\t"])
        if layout is not None:
            table = _table(file, f" [{sheet}]", lines, layout, "", form)
            found.append(replace(table, name=str(sheet)))
    if not found:
        raise refusal(file, "holds no sheet with a table of numbers; is it the right workbook?")
    return [replace(found[0], name=file.stem)] if len(found) == 1 else found


# ---- files -> lines of text


def _text_lines(file: Path, data: bytes, stated: str | None) -> tuple[list[str], str]:
    """The lines of a text file and its encoding: as stated, by its mark, UTF-16 where every other byte is zero, else
    UTF-8, else cp1252 (Windows); raises CampaignError for what is no text."""
    for magic, what in _FORMATS.items():
        if data.startswith(magic):
            raise refusal(file, f"holds no text ({what}); save it as .xlsx or CSV")
    encoding = stated or next((name for mark, name in _MARKS.items() if data.startswith(mark)), "")
    if not encoding:
        head = data[:HEAD_BYTES]
        even, odd = (head[k::2].count(0) / (len(head) / 2.0) for k in (0, 1))
        control = sum(head.count(bytes([k])) for k in range(32) if k not in (7, 9, 10, 11, 12, 13, 26, 27))
        wide = {"utf-16-le": odd > 0.6 and even < 0.05, "utf-16-be": even > 0.6 and odd < 0.05}
        encoding = next((name for name, fits in wide.items() if fits), "utf-8")
        if encoding == "utf-8" and (even + odd or control > 0.01 * len(head)):
            line = head[: head.index(0)].count(b"\n") + 1 if even + odd else None
            raise refusal(file, "holds binary data; export the log as CSV, TSV or xlsx", line=line)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        if encoding != "utf-8":
            raise refusal(file, f"is not the {encoding} text that it begins as; save it as UTF-8 text") from None
        text, encoding = data.decode("cp1252", errors="replace"), "cp1252"
    except LookupError:
        raise refusal(file, f"format.encoding = {encoding} is not known; use utf-8, cp1252, utf-16") from None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise refusal(file, "holds binary data from here on; give the text before it", line=line)
    lines = plain_minus(text.translate(_WIDE)).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    longest = max(map(len, lines))
    if longest > LONGEST_LINE:
        raise refusal(file, f"has a line of {longest} characters; is it a table?")
    return lines, encoding


def _cell_text(value: Any) -> str:
    """A cell of a workbook as one line of text; numbers with a decimal point, dates and clocks in ISO 8601."""
    if value is None or value != value:
        return ""
    if isinstance(value, datetime | time):
        return value.isoformat(**({"sep": " "} if isinstance(value, datetime) else {}))
    value = value.total_seconds() if isinstance(value, timedelta) else value
    if isinstance(value, int | float) and not isinstance(value, bool):
        short = f"{value:.15g}"
        short = short if float(short) == value else repr(float(value))
        return f"{short}e0" if "." in short and "e" not in short else short  # a point beyond doubt
    return plain_minus(" ".join(str(value).split()).translate(_WIDE))


# ---- where the table begins, how its columns are set apart, and what they are called

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}


class Layout(NamedTuple):
    """names: columns, no two alike; units: of a units row ("" where none); first: line of the first data row, from 1;
    header: line of the header (0: none)."""

    separator: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    header: int
    first: int


def layout_of(lines: Sequence[str], separators: Iterable[str]) -> Layout | None:
    """The layout of the first lines of a file; None when no table stands there.

    Of all separators the one that sees most: rows of data, less where their cells are no numbers or times. The table is
    as wide as most rows of data (of whose filled cells half are numbers or times), and begins with the first of these.
    """
    best, most = None, 0.0
    for separator in separators:
        rows = [split(line, separator) for line in lines]
        of_data = []
        for k, row in enumerate(rows):
            filled = [c for c in row if not is_missing(c)]
            if filled and len(row) > 1 and count_readings(filled) >= 0.5 * len(filled):
                of_data.append(k)
        if not of_data:
            continue
        width, height = Counter(len(rows[k]) for k in of_data).most_common(1)[0]
        of_data = [k for k in of_data if len(rows[k]) == width]
        cells = [c for row in rows if len(row) == width for c in row if c.strip()]
        score = height * (count_readings(cells) / len(cells)) ** 3 * (0.6 if separator == " " else 1.0)
        if score > most:  # of equals the first
            header, names, units = _head(rows[: of_data[0]], width)
            counts = [rows[k][0].strip(' "') for k in of_data]
            counted = any(counts == [str(k + n) for k in range(len(counts))] for n in (0, 1))
            if header and counted and len(rows[header - 1]) == width - 1:
                names = ("row", *names[:-1])  # its rows are counted in a column without a name
            best, most = Layout(separator, names, units, header, of_data[0] + 1), score
    return best


def count_readings(row: Sequence[str]) -> int:
    """How many cells of a row are numbers or times."""
    return sum(bool(readings_of(c)) or is_time(c) for c in row)


def _head(above: Sequence[Sequence[str]], width: int) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Line of the header (0: none), names and units of the columns, from the rows above the data.

    A row is of units if most of its cells are, or some where the row above has the names.
    """
    filled, blanks = [k for k, row in enumerate(above) if any(c.strip() for c in row)], [""] * width
    header, names, units = 0, blanks, blanks
    if len(filled) > 1:
        row, before = above[filled[-1]], above[filled[-2]]
        cells = [c for c in row if c.strip()]
        known = sum(unit_named(c) is not None for c in cells)
        named, spoken = (sum(len(c.strip()) > 1 and roles_named(c) != [] for c in some) for some in (before, row))
        most = known >= 0.5 * len(cells) or (known > 0 and len(before) == len(row) and named > spoken)
        if most and all(len(c.strip()) < 12 for c in cells):
            filled.pop()
            units = ["" if is_missing(c) else unit_named(c) or c.strip("[](){}<> ") for c in [*row, *blanks][:width]]
    last = above[filled[-1]] if filled else []
    said = [c for c in last if c.strip()]
    if len(said) > 1 and abs(len(last) - width) <= 1 and count_readings(said) < 0.5 * len(said):
        header, names = filled[-1] + 1, [c.strip() for c in [*last, *blanks][:width]]
    names = [name or f"column_{k}" for k, name in enumerate(names, start=1)]
    letters = "abcdefghijklmnopqrstuvwxyz"  # for a second y, as "y (2)" would name a place
    names = unique(names, lambda n: f" ({letters[n - 1] if n <= len(letters) else f'no {n}'})")
    return header, tuple(names), tuple(units)


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


# ---- lines of text -> a table


def _table(
    file: Path, part: str, lines: list[str], layout: Layout, remark: str, form: Mapping[str, Any]
) -> LoggedTable:
    """The table in lines of text; part: what follows the file's name where it has several tables; remark: on them."""
    place = f"{file}{part}"
    if (longest := max(map(len, layout.names))) > LONGEST_NAME:
        raise refusal(place, f"a column's name has {longest} characters; give it a short one", line=layout.header)
    kept, numbers, again, remarks = _rows(place, lines, layout)
    sample = [cells for line in kept[:MARKS] if len(cells := split(line, layout.separator)) == len(layout.names)]
    shown = Counter[str]()  # decimal marks that cells show beyond doubt
    for found in (readings_of(c) for cells in sample for c in cells):
        shown.update(found if len(found) == 1 else ())
    of_doubt = {m for cells in sample for c in cells if is_doubtful(c) for m in ".," if m in c}
    known = form.get("decimal") or max(shown, key=lambda m: shown[m], default="")
    is_open = not known and bool(of_doubt) and not (of_doubt == {"."} and layout.separator == ",")
    decimal = known or "."
    remark += f"decimal {'comma' if decimal == ',' else 'point'}, " if remark else ""
    marked = [n for k, n in enumerate(layout.names) if is_open and any(is_doubtful(cells[k]) for cells in sample)]
    blanks = layout.separator == " "
    options: dict[str, Any] = {"sep": r"\s+" if blanks else layout.separator, "decimal": decimal}
    options |= {"header": None, "index_col": False, "names": layout.names, "na_values": list(MISSING)}
    options |= {"skipinitialspace": True, "skip_blank_lines": False, "low_memory": False}
    try:
        frame = pd.read_csv(io.StringIO("\n".join(kept)), dtype=dict.fromkeys(marked, str), **options)
    except pd.errors.ParserError as error:
        cause = " ".join(str(error).split())
        raise refusal(place, f"is no table that can be read ({cause}); export it again") from None
    if len(frame) != len(kept):
        raise refusal(place, "a quotation mark is opened and not closed; mend it or export the log again")
    columns, missing = [], form.get("missing")
    for (_, cells), unit in zip(frame.items(), layout.units, strict=True):
        column = column_of(cells, unit, decimal, is_open, numbers, place)
        if not (column.is_text or column.stamp or column.asked):
            values = column.values
            if missing is not None:
                mask = np.isin(values, np.atleast_1d(missing).astype(float))
            else:  # of CODES those that lie far off all other numbers
                rest = values[np.isfinite(values) & ~np.isin(values, CODES)]
                mask = np.zeros(len(values), dtype=bool)
                for code in CODES if len(rest) >= 3 else ():
                    reach = FAR * max(float(np.ptp(rest)), 1e-3 * abs(code))
                    is_far = not rest.min() - reach <= code <= rest.max() + reach
                    mask |= (values == code) & (is_far and np.sum(values == code) < len(rest))
            if mask.any() and missing is None:
                codes = ", ".join(f"{c:g}" for c in np.unique(column.values[mask]))
                text = f"{codes} stands for no reading (line {shortlist(numbers[mask])})"
                remarks.append(f"{column.name}: {text}; format: {{missing: []}} would keep it")
            column = replace(column, values=np.where(mask, np.nan, column.values))
        columns.append(column)
    starts = tuple(int(k) for k in np.searchsorted(numbers, again) if 0 < k < len(numbers))
    notes = tuple(Note(f"{file.name}{part}", what) for what in (f"{remark}{len(kept)} rows", *remarks))
    return LoggedTable(name=file.stem, file=file, columns=tuple(columns), lines=numbers, starts=starts, notes=notes)


def _rows(file: str, lines: list[str], layout: Layout) -> tuple[list[str], np.ndarray, list[int], list[str]]:
    """Rows of data, their lines (n,), lines where the header stands again, and remarks.

    Raises CampaignError for a row that does not fit, but for a last one that is cut short.
    """
    width, separator = len(layout.names), layout.separator
    header = lines[layout.header - 1].strip() if layout.header else None
    kept: dict[int, str] = {}
    again, comments = list[int](), list[int]()
    ragged: dict[int, int] = {}
    for number, line in enumerate(lines[layout.first - 1 :], layout.first):
        text = line.strip()
        plain = '"' not in line and separator != " "
        cells = line.count(separator) + 1 if plain else len(split(line, separator))
        if not text.strip(separator + " "):
            continue
        if text == header or (cells != width and text.startswith("#")):
            (again if text == header else comments).append(number)
            continue
        if cells == width + 1 and text.endswith(separator):
            line = text[: -len(separator)]  # every row ends with a separator
        elif cells != width:
            ragged[number] = cells
        kept[number] = line
    remarks = [f"line {shortlist(comments)} begins with # and was left out"] if comments else []
    for number, cells in ragged.items():
        if len(ragged) > 1 or cells > width or number != max(kept):
            remedy = f"the header has {width}; mend this row, or name format: {{separator: ..., decimal: ...}}"
            raise refusal(file, remedy, line=number, name="cells", value=cells)
        remarks.append(f"line {number} is cut short and was left out")
        del kept[number]
    if again:
        stands = f"the header stands there again in line {shortlist(again)}"
        remarks.append(f"{stands}; what follows counts as a run of its own")
    if not kept:
        raise refusal(file, "has a header but no rows of numbers; export the log again")
    return [*kept.values()], np.array([*kept]), again, remarks
