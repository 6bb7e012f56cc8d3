"""Numbers and lists as people read them; every rounding of a result stands here."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from belt_sim.units import DEGREE, N_PER_MM2

KILO = 1e3  # m -> mm, rad -> mrad
NONE = "–"


def number(value: Any, digits: int = 3) -> str:
    """A number to ``digits`` significant digits; a dash when there is none."""
    if not _is_number(value):
        return NONE
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return _minus(f"{value:.{decimals}f}")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return _minus(f"{mantissa}·{_power(int(exponent))}")


def thousandths(value: Any) -> str:
    """A length [m] in mm or an angle [rad] in mrad as a rig's people read it: hundredths, below 0.1 two digits."""
    if not _is_number(value):
        return NONE
    shown = value * KILO
    return _minus(f"{shown:.2f}") if abs(shown) >= 0.1 or shown == 0.0 else number(shown, 2)


def column(value: Any, *, sign: bool = False) -> str:
    """The same, or a rate [m/m] in mm per m, to four decimals, for columns of a terminal."""
    if not _is_number(value):
        return "-"
    return f"{value * KILO:+.4f}" if sign else f"{value * KILO:.4f}"


def decimal(value: Any, decimals: int) -> str:
    """A number to so many decimals, for columns of a terminal."""
    return f"{value:.{decimals}f}" if _is_number(value) else "-"


def plain(value: Any) -> str:
    """A number as somebody set it, without digits that say nothing."""
    return _minus(f"{value:g}") if _is_number(value) else NONE


def tension(stress: float) -> str:
    """A tension [Pa] as somebody set it, in N/mm2."""
    return f"{stress / N_PER_MM2:g}"


def yaw(angle: float) -> str:
    """An angle [rad] in degrees, with its sign."""
    return f"{angle / DEGREE:+.3g}"


def degrees(angle: float) -> str:
    """An angle [rad] in degrees, without digits that say nothing."""
    return plain(angle / DEGREE)


def with_u(value: Any, u: Any, unit: str = "") -> str:
    """value ± u (one sigma) to two digits of u, with the unit; both share a power of ten."""
    unit = "" if unit in ("", "1") else f" {unit}"
    if not _is_number(value):
        return NONE
    if not _is_number(u) or u <= 0.0:
        return number(value) + unit
    top = max(abs(value), u)
    power = 0 if 1e-3 <= top < 1e5 else math.floor(math.log10(top))
    decimals = max(0, 1 - math.floor(math.log10(u / 10.0**power)))
    core = f"{value / 10.0**power:.{decimals}f} ± {u / 10.0**power:.{decimals}f}"
    core = f"({core})·{_power(power)}" if power else core
    return _minus(core) + unit


def join_effects(ids: Sequence[str]) -> str:
    """Effects of one set: a + b."""
    return " + ".join(ids)


def capital(line: str) -> str:
    """A line as a sentence begins; names such as y1 and idler_skew stay."""
    first = line.split(" ")[0].rstrip(":,")
    return line if "_" in first or any(c.isdigit() for c in first) else line[:1].upper() + line[1:]


def count(n: int) -> str:
    """A small number as a word."""
    return dict(enumerate(["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"])).get(
        n, str(n)
    )


def join_words(names: Sequence[str]) -> str:
    """a, b and c."""
    names = list(names)
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1] if names else "nothing"


def rows(table: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    """A nested mapping as (name, text) rows, for what has no layout of its own."""
    out: list[tuple[str, str]] = []
    for key, value in table.items():
        name = f"{prefix}{str(key).replace('_', ' ')}"
        if isinstance(value, Mapping):
            out += rows(value, f"{name} · ")
        else:
            out.append((name, number(value, 4) if isinstance(value, float) else str(value)))
    return out


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _power(exponent: int) -> str:
    """10 to this power."""
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
