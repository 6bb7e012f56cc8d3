"""Which rows and columns of a logger's table are one run."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.campaign.problems import CampaignError, refusal
from belt_sim.errors import InputError
from belt_sim.importing.columns import UsedTable

#: A run begins anew where time or travel falls back to within this share of where the file began.
RESTART = 0.05
FEWEST = 3  # rows of a run


@dataclass(frozen=True, kw_only=True)
class LoggedBlock:
    """rows of one table that are one run; name: as proposed; text: what may state its settings (file or run name)."""

    table: UsedTable
    rows: np.ndarray
    name: str
    text: str

    def values(self, role: str) -> np.ndarray | None:
        """Numbers [SI] of the column with this role, None where there is none."""
        found = self.table.column(role)
        return None if found is None else found.si(self.rows)

    def line(self, k: int) -> int:
        return int(self.table.logged.lines[self.rows[k]])

    def refuse(self, k: int, name: str, value: object, unit: str, remedy: str) -> CampaignError:
        """The error of row ``k`` of the run."""
        return refusal(self.table.logged.file, remedy, line=self.line(k), name=name, value=value, unit=unit)


def blocks_of(table: UsedTable) -> list[LoggedBlock]:
    """The runs of a table; its columns may belong to different runs, or have travels of their own."""
    own = [u for u in table.columns if u.entry.run or u.entry.against]
    travels = {u.entry.against for u in own if u.entry.against}
    base = tuple(u for u in table.columns if u not in own and u.column.name not in travels)
    shared = tuple(u for u in base if u.role != "signal")
    found: list[LoggedBlock] = []
    for u in own:
        columns = (*shared, u)
        if u.entry.against:
            along = next((v for v in table.columns if v.column.name == u.entry.against), None)
            if along is None:
                raise InputError(f"columns.{u.column.name}.against", u.entry.against, "", "names no column of its file")
            columns = (*(v for v in shared if v.role not in ("time", "travel")), along, u)
        part, run = replace(table, columns=columns), u.entry.run
        if run is None:
            found += _blocks_of_rows(part)
        else:
            found.append(LoggedBlock(table=part, rows=np.arange(len(table.logged.lines)), name=run_name(run), text=run))
    if not own or len(shared) < len(base):
        found += _blocks_of_rows(replace(table, columns=base))
    return found


def _blocks_of_rows(table: UsedTable) -> list[LoggedBlock]:
    """The runs of one table: by its run column, else where the file, its time or its travel begins anew."""
    run, name = table.column("run"), table.logged.name
    rows = np.arange(len(table.logged.lines))
    if run is not None:
        of_row = np.array(run.labels, dtype=object)
        labels = dict.fromkeys(label for label in run.labels if label)
        return [LoggedBlock(table=table, rows=rows[of_row == n], name=run_name(n), text=n) for n in labels]
    cuts = sorted({*table.logged.starts, *_restarts(table)})
    parts = [p for p in np.split(rows, cuts) if len(p) >= FEWEST]
    if len(parts) < 2:
        return [LoggedBlock(table=table, rows=rows, name=run_name(name), text=name)]
    numbered = ((f"{run_name(name)}_{k}", part) for k, part in enumerate(parts, start=1))
    return [LoggedBlock(table=table, rows=part, name=n, text=name) for n, part in numbered]


def run_name(text: str) -> str:
    """A name that a run may have in a campaign: letters, digits, blanks and _ . + - only, beginning with a letter."""
    kept = "".join(c if c.isalnum() or c in "_.+- " else "_" for c in text).strip(" .+-")
    kept = " ".join(kept.split())[:60].strip()
    return f"r{kept}" if kept[:1].isdigit() or not kept else kept


def _restarts(table: UsedTable) -> list[int]:
    """Rows at which time or travel falls back to where it began."""
    for role in ("travel", "time"):
        key = table.column(role)
        if key is None:
            continue
        values = key.si()
        there = np.flatnonzero(np.isfinite(values))
        steps = np.diff(values[there])
        if len(there) < FEWEST or np.mean(steps < 0.0) > 0.5:  # it falls throughout
            return []
        reach = RESTART * float(np.ptp(values[there]))
        back = np.flatnonzero((steps < -max(reach, 0.0)) & (values[there][1:] <= values[there][0] + reach))
        return [int(there[k + 1]) for k in back]
    return []
