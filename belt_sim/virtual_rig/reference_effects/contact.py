"""How the pulleys hold the belt: friction, cover, film, bending layer."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size


@dataclass(frozen=True, kw_only=True)
class Slip(Fault):
    """Both pulleys hold the belt by friction, given as 1/mu; 0 = they hold any moment.

    At each change of yaw the run-ups let go once, and the run-offs let go all the time (grip.py, travel.py).
    """

    id = "slip"
    sizes = {"inverse_friction": Size(unit="1", typical=1 / 0.15, limit=20.0)}
    positive = True
    draw_order = 8
    inverse_friction: float = 0.0

    def set(self, line):
        slippery = np.broadcast_to(self.inverse_friction, line.friction.shape)
        with np.errstate(divide="ignore"):
            return replace(line, friction=np.minimum(line.friction, 1.0 / slippery))

    def scene(self, parts, case):
        held = 1 / self.inverse_friction if self.inverse_friction else np.inf
        return replace(parts, friction=min(parts.friction, held))


@dataclass(frozen=True, kw_only=True)
class SoftCover(Fault):
    """Both pulleys yield under the entry moment M: dtheta/ds = -(kappa + c M)."""

    id = "soft_cover"
    sizes = {"c": Size(unit="1/(N m2)", typical=5e-6, limit=2e-4)}
    positive = True
    draw_order = 7
    c: float = 0.0

    def set(self, line):
        return replace(line, cover=line.cover + self.c)


@dataclass(frozen=True, kw_only=True)
class TractionLoss(Fault):
    """A film above a speed: the belt follows its contact angle in part, by 1 - loss (v - onset), on both pulleys."""

    id = "traction_loss"
    sizes = {"loss": Size(unit="s/m", typical=0.2, limit=1.0)}
    positive = True
    draw_order = 20
    loss: float = 0.0
    onset: float = 0.0

    def slide(self, s, line, alpha):
        return np.maximum(1 - self.loss * np.maximum(line.speed - self.onset, 0.0), 0.0)

    @classmethod
    def random_shape(cls, plan, rng):
        """The film begins somewhere below the fastest run."""
        return {"onset": float(rng.uniform(0.0, 0.8) * max(run.speed for run in plan.runs))}

    @classmethod
    def shapes(cls, plan):
        return tuple({"onset": share * max(run.speed for run in plan.runs)} for share in (0.0, 0.7))


@dataclass(frozen=True, kw_only=True)
class LiftOff(Fault):
    """A belt that resists bending leaves its pulleys along a layer: the ends of its spans give way to their couples.

    They do so unlike above and below. 1 is the layer of the belt's own plate stiffness; nothing of it is fitted.
    """

    id = "lift_off"
    sizes = {"strength": Size(unit="1", typical=1.0, limit=1.5)}
    fixed = True
    strength: float = 0.0

    def set(self, line):
        return replace(line, layer=line.layer + self.strength)
