"""The ONE table of bounds, for configurations, data sheets and imports alike: wide ranges that only a slipped unit or a
typing error leaves."""

from dataclasses import dataclass
from typing import Any

from belt_sim.errors import InputError
from belt_sim.si import UNITS, to_si


@dataclass(frozen=True)
class Range:
    """Bounds of a quantity in ``unit``: low <= value <= high, or low < value when ``open_low``."""

    dimension: str
    low: float
    high: float
    unit: str
    open_low: bool = False

    def check(self, value: float, unit: str | None = None, *, name: str = "") -> float:
        """The value in SI; raises InputError for a unit of another kind or an implausible magnitude."""
        unit = self.unit if unit is None else unit
        try:
            si = to_si(value, unit, dimension=self.dimension, name=name)
        except InputError as error:
            what = "unknown unit" if unit else "the unit is missing"
            raise InputError(name, _short(value), unit, f"{what}; {error.remedy}") from None
        if not self.holds(si):
            raise InputError(name, _short(value), unit, self._remedy(value, unit))
        return si

    def holds(self, si: Any) -> Any:
        """Whether an SI value, or each of an array, lies in the range."""
        factor = UNITS[self.unit][1]
        above = si > self.low * factor if self.open_low else si >= self.low * factor
        return above & (si <= self.high * factor)

    def _remedy(self, value: float, unit: str) -> str:
        low = f"above {self.low:g} and at most" if self.open_low else f"{self.low:g} to"
        bounds = f"must be {low} {self.high:g} {self.unit}".rstrip()
        for other, (dimension, factor) in UNITS.items():
            ratio = factor / UNITS[unit][1]
            if dimension == self.dimension != "number" and ratio != 1.0 and self.holds(value * factor) and value:
                return f"{bounds}; did you mean {_short(value)} {other}, that is {_short(value * ratio)} {unit}?"
        return f"{bounds}; check the value and its unit"


def _short(value: float) -> str:
    return f"{value:.6g}" if abs(value) < 1e6 else f"{value:.15g}"


CENTRE_DISTANCE = Range("length", 0.1, 500.0, "m")
RADIUS = Range("length", 5.0, 5000.0, "mm")
WIDTH = Range("length", 2.0, 10000.0, "mm")
THICKNESS = Range("length", 0.005, 50.0, "mm")
YOUNGS_MODULUS = Range("stress", 1.0, 1000.0, "GPa")
DENSITY = Range("density", 500.0, 25000.0, "kg/m^3")
POISSON_RATIO = Range("number", 0.0, 0.5, "")

#: data of the machine and of the belt -> their ranges
MACHINE = {"centre_distance": CENTRE_DISTANCE, "head_radius": RADIUS, "tail_radius": RADIUS}
BELT = {
    "width": WIDTH,
    "thickness": THICKNESS,
    "youngs_modulus": YOUNGS_MODULUS,
    "density": DENSITY,
    "poisson_ratio": POISSON_RATIO,
}

TENSION = Range("stress", 0.1, 1500.0, "N/mm2")  # a slacker steel belt lies on the floor, a tighter one is broken
YAW = Range("angle", -2.0, 2.0, "deg")  # beyond any steering
SPEED = Range("speed", 1e-3, 50.0, "m/s")
DIRECTION = Range("number", -1e9, 1e9, "")  # which of them are directions is said by the reader
TRAVEL = Range("length", 0.0, 20000.0, "m")  # of a reading
STEP = Range("length", 1e-4, 0.1, "m")  # of an analytic march, whose records are 0.1 m apart at most
KEEP = Range("length", 1e-3, 1e3, "m")
SIMULATED_TRAVEL = Range("length", 0.1, 1e5, "m")
Y0 = Range("length", -10000.0, 10000.0, "mm")
YAW_AT_U = Range("length", 0.0, 10.0, "m")
TIME = Range("time", -1e10, 1e10, "s")
RATE = Range("angle", -200.0, 200.0, "mm/m")
RATE_U = Range("angle", 0.0, 200.0, "mm/m", open_low=True)

TENSION_REL = Range("number", 0.0, 0.5, "")
YAW_U = Range("angle", 0.0, 0.5, "deg")
GAIN = Range("number", 0.0, 0.5, "")
WANDER_LENGTH = Range("length", 0.0, 10000.0, "m", open_low=True)

#: kind of signal -> dimension of its unit
SIGNAL_DIMENSION = {"lateral": "length", "tilt": "angle"}
#: kind of signal -> range of one reading
READING = {"lateral": Range("length", -1000.0, 1000.0, "m"), "tilt": Range("angle", -1000.0, 1000.0, "rad")}
#: kind of signal -> range of its white noise, and of its other errors
WHITE = {
    "lateral": Range("length", 0.0, 1000.0, "mm", open_low=True),
    "tilt": Range("angle", 0.0, 1000.0, "mrad", open_low=True),
}
ERROR = {"lateral": Range("length", 0.0, 1000.0, "mm"), "tilt": Range("angle", 0.0, 1000.0, "mrad")}
