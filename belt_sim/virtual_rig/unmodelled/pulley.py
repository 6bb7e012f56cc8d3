"""Run-up: what turns the belt where it lands."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import HEAD, TAIL, Size, Unmodelled
from belt_sim.virtual_rig.time_courses import random_course


@dataclass(frozen=True, kw_only=True)
class QuadraticContact(Unmodelled):
    """The tail pulley turns the belt by c y^2 per metre."""

    id = "quadratic_contact"
    sizes = {"c": Size(unit="1/m3", typical=0.05, limit=50.0)}
    place, variable, form = "runup_tail", "y", "power"
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.c * y**2 * TAIL


@dataclass(frozen=True, kw_only=True)
class SoftShoulder(Unmodelled):
    """The head pulley has shoulders: off the middle it turns the belt back by kappa at most, kappa tanh(y/y0)."""

    id = "soft_shoulder"
    blind = True
    sizes = {"kappa": Size(unit="1/m", typical=3e-5, limit=2e-3)}
    place, variable, form = "runup_head", "y", "saturating"
    also = (("y", "power"), ("y", "threshold"))
    kappa: float = 0.0
    width: float = 1e-3

    def turn(self, s, line, y, kappa):
        return -self.kappa * np.tanh(y / self.width) * HEAD

    @classmethod
    def random_shape(cls, plan, rng):
        return {"width": float(10 ** rng.uniform(-3.7, -2.5))}


@dataclass(frozen=True, kw_only=True)
class DeadZone(Unmodelled):
    """Curvature below kappa_d does not turn the belt on the pulley."""

    id = "dead_zone"
    sizes = {"kappa_d": Size(unit="1/m", typical=1e-5, limit=5e-4)}
    positive = True
    place, variable, form = "runup_both", "curvature", "threshold"
    also = (("curvature", "saturating"),)
    kappa_d: float = 0.0

    def turn(self, s, line, y, kappa):
        return -np.clip(kappa, -self.kappa_d, self.kappa_d)


@dataclass(frozen=True, kw_only=True)
class SquareMoment(Unmodelled):
    """The cover gives way more than in proportion: both pulleys turn the belt by c kappa |kappa| more."""

    id = "square_moment"
    blind = True
    sizes = {"c": Size(unit="m", typical=800.0, limit=2e5)}
    place, variable, form = "runup_both", "curvature", "power"
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return kappa * np.maximum(self.c * np.abs(kappa), -0.95)


@dataclass(frozen=True, kw_only=True)
class BaldPatch(Unmodelled):
    """The tail pulley's lagging is gone on one side of a patch: a taper that acts while the patch takes the belt up."""

    id = "bald_patch"
    blind = True
    sizes = {"kappa": Size(unit="1/m", typical=1e-4, limit=1e-2)}
    place, variable, form = "runup_tail", "pulley_phase", "periodic"
    also = (("wave", "periodic"), ("travel", "periodic"))
    kappa: float = 0.0
    phase: float = 0.0
    narrow: float = 3.0

    def turn(self, s, line, y, kappa):
        return self.kappa * np.exp(self.narrow * (np.cos((s + line.start) / line.tail_radius - self.phase) - 1)) * TAIL

    @classmethod
    def random_shape(cls, plan, rng):
        return {"phase": float(rng.uniform(0, 2 * np.pi)), "narrow": float(rng.uniform(1.5, 5.0))}


_FULL = 1e-4  # [rad]


@dataclass(frozen=True, kw_only=True)
class LaggingSet(Unmodelled):
    """The tail pulley's rubber stays askew after a yaw step and recovers in time: it turns the belt meanwhile.

    Fully from a yaw of ``_FULL`` on; a pulley that is set to no yaw, and errs by a microradian, sets nothing.
    """

    id = "lagging_set"
    blind = True
    sizes = {"kappa": Size(unit="1/m", typical=1e-4, limit=5e-3)}
    place, variable, form = "runup_tail", "time_since_step", "exponential"
    also = (("travel", "exponential"), ("time_since_step", "saturating"))
    kappa: float = 0.0
    time: float = 20.0

    def turn(self, s, line, y, kappa):
        t = (s - line.yaw_at) / line.speed
        left = np.where(t >= 0, np.exp(-np.maximum(t, 0.0) / self.time), 0.0)
        return self.kappa * np.clip(line.yaw / _FULL, -1.0, 1.0) * left * TAIL

    @classmethod
    def random_shape(cls, plan, rng):
        return {"time": float(rng.uniform(0.08, 0.5) * plan.length / plan.runs[0].speed)}


@dataclass(frozen=True, kw_only=True)
class Rut(Unmodelled):
    """The belt wears a rut into the tail pulley: it is turned as it lay there one revolution of the belt ago."""

    id = "rut"
    blind = True
    sizes = {"c": Size(unit="1/m2", typical=1e-2, limit=1.0)}
    place, variable, form = "runup_tail", "y", "linear"
    also = (("belt_phase", "linear"), ("belt_phase", "periodic"))
    c: float = 0.0

    def recall(self, s, past):
        return self.c * past.at(s - past.line.belt_length, 0, 1) * TAIL


@dataclass(frozen=True, kw_only=True)
class WalkingAngle(Unmodelled):
    """The contact angle on the tail pulley takes a random walk of its own in every run."""

    id = "walking_angle"
    sizes = {"size": Size(unit="rad/m^0.5", typical=5e-6, limit=1e-3)}
    positive = True
    place, variable, form = "runup_tail", "travel", "random"
    size: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        return self.size * random_course(self.seed, line.run, s) * TAIL

    @classmethod
    def random_shape(cls, plan, rng):
        return {"seed": int(rng.integers(2**31))}
