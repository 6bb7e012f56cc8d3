"""Yaw of the pulleys."""

from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size, Unmodelled


@dataclass(frozen=True, kw_only=True)
class ProgressiveYaw(Unmodelled):
    """The steering's lever turns the pulley more than in proportion: share yaw |yaw|/1 mrad is added."""

    id = "progressive_yaw"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=5.0)}
    place, variable, form = "yaw_tail", "yaw", "power"
    also = (("yaw", "linear"),)
    share: float = 0.0

    def yaw(self, s, line):
        return self.share * line.yaw * np.abs(line.yaw) / 1e-3 * (s >= line.yaw_at)


@dataclass(frozen=True, kw_only=True)
class SpeedBow(Unmodelled):
    """The frame bows under the drive: the tail pulley turns by c v^2."""

    id = "speed_bow"
    blind = True
    sizes = {"c": Size(unit="rad s2/m2", typical=2e-4, limit=2e-2)}
    place, variable, form = "yaw_tail", "speed", "power"
    also = (("speed", "linear"),)
    c: float = 0.0

    def yaw(self, s, line):
        return self.c * line.speed**2


@dataclass(frozen=True, kw_only=True)
class FrameTwist(Unmodelled):
    """The frame twists under the belt's pull more than in proportion: the head pulley turns by c (sigma/10 N/mm2)^2."""

    id = "frame_twist"
    blind = True
    sizes = {"c": Size(unit="rad", typical=2e-5, limit=2e-3)}
    place, variable, form = "yaw_head", "tension", "power"
    also = (("tension", "linear"),)
    c: float = 0.0

    def yaw_head(self, s, line):
        return self.c * (line.stress / 1e7) ** 2


@dataclass(frozen=True, kw_only=True)
class YawCreep(Unmodelled):
    """The steering relaxes after its step: share (1 - exp(-t/time)) of the yaw is added in time."""

    id = "yaw_creep"
    sizes = {"share": Size(unit="1", typical=0.2, limit=3.0)}
    place, variable, form = "yaw_tail", "time_since_step", "exponential"
    also = (("time_since_step", "saturating"), ("travel", "exponential"))
    share: float = 0.0
    time: float = 25.0

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * (1 - np.exp(-t / self.time))

    @classmethod
    def random_shape(cls, plan, rng):
        return {"time": float(rng.uniform(0.1, 0.5) * plan.length / plan.runs[0].speed)}


@dataclass(frozen=True, kw_only=True)
class RingingYaw(Unmodelled):
    """The steering swings about its new position after the step, by a share of it that dies out in time."""

    id = "ringing_yaw"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=3.0)}
    place, variable, form = "yaw_tail", "time_since_step", "exponential"
    also = (("time_since_step", "periodic"), ("wave", "periodic"), ("travel", "exponential"))
    share: float = 0.0
    time: float = 30.0
    period: float = 20.0

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * np.exp(-t / self.time) * np.sin(2 * np.pi * t / self.period)

    @classmethod
    def random_shape(cls, plan, rng):
        lasts = plan.length / plan.runs[0].speed
        return {"time": float(rng.uniform(0.1, 0.6) * lasts), "period": float(rng.uniform(0.1, 0.4) * lasts)}


@dataclass(frozen=True, kw_only=True)
class StrangeWave(Unmodelled):
    """The tail pulley's yaw swings with a wavelength that belongs to no part of the machine."""

    id = "strange_wave"
    sizes = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    place, variable, form = "yaw_tail", "wave", "periodic"
    amplitude: float = 0.0
    wavelength: float = 7.3
    phase: float = 0.0

    def yaw(self, s, line):
        return self.amplitude * np.sin(2 * np.pi * s / self.wavelength + self.phase)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"wavelength": float(rng.uniform(3.0, 9.0)), "phase": float(rng.uniform(0, 2 * np.pi))}


@dataclass(frozen=True, kw_only=True)
class BeatingHead(Unmodelled):
    """Two gears of nearly the same pitch turn the head pulley to and fro: its swing comes and goes."""

    id = "beating_head"
    blind = True
    sizes = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    place, variable, form = "yaw_head", "wave", "periodic"
    also = (("travel", "periodic"),)
    amplitude: float = 0.0
    wavelength: float = 4.0
    ratio: float = 1.15
    phase: float = 0.0

    def yaw_head(self, s, line):
        way = 2 * np.pi * s / self.wavelength
        return self.amplitude * (np.sin(way + self.phase) + np.sin(way / self.ratio))

    @classmethod
    def random_shape(cls, plan, rng):
        drawn = {
            "wavelength": rng.uniform(2.5, 7.0),
            "ratio": rng.uniform(1.08, 1.3),
            "phase": rng.uniform(0, 2 * np.pi),
        }
        return {name: float(value) for name, value in drawn.items()}


@dataclass(frozen=True, kw_only=True)
class ThermostatHead(Unmodelled):
    """A fan cools the head pulley's bearing in turns: its yaw swings to and fro in straight strokes, in time."""

    id = "thermostat_head"
    blind = True
    sizes = {"amplitude": Size(unit="rad", typical=1e-4, limit=5e-3)}
    place, variable, form = "yaw_head", "wave", "periodic"
    also = (("time_since_step", "periodic"), ("travel", "periodic"))
    amplitude: float = 0.0
    period: float = 40.0
    phase: float = 0.0

    def yaw_head(self, s, line):
        return self.amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * s / line.speed / self.period + self.phase))

    @classmethod
    def random_shape(cls, plan, rng):
        lasts = plan.length / plan.runs[0].speed
        return {"period": float(rng.uniform(0.1, 0.5) * lasts), "phase": float(rng.uniform(0, 2 * np.pi))}
