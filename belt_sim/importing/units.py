"""Units as loggers and people write them: names, brackets, words -> a factor to SI."""

import re

from belt_sim.errors import InputError
from belt_sim.si import UNITS

#: unit -> other spellings, in lower case and without blanks
_SPELLINGS = {
    "m": "metre meter metres",
    "mm": "millimeter",
    "um": "µm μm mikrometer micron",
    "in": "inch inches zoll",
    "ft": "foot feet",
    "mil": "mils thou",
    "deg": "° degree degrees grad",
    "mdeg": "m° millidegree millidegrees milligrad",
    "urad": "µrad μrad",
    "s": "sec sek seconds sekunden",
    "ms": "msec",
    "min": "minuten",
    "h": "std",
    "m/s": "mps m_per_s",
    "m/min": "mpermin m_per_min",
    "ft/s": "fps ft_per_s",
    "ft/min": "fpm ft_per_min",
    "psi": "lbf/in2 lbf/in² lbf/in^2 lb/in2 lb/in²",
    "lbf": "lb lbs",
    "N/mm2": "n/mm² n/mm^2 n_per_mm2 nmm2 nmm-2",
    "kg/m^3": "kg/m3 kg/m³",
    "1": "-",
}
SPELLINGS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()} | {"": "1"}
#: names as an import writes them
NAMES = [name for name in UNITS if name.lower() not in SPELLINGS]
_LOWER = {name.lower(): name for name in NAMES}
_BRACKET = re.compile(r"[\[({<]\s*([^\])}>]*?)\s*[\])}>]")
_TAIL = re.compile(r"(?:\s+in\s+|\s*/\s*|[\s_]+)(?P<unit>\S+)$")


def unit_named(text: str) -> str | None:
    """The unit that a text names; None when it names none."""
    text = text.strip().strip("[](){}<>").strip()
    if text in NAMES:
        return text
    key = text.lower().replace(" ", "")
    found = _LOWER.get(key) or SPELLINGS.get(key)
    return found if found != "1" or key else None


def split_unit(header: str) -> tuple[str, str | None]:
    """A column's name without its unit, and the unit: ``Kante vorn [mm]``, ``travel_m``, ``Weg in m``."""
    for bracket in _BRACKET.finditer(header):
        unit = unit_named(bracket.group(1))
        if unit:
            return (header[: bracket.start()] + header[bracket.end() :]).strip(), unit
    for known in sorted((s for s in SPELLINGS if "_" in s), key=len, reverse=True):
        if header.lower().endswith("_" + known):
            return header[: -len(known) - 1], SPELLINGS[known]
    tail = _TAIL.search(header)
    unit = unit_named(tail.group("unit")) if tail else None
    if tail and unit and unit != "1" and tail.group().strip() != "in":  # as in "Sensor in"
        return header[: tail.start()].strip(), unit
    return header.strip(), None


def unit_of(text: str, dimensions: tuple[str, ...], name: str) -> str:
    """The unit that a text names; raises InputError for one that is unknown or of another kind."""
    unit = unit_named(text)
    if unit is None or UNITS[unit][0] not in dimensions:
        known = ", ".join(u for u in NAMES if UNITS[u][0] in dimensions)
        raise InputError(name, text, "", f"is no unit of {' or '.join(dimensions)}; use one of {known}")
    return unit


#: a minus sign or dash of typesetting where a number begins
_MINUS = re.compile(r"(?<![^\W_])[\u2212\u2013](?=[.,]?\d)")


def plain_minus(text: str) -> str:
    """Text in which a Unicode minus or an en dash before a number is the minus sign of a keyboard."""
    return _MINUS.sub("-", text)


_QUANTITY = re.compile(
    r"\s*(?P<value>[+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*(?:(?:\+-|\+/-|±)\s*(?P<u>[\d.,]+(?:[eE][+-]?\d+)?))?\s*(?P<unit>\S.*)?\Z"
)


def quantity(text: object, dimensions: tuple[str, ...], default: str, name: str) -> tuple[float, float | None, str]:
    """(value, u, unit) of ``10``, ``10 N/mm2`` or ``11.28 +- 0.005 m``; u is None when it is not stated."""
    found = _QUANTITY.match(plain_minus(str(text)))
    example = f"write it as {'0.3' if default == '1' else '10 ' + default}"
    if not found:
        raise InputError(name, text, "", f"is no number with a unit; {example}")
    unit = unit_of(found.group("unit"), dimensions, name) if found.group("unit") else default
    try:
        value, u = (float(x.replace(",", ".")) if x else None for x in (found.group("value"), found.group("u")))
    except ValueError:
        raise InputError(name, text, "", f"is no number; {example}") from None
    assert value is not None
    return value, u, unit


def size_of(text: str, unit: str, name: str) -> float:
    """A number [SI] that is not negative; unit: where none is written, and the kind that it is of."""
    value, _, own = quantity(text, (UNITS[unit][0],), unit, name)
    if value < 0.0:
        raise InputError(name, text, "", "must not be negative")
    return value * UNITS[own][1]
