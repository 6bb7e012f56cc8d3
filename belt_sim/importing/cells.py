"""Cells of a table as numbers, seconds or words, in every reading that their marks allow.

``1,500`` is 1.5 or 1500, ``05/12/2024`` a day of May or of December, ``00:02`` two minutes or two seconds: where the
rest of the file does not settle it, a column keeps all readings and the mapping says which (format: {decimal, date,
time}).
"""

import re
from collections.abc import Iterable, Mapping, Sequence
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
DAY = 86400.0  # [s]
OTHER = {".": ",", ",": "."}

# ---- numbers

#: decimal mark -> a number without and with marks of thousands; with an exponent either mark is a decimal one
_PLAIN = {d: re.compile(rf"[+-]?(?:\d+[{d}]?\d*|[{d}]\d+)\Z|[+-]?\d*[.,]?\d*[eE][+-]?\d+\Z") for d in ".,"}
_GROUPED = {d: re.compile(rf"[+-]?\d{{1,3}}(?:[{OTHER[d]}]\d{{3}})+(?:[{d}]\d*)?\Z") for d in ".,"}
_DOUBTFUL = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}\Z")
_GAP = re.compile(r"(?<=\d)[ '’\u00a0\u202f](?=\d{3}(?!\d))")


def is_missing(cell: str) -> bool:
    return not cell.strip() or cell.strip() in MISSING


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal mark, the other one or a gap between thousands."""
    text = _GAP.sub("", cell.strip())
    return bool(_PLAIN[decimal].match(text) or _GROUPED[decimal].match(text))


def doubtful(cell: str) -> bool:
    """Whether a cell is a number with one mark that may be of decimals or of thousands, as 1,500."""
    return bool(_DOUBTFUL.match(cell.strip()))


def decimal_marks(cells: Iterable[str]) -> set[str]:
    """The decimal marks that the cells of a file show beyond doubt."""
    found = set()
    for cell in cells:
        text = _GAP.sub("", cell.strip())
        marks = {m: text.count(m) for m in ".,"}
        if not any(marks.values()) or "e" in text.lower() or doubtful(text):
            continue
        for mark, other in OTHER.items():
            if marks[mark] <= 1 and (_GROUPED if marks[other] else _PLAIN)[mark].match(text):
                found.add(mark)
    return found


def numbers_of(texts: pd.Series, decimal: str) -> np.ndarray:
    """Cells as numbers (n,) with this decimal mark; nan where a cell is none."""
    texts = texts.str.replace(_GAP, "", regex=True)
    fits = texts.map(lambda c: isinstance(c, str) and is_number(c, decimal)).astype(bool)
    exponent = texts.str.contains("e", case=False, regex=False).fillna(False).astype(bool)
    plain = texts.str.replace(OTHER[decimal], "", regex=False).str.replace(decimal, ".", regex=False)
    plain = plain.where(~exponent, texts.str.replace(",", ".", regex=False)).where(fits)
    return pd.to_numeric(plain, errors="coerce").to_numpy(dtype=float, na_value=np.nan)


# ---- dates and times of day

_MONTHS = ("jan", "feb", "m[aä]r", "apr", "ma[yi]", "jun", "jul", "aug", "sep", "o[ck]t", "nov", "de[cz]")
_MONTH = rf"(?P<mon>{'|'.join(_MONTHS)})[a-zä]*\.?"
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
#: what a date of three numbers may be -> which of its numbers are year, month, day
ORDERS = {"dmy": "cba", "mdy": "cab", "ymd": "abc"}
#: a clock goes on at midnight, and is set by an hour in spring and autumn, where the step left is below so many steps
NEXT, SHORT = 20.0, 60.0


def is_time(cell: str) -> bool:
    """Whether a cell is a date or a time of day."""
    return any(pattern.match(cell.strip()) for pattern in _STAMPS)


def stamps_of(texts: pd.Series) -> tuple[str, dict[str, np.ndarray], str]:
    """Dates or times of day as seconds (n,), in every reading that all cells allow: (key of ``format``, reading ->
    seconds, zone of the first); nan where a cell is not of the first one's form."""
    first = str(texts.dropna().iloc[0])
    pattern = next(p for p in _STAMPS if p.match(first))
    parts = texts.str.extract(pattern)

    def number(name: str) -> pd.Series:
        return pd.to_numeric(parts[name].str.replace(",", ".").str.replace(r":(?=\d+$)", ".", regex=True))

    there = parts.notna().any(axis=1)
    clock = pd.Series(0.0, index=texts.index)
    by_minute = pd.Series(np.nan, index=texts.index)
    if "h" in parts and parts["h"].notna().any():
        hours, minutes = number("h"), number("min")
        if "half" in parts and parts["half"].notna().any():
            hours = hours % 12 + 12.0 * (parts["half"].str.lower() == "p")
        clock = 3600.0 * hours + 60.0 * minutes + number("s").fillna(0.0)
        if "half" in parts and not parts["half"].notna().any() and parts["s"].isna().all():
            by_minute = 60.0 * hours + minutes + number("part").fillna(0.0)
    if not {"y", "c"} & {*parts.columns}:
        if by_minute.isna().all():
            return "", {"": clock.where(there).to_numpy(dtype=float)}, ""
        readings = {"hh:mm": clock, "mm:ss": by_minute}
        if parts["part"].notna().any() or (number("h") > 23).any():
            del readings["hh:mm"]
        return "time", {k: v.where(there).to_numpy(dtype=float) for k, v in readings.items()}, ""
    zones = parts["zone"].fillna("") if "zone" in parts else pd.Series("", index=texts.index)
    shifts = {z: zone_seconds(z) for z in zones.unique()}
    own = next((z for z in zones[there] if z), "")
    days: dict[str, pd.Series] = {}
    for order, letters in ORDERS.items() if "c" in parts else (("", ""),):
        if order:
            year, month, day = (number(letter) for letter in letters)
            if order == "ymd" and (parts["c"].str.len() == 4).any():
                continue
            if order != "dmy" and (parts["mark"] == ".").any():  # 12.05.2024 is German
                continue
        else:
            year, day = number("y"), number("d")
            month = number("m") if "m" in parts else parts["mon"].map(_month)
        year = year.where(year >= 100, year + 2000)
        date = pd.to_datetime({"year": year, "month": month, "day": day}, errors="coerce")
        if order and date[there].isna().any():
            continue
        days[order] = (date - pd.Timestamp(1970, 1, 1)).dt.total_seconds()
    shift = zones.map(shifts).astype(float)
    found = {order: (day + clock - shift).where(there).to_numpy(dtype=float) for order, day in days.items()}
    return ("date" if len(found) > 1 else ""), found or {"": np.full(len(texts), np.nan)}, own


def _month(name: Any) -> float:
    return next((k for k, m in enumerate(_MONTHS, 1) if re.match(m, str(name).lower())), np.nan)


def zone_seconds(zone: str) -> float:
    """Seconds that a zone (+02:00, Z, "") is ahead of UTC; nan for what is none."""
    found = re.fullmatch(r"([+-])(\d{2}):?(\d{2})", zone)
    if not found:
        return 0.0 if zone.upper() in ("", "Z", "UTC", "GMT") else np.nan
    return (-60.0 if found[1] == "-" else 60.0) * (60 * int(found[2]) + int(found[3]))


def wind_on(seconds: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Seconds (n,) that go on over midnight and over an hour's change of the clock, and remarks on where they do."""
    there = np.flatnonzero(np.isfinite(seconds))
    out, steps, remarks = seconds.copy(), np.diff(seconds[there]), []
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 1.0
    changes = [(DAY, SHORT, "the clock passed midnight")] if len(there) and np.nanmax(seconds) < DAY else []
    hour = ((seconds[there][:-1] % DAY) / 3600.0 >= 1) & ((seconds[there][:-1] % DAY) / 3600.0 <= 4)
    changes += [(3600.0, 5.0, "the clock was set back by an hour"), (-3600.0, 5.0, "the clock was set on by an hour")]
    for shift, short, remark in changes:
        left = steps + shift
        at = np.flatnonzero((left > 0.0) & (left <= max(short, NEXT * usual)) & ((steps < 0.0) | (shift < 0.0)))
        at = at if shift == DAY else at[hour[at] & (left[at] <= max(short, 5.0 * usual))]
        for k in at:
            out[there[k + 1] :] += shift
        if len(at):
            remarks.append(remark)
    return out, remarks


# ---- a column


def count_readings(row: Sequence[str], decimal: str) -> int:
    """How many cells of a row are numbers or times."""
    return sum(is_number(c, decimal) or is_time(c) for c in row)


def column_values(
    cells: pd.Series, decimal: str, is_open: bool, lines: np.ndarray, file: str
) -> tuple[str, Mapping[str, np.ndarray], bool, str]:
    """A column's cells: (what settles the reading, reading -> values (n,), whether dates or times of day, their zone).

    What settles the reading is "", decimal, date or time; texts come as object dtype. is_open: whether the file leaves
    its decimal mark open; lines: line of each cell. Raises CampaignError for a cell that is not of its column's kind.
    """
    if pd.api.types.is_numeric_dtype(cells):
        return "", {"": cells.to_numpy(dtype=float)}, False, ""
    texts = cells.astype("string").str.strip().fillna("")
    filled = ~texts.map(is_missing).to_numpy(dtype=bool)
    sample = [str(c) for c in texts[filled].iloc[:SAMPLE]]
    numbers = sum(is_number(c, ".") or is_number(c, ",") for c in sample)
    are_times = sum(map(is_time, sample)) > 0.5 * len(sample)
    if not are_times and numbers <= 0.5 * len(sample):
        return "", {"": texts.where(filled, "").to_numpy(dtype=object)}, False, ""
    key, zone = "", ""
    if are_times:
        start = next(c for c in texts[filled] if is_time(str(c)))
        known = texts.where(filled)
        if not is_time(str(known.dropna().iloc[0])):
            known = pd.concat([pd.Series([start]), known])
        key, readings, zone = stamps_of(known.astype(object))
        readings = {k: v[len(v) - len(texts) :] for k, v in readings.items()}
    else:
        marks = (decimal, OTHER[decimal]) if is_open else (decimal,)
        readings = {d: numbers_of(texts.where(filled).astype(object), d) for d in marks}
        whole = {d: v for d, v in readings.items() if not (filled & np.isnan(v)).any()}
        if len(whole) == 2:
            key = "decimal"
        readings = whole or {decimal: readings[decimal]}
    wrong = filled & np.isnan(next(iter(readings.values())))
    if wrong.any():
        remedy = "is no number; mend this cell or leave it blank"
        if are_times:
            remedy = "is neither a date nor a time of day like those before it; mend this cell"
        elif any(is_number(str(c), OTHER[decimal]) for c in texts[wrong]):
            remedy = f"decimal marks are mixed: the file has '{decimal}' elsewhere; write one mark throughout"
        k = int(np.argmax(wrong))
        raise refusal(file, remedy, line=int(lines[k]), name=str(cells.name), value=str(cells.iloc[k]))
    return key, readings, are_times, zone


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
