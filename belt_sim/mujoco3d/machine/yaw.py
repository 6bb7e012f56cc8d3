"""The order of a run: straight run-in, stops for yaw steps, and the speed in between."""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.case import Schedule
from belt_sim.mujoco3d.options import Options


@dataclass(frozen=True)
class YawPlan:
    """A schedule split into steps, which are made while the belt stands still, and ramps over travel."""

    schedule: Schedule

    def stops(self, until: float) -> list[float]:
        """Travels [m] of the steps within the run."""
        at, over = np.asarray(self.schedule.at, float), np.asarray(self.schedule.over, float)
        change = np.asarray(self.schedule.change, float)
        return sorted({float(s) for s, o, c in zip(at, over, change, strict=True) if o <= 0.0 and c and s < until})

    def angle(self, travel: float, done: float) -> float:
        """Yaw [rad] at ``travel`` [m] when the steps up to travel ``done`` [m] have been made."""
        total = 0.0
        for at, over, change in zip(self.schedule.at, self.schedule.over, self.schedule.change, strict=True):
            if over <= 0.0:
                total += float(change) if at <= done else 0.0
            else:
                total += float(change) * min(max((travel - float(at)) / float(over), 0.0), 1.0)
        return total


@dataclass
class Clock:
    """Travel, speed and pauses: ``advance`` is called once a step and moves the head pulley's clock on.

    The belt speeds up and slows down with options.acceleration, stands still at every stop for the yaw step
    (smooth over yaw_time) and for half of ``settle`` after it.
    """

    options: Options
    stops: list[float]
    end: float
    travel: float
    speed: float = 0.0
    time: float = 0.0
    paused_since: float | None = None
    done: float = -math.inf

    def advance(self, dt: float) -> None:
        self.time += dt
        if self.paused_since is not None:
            if self.time - self.paused_since < self.options.yaw_time + 0.5 * self.options.settle:
                return
            self.done, self.paused_since = self.stops.pop(0), None
        ahead = self.stops[0] - self.travel if self.stops else math.inf
        a = self.options.acceleration
        allowed = min(self.options.belt_speed, math.sqrt(2.0 * a * max(ahead, 0.0)) + 0.5 * a * dt)
        self.speed = min(self.speed + a * dt, allowed)
        if ahead <= self.speed * dt:
            self.travel, self.speed, self.paused_since = self.stops[0], 0.0, self.time
        else:
            self.travel += self.speed * dt

    def step_share(self) -> float:
        """How much of the present yaw step has been made, 0..1 (3 u^2 - 2 u^3)."""
        if self.paused_since is None:
            return 0.0
        u = min((self.time - self.paused_since) / self.options.yaw_time, 1.0)
        return u * u * (3.0 - 2.0 * u)

    @property
    def moving(self) -> bool:
        return self.paused_since is None

    @property
    def finished(self) -> bool:
        return self.travel >= self.end and self.paused_since is None


def yaw_now(plan: YawPlan, clock: Clock) -> float:
    """Commanded yaw [rad] of a pulley at the clock's instant."""
    share = clock.step_share()
    before = plan.angle(clock.travel, clock.done)
    if share == 0.0:
        return before
    return before + share * (plan.angle(clock.travel, clock.travel) - before)
