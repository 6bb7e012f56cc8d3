"""Effects that no catalogue lists: what an open-set test hides."""

from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Fault, Size

_RUNS, _KNOTS = 256, 400  # a random disturbance is drawn for this many runs, at one knot a metre


def _smooth_step(s, at, over):
    t = np.clip((s - at) / over, 0.0, 1.0)
    return t * t * (3 - 2 * t)


@cache
def _drawn_once(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((_RUNS, _KNOTS))


@dataclass(frozen=True, kw_only=True)
class AdhesionLoss(Fault):
    """From travel ``after`` on, the belt climbs faster or slower sideways than it should by ``share``."""

    id = "adhesion_loss"
    sizes: ClassVar = {"share": Size(unit="1", typical=0.15, limit=2.0)}
    share: float = 0.0
    after: float = 20.0

    def slide(self, s, line):
        return 1 + self.share * _smooth_step(s, self.after, 4.0)


@dataclass(frozen=True, kw_only=True)
class QuadraticContact(Fault):
    """The tail pulley turns the belt by c y^2 per metre."""

    id = "quadratic_contact"
    sizes: ClassVar = {"c": Size(unit="1/m3", typical=0.05, limit=50.0)}
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.c * y**2 * TAIL


@dataclass(frozen=True, kw_only=True)
class YawCreep(Fault):
    """The steering relaxes after its step: share (1 - exp(-t/time)) of the yaw is added in time."""

    id = "yaw_creep"
    sizes: ClassVar = {"share": Size(unit="1", typical=0.2, limit=3.0)}
    share: float = 0.0
    time: float = 25.0

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * (1 - np.exp(-t / self.time))


@dataclass(frozen=True, kw_only=True)
class SensorCubic(Fault):
    """The sensor at point 1 shows y + c y^3."""

    id = "sensor_cubic"
    sizes: ClassVar = {"c": Size(unit="1/m2", typical=1000.0, limit=1e5)}
    c: float = 0.0

    def read(self, value, place, s, journey):
        return value + self.c * value**3 if place == "point_1" else value


@dataclass(frozen=True, kw_only=True)
class StrangeWave(Fault):
    """The tail pulley's yaw swings with a wavelength that belongs to no part of the machine."""

    id = "strange_wave"
    sizes: ClassVar = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    amplitude: float = 0.0
    wavelength: float = 7.3
    phase: float = 0.0

    def yaw(self, s, line):
        return self.amplitude * np.sin(2 * np.pi * s / self.wavelength + self.phase)


@dataclass(frozen=True, kw_only=True)
class TensionDecay(Fault):
    """The belt loses ``share`` of its tension over ``length`` metres of travel."""

    id = "tension_decay"
    sizes: ClassVar = {"share": Size(unit="1", typical=0.15, limit=0.6)}
    positive: ClassVar = True
    share: float = 0.0
    length: float = 20.0

    def set(self, line):
        both = np.broadcast_to(self.share, line.decay.shape), np.broadcast_to(self.length, line.decay.shape)
        return replace(line, decay=both[0], decay_length=both[1])


@dataclass(frozen=True, kw_only=True)
class LateSensor(Fault):
    """The sensor at point 4 shows what was there ``delay`` seconds ago."""

    id = "late_sensor"
    sizes: ClassVar = {"delay": Size(unit="s", typical=1.5, limit=30.0)}
    positive: ClassVar = True
    delay: float = 0.0

    def read(self, value, place, s, journey):
        if place != "point_4":
            return value
        back = self.delay * journey.line.speed + 0 * s[0]
        lanes = [np.interp(s[:, b] - back[b], s[:, b], value[:, b]) for b in range(s.shape[1])]
        return np.stack(lanes, axis=1)


@dataclass(frozen=True, kw_only=True)
class WarmingStand(Fault):
    """The sensors' stand moves with the square root of time, as heat does."""

    id = "warming_stand"
    sizes: ClassVar = {"c": Size(unit="m/s^0.5", typical=3e-5, limit=2e-3)}
    c: float = 0.0

    def read(self, value, place, s, journey):
        return value + self.c * np.sqrt(np.maximum(s - journey.line.yaw_at, 0) / journey.line.speed)


@dataclass(frozen=True, kw_only=True)
class WalkingAngle(Fault):
    """The contact angle on the tail pulley takes a random walk of its own in every run."""

    id = "walking_angle"
    sizes: ClassVar = {"size": Size(unit="rad/m^0.5", typical=5e-6, limit=1e-3)}
    positive: ClassVar = True
    size: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        knot = min(int(s), _KNOTS - 1)
        return self.size * _drawn_once(self.seed)[line.run, knot] * TAIL


@dataclass(frozen=True, kw_only=True)
class MidStick(Fault):
    """In mid run the belt runs straight for a while, sideways held by ``share``."""

    id = "mid_stick"
    sizes: ClassVar = {"share": Size(unit="1", typical=0.5, limit=1.0)}
    positive: ClassVar = True
    share: float = 0.0
    begin: float = 25.0
    length: float = 6.0

    def slide(self, s, line):
        return 1 - self.share * _smooth_step(s, self.begin, 1) * (1 - _smooth_step(s, self.begin + self.length, 1))


@dataclass(frozen=True, kw_only=True)
class WindSteps(Fault):
    """Wind presses on both spans, changing every 9 m: p bends a clamped span by p L^2/(12 EI) at its end."""

    id = "wind_steps"
    sizes: ClassVar = {"pressure": Size(unit="N/m", typical=0.03, limit=5.0)}
    positive: ClassVar = True
    pressure: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        gust = _drawn_once(self.seed)[line.run, min(int(s / 9.0), _KNOTS - 1)]
        both = np.broadcast_to(self.pressure * gust * line.span_length**2 / (12 * line.bending), y.shape)
        return both


@dataclass(frozen=True, kw_only=True)
class DeadZone(Fault):
    """Curvature below kappa_d does not turn the belt on the pulley."""

    id = "dead_zone"
    sizes: ClassVar = {"kappa_d": Size(unit="1/m", typical=1e-5, limit=5e-4)}
    positive: ClassVar = True
    kappa_d: float = 0.0

    def turn(self, s, line, y, kappa):
        return -np.clip(kappa, -self.kappa_d, self.kappa_d)
