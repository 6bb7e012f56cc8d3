"""An Excel workbook: every sheet that holds a table of numbers."""

import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.intake.cells import is_missing, is_number, is_time, of_cell, seconds
from belt_sim.intake.encoding import refuse
from belt_sim.intake.layout import HEAD_LINES, Layout, of_rows
from belt_sim.intake.text_table import unique

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
    head = [[_text(v) for v in row] for row in rows[:HEAD_LINES]]
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


def _text(value: object) -> str:
    return "" if value is None else f"{value:.15g}" if isinstance(value, float) else str(value)


def _are_times(cells: list[object]) -> bool:
    """Whether most cells are dates or times of day."""
    filled = [c for c in cells if c is not None and not is_missing(_text(c))]
    return sum(isinstance(c, str) and is_time(c) for c in filled) > 0.5 * len(filled)


def _column(file: Path, sheet: str, name: str, cells: list[object], lines: list[int]) -> np.ndarray:
    """A column as numbers, or as texts when most of its cells are."""
    filled = [c for c in cells if c is not None and not is_missing(_text(c))]
    texts = [c for c in filled if isinstance(c, str)]
    numeric = len(filled) - len(texts) + sum(is_number(c, ".") or is_number(c, ",") for c in texts)
    if _are_times(cells):
        return seconds(pd.Series([_text(c) for c in cells]))
    if numeric <= 0.5 * len(filled):
        return np.array([_text(c) for c in cells], dtype=object)
    found = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if isinstance(cell, float):
            found[k] = cell
        elif cell is not None and not is_missing(_text(cell)):
            text = _text(cell).replace(",", ".")
            if not is_number(text, "."):
                remedy = "is no number; mend this cell or leave it blank"
                problem = Problem(file=f"{file} [{sheet}]", line=lines[k], name=name, value=cell, remedy=remedy)
                raise CampaignError([problem])
            found[k] = float(text)
    return found
