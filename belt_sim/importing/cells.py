"""What the cells of a logger's table hold: numbers, times, texts, or words and codes for no reading."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import refusal

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


#: a minus sign or dash of typesetting where a number begins
_MINUS = re.compile(r"(?<![^\W_])[\u2212\u2013](?=[.,]?\d)")


# ---- one cell


def plain_minus(text: str) -> str:
    """Text in which a Unicode minus or an en dash before a number is the minus sign of a keyboard."""
    return _MINUS.sub("-", text)


def is_missing(cell: str) -> bool:
    return not cell.strip() or cell.strip() in MISSING


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark."""
    return bool(_NUMBER[decimal].match(cell.strip()))


def has_thousands(cell: str, decimal: str) -> bool:
    """Whether a cell has thousands set apart, as 1.234,5."""
    return bool(_THOUSANDS[decimal].match(cell.strip()))


def is_time(cell: str) -> bool:
    """Whether a cell is a date or a time of day."""
    return bool(_CLOCK.match(cell.strip()) or _DATE.match(cell.strip()))


def count_readings(row: Sequence[str], decimal: str) -> int:
    """How many cells of a row are numbers or times."""
    return sum(is_number(c, decimal) or has_thousands(c, decimal) or is_time(c) for c in row)


# ---- a column of cells


def column_values(cells: pd.Series, decimal: str, lines: np.ndarray, file: str) -> tuple[np.ndarray, bool]:
    """A column as numbers, seconds or texts (object dtype), shape (n,), and whether these are dates or times of day.

    lines: line of each cell in the file. Raises CampaignError for the first cell that is not of its column's kind.
    """
    if pd.api.types.is_numeric_dtype(cells):
        return cells.to_numpy(dtype=float), False
    texts = cells.astype("string").str.strip().fillna("")
    filled = ~texts.map(is_missing).to_numpy(dtype=bool)
    sample = [str(c) for c in texts[filled].iloc[:SAMPLE]]
    numbers = sum(is_number(c, ".") or is_number(c, ",") or has_thousands(c, decimal) for c in sample)
    are_times = sum(map(is_time, sample)) > 0.5 * len(sample)
    if not are_times and numbers <= 0.5 * len(sample):
        return texts.where(filled, "").to_numpy(dtype=object), False
    values = _seconds(texts.where(filled)) if are_times else _numbers(texts, decimal)
    wrong = filled & np.isnan(values)
    if wrong.any():
        remedy = "is no number; mend this cell or leave it blank"
        if are_times:
            remedy = "is neither a date nor a time of day; mend this cell"
        elif any(is_number(str(c), "." if decimal == "," else ",") for c in texts[wrong]):
            remedy = f"decimal marks are mixed: the file has '{decimal}' elsewhere; write one mark throughout"
        k = int(np.argmax(wrong))
        raise refusal(file, remedy, line=int(lines[k]), name=str(cells.name), value=str(cells.iloc[k]))
    return values, are_times


def _numbers(texts: pd.Series, decimal: str) -> np.ndarray:
    """Numbers with this decimal mark, shape (n,); nan where a cell is none."""
    fits = texts.map(lambda c: is_number(c, decimal))
    pointed = texts.where(fits).str.replace(decimal, ".", regex=False)
    return pd.to_numeric(pointed, errors="coerce").to_numpy(dtype=float, na_value=np.nan)


def _seconds(texts: pd.Series) -> np.ndarray:
    """Dates or times of day as seconds, shape (n,); nan where a cell is neither."""
    clean = texts.str.replace(",", ".", regex=False)
    first = str(clean.dropna().iloc[0])
    if _CLOCK.match(first):
        clean = clean.where(~(clean.str.count(":") == 1).fillna(False), clean + ":00")
        return pd.to_timedelta(clean, errors="coerce").dt.total_seconds().to_numpy(dtype=float)
    iso = bool(re.match(r"\d{4}-", first))
    found = pd.to_datetime(clean, errors="coerce", format="ISO8601" if iso else "mixed", dayfirst=not iso)
    nanoseconds = found.astype("datetime64[ns]").to_numpy().astype("int64")
    return np.where(found.isna().to_numpy(), np.nan, nanoseconds / 1e9)


def code_mask(values: np.ndarray, stated: Any) -> np.ndarray:
    """Which numbers (n,) stand for no reading: as stated, else of CODES those that lie far off all other numbers."""
    if stated is not None:
        return np.isin(values, np.atleast_1d(stated).astype(float))
    mask = np.zeros(len(values), dtype=bool)
    rest = values[np.isfinite(values) & ~np.isin(values, CODES)]
    if len(rest) < 3:
        return mask
    for code in CODES:
        reach = FAR * max(float(np.ptp(rest)), 1e-3 * abs(code))
        is_far = not rest.min() - reach <= code <= rest.max() + reach
        if is_far and np.sum(values == code) < len(rest):
            mask |= values == code
    return mask
