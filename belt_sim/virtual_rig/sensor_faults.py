"""Faults of the recorder and its sensors (physics sheet, section 7), as this line has them."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.readings import belt_coordinate


def _each(letter: str, unit: str, typical: float, limit: float) -> dict[str, Size]:
    return {f"{letter}{k}": Size(unit=unit, typical=typical, limit=limit) for k in (1, 2, 3, 4)}


def _of(fault: Fault, letter: str, place: str):
    """The parameter of the sensor at a point; none for a tilt sensor."""
    return getattr(fault, letter + place[-1]) if place.startswith("point_") else 0.0


@dataclass(frozen=True, kw_only=True)
class EncoderScale(Fault):
    """The recorder shows (1 + e) s."""

    id = "encoder_scale"
    sizes: ClassVar = {"e": Size(unit="1", typical=0.02, limit=0.1)}
    e: float = 0.0

    def set(self, line):
        return replace(line, yaw_at=line.yaw_at / (1 + self.e))

    def travelled(self, shown, line):
        return shown / (1 + self.e)


@dataclass(frozen=True, kw_only=True)
class SensorGain(Fault):
    """The sensor at point k shows (1 + gk) y."""

    id = "sensor_gain"
    sizes: ClassVar = _each("g", "1", 0.05, 0.3)
    g1: float = 0.0
    g2: float = 0.0
    g3: float = 0.0
    g4: float = 0.0

    def read(self, value, place, s, journey):
        return value * (1 + _of(self, "g", place))


@dataclass(frozen=True, kw_only=True)
class SensorOffset(Fault):
    """The sensor at point k shows y + ck in every run."""

    id = "sensor_offset"
    sizes: ClassVar = _each("c", "m", 5e-4, 2e-2)
    c1: float = 0.0
    c2: float = 0.0
    c3: float = 0.0
    c4: float = 0.0

    def read(self, value, place, s, journey):
        return value + _of(self, "c", place)


@dataclass(frozen=True, kw_only=True)
class SensorDrift(Fault):
    """The sensor at point k shows y + dk t, t since the yaw was applied."""

    id = "sensor_drift"
    sizes: ClassVar = _each("d", "m/s", 5e-6, 1e-4)
    d1: float = 0.0
    d2: float = 0.0
    d3: float = 0.0
    d4: float = 0.0

    def read(self, value, place, s, journey):
        return value + _of(self, "d", place) * (s - journey.line.yaw_at) / journey.line.speed


@dataclass(frozen=True, kw_only=True)
class EdgeProfile(Fault):
    """The belt's edge is not straight: y + e(m) - e(m when the yaw was applied), m the part of the belt.

    e = sum over k of (cosk cos + sink sin)(2 pi k m / belt length), m counted backwards from what was at
    point 4 at travel 0. The last term: y = 0 is where the point was when the yaw was applied.
    """

    id = "edge_profile"
    sizes: ClassVar = {
        f"{kind}{k}": Size(unit="m", typical=2e-4 / k, limit=1e-2) for k in (1, 2, 3) for kind in ("cos", "sin")
    }
    cos1: float = 0.0
    sin1: float = 0.0
    cos2: float = 0.0
    sin2: float = 0.0
    cos3: float = 0.0
    sin3: float = 0.0

    def read(self, value, place, s, journey):
        if not place.startswith("point_"):
            return value
        line = journey.line
        return value + self._edge(place, s, journey) - self._edge(place, line.yaw_at + 0 * s, journey)

    def _edge(self, place, s, journey):
        phase = -2 * np.pi * belt_coordinate(journey, place, s) / journey.line.belt_length
        return sum(
            getattr(self, f"cos{k}") * np.cos(k * phase) + getattr(self, f"sin{k}") * np.sin(k * phase)
            for k in (1, 2, 3)
        )
