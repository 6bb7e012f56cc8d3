"""Units at the border: every conversion between what people write and the SI numbers inside stands here."""

import math

from belt_sim.errors import InputError

POUND_FORCE = 0.45359237 * 9.80665  # [N], exact by definition

#: unit -> (dimension, factor to SI); a force is a stress once the belt's section is known
UNITS: dict[str, tuple[str, float]] = {
    "m": ("length", 1.0),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "cm": ("length", 1e-2),
    "in": ("length", 0.0254),
    "ft": ("length", 0.3048),
    "mil": ("length", 2.54e-5),
    "rad": ("angle", 1.0),
    "mrad": ("angle", 1e-3),
    "urad": ("angle", 1e-6),
    "deg": ("angle", math.pi / 180.0),
    "mdeg": ("angle", 1e-3 * math.pi / 180.0),
    "mm/m": ("angle", 1e-3),
    "Pa": ("stress", 1.0),
    "MPa": ("stress", 1e6),
    "GPa": ("stress", 1e9),
    "N/mm2": ("stress", 1e6),
    "N/mm^2": ("stress", 1e6),
    "kPa": ("stress", 1e3),
    "psi": ("stress", POUND_FORCE / 0.0254**2),
    "ksi": ("stress", 1e3 * POUND_FORCE / 0.0254**2),
    "N": ("force", 1.0),
    "kN": ("force", 1e3),
    "lbf": ("force", POUND_FORCE),
    "kg/m^3": ("density", 1.0),
    "kg/m3": ("density", 1.0),
    "m/s": ("speed", 1.0),
    "mm/s": ("speed", 1e-3),
    "m/min": ("speed", 1.0 / 60.0),
    "ft/s": ("speed", 0.3048),
    "ft/min": ("speed", 0.3048 / 60.0),
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "min": ("time", 60.0),
    "h": ("time", 3600.0),
    "1": ("number", 1.0),
    "%": ("number", 1e-2),
    "": ("number", 1.0),
}

#: SI unit -> (units of the shop in one of it, their name): how people at a machine read a number
SHOP_UNITS: dict[str, tuple[float, str]] = {
    "m": (1e3, "mm"),
    "rad": (1e3, "mm/m"),
    "1/m": (1e3, "1/km"),
    "Pa": (1e-6, "N/mm²"),
    "N/m": (1e-3, "N/mm"),
    "rad/s": (3.6e6, "mm/m per hour"),
    "rad/N": (1e6, "mm/m per kN"),
    "rad/(N m)": (1e6, "mm/m per kN m"),
    "1": (1.0, ""),
}

MM = 1e-3
MM_PER_M = 1e-3
N_PER_MM2 = 1e6
DEGREE = math.pi / 180.0


def shop_unit(unit: str) -> tuple[float, str]:
    """Units of the shop in one ``unit`` of SI, and their name; a unit that has none stays."""
    return SHOP_UNITS.get(unit, (1.0, unit))


def round_digits(value: float, digits: int) -> float:
    """A number to so many significant digits."""
    return float(f"{value:.{digits}g}")


def to_si(value: float, unit: str, *, dimension: str, name: str) -> float:
    """Convert ``value`` in ``unit`` to SI; raises InputError when the unit is unknown or of another dimension."""
    known = [u for u, (dim, _) in UNITS.items() if dim == dimension and u]
    if unit not in UNITS or UNITS[unit][0] != dimension:
        raise InputError(name, value, unit, f"use one of {', '.join(known) or 'no unit'}")
    return value * UNITS[unit][1]
