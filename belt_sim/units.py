"""Units at the border: the ONE table of units, and numbers and units as people and loggers write them, in SI."""

import math
import re

from belt_sim.errors import InputError

POUND_FORCE = 0.45359237 * 9.80665  # [N], exact by definition
DEGREE = math.pi / 180.0
MM = 1e-3
MM_PER_M = 1e-3
N_PER_MM2 = 1e6

_LENGTH = {"m": 1.0, "mm": MM, "um": 1e-6, "cm": 1e-2, "km": 1e3, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
_LENGTH |= {"mil": 2.54e-5}
_ANGLE = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": DEGREE, "mdeg": 1e-3 * DEGREE, "mm/m": 1e-3, "um/m": 1e-6}
_ANGLE |= {"arcmin": DEGREE / 60.0, "arcsec": DEGREE / 3600.0, "gon": 0.9 * DEGREE}
_FORCE = {"N": 1.0, "kN": 1e3, "daN": 10.0, "kp": 9.80665, "lbf": POUND_FORCE}
_STRESS = {"N/mm2": N_PER_MM2, "N/mm^2": N_PER_MM2, "MPa": 1e6, "GPa": 1e9, "kPa": 1e3, "Pa": 1.0}
_STRESS |= {"psi": POUND_FORCE / 0.0254**2, "ksi": 1e3 * POUND_FORCE / 0.0254**2}
_STRESS |= {"kp/mm2": 9.80665e6, "kp/cm2": 9.80665e4, "daN/mm2": 1e7, "kN/mm2": 1e9, "kN/cm2": 1e7, "N/cm2": 1e4}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86400.0}
_TABLE = {
    "length": _LENGTH,
    "angle": _ANGLE,
    "stress": _STRESS,
    "force": _FORCE,
    # force per width of the belt: a stress once its thickness is known
    "line load": {f"{f}/{x}": _FORCE[f] / _LENGTH[x] for f in _FORCE for x in ("mm", "m", "cm", "in", "ft")},
    "density": {"kg/m^3": 1.0, "kg/m3": 1.0, "g/cm3": 1e3, "kg/dm3": 1e3, "lb/in3": 0.45359237 / 0.0254**3},
    "speed": {"m/s": 1.0, "mm/s": MM, "cm/s": 1e-2, "m/min": 1.0 / 60.0, "mm/min": MM / 60.0, "m/h": 1.0 / 3600.0}
    | {"ft/s": 0.3048, "ft/min": 0.3048 / 60.0, "in/s": 0.0254, "km/h": 1.0 / 3.6},
    "time": _TIME,
    "number": {"1": 1.0, "%": 1e-2, "": 1.0},
}

#: unit -> (dimension, factor to SI); a force or a line load is a stress once the belt's section is known
UNITS: dict[str, tuple[str, float]] = {u: (kind, f) for kind, units in _TABLE.items() for u, f in units.items()}

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

#: unit -> other spellings, in lower case, without blanks and powers' marks
_SPELLINGS = {
    "m": "metre meter metres meters",
    "mm": "millimeter millimetre",
    "um": "mikrometer micron microns micrometer",
    "in": 'inch inches zoll "',
    "ft": "foot feet",
    "mil": "mils thou",
    "yd": "yard yards",
    "deg": "° degree degrees grad",
    "mdeg": "m° millidegree millidegrees milligrad",
    "arcmin": "' arcminute arcminutes winkelminuten moa",
    "arcsec": "arcsecond arcseconds winkelsekunden",
    "s": "sec sek seconds sekunden",
    "ms": "msec",
    "min": "minuten minutes",
    "h": "std hours stunden",
    "d": "days tage",
    "m/s": "mps m_per_s",
    "m/min": "mpermin m_per_min mpm",
    "mm/s": "mm_per_s",
    "ft/s": "fps ft_per_s",
    "ft/min": "fpm ft_per_min",
    "km/h": "kmh",
    "psi": "lbf/in2 lb/in2",
    "kp": "kgf kg",
    "kp/mm2": "kgf/mm2 kg/mm2",
    "kp/cm2": "kgf/cm2 kg/cm2",
    "lbf": "lb lbs",
    "lbf/in": "pli lb/in",
    "lbf/ft": "lb/ft plf",
    "N/mm2": "n_per_mm2 nmm2 nmm-2",
    "N/mm": "n_per_mm",
    "kg/m^3": "kg/m3",
    "1": "-",
}
SPELLINGS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()} | {"": "1"}
#: names as an import writes them
NAMES = [name for name in UNITS if name.lower() not in SPELLINGS]
_LOWER = {name.lower(): name for name in NAMES}
_SIGNS = str.maketrans({"²": "2", "³": "3", "^": None, "µ": "u", "μ": "u", "·": None, " ": None, "\u00a0": None})
_BRACKET = re.compile(r"[\[({<]\s*([^\])}>]{0,40})[\])}>]")
_TAIL = re.compile(r"(?:\s+in\s+|\s*/\s*|[\s_]+)(?P<unit>[^\s/_\])}>]+(?:/[^\s/_\])}>]+)?)$")
#: ``0.01 mm``, ``1/100 mm``, ``mm x 0.01``, ``10^-2 mm``: a unit of the file's own, or the resolution of its numbers
_SCALED = re.compile(
    r"(?:(?P<a>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)(?:\s*/\s*(?P<b>\d+))?|10\^?(?P<e>[+-]\d+))\s*[x*·]?\s*(?P<u>[^\W\d].*|[°µμ].*)\Z|"
    r"(?P<u2>\D+?)\s*[x*·/]\s*(?P<a2>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)\Z",
    re.IGNORECASE,
)
#: a minus sign or dash of typesetting where a number begins
_MINUS = re.compile(r"(?<![^\W_])[\u2212\u2013](?=[.,]?\d)")


def shop_unit(unit: str) -> tuple[float, str]:
    """Units of the shop in one ``unit`` of SI, and their name; a unit that has none stays."""
    return SHOP_UNITS.get(unit, (1.0, unit))


def round_digits(value: float, digits: int) -> float:
    """A number to so many significant digits."""
    return float(f"{value:.{digits}g}")


def two_digits(value: float) -> float:
    """A number above 0, cut to two digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{unit * math.floor(value / unit):.2g}")


def unit_named(text: str) -> str | None:
    """The unit that a text names; None when it names none, or two (mPa is a thousandth of a Pa and a slip for MPa)."""
    text = text.strip().strip("[](){}<>").strip()
    if text in NAMES:
        return text
    written = text.translate(_SIGNS).removeprefix("in ")
    key = written.lower().replace("newton", "n").replace("per", "/") if len(written) > 1 else written.lower()
    found = _LOWER.get(key) or SPELLINGS.get(key) or SPELLINGS.get(written.lower())
    if found and found[0] == "M" and written[0] == "m" and written != written.lower():
        return None
    return found if found != "1" or key else None


def scaled_unit(text: str) -> tuple[float, str] | None:
    """(0.01, mm) of ``0.01 mm``, ``1/100 mm``, ``mm x 0.01``; None where a text is no number times a unit."""
    found = _SCALED.fullmatch(text.strip().strip("[](){}<>").strip())
    unit = unit_named(found["u"] or found["u2"]) if found else None
    if not found or unit in (None, "1", "%"):
        return None
    number = found["a"] or found["a2"]
    scale = float(number.replace(",", ".")) if number else 10.0 ** int(found["e"])
    scale /= float(found["b"] or 1.0)
    return (scale, str(unit)) if 0.0 < scale < 1e12 else None


def split_units(header: str) -> tuple[str, tuple[str, ...]]:
    """A column's name without its units, and these: ``Kante vorn [mm]``, ``travel_m``, ``Weg in m``; a remark in
    brackets may look like one, as in ``Kante (h) [mm]``."""
    header = header[:1000]
    if named := {b.group(): unit for b in _BRACKET.finditer(header) if (unit := unit_named(b.group(1)))}:
        name = _BRACKET.sub(lambda bracket: "" if bracket.group() in named else bracket.group(), header)
        return name.strip(), tuple(named.values())
    for known in sorted((s for s in SPELLINGS if "_" in s), key=len, reverse=True):
        if header.lower().endswith("_" + known):
            return header[: -len(known) - 1], (SPELLINGS[known],)
    tail = _TAIL.search(header)
    unit = unit_named(tail.group("unit")) if tail else None
    if tail and unit and unit != "1" and tail.group().strip() != "in":  # as in "Sensor in"
        return header[: tail.start()].strip(), (unit,)
    return header.strip(), ()


def unit_of(text: str, dimensions: tuple[str, ...], name: str) -> str:
    """The unit that a text names; raises InputError for one that is unknown or of another kind."""
    unit = unit_named(text)
    if unit is None or UNITS[unit][0] not in dimensions:
        known = ", ".join(u for u in NAMES if UNITS[u][0] in dimensions)
        raise InputError(name, text, "", f"is no unit of {' or '.join(dimensions)}; use one of {known}")
    return unit


def plain_minus(text: str) -> str:
    """Text in which a Unicode minus or an en dash before a number is the minus sign of a keyboard."""
    return _MINUS.sub("-", text)


_DIGITS = r"[+-]?\d(?:[\d.,'’ \u00a0\u202f]*\d)?[.,]?(?:[eE][+-]?\d+)?|[+-]?[.,]\d+(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*(?P<value>{_DIGITS})\s*(?:(?:\+-|\+/-|±)\s*(?P<u>{_DIGITS}))?\s*(?P<unit>[^\s\d].*)?\Z")


#: the other mark of a number
OTHER = {".": ",", ",": "."}
#: decimal mark -> a number without and with marks of thousands; with an exponent either mark is a decimal one
_DECIMAL = r"[+-]?(?:\d+{0}?\d*|{0}\d+)"
_PLAIN = {d: re.compile(rf"{_DECIMAL.format(f'[{d}]')}\Z|{_DECIMAL.format('[.,]')}[eE][+-]?\d+\Z") for d in ".,"}
_GROUPED = {d: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:[{OTHER[d]}]\d{{3}})+(?:[{d}]\d*)?\Z") for d in ".,"}
#: a gap between thousands or behind a sign, a Fortran exponent (1.0D+00), and a negative number as (12.5) or 12.5-
_GAP = re.compile(r"(?<=\d)[ '’\u00a0\u202f](?=\d{3}(?!\d))|(?<=^[+-]) +")
_FORTRAN = re.compile(r"(?<=[\d.,])[dD](?=[+-]?\d+\Z)")
_NEGATIVE = re.compile(r"\((\d[\d.,]*)\)\Z|(\d[\d.,]*)-\Z")


def readings_of(cell: str) -> dict[str, float]:
    """The number in a cell by the decimal mark that it is read with, the other mark or a gap between thousands.

    Both are there of 1,500, which is 1.5 or 1500, and of 15; none is there of what is no number.
    """
    text, found = _FORTRAN.sub("e", _NEGATIVE.sub(r"-\1\2", _GAP.sub("", cell.strip()))), dict[str, float]()
    for mark, other in OTHER.items():
        if _PLAIN[mark].match(text):
            found[mark] = float(text.replace(",", "."))
        elif _GROUPED[mark].match(text):
            found[mark] = float(text.replace(other, "").replace(mark, "."))
    return found


def number_of(text: str, name: str = "number") -> float:
    """The number in a text with a decimal point or comma and marks of thousands (1,200.5; 1.200,5; 1 200; 1'200).

    Raises InputError for what is none, and for ``1,200``, which is 1.2 to some and 1200 to others.
    """
    found = readings_of(plain_minus(text))
    if "," in text and len({*found.values()}) == 2:
        whole, small = (f"{found[mark]:g}" for mark in ".,")
        raise InputError(name, text, "", f"has two readings; write {whole} or {small}")
    if not found:
        raise InputError(name, text, "", "is no number; write it with a decimal point, as 1200.5")
    return next(iter(found.values()))


def quantity(text: object, dimensions: tuple[str, ...], default: str, name: str) -> tuple[float, float | None, str]:
    """(value, u, unit) of ``10``, ``10 N/mm2`` or ``11.28 +- 0.005 m``; u is None when it is not stated."""
    found = _QUANTITY.match(plain_minus(str(text)))
    if not found:
        example = f"write it as {'0.3' if default == '1' else '10 ' + default}"
        raise InputError(name, text, "", f"is no number with a unit; {example}")
    unit = unit_of(found.group("unit"), dimensions, name) if found.group("unit") else default
    value, u = (number_of(x, name) if x else None for x in (found.group("value"), found.group("u")))
    assert value is not None
    return value, u, unit


def size_of(text: str, unit: str, name: str) -> float:
    """A number [SI] that is not negative; unit: where none is written, and the kind that it is of."""
    value, _, own = quantity(text, (UNITS[unit][0],), unit, name)
    if value < 0.0:
        raise InputError(name, text, "", "must not be negative")
    return value * UNITS[own][1]
