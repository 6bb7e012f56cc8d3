"""Sensors and recorder."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import Size, Unmodelled


@dataclass(frozen=True, kw_only=True)
class SensorCubic(Unmodelled):
    """The sensor at point 1 shows y + c y^3."""

    id = "sensor_cubic"
    sizes = {"c": Size(unit="1/m2", typical=1000.0, limit=1e5)}
    place, variable, form = "sensor_y1", "y", "power"
    c: float = 0.0

    def read(self, value, place, s, line):
        return value + self.c * value**3 if place == "point_1" else value


@dataclass(frozen=True, kw_only=True)
class ShortRange(Unmodelled):
    """The sensors' optics flatten towards the ends of their range: tanh(c y)/c instead of y."""

    id = "short_range"
    blind = True
    sizes = {"c": Size(unit="1/m", typical=40.0, limit=2e3)}
    positive = True
    place, variable, form = "sensor_all", "y", "saturating"
    also = (("y", "power"),)
    c: float = 0.0

    def read(self, value, place, s, line):
        if not place.startswith("point_"):
            return value
        x = self.c * value
        return value * np.where(np.abs(x) > 1e-6, np.tanh(x) / np.where(np.abs(x) > 1e-6, x, 1.0), 1.0)


@dataclass(frozen=True, kw_only=True)
class StickyGauge(Unmodelled):
    """The feeler at point 1 sticks: it follows the belt only once it is ``half`` behind."""

    id = "sticky_gauge"
    blind = True
    sizes = {"half": Size(unit="m", typical=1e-4, limit=1e-2)}
    positive = True
    place, variable, form = "sensor_y1", "y", "threshold"
    also = (("y", "constant"), ("y", "saturating"))
    half: float = 0.0

    def read(self, value, place, s, line):
        if place != "point_1":
            return value
        shown = np.empty_like(value)
        last = value[0]
        for k, true in enumerate(value):
            last = shown[k] = np.clip(last, true - self.half, true + self.half)
        return shown


@dataclass(frozen=True, kw_only=True)
class WarmingStand(Unmodelled):
    """The sensors' stand moves with the square root of time, as heat does."""

    id = "warming_stand"
    sizes = {"c": Size(unit="m/s^0.5", typical=3e-5, limit=2e-3)}
    place, variable, form = "sensor_all", "time_since_step", "power"
    also = (("travel", "power"), ("time_since_step", "saturating"))
    c: float = 0.0

    def read(self, value, place, s, line):
        return value + self.c * np.sqrt(np.maximum(s - line.yaw_at, 0) / line.speed)


@dataclass(frozen=True, kw_only=True)
class WearingWheel(Unmodelled):
    """The measuring wheel wears down while it runs: the recorder shows s + c s^2."""

    id = "wearing_wheel"
    blind = True
    sizes = {"c": Size(unit="1/m", typical=5e-4, limit=2e-3)}
    place, variable, form = "travel", "travel", "power"
    also = (("travel", "linear"),)
    c: float = 0.0

    def set(self, line):
        return replace(line, yaw_at=self.true_travel(line.yaw_at, line))

    def true_travel(self, shown, line):
        root = np.sqrt(np.maximum(1 + 4 * self.c * shown, 0.05))
        return 2 * shown / (1 + root)
