"""A text file -> columns of numbers, read in pieces; files that are too long are averaged while they are read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.intake.cells import MISSING, has_thousands, is_missing, is_number, is_time, seconds
from belt_sim.intake.encoding import refuse
from belt_sim.intake.scan import Scan

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
