"""Run-up and wrap: how the belt follows its contact angle, and slides."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size, Unmodelled
from belt_sim.virtual_rig.time_courses import smooth_step


@dataclass(frozen=True, kw_only=True)
class AdhesionLoss(Unmodelled):
    """From travel ``after`` on, the belt climbs faster or slower sideways than it should by ``share``."""

    id = "adhesion_loss"
    sizes = {"share": Size(unit="1", typical=0.15, limit=2.0)}
    place, variable, form = "runup_both", "travel", "threshold"
    also = (("travel", "saturating"), ("time_since_step", "threshold"))
    share: float = 0.0
    after: float = 20.0

    def slide(self, s, line, alpha):
        return 1 + self.share * smooth_step(s, self.after, 4.0)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"after": float(rng.uniform(0.15, 0.5) * plan.length)}


@dataclass(frozen=True, kw_only=True)
class MidStick(Unmodelled):
    """In mid run the belt runs straight for a while, sideways held by ``share``."""

    id = "mid_stick"
    sizes = {"share": Size(unit="1", typical=0.5, limit=1.0)}
    positive = True
    place, variable, form = "runup_both", "travel", "threshold"
    also = (("time_since_step", "threshold"),)
    share: float = 0.0
    begin: float = 25.0
    length: float = 6.0

    def slide(self, s, line, alpha):
        return 1 - self.share * smooth_step(s, self.begin, 1) * (1 - smooth_step(s, self.begin + self.length, 1))

    @classmethod
    def random_shape(cls, plan, rng):
        return {
            "begin": float(rng.uniform(0.15, 0.6) * plan.length),
            "length": float(rng.uniform(0.1, 0.25) * plan.length),
        }


@dataclass(frozen=True, kw_only=True)
class GreasyStretch(Unmodelled):
    """A stretch of the belt is greasy: while it runs up on a pulley, the belt follows its contact angle less."""

    id = "greasy_stretch"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=1.0)}
    positive = True
    place, variable, form = "runup_both", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"))
    share: float = 0.0
    at: float = 0.3
    stretch: float = 0.3

    def slide(self, s, line, alpha):
        """at, stretch: shares of the belt's length, from what runs up to the tail pulley at travel 0, backwards."""
        run = (np.stack([s + 0.0 * line.start, s - line.span_length - line.wrap_tail]) + line.start) / line.belt_length
        off = np.mod(run - self.at + 0.5, 1.0) - 0.5
        return 1 - self.share * np.where(np.abs(off) < self.stretch / 2, np.cos(np.pi * off / self.stretch) ** 2, 0.0)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"at": float(rng.uniform(0.0, 1.0)), "stretch": float(rng.uniform(0.15, 0.5))}


@dataclass(frozen=True, kw_only=True)
class FollowPower(Unmodelled):
    """On the tail pulley the belt climbs by a power of its contact angle, |alpha|^(1 + p), alike at 0.1 mrad."""

    id = "follow_power"
    blind = True
    sizes = {"p": Size(unit="1", typical=0.2, limit=1.5)}
    place, variable, form = "runup_tail", "contact_angle", "power"
    p: float = 0.0
    REFERENCE, SMALLEST = 1e-4, 1e-5  # [rad]

    def slide(self, s, line, alpha):
        size = np.sqrt(alpha[:1] ** 2 + self.SMALLEST**2) / self.REFERENCE
        return np.concatenate([size**self.p, np.ones_like(size)])


@dataclass(frozen=True, kw_only=True)
class GripLimit(Unmodelled):
    """The belt follows its contact angle less and less, the larger it is: alpha becomes a tanh(alpha/a)."""

    id = "grip_limit"
    blind = True
    sizes = {"inverse_angle": Size(unit="1/rad", typical=2e3, limit=2e5)}
    positive = True
    place, variable, form = "runup_both", "contact_angle", "saturating"
    also = (("contact_angle", "power"),)
    inverse_angle: float = 0.0

    def slide(self, s, line, alpha):
        x = np.abs(alpha * self.inverse_angle)
        return np.where(x > 1e-6, np.tanh(x) / np.maximum(x, 1e-6), 1.0)


@dataclass(frozen=True, kw_only=True)
class WrapCreep(Unmodelled):
    """Wrapped round both pulleys, the belt goes on sideways by a share of what its contact angle asks for."""

    id = "wrap_creep"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=5.0)}
    place, variable, form = "wrap", "contact_angle", "linear"
    share: float = 0.0

    def creep(self, s, line, alpha):
        return -self.share * np.stack([line.wrap_tail * alpha[0], line.wrap_head * alpha[1]])


@dataclass(frozen=True, kw_only=True)
class WrapSlide(Unmodelled):
    """On the tail pulley a belt that lies too much askew slides on: by ``length`` times the angle beyond a limit."""

    id = "wrap_slide"
    blind = True
    sizes = {"length": Size(unit="m", typical=0.5, limit=5.0)}
    positive = True
    place, variable, form = "wrap", "contact_angle", "threshold"
    also = (("contact_angle", "linear"),)
    length: float = 0.0
    limit: float = 1e-4

    def creep(self, s, line, alpha):
        beyond = np.sign(alpha[:1]) * np.maximum(np.abs(alpha[:1]) - self.limit, 0.0)
        return np.concatenate([-self.length * beyond, np.zeros_like(beyond)])

    @classmethod
    def random_shape(cls, plan, rng):
        return {"limit": float(rng.uniform(0.1, 0.4) * max(abs(run.yaw) for run in plan.runs))}
