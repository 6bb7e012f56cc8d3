"""A map on disk: parts of so many cases each, in Parquet, written one by one; what is there need not be made again."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.errors import BeltError, InputError
from belt_sim.files import clear_drafts, read_json, write_json, write_with

FOLDER = "cases"
NOTE = "map.json"
SCHEMA = "belt-map/1"


def parquet() -> Any:
    """PyArrow's Parquet module; raises BeltError saying how to get it."""
    try:
        import pyarrow.parquet
    except ImportError as missing:
        raise BeltError("a map needs PyArrow: pip install 'belt-sim[sweeps]'") from missing
    return pyarrow.parquet


def claim(folder: Path, note: Mapping[str, Any]) -> Path:
    """The folder of the parts, for the map that ``note`` describes; raises InputError when it holds another one."""
    parts = folder / FOLDER
    parts.mkdir(parents=True, exist_ok=True)
    clear_drafts(parts)
    clear_drafts(folder)
    try:
        before = dict(read_json(folder / NOTE))
    except FileNotFoundError:
        before = dict(note)
    if before.get("config_sha256") != note["config_sha256"]:
        remedy = "holds another map, or the same of other effect files or code; choose another folder, or remove it"
        raise InputError("out", folder, "", remedy)
    write_json(folder / NOTE, note)
    return parts


def missing_parts(parts: Path, count: int, size: int) -> Iterator[tuple[Path, int, int]]:
    """(file, first case, end) of each part that is not there yet, or is damaged."""
    for number, start in enumerate(range(0, count, size)):
        path, stop = parts / f"{number:06d}.parquet", min(start + size, count)
        if _rows(path) != stop - start:
            yield path, start, stop


def _rows(path: Path) -> int | None:
    """Cases in a part; None where there is none that can be read."""
    import pyarrow

    try:
        return int(parquet().read_metadata(path).num_rows)
    except (OSError, pyarrow.ArrowException):
        return None


def write_part(path: Path, first: int, columns: Mapping[str, np.ndarray]) -> None:
    """One part: the numbers of its cases from ``first`` on, and columns (n,)."""
    import pyarrow

    number = len(next(iter(columns.values())))
    table = pyarrow.table({"case": np.arange(first, first + number)} | dict(columns))
    write = parquet().write_table
    write_with(path, lambda draft: write(table, draft, compression="zstd"))


def stream(parts: Path, count: int, size: int, make: Callable[[int, int], Mapping[str, np.ndarray]]) -> Iterator[int]:
    """Make and write what is missing of ``count`` cases, ``size`` a part; yields how many cases each part had."""
    for path, start, stop in missing_parts(parts, count, size):
        write_part(path, start, make(start, stop))
        yield stop - start
