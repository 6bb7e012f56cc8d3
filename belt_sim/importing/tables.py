"""Read logger files (separated text, Excel workbooks) as tables of numbers."""

import codecs
import csv
import io
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import refusal, shortlist
from belt_sim.errors import InputError
from belt_sim.importing.cells import MISSING, code_mask, column_values, is_number, plain_minus
from belt_sim.importing.layout import Layout, layout_of, split, unique
from belt_sim.importing.roles import propose_roles
from belt_sim.importing.types import Column, LoggedTable, LoggedTables, Note

#: Bytes by which the encoding is told, lines by which the layout is.
HEAD, HEAD_LINES = 1 << 16, 300
#: Largest text file, and largest workbook when unpacked [bytes]; longest line [characters].
LARGEST, LARGEST_WORKBOOK, LONGEST_LINE = 500_000_000, 2_000_000_000, 100_000
#: How every xlsx file begins.
ZIP = b"PK\x03\x04"
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


def read(files: Sequence[str | Path], form: Mapping[str, Any] | None = None) -> LoggedTables:
    """Read logger files (CSV, TSV, other separated text, xlsx), with a role, a unit and a place proposed per column.

    form: what is known of the files: separator, decimal, encoding, missing (numbers that stand for no reading). Raises
    CampaignError, InputError.
    """
    paths = [Path(f) for f in files]
    if not paths:
        raise InputError(
            "files", "[]", "", "name the files of your logger after the command, as belt-sim import a.csv b.csv"
        )
    twice = next((p for k, p in enumerate(paths) if p in paths[:k]), None)
    if twice is not None:
        raise InputError("files", twice, "", "is named twice; name each file once")
    tables = [propose_roles(table) for path in paths for table in _read_file(path, form or {})]
    names = unique((table.name for table in tables), lambda n: f"_{n}")
    return LoggedTables(tables=tuple(replace(t, name=name) for t, name in zip(tables, names, strict=True)))


def _read_file(file: Path, form: Mapping[str, Any]) -> list[LoggedTable]:
    """The table of a text file, or every sheet of a workbook that holds one."""
    data = _read_bytes(file)
    if not data.startswith(ZIP):
        lines, encoding = _text_lines(file, data, form.get("encoding"))
        layout = layout_of(lines[:HEAD_LINES], form)
        if layout is None:
            remedy = "no table of numbers is seen in it (columns by tabs, semicolons, commas, bars or blanks)"
            raise refusal(file, f"{remedy}; export it as CSV, or name format: {{separator: ..., decimal: ...}}")
        return [_table(file, "", lines, layout, f"{encoding}, {layout}, ", form.get("missing"))]
    found = []
    for sheet, lines in _sheets(file):
        layout = layout_of(lines[:HEAD_LINES], {"separator": "\t", "decimal": "."})
        if layout is not None:
            table = _table(file, f" [{sheet}]", lines, layout, "", form.get("missing"))
            found.append(replace(table, name=sheet))
    if not found:
        raise refusal(file, "holds no sheet with a table of numbers; is it the right workbook?")
    return [replace(found[0], name=file.stem)] if len(found) == 1 else found


# ---- files -> lines of text


def _read_bytes(file: Path) -> bytes:
    """The content of a file that is there and not empty."""
    try:
        if not file.is_file():
            what = "is a folder; name the files in it" if file.is_dir() else "there is no such file; check its path"
            raise refusal(file, what)
        size = file.stat().st_size
        if size > LARGEST:
            raise refusal(file, f"has {size / 1e9:.1f} GB; export it at a lower rate, or cut it")
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise refusal(file, f"cannot be read ({cause}); give a file that can") from None
    if not data[:HEAD].strip(b"\0\xef\xbb\xbf\xff\xfe \t\r\n"):
        raise refusal(file, "is empty; export the log again")
    return data


def _text_lines(file: Path, data: bytes, stated: str | None) -> tuple[list[str], str]:
    """The lines of a text file and its encoding: as stated, by its mark, by its bytes, else cp1252 (Windows)."""
    for magic, what in _FORMATS:
        if data.startswith(magic):
            raise refusal(file, f"is {what}")
    marked = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    encoding = stated or marked or _guess_encoding(file, data[:HEAD])
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
    lines = plain_minus(text).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    longest = max(map(len, lines))
    if longest > LONGEST_LINE:
        raise refusal(file, f"has a line of {longest} characters; is it a table?")
    return lines, encoding


def _guess_encoding(file: Path, head: bytes) -> str:
    """UTF-16 where every other byte is zero, else UTF-8; raises CampaignError for what is no text."""
    even, odd, half = head[0::2].count(0), head[1::2].count(0), len(head) / 2.0
    if odd > 0.6 * half and even < 0.05 * half:
        return "utf-16-le"
    if even > 0.6 * half and odd < 0.05 * half:
        return "utf-16-be"
    if even + odd:
        line = head[: head.index(0)].count(b"\n") + 1
        raise refusal(file, "holds binary data; export the log as CSV, TSV or xlsx", line=line)
    control = sum(head.count(bytes([k])) for k in range(32) if k not in (7, 9, 10, 11, 12, 13, 26, 27))
    if control > 0.01 * len(head):
        raise refusal(file, "holds binary data; export the log as CSV, TSV or xlsx")
    return "utf-8"


def _sheets(file: Path) -> Iterator[tuple[str, list[str]]]:
    """Every sheet of a workbook: its name, and its rows as lines of cells that are separated by tabs."""
    try:
        with zipfile.ZipFile(file) as packed:
            size = sum(info.file_size for info in packed.infolist())
        if size > LARGEST_WORKBOOK:
            raise refusal(file, f"unpacks to {size / 1e9:.1f} GB; export the sheet as CSV")
        sheets = pd.read_excel(file, sheet_name=None, header=None, dtype=object, engine="openpyxl")
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise refusal(file, f"is no Excel workbook that can be read ({error}); save it as .xlsx or CSV") from None
    for name, cells in sheets.items():
        texts = cells.map(_cell_text)
        texts = texts.loc[:, (texts != "").any()]
        written = io.StringIO()
        csv.writer(written, delimiter="\t", lineterminator="\n").writerows(texts.to_numpy().tolist())
        yield str(name), written.getvalue().split("\n")


def _cell_text(value: Any) -> str:
    """A cell of a workbook as one line of text; numbers with a decimal point, dates and clocks in ISO 8601."""
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
    text = plain_minus(" ".join(str(value).split()))
    return text.replace(",", ".") if is_number(text, ",") else text


# ---- lines of text -> a table


def _table(file: Path, part: str, lines: list[str], layout: Layout, remark: str, missing: Any) -> LoggedTable:
    """The table in lines of text; part: what follows the file's name where it has several tables; remark: on them;
    missing: numbers that stand for no reading, None where nobody stated them."""
    place = f"{file}{part}"
    kept, numbers, again, remarks = _rows(place, lines, layout)
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
        raise refusal(
            place, f"is no table that can be read ({' '.join(str(error).split())}); export it again"
        ) from None
    if len(frame) != len(kept):
        raise refusal(place, "a quotation mark is opened and not closed; mend it or export the log again")
    columns = []
    for (name, cells), unit in zip(frame.items(), layout.units, strict=True):
        values, is_stamp = column_values(cells, layout.decimal, numbers, place)
        if values.dtype != object and not is_stamp:
            mask = code_mask(values, missing)
            if mask.any() and missing is None:
                codes = ", ".join(f"{c:g}" for c in np.unique(values[mask]))
                text = f"{codes} stands for no reading (line {shortlist(numbers[mask])})"
                remarks.append(f"{name}: {text}; format: {{missing: []}} would keep it")
            values = np.where(mask, np.nan, values)
        columns.append(Column(name=str(name), values=values, unit="s" if is_stamp else unit, stamp=is_stamp))
    starts = np.searchsorted(numbers, again)
    return LoggedTable(
        name=file.stem,
        file=file,
        columns=tuple(columns),
        lines=numbers,
        starts=tuple(int(k) for k in starts if 0 < k < len(numbers)),
        notes=tuple(Note(f"{file.name}{part}", what) for what in (f"{remark}{len(kept)} rows", *remarks)),
    )


def _rows(file: str, lines: list[str], layout: Layout) -> tuple[list[str], np.ndarray, list[int], list[str]]:
    """Rows of data, their lines (n,), lines where the header stands again, and remarks.

    Raises CampaignError for a row that does not fit, but for a last one that is cut short.
    """
    width, separator = len(layout.names), layout.separator
    header = lines[layout.header - 1].strip() if layout.header else None
    kept: dict[int, str] = {}
    again: list[int] = []
    ragged: dict[int, int] = {}
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
            ragged[number] = cells
        kept[number] = line
    remarks = []
    for number, cells in ragged.items():
        if len(ragged) > 1 or cells > width or number != max(kept):
            remedy = f"the header has {width}; mend this row, or name format: {{separator: ..., decimal: ...}}"
            raise refusal(file, remedy, line=number, name="cells", value=cells)
        remarks.append(f"line {number} is cut short and was left out")
        del kept[number]
    if again:
        remarks.append(
            f"the header stands there again in line {shortlist(again)}; what follows counts as a run of its own"
        )
    if not kept:
        raise refusal(file, "has a header but no rows of numbers; export the log again")
    return [*kept.values()], np.array([*kept]), again, remarks
