"""Sensors and recorder."""

from dataclasses import dataclass, replace

from belt_sim.virtual_rig.fault import Fault, Size


def size_at_points(letter: str, unit: str, typical: float, limit: float) -> dict[str, Size]:
    """Sizes of the parameters letter1 ... letter4 of the sensors at points 1 ... 4."""
    return {f"{letter}{k}": Size(unit=unit, typical=typical, limit=limit, place=f"point_{k}") for k in (1, 2, 3, 4)}


def at_point(fault: Fault, letter: str, place: str):
    """The parameter of the sensor at a point; none for a tilt sensor."""
    return getattr(fault, letter + place[-1]) if place.startswith("point_") else 0.0


@dataclass(frozen=True, kw_only=True)
class SensorOffset(Fault):
    """The sensor at point k shows y + ck in every run."""

    id = "sensor_offset"
    sizes = size_at_points("c", "m", 5e-4, 2e-2)
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0
    c4: float = 0.0

    def read(self, value, place, s, line):
        return value + at_point(self, "c", place)


@dataclass(frozen=True, kw_only=True)
class SensorGain(Fault):
    """The sensor at point k shows (1 + gk) y."""

    id = "sensor_gain"
    sizes = size_at_points("g", "1", 0.05, 0.3)
    draw_order = 12
    g1: float = 0.0
    g2: float = 0.0
    g3: float = 0.0
    g4: float = 0.0

    def read(self, value, place, s, line):
        return value * (1 + at_point(self, "g", place))


@dataclass(frozen=True, kw_only=True)
class SensorDrift(Fault):
    """The sensor at point k shows y + dk t, t since the yaw was applied."""

    id = "sensor_drift"
    sizes = size_at_points("d", "m/s", 5e-6, 2e-5)
    draw_order = 13
    d1: float = 0.0
    d2: float = 0.0
    d3: float = 0.0
    d4: float = 0.0

    def read(self, value, place, s, line):
        return value + at_point(self, "d", place) * (s - line.yaw_at) / line.speed


@dataclass(frozen=True, kw_only=True)
class SensorDelay(Fault):
    """Every lateral reading shows what was there ``delay`` seconds ago."""

    id = "sensor_delay"
    sizes = {"delay": Size(unit="s", typical=1.5, limit=5.0)}
    positive = True
    draw_order = 26
    delay: float = 0.0

    def sensor_travel(self, s, line):
        return s - self.delay * line.speed


@dataclass(frozen=True, kw_only=True)
class EncoderScale(Fault):
    """The recorder shows (1 + e) s."""

    id = "encoder_scale"
    sizes = {"e": Size(unit="1", typical=0.02, limit=0.1)}
    draw_order = 11
    e: float = 0.0

    def set(self, line):
        return replace(line, yaw_at=line.yaw_at / (1 + self.e))

    def true_travel(self, shown, line):
        return shown / (1 + self.e)
