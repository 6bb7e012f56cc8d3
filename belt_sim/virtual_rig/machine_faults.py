"""Faults of machine and belt in the catalogue of the physics sheet (section 7), as this line has them."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Fault, Size
from belt_sim.virtual_rig.line import Line


@dataclass(frozen=True, kw_only=True)
class SagRoll(Fault):
    """The sagging belt tilts instead of bending in its plane; strength 1 is the strip."""

    id = "sag_roll"
    sizes: ClassVar = {"strength": Size(unit="1", typical=1.0, limit=1.5)}
    strength: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, sag_roll=line.sag_roll + self.strength)


@dataclass(frozen=True, kw_only=True)
class YawOffsetTail(Fault):
    """The tail pulley stands at beta_0 when zero is commanded."""

    id = "yaw_offset_tail"
    sizes: ClassVar = {"beta_0": Size(unit="rad", typical=1e-4, limit=2e-3)}
    beta_0: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, offset_tail=line.offset_tail + self.beta_0)


@dataclass(frozen=True, kw_only=True)
class YawOffsetHead(Fault):
    """The head pulley stands at beta_0 when zero is commanded."""

    id = "yaw_offset_head"
    sizes: ClassVar = {"beta_0": Size(unit="rad", typical=1e-4, limit=2e-3)}
    beta_0: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, offset_head=line.offset_head + self.beta_0)


@dataclass(frozen=True, kw_only=True)
class Cant(Fault):
    """The tail pulley's axis rises by gamma towards +y."""

    id = "cant"
    sizes: ClassVar = {"gamma": Size(unit="rad", typical=1e-3, limit=1e-2)}
    gamma: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, cant=line.cant + self.gamma)


@dataclass(frozen=True, kw_only=True)
class Taper(Fault):
    """The tail pulley is a cone: (dR/dy)/R = kappa_t turns the stuck belt, dtheta/ds = -(kappa + kappa_t)."""

    id = "taper"
    sizes: ClassVar = {"kappa_t": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    kappa_t: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.kappa_t * TAIL


@dataclass(frozen=True, kw_only=True)
class Crown(Fault):
    """The tail pulley is thicker in its middle: a taper -c y."""

    id = "crown"
    sizes: ClassVar = {"c": Size(unit="1/m2", typical=5e-3, limit=0.5)}
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return -self.c * y * TAIL


@dataclass(frozen=True, kw_only=True)
class Camber(Fault):
    """The belt is curved in its plane by nature; by Betti a run-up feels what its span's shape does not take up."""

    id = "camber"
    sizes: ClassVar = {"kappa_c": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    kappa_c: float = 0.0
    left: np.ndarray = field(default_factory=lambda: np.empty(0), init=False)

    def prepared(self, line: Line) -> "Camber":
        known = replace(self)
        object.__setattr__(known, "left", 1 - line.turning().mean(axis=1) * line.span_length)
        return known

    def turn(self, s, line, y, kappa):
        return np.broadcast_to(self.kappa_c * self.left, kappa.shape)


@dataclass(frozen=True, kw_only=True)
class Wobble(Fault):
    """The tail pulley swings once a turn: yaw beta_1 cos(s/R + phase)."""

    id = "wobble"
    sizes: ClassVar = {"beta_1": Size(unit="rad", typical=1e-3, limit=1e-2)}
    beta_1: float = 0.0
    phase: float = 0.0

    def yaw(self, s, line):
        return self.beta_1 * np.cos(s / line.tail_radius + self.phase)


@dataclass(frozen=True, kw_only=True)
class SoftCover(Fault):
    """Both pulleys yield under the entry moment M: dtheta/ds = -(kappa + c M)."""

    id = "soft_cover"
    sizes: ClassVar = {"c": Size(unit="1/(N m2)", typical=5e-6, limit=2e-4)}
    positive: ClassVar = True
    c: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, cover=line.cover + self.c)


@dataclass(frozen=True, kw_only=True)
class Slip(Fault):
    """Both pulleys hold an entry moment of mu F b/2 at most; given as 1/mu, 0 = they hold any."""

    id = "slip"
    sizes: ClassVar = {"inverse_friction": Size(unit="1", typical=1 / 0.15, limit=20.0)}
    positive: ClassVar = True
    inverse_friction: float = 0.0

    def set(self, line: Line) -> Line:
        slippery = np.broadcast_to(self.inverse_friction, line.friction.shape)
        with np.errstate(divide="ignore"):
            return replace(line, friction=np.minimum(line.friction, 1.0 / slippery))


@dataclass(frozen=True, kw_only=True)
class YawCompliance(Fault):
    """The tail pulley's bearings yield to the spans' end moments: yaw beta - c_m (M_1 + M_2)."""

    id = "yaw_compliance"
    sizes: ClassVar = {"c_m": Size(unit="rad/(N m)", typical=5e-6, limit=5e-5)}
    positive: ClassVar = True
    c_m: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, compliance=line.compliance + self.c_m)


@dataclass(frozen=True, kw_only=True)
class YawBacklash(Fault):
    """The tail pulley follows its command through a play of +-half, from the middle of the play."""

    id = "yaw_backlash"
    sizes: ClassVar = {"half": Size(unit="rad", typical=5e-5, limit=5e-4)}
    positive: ClassVar = True
    half: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, yaw=np.sign(line.yaw) * np.maximum(np.abs(line.yaw) - self.half, 0.0))


@dataclass(frozen=True, kw_only=True)
class TensionBias(Fault):
    """The load cell errs: true tension sigma (1 + gain) + bias."""

    id = "tension_bias"
    sizes: ClassVar = {
        "gain": Size(unit="1", typical=0.1, limit=0.3),
        "bias": Size(unit="Pa", typical=5e5, limit=3e6),
    }
    gain: float = 0.0
    bias: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, stress=line.stress * (1 + self.gain) + self.bias)


@dataclass(frozen=True, kw_only=True)
class SpeedTension(Fault):
    """Centrifugal tension: the spans feel sigma - share rho v^2."""

    id = "speed_tension"
    sizes: ClassVar = {"share": Size(unit="1", typical=1.0, limit=1.5)}
    positive: ClassVar = True
    share: float = 0.0

    def set(self, line: Line) -> Line:
        return replace(line, stress=line.stress - self.share * line.density * line.speed**2)
