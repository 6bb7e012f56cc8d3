"""Which rows of the files belong to which run."""

from dataclasses import dataclass

import numpy as np

from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.intake.nouns import LoggedTable
from belt_sim.intake.roles import Used

#: A run begins anew where time or travel falls back to within this share of where the file began.
RESTART = 0.05
FEWEST = 3  # rows of a run


@dataclass(frozen=True, kw_only=True)
class Block:
    """rows of one table that are one run; name: as proposed; text: what may state its settings (file or run name)."""

    table: LoggedTable
    used: tuple[Used, ...]
    rows: np.ndarray
    name: str
    text: str

    def values(self, role: str) -> np.ndarray | None:
        """Numbers [SI] of the column with this role, None where there is none."""
        found = next((u for u in self.used if u.role == role), None)
        return None if found is None else found.si(self.rows)

    def line(self, k: int) -> int:
        return int(self.table.lines[self.rows[k]])

    def refuse(self, k: int, name: str, value: object, unit: str, remedy: str) -> CampaignError:
        """The error of row ``k`` of the run."""
        file, line = str(self.table.file), self.line(k)
        return CampaignError([Problem(file=file, line=line, name=name, value=value, unit=unit, remedy=remedy)])


def blocks_of(table: LoggedTable, used: tuple[Used, ...]) -> list[Block]:
    """The runs of one table: by its run column, else where the file, its time or its travel begins anew."""
    run = next((u for u in used if u.role == "run"), None)
    rows = np.arange(len(table.lines))
    if run is not None:
        names = [_label(v) for v in run.column.values]
        order = dict.fromkeys(n for n in names if n)
        of_row = np.array(names, dtype=object)
        return [
            Block(table=table, used=used, rows=rows[of_row == name], name=run_name(name), text=name) for name in order
        ]
    cuts = sorted({*table.starts, *_restarts(table, used)})
    parts = [p for p in np.split(rows, cuts) if len(p) >= FEWEST]
    if len(parts) < 2:
        return [Block(table=table, used=used, rows=rows, name=run_name(table.name), text=table.name)]
    names = [f"{run_name(table.name)}_{k}" for k in range(1, len(parts) + 1)]
    return [Block(table=table, used=used, rows=p, name=n, text=table.name) for p, n in zip(parts, names, strict=True)]


def _label(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{value:.15g}"
    return str(value).strip()


def run_name(text: str) -> str:
    """A name that a run may have in a campaign: letters, digits, blanks and _ . + - only, beginning with a letter."""
    kept = "".join(c if c.isalnum() or c in "_.+- " else "_" for c in text).strip(" .+-")
    kept = " ".join(kept.split())[:60].strip()
    return f"r{kept}" if kept[:1].isdigit() or not kept else kept


def _restarts(table: LoggedTable, used: tuple[Used, ...]) -> list[int]:
    """Rows at which time or travel falls back to where it began."""
    for role in ("travel", "time"):
        key = next((u for u in used if u.role == role), None)
        if key is None:
            continue
        values = key.si(np.arange(len(table.lines)))
        there = np.flatnonzero(np.isfinite(values))
        if len(there) < FEWEST or _falls_throughout(values[there]):
            return []
        steps = np.diff(values[there])
        reach = RESTART * float(np.ptp(values[there]))
        back = np.flatnonzero((steps < -max(reach, 0.0)) & (values[there][1:] <= values[there][0] + reach))
        return [int(there[k + 1]) for k in back]
    return []


def _falls_throughout(values: np.ndarray) -> bool:
    return bool(np.mean(np.diff(values) < 0.0) > 0.5)
