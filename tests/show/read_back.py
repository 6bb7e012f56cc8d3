"""Read a recording again: what was logged, by path."""

import os
from dataclasses import dataclass

import numpy as np
from rerun.chunk import RrdReader

from belt_sim.errors import BeltError
from belt_sim.show.rerun import TRAVEL_LINE


@dataclass(frozen=True, kw_only=True)
class LoggedComponent:
    """One component of one path: travel_mm, shape (n,); values, one entry (an array or a number) a row."""

    travel_mm: np.ndarray
    values: list


def read_back(path: str | os.PathLike, below: str = "") -> dict[str, LoggedComponent]:
    """All that is not static in an .rrd, as {"entity/path:Archetype:component": LoggedComponent}, in order of travel.

    below: of a path, which is left out of the names.

    Raises BeltError when the file is no recording.
    """
    found: dict[str, list[tuple[int, object]]] = {}
    try:
        chunks = list(RrdReader(os.fspath(path)).stream())
    except (OSError, RuntimeError, ValueError) as cause:
        raise BeltError(f"recording {path}: cannot be read ({cause}); write it again with watch=rrd") from cause
    for chunk in chunks:
        if TRAVEL_LINE in chunk.timeline_names:
            _gather(chunk, found)
    out = {}
    for key, rows in found.items():
        rows.sort(key=lambda row: row[0])
        out[key.removeprefix(f"{below}/")] = LoggedComponent(
            travel_mm=np.array([t for t, _ in rows]), values=[v for _, v in rows]
        )
    return out


def _gather(chunk, found: dict[str, list[tuple[int, object]]]) -> None:
    """Append the rows of one chunk."""
    batch = chunk.to_record_batch()
    nanoseconds = np.array(batch.column(TRAVEL_LINE).cast("int64").to_pylist())  # 1 s stands for 1 m
    travel = (nanoseconds / 1e6).round(6).tolist()
    for name in batch.schema.names:
        if ":" not in name:
            continue
        rows = found.setdefault(f"{chunk.entity_path.lstrip('/')}:{name}", [])
        for at, value in zip(travel, batch.column(name).to_pylist(), strict=True):
            if value is not None:
                rows.append((at, np.array(value[0]) if len(value) == 1 else [np.array(v) for v in value]))
