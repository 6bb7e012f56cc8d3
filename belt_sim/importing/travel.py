"""How far the belt has travelled in a run: by a counter, which is mended where it fails, or from time and speed."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from belt_sim.campaign.quality import resolution, scatter
from belt_sim.campaign.types import shortlist
from belt_sim.importing.columns import LoggedTable, Note
from belt_sim.importing.mapping import Question, ask

#: A run begins anew where time or travel falls back to within this share of where the file began.
RESTART = 0.05
FEWEST_ROWS = 3  # rows of a run
#: A travel that falls back by less than this share of the record is jitter of the encoder.
JITTER = 2e-3
#: Share of the speed's median beyond which a speed of the other sign is a reversal.
REVERSAL = 0.2
#: Speed [m/s] below which the belt stands.
STOPPED = 1e-3
#: Share of a run's usual speed below which the travel stands, or creeps as a counter does that has come loose.
CREEPS = 0.01
#: Usual steps within which a counter or a reading goes on.
GOES_ON = 3.0
#: Usual steps of the clock that are a gap.
GAP_OF_CLOCK = 20.0
#: Steps of the travel beyond which a last row is no reading, but a total.
LAST_ROW_STEPS = 100.0


def count_on(table: LoggedTable) -> LoggedTable:
    """The table with its travel mended, and told of it: blank where the counter reads one far-off number (0, 1500) for
    some rows and then goes on from where it was. A fall to where the file began is a new run, or is asked about."""
    column = table.column("travel")
    values = column.values.astype(float) if column is not None and not column.is_text else np.empty(0)
    there = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[there])
    if column is None or len(steps) < FEWEST_ROWS or np.mean(steps < 0.0) > 0.5 or not np.any(steps > 0.0):
        return table
    usual, notes, lost = float(np.median(steps[steps > 0.0])), list(table.notes), list[int]()
    begins = values[there][1:] <= values[there[0]] + RESTART * np.ptp(values[there])
    least = JITTER * float(np.ptp(values[there]))
    away = (begins & (steps < -least)) | (steps > GOES_ON * usual)
    for k in np.flatnonzero(away).tolist():
        before, later = values[there[k]], values[there[k + 1 :]]
        rows = int(np.argmax(later != later[0]))
        returns = later[0] < before or later[0] - later[rows] > least
        if rows and returns and 0.0 <= later[rows] - before <= GOES_ON * usual * (rows + 1):
            lost += (gone := there[k + 1 : k + 1 + rows].tolist())
            lines, way = shortlist(table.lines[gone]), "drops" if later[0] < before else f"jumps to {later[0]:.6g}"
            notes.append(Note("", f"{column.name} {way} and comes back: left out (line {lines})"))
    if steps[-1] > LAST_ROW_STEPS * usual:
        lost.append(int(there[-1]))
        notes.append(Note("", f"{column.name} is {values[lost[-1]]:.6g} in the last row, far off all others: left out"))
    values[lost] = np.nan
    columns = tuple(replace(c, values=values) if c is column else c for c in table.columns)
    return replace(table, columns=columns, notes=tuple(notes))


class Travel(NamedTuple):
    """keep: rows of the run that are used; travel [m] and time [s] (None where not logged) at these, from 0 on;
    direction: 1, or -1 where travel or speed are counted backwards; speed [m/s], None where not known."""

    keep: np.ndarray
    travel: np.ndarray
    time: np.ndarray | None
    direction: float
    speed: float | None
    notes: list[str]


def travel_of(
    block: LoggedTable, speed: float | None, standstill: str | None, open_questions: list[Question]
) -> Travel | None:
    """The travel of one run; None when it takes a speed that nobody has told. speed [m/s]: where none was logged;
    standstill: what the mapping says of a travel that stands while the time goes on."""
    time, notes = _time(block)
    logged, speeds, sign, stood = block.values("travel"), block.values("speed"), 1.0, np.zeros(2)
    if logged is not None:
        keep, way, sign = _logged_travel(block, logged, time, notes)
        way, stood = _over_standstills(block, keep, way, time, standstill, notes, open_questions)
        ran = np.empty(0) if speeds is None else running_speeds(speeds[keep], way)
        if len(ran) and np.median(ran) < 0.0 < sign:
            sign = -1.0
            notes.append("the speed is negative: direction -1")
    elif time is None:
        return None
    else:
        keep = np.flatnonzero(np.isfinite(time))
        if speeds is not None:  # by the trapezoidal rule
            there = np.flatnonzero(np.isfinite(speeds))
            paces = np.interp(keep, there, speeds[there])
            usual = float(np.median(paces[paces != 0.0])) if np.any(paces) else 0.0
            if usual == 0.0:
                remedy = "the belt stands still throughout; give a record of a running belt"
                raise block.refuse(0, "speed", 0.0, "m/s", remedy)
            other = np.flatnonzero(paces * np.sign(usual) < -REVERSAL * abs(usual))
            if len(other):
                remedy = "the belt reverses within a run; cut the record there, one run a direction"
                raise block.refuse(keep[other[0]], "speed", float(paces[other[0]]), "m/s", remedy)
            steps = 0.5 * (paces[1:] + paces[:-1]) * np.diff(time[keep])
            way, sign = np.concatenate([[0.0], np.cumsum(np.abs(steps))]), float(np.sign(usual))
            notes.append("travel was integrated from time and speed")
        elif speed is None:
            return None
        else:
            way = abs(speed) * (time[keep] - time[keep[0]])
            notes.append(f"travel was taken as time x {abs(speed):g} m/s")
    steps = np.diff(time[keep]) if time is not None and logged is None else np.empty(0)
    if len(steps) and steps.max() > GAP_OF_CLOCK * np.median(steps):
        k = int(np.argmax(steps))
        far = f"{steps[k]:.4g} s behind line {block.lines[keep[k]]}, over which the belt is taken to have run on"
        notes.append(f"no rows for {far} ({way[k + 1] - way[k]:.4g} m)")
    own, pace = None if time is None else time[keep] - time[keep[0]], None
    if own is not None and len(own) and own[-1] > 0.0 and way[-1] > 0.0:
        far, lasted = np.array([way[-1], own[-1]]) - stood
        pace = float(far / lasted)
    return Travel(keep, way, own, sign, pace, notes)


def running_speeds(speeds: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """Logged speeds [m/s] of the rows in which the belt ran: where travel [m] moves, if any is known there, and it does
    not creep; of (n,) each."""
    there = np.isfinite(speeds)
    moves = there & (np.gradient(travel) > 0.0)
    found = speeds[moves if moves.any() else there]
    return found[np.abs(found) > CREEPS * np.quantile([*np.abs(found), 0.0], 0.9)]  # whatever single readings say


def usual_speeds(way: Travel, logged: np.ndarray | None) -> list[float]:
    """Median speeds [m/s] at which the belt ran: by travel over tenths of the time, and as ``logged`` in the rows that
    were kept; each where it is known, 0 where it never ran."""
    found = [] if logged is None else [np.abs(logged[np.isfinite(logged)])]
    if way.time is None or not way.time[-1] > 0.0:
        return []
    tenths = np.linspace(0.0, way.time[-1], 11)
    found.insert(0, np.diff(np.interp(tenths, way.time, way.travel)) / tenths[1])
    running = [paces[paces > CREEPS * paces.max(initial=0.0)] for paces in found]
    return [float(np.median(paces)) if len(paces) else 0.0 for paces in running]


def _time(block: LoggedTable) -> tuple[np.ndarray | None, list[str]]:
    """Time [s], strictly rising; repeated stamps are spread evenly. Raises CampaignError where it runs backwards."""
    time = block.values("time")
    if time is None:
        return None, []
    there = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[there])
    back = np.flatnonzero(steps < 0.0)
    if len(back):
        k = there[back[0] + 1]
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


def _logged_travel(
    block: LoggedTable, travel: np.ndarray, time: np.ndarray | None, notes: list[str]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Rows with travel, and it at these as logged, from 0 on and rising whichever way the belt runs, and its sign; rows
    where it stands still fall together."""
    there = np.isfinite(travel) if time is None else np.isfinite(travel) & np.isfinite(time)
    keep = np.flatnonzero(there)
    if len(keep) < 2 or np.ptp(travel[keep]) == 0.0:
        raise block.refuse(0, "travel", None, "", "travel stands still; give a column that rises")
    sign = 1.0 if travel[keep[-1]] >= travel[keep[0]] else -1.0
    way = sign * (travel[keep] - travel[keep[0]])
    highest = np.maximum.accumulate(way)
    fallen = np.flatnonzero(highest - way > JITTER * way.max())
    if len(fallen):
        k = keep[fallen[0]]
        before = travel[keep[fallen[0] - 1]]
        remedy = f"travel runs backwards; before it was {before:.15g} m; mend or cut the record there"
        raise block.refuse(k, "travel", float(travel[k]), "m", remedy)
    if np.any(way < highest):
        notes.append("the encoder jitters: where travel falls back a little it was held")
    if sign < 0.0:
        notes.append("travel was counted downwards: direction -1 (or is the newest row first? then turn them round)")
    return keep, highest, sign


def _over_standstills(
    block: LoggedTable,
    keep: np.ndarray,
    way: np.ndarray,
    logged_time: np.ndarray | None,
    standstill: str | None,
    notes: list[str],
    open_questions: list[Question],
) -> tuple[np.ndarray, np.ndarray]:
    """The travel of the rows ``keep``, carried on over stretches in which it stands or creeps and the time goes on, if
    the belt ran: by a column of speed, or by ``standstill``, which is asked once where the readings move on by more
    than scatter; and the travel [m] and the time [s] (2,) in which the belt stood."""
    steps, stood, usual = np.diff(way), np.zeros(2), 0.0
    time, paces = np.zeros(len(way)), steps
    if logged_time is not None:
        time = logged_time[keep]
        paces = steps / np.diff(time)
        usual = float(np.median(paces[steps > 0.0]))
    ends = np.flatnonzero(np.append(paces > CREEPS * usual, True))  # the last row of each travel
    begins, found = np.concatenate([[0], ends[:-1] + 1]), way.astype(float)
    speeds = block.values("speed")
    for k in np.flatnonzero(ends - begins >= FEWEST_ROWS + 2 * np.median(ends - begins)):
        begin, end = int(begins[k]), int(ends[k])
        rows, lasted, pace = slice(begin, end + 1), time[begin : end + 1] - time[begin], usual
        crept = way[rows] - way[begin]
        lines = f"line {block.lines[keep[begin]]} to {block.lines[keep[end]]}"
        how = f"creeps on by {crept[-1]:.2g} m" if crept[-1] > 0.0 else "stands still"
        stands = f"travel {how} at {way[begin]:.6g} m in {end - begin + 1} rows ({lines})"
        stands += f" while the time goes on by {lasted[-1]:.4g} s" if usual else ""
        ran = standstill == "belt_ran" and usual > 0.0
        if usual and speeds is not None:
            pace = float(np.median(np.abs(np.nan_to_num(speeds[keep[rows]]))))
            ran = pace > STOPPED
        elif usual and standstill is None and not any(q.path[-1] == "standstill" for q in open_questions):
            for y in (c.si()[keep] for c in block.columns if c.role == "signal"):
                before, after = map(np.nanmedian, np.array_split(y[rows], 2))
                there = y[np.isfinite(y)]
                if abs(after - before) > GOES_ON * max(scatter(there), resolution(there)):
                    open_questions.append(ask("standstill", stands=stands))
                    break
        if not ran:
            stood += crept[-1], lasted[-1]
            left = "taken as counted" if crept[-1] > 0.0 else "one row is left, their mean"
            notes.append(f"{stands}: {left}" + ("" if usual else "; cut it there if the belt ran on"))
            continue
        notes.append(f"{stands}: carried on at {pace:.4g} m/s, as the belt ran")
        found[rows] += pace * lasted - crept
        later = slice(end + 1, None)
        if not np.any(way[later]) or way[end + 1] - way[end] < 0.5 * pace * (time[end + 1] - time[begin]):
            found[later] += pace * lasted[-1] - crept[-1]  # it goes on from where it stood, and has not caught up
    return found, stood
