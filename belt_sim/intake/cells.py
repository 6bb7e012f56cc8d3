"""Cells of a table as text: numbers with either decimal mark, clock times, blanks."""

import re
from datetime import datetime, time

import numpy as np
import pandas as pd

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
