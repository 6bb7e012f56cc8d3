"""Yaw steps, which are made while the belt stands still, and yaw ramps over travel."""

from dataclasses import dataclass

import numpy as np

from belt_sim.case import Schedule, Settings

#: entries of a schedule: at [m], over [m], change [rad]
_Entries = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class YawPlan:
    """What the head and the tail pulley are to be turned by."""

    head: _Entries
    tail: _Entries

    @staticmethod
    def of(settings: Settings) -> "YawPlan":
        """As it is set."""
        return YawPlan(_entries(settings.yaw_head), _entries(settings.yaw))

    def stops(self, until: float) -> set[float]:
        """Travels [m] of the steps within the run."""
        return {at for at, over, change in (*self.head, *self.tail) if over <= 0.0 and change and at < until}

    def angles(self, travel: float, done: float) -> np.ndarray:
        """Yaw [rad] of both at ``travel`` [m] when the steps up to travel ``done`` [m] have been made, shape (2,)."""
        return np.array([_angle(entries, travel, done) for entries in (self.head, self.tail)])

    def turning(self, travel: float, done: float, share: float) -> np.ndarray:
        """Yaw [rad] of both when ``share`` (0..1) of the step at ``travel`` [m] has been made, shape (2,)."""
        before = self.angles(travel, done)
        return before + share * (self.angles(travel, travel) - before)


def _entries(schedule: Schedule) -> _Entries:
    columns = (np.asarray(v, float).tolist() for v in (schedule.at, schedule.over, schedule.change))
    return tuple(zip(*columns, strict=True))


def _angle(entries: _Entries, travel: float, done: float) -> float:
    total = 0.0
    for at, over, change in entries:
        if over <= 0.0:
            total += change if at <= done else 0.0
        else:
            total += change * min(max((travel - at) / over, 0.0), 1.0)
    return total


def smooth(u: float) -> float:
    """From 0 at u = 0 to 1 at 1 and beyond, 3 u^2 - 2 u^3."""
    u = min(u, 1.0)
    return u * u * (3.0 - 2.0 * u)
