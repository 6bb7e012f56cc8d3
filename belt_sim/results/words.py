"""Results as people read them: numbers and lists in words (every rounding of a result stands here), tables in
terminals and notebooks, pandas frames and xarray datasets."""

import html
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from belt_sim.errors import BeltError

KILO = 1e3  # m -> mm, rad -> mrad
NO_NUMBER = "–"
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: Any, digits: int = 3) -> str:
    """A number to ``digits`` significant digits; a dash when there is none."""
    if not _is_number(value):
        return NO_NUMBER
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{decimals}f}".replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPTS)}".replace("-", "−")


def thousandths(value: Any) -> str:
    """A length [m] in mm or an angle [rad] in mrad as a rig's people read it: hundredths, below 0.1 two digits."""
    if not _is_number(value):
        return NO_NUMBER
    shown = value * KILO
    return f"{shown:.2f}".replace("-", "−") if abs(shown) >= 0.1 or shown == 0.0 else number(shown, 2)


def column(value: Any, *, sign: bool = False) -> str:
    """The same, or a rate [m/m] in mm per m, to four decimals, for columns of a terminal."""
    if not _is_number(value):
        return "-"
    return f"{value * KILO:+.4f}" if sign else f"{value * KILO:.4f}"


def decimal(value: Any, decimals: int) -> str:
    """A number to so many decimals, for columns of a terminal."""
    return f"{value:.{decimals}f}" if _is_number(value) else "-"


def with_u(value: Any, u: Any, unit: str = "") -> str:
    """value ± u (one sigma) to two digits of u, with the unit; both share a power of ten."""
    unit = "" if unit in ("", "1") else f" {unit}"
    if not _is_number(value):
        return NO_NUMBER
    if not _is_number(u) or u <= 0.0:
        return number(value) + unit
    top = max(abs(value), u)
    power = 0 if 1e-3 <= top < 1e5 else math.floor(math.log10(top))
    decimals = max(0, 1 - math.floor(math.log10(u / 10.0**power)))
    core = f"{value / 10.0**power:.{decimals}f} ± {u / 10.0**power:.{decimals}f}"
    core = f"({core})·10{str(power).translate(_SUPERSCRIPTS)}" if power else core
    return core.replace("-", "−") + unit


def in_print(text: str) -> str:
    """A text with its units and arrows as pictures and pages write them."""
    text = re.sub(r"(?<![A-Za-z_])mm2\b", "mm²", text).replace(" -> ", " → ").replace(" -&gt; ", " → ")
    return re.sub(r"(?<=[0-9]) deg\b", "°", text.replace("kg/m^3", "kg/m³"))


def in_terminal(text: object) -> str:
    """A text with its units as they are typed."""
    return str(text).replace("mm²", "mm2")


def capital(line: str) -> str:
    """A line as a sentence begins; names such as y1 and idler_skew stay."""
    first = line.split(" ")[0].rstrip(":,")
    return line if "_" in first or any(c.isdigit() for c in first) else line[:1].upper() + line[1:]


def count(n: int) -> str:
    """A small number as a word."""
    named = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    return named[n] if n < len(named) else str(n)


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


@dataclass(frozen=True)
class Table:
    """Columns and rows of text; left: columns of words; marked: rows to be seen first."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: Sequence[str] = ()
    marked: Sequence[int] = ()

    def html(self) -> str:
        """Return the table as HTML for a notebook."""
        sides = ["left" if c in self.left else "right" for c in self.columns]
        body = f"<caption>{html.escape(self.title)}</caption>" if self.title else ""
        for k, row in enumerate([self.columns, *self.rows], start=-1):
            tag, style = "th" if k < 0 else "td", ' style="color:#d55e00"' if k in self.marked else ""
            cells = zip(sides, map(html.escape, row), strict=True)
            said = "".join(f'<{tag} style="text-align:{side}">{text}</{tag}>' for side, text in cells)
            body += f"<tr{style}>{said}</tr>"
        return f"<table>{body}</table>"


class Display:
    """Mixin of results: text in a terminal, HTML in a notebook."""

    def lines(self) -> Sequence[str]:
        """Return the result in a few lines."""
        raise NotImplementedError

    def tables(self) -> Sequence[Table]:
        """Return the tables that a notebook shows below the lines."""
        return ()

    def __repr__(self) -> str:
        return in_terminal("\n".join(self.lines()))

    def _repr_html_(self) -> str:
        first, *rest = (html.escape(line) for line in self.lines())
        text = f"<p><b>{first}</b>{''.join(f'<br>{line}' for line in rest)}</p>"
        return in_print("".join([text, *(table.html() for table in self.tables())]))


def dataset(variables: Mapping[str, Any], coords: Mapping[str, Any], units: Mapping[str, str]) -> Any:
    """Return an xarray Dataset whose variables carry their units; raise BeltError if xarray is not installed."""
    try:
        import xarray as xr
    except ImportError as missing:
        raise BeltError("to_xarray: xarray is not installed; run `pip install 'belt-sim[xarray]'`") from missing
    made = xr.Dataset(dict(variables), dict(coords))
    for name, unit in units.items():
        made[name].attrs["units"] = unit
    return made
