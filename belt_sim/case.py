"""A case: one rig, one belt, and how it is set."""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.pytree import Numbers, pytree
from belt_sim.rig import Belt, Rig


@pytree
@dataclass(frozen=True, kw_only=True)
class Schedule:
    """A yaw angle against belt travel: a sum of steps and ramps.

    at [m], over [m], change [rad]: arrays of one length; entry k turns the pulley by change[k], beginning at
    travel at[k] and spread evenly over over[k] metres (0 = a step). The angle before the first entry is 0.
    """

    at: Numbers
    over: Numbers
    change: Numbers

    @staticmethod
    def step(angle: float, at: float = 0.0) -> "Schedule":
        """The pulley is turned by ``angle`` [rad] at travel ``at`` [m]."""
        return Schedule(at=np.array([at]), over=np.array([0.0]), change=np.array([angle]))

    @staticmethod
    def ramp(angle: float, at: float, over: float) -> "Schedule":
        """The pulley is turned evenly by ``angle`` [rad] between travel ``at`` and ``at + over`` [m]."""
        return Schedule(at=np.array([at]), over=np.array([over]), change=np.array([angle]))

    def then(self, other: "Schedule") -> "Schedule":
        """Both schedules one after (or over) the other."""
        pairs = [(self.at, other.at), (self.over, other.over), (self.change, other.change)]
        at, over, change = (np.concatenate([np.asarray(a), np.asarray(b)]) for a, b in pairs)
        return Schedule(at=at, over=over, change=change)

    def last(self) -> Numbers:
        """The angle that the schedule ends at [rad]."""
        return self.change.sum(axis=-1)


@pytree
@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a case is run.

    tension [Pa]; yaw of the tail pulley and yaw_head of the head pulley, both about +z; speed [m/s];
    direction +1 (the upper span runs from head to tail) or -1; start: travel [m] that the belt had behind it at travel
    0, since its marked place lay at point 4: by so much belt and pulleys had turned.
    """

    tension: Numbers
    yaw: Schedule
    yaw_head: Schedule = field(default_factory=lambda: Schedule.step(0.0))
    speed: Numbers = 0.5
    direction: Numbers = 1.0
    start: Numbers = 0.0


@pytree
@dataclass(frozen=True, kw_only=True)
class Case:
    """Rig + Belt + Settings."""

    rig: Rig
    belt: Belt
    settings: Settings

    @property
    def tension_force(self) -> Numbers:
        """F = sigma b h [N]."""
        return self.settings.tension * self.belt.area

    @property
    def weight_per_length(self) -> Numbers:
        """q = rho g b h [N/m]."""
        return self.belt.mass_per_length * self.rig.gravity

    @property
    def sag_curvature(self) -> Numbers:
        """Z = q / F, the vertical curvature of the hanging span [1/m]."""
        return self.weight_per_length / self.tension_force
