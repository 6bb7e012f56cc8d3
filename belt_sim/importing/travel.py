"""How far the belt has travelled at each row of a run: as logged, or from time and speed."""

from dataclasses import dataclass

import numpy as np

from belt_sim.importing.blocks import LoggedBlock

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
    travel, speeds = block.values("travel"), block.values("speed")
    if travel is not None:
        return _logged_travel(block, travel, time, notes)
    if time is None:
        return None
    if speeds is not None and np.isfinite(speeds).any():
        return _integrated_travel(block, speeds, time, notes)
    if speed is None:
        return None
    keep = np.flatnonzero(np.isfinite(time))
    notes.append(f"travel was taken as time x {abs(speed):g} m/s")
    return _travel(keep, abs(speed) * (time[keep] - time[keep[0]]), time, 0.0, notes)


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


def _integrated_travel(block: LoggedBlock, speeds: np.ndarray, time: np.ndarray, notes: list[str]) -> Travel:
    """Travel from time and speed by the trapezoidal rule; raises CampaignError where the belt reverses."""
    keep, there = np.flatnonzero(np.isfinite(time)), np.flatnonzero(np.isfinite(speeds))
    speed = np.interp(keep, there, speeds[there])
    usual = float(np.median(speed[speed != 0.0])) if np.any(speed) else 0.0
    if usual == 0.0:
        raise block.refuse(0, "speed", 0.0, "m/s", "the belt stands still throughout; give a record of a running belt")
    other = np.flatnonzero(speed * np.sign(usual) < -REVERSAL * abs(usual))
    if len(other):
        remedy = "the belt reverses within a run; cut the record there, one run a direction"
        raise block.refuse(int(keep[other[0]]), "speed", float(speed[other[0]]), "m/s", remedy)
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time[keep])
    notes.append("travel was integrated from time and speed")
    return _travel(keep, np.concatenate([[0.0], np.cumsum(np.abs(steps))]), time, float(np.sign(usual)), notes)
