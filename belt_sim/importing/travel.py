"""Which rows are one run, how far the belt has travelled at each, and records on one grid of travel."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from belt_sim.campaign.problems import CampaignError, refusal
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


#: A travel that falls back by less than this share of the record is jitter of the encoder.
JITTER = 2e-3
#: Share of the speed's median beyond which a speed of the other sign is a reversal.
REVERSAL = 0.2


@dataclass(frozen=True, kw_only=True)
class Travel:
    """keep: rows of the block that are used; travel [m] and time [s] (None where not logged) at these, from 0 on;
    direction by the sign that was logged, 0 where none was; speed [m/s], 0 where it is not known."""

    keep: np.ndarray
    travel: np.ndarray
    time: np.ndarray | None
    direction: float
    speed: float
    notes: tuple[str, ...] = ()


def travel_of(block: LoggedBlock, speed: float | None) -> Travel | None:
    """The travel of one run; None when it takes a speed that nobody has told. speed [m/s]: where none was logged."""
    time, notes = _time(block)
    travel = block.values("travel")
    if travel is not None:
        return _logged_travel(block, travel, time, notes)
    if time is None:
        return None
    logged = block.values("speed")
    if logged is None and speed is None:
        return None
    keep = np.flatnonzero(np.isfinite(time))
    if logged is not None and np.isfinite(logged).any():
        there = np.flatnonzero(np.isfinite(logged))
        fast = np.interp(keep, there, logged[there])
        _refuse_reversal(block, keep, fast)
        steps = 0.5 * (fast[1:] + fast[:-1]) * np.diff(time[keep])
        way = np.concatenate([[0.0], np.cumsum(np.abs(steps))])
        notes.append("travel was integrated from time and speed")
        sign = float(np.sign(np.median(fast[fast != 0.0]))) if np.any(fast) else 1.0
    else:
        assert speed is not None
        way, sign = abs(speed) * (time[keep] - time[keep[0]]), 0.0
        notes.append(f"travel was taken as time x {abs(speed):g} m/s")
    return _travel(keep, way, time, sign, notes)


def _travel(keep: np.ndarray, travel: np.ndarray, time: np.ndarray | None, sign: float, notes: list[str]) -> Travel:
    own = None if time is None else time[keep] - time[keep[0]]
    speed = float(travel[-1] / own[-1]) if own is not None and len(own) and own[-1] > 0.0 else 0.0
    return Travel(keep=keep, travel=travel, time=own, direction=sign, speed=speed, notes=tuple(notes))


def _time(block: LoggedBlock) -> tuple[np.ndarray | None, list[str]]:
    """Time [s], strictly rising; repeated stamps are spread evenly. Raises CampaignError where it runs backwards."""
    time = block.values("time")
    if time is None or not np.isfinite(time).any():
        return None, []
    there = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[there])
    back = np.flatnonzero(steps < 0.0)
    if len(back):
        k = int(there[back[0] + 1])
        remedy = f"time runs backwards; the row before has {time[there[back[0]]]:.15g}; mend or cut the record there"
        raise block.refuse(k, "time", float(time[k]), "s", remedy)
    if np.all(steps > 0.0):
        return time, []
    first = there[np.concatenate([[True], steps > 0.0])]
    if len(first) < 2:
        raise block.refuse(0, "time", float(time[there[0]]), "s", "time stands still; give a column that rises")
    spread = np.interp(there, first, time[first])
    last = there > first[-1]
    rate = (time[first[-1]] - time[first[0]]) / (first[-1] - first[0])
    spread[last] = time[first[-1]] + rate * (there[last] - first[-1])
    out = np.full(len(time), np.nan)
    out[there] = spread
    return out, ["several rows have one time stamp: they were spread evenly"]


def _logged_travel(block: LoggedBlock, travel: np.ndarray, time: np.ndarray | None, notes: list[str]) -> Travel:
    """Travel as logged, from 0 on and rising whichever way the belt runs; rows where it stands still fall together."""
    there = np.isfinite(travel) if time is None else np.isfinite(travel) & np.isfinite(time)
    keep = np.flatnonzero(there)
    if len(keep) < 2 or np.ptp(travel[keep]) == 0.0:
        raise block.refuse(0, "travel", None, "", "travel stands still; give a column that rises")
    sign = 1.0 if travel[keep[-1]] >= travel[keep[0]] else -1.0
    way = sign * (travel[keep] - travel[keep[0]])
    highest = np.maximum.accumulate(way)
    fallen = np.flatnonzero(highest - way > JITTER * way.max())
    if len(fallen):
        k = int(keep[fallen[0]])
        remedy = (
            f"travel runs backwards; before it was {travel[keep[fallen[0] - 1]]:.15g} m; mend or cut the record there"
        )
        raise block.refuse(k, "travel", float(travel[k]), "m", remedy)
    if np.any(way < highest):
        notes.append("the encoder jitters: where travel falls back a little it was held")
    if sign < 0.0:
        notes.append("travel was counted downwards: direction -1")
    return _travel(keep, highest, time, sign if sign < 0.0 else 0.0, notes)


def _refuse_reversal(block: LoggedBlock, keep: np.ndarray, speed: np.ndarray) -> None:
    usual = float(np.median(speed[speed != 0.0])) if np.any(speed) else 0.0
    if usual == 0.0:
        raise block.refuse(0, "speed", 0.0, "m/s", "the belt stands still throughout; give a record of a running belt")
    other = np.flatnonzero(speed * np.sign(usual) < -REVERSAL * abs(usual))
    if len(other):
        k = int(keep[other[0]])
        remedy = "the belt reverses within a run; cut the record there, one run a direction"
        raise block.refuse(k, "speed", float(speed[other[0]]), "m/s", remedy)


#: Samples a run that are aimed at, and the fewest that a step may leave.
AIMED, LEFT = 600, 60
#: Travel from time and speed is a little uneven; a step this share below twice the spacing still has two rows.
UNEVEN = 0.95
#: Decimals of a reading in SI that are kept.
DECIMALS = 10
#: Repeats are cut to the shortest of them when they differ by less than this share.
ALIKE = 0.1


#: Column of the time [s] in the record of a run, a table over the travel [m] whose other columns are the signals.
TIME = "time_s"


def signals_in(record: pd.DataFrame) -> list[str]:
    """The names of the signals of a record."""
    return [str(name) for name in record.columns if name != TIME]


def step_for(records: list[pd.DataFrame]) -> float:
    """A step [m] that keeps some hundred samples a run; 0 where records are so sparse that they stay as they are."""
    places = [np.unique(record.index) for record in records]
    spacing = [float(np.median(np.diff(travel))) for travel in places if len(travel) > 2]
    if not spacing or _on_one_grid(records):
        return 0.0
    longest = max(float(record.index[-1]) for record in records)
    step = _nice(max(longest / AIMED, UNEVEN * 2.0 * max(spacing)))
    return step if step <= longest / LEFT else 0.0


def _on_one_grid(records: list[pd.DataFrame]) -> bool:
    """Whether all records stand at the same travels already, and not at too many of them."""
    first = max(records, key=len).index
    if len(first) > 4 * AIMED:
        return False
    return all(r.index.is_unique and np.allclose(r.index, first[: len(r)], atol=1e-6) for r in records)


def _nice(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(step))
    return float(next(f"{f * power:.6g}" for f in (1.0, 2.0, 5.0, 10.0) if f * power >= step * (1.0 - 1e-9)))


def resample(record: pd.DataFrame, step: float) -> pd.DataFrame:
    """Averages over bins of ``step`` [m] about its multiples; with step 0 only rows of one travel fall together."""
    travel = record.index.to_numpy()
    means = record.groupby(np.rint(travel / step) * step if step > 0.0 else travel).mean()
    hardly_begun = step > 0.0 and len(means) > 2 and travel[-1] < means.index[-1] - 0.25 * step
    means.index = np.round(means.index, 9)
    return means.iloc[:-1] if hardly_begun else means


def merge_records(records: list[pd.DataFrame]) -> pd.DataFrame:
    """Records of one run from several files or curves, on all their travels."""
    if len(records) == 1:
        return records[0]
    merged = pd.concat(records).groupby(level=0).last()
    return merged if all(TIME in r for r in records) else merged.drop(columns=TIME, errors="ignore")


def cut_repeats(groups: list[list[int]], records: list[pd.DataFrame]) -> list[pd.DataFrame]:
    """Repeats (groups of positions) cut to the shortest, where they differ by little, so that they compare."""
    out = list(records)
    for group in groups:
        counts = [len(records[k]) for k in group]
        if max(counts) - min(counts) <= ALIKE * max(counts):
            for k in group:
                out[k] = records[k].iloc[: min(counts)]
    return out


def count_from_yaw(records: list[pd.DataFrame], yaw_at: list[float]) -> tuple[list[pd.DataFrame], list[str]]:
    """Readings counted from where each point was when the yaw was applied [m], and what was taken off, in words."""
    out: list[pd.DataFrame] = []
    off: dict[str, list[float]] = {}
    for record, at in zip(records, yaw_at, strict=True):
        travel = record.index.to_numpy()
        starts = {name: _reading_at_yaw(travel, record[name].to_numpy(), at) for name in signals_in(record)}
        out.append(record.assign(**{name: np.round(record[name] - y, DECIMALS) for name, y in starts.items()}))
        for name, start in starts.items():
            off.setdefault(name, []).append(1e3 * start)
    told = [f"{name} {min(x):.4g} to {max(x):.4g}" for name, x in off.items() if max(map(abs, x)) > 1e-3]
    if not told:
        return out, []
    return out, [f"readings count from where each point was at the yaw; taken off: {', '.join(told)} (mm or mrad)"]


def _reading_at_yaw(travel: np.ndarray, y: np.ndarray, yaw_at: float) -> float:
    """Reading [SI] at the yaw: the mean of what stands before it, else a line through the first readings after it."""
    there = np.isfinite(y)
    before = there & (travel < yaw_at)
    if before.sum() >= 3:
        return float(np.mean(y[before]))
    s, values = travel[there] - yaw_at, y[there]
    if not len(s):
        return 0.0
    near = s <= max(0.01 * (s[-1] - s[0]), 4.0 * float(np.median(np.diff(s))) if len(s) > 4 else 0.0)
    if near.sum() < 4:
        return float(values[0])
    return float(np.polynomial.Polynomial.fit(s[near], values[near], 1)(0.0))
