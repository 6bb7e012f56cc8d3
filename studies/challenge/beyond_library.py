"""Tables of campaigns whose hidden law is outside the library: by distance, by form, by law."""

from collections.abc import Sequence

import numpy as np

from studies.challenge.facts import Facts
from studies.challenge.tables import ranged, table
from studies.challenge.targets import of_kind

DISTANCES = ((0.0, 8.0), (8.0, 12.0), (12.0, 20.0), (20.0, 1e9))
FAR = 8.0  # from which a law is expected to be found
GOOD = 0.8  # share of the reducible held-out error
_TEXT = """## What is not in the library

The distance is what the best three effects of the library leave over of the hidden law, in units of noise. A place, and
a variable with its form, are right where the discovered law, or one that the answer cannot tell from it, has the
generator's; where no law is told they are wrong. The tables by form and law count distances of 8 and more.
"""
_HEAD = ("flagged as unknown", "false names", "place right", "variable and form right", "80 % of the error removed")


def of_strangers(rows: Sequence[Facts]) -> str:
    """The section; empty where there is no such campaign."""
    strange = [f for f in of_kind(rows, "outside") if f.distance is not None]
    if not strange:
        return ""
    far = [f for f in strange if (f.distance or 0.0) >= FAR]
    return "\n".join([_TEXT, _by_distance(strange), _by_form(far), _by_law(far)])


def _by_distance(rows: Sequence[Facts]) -> str:
    lines = []
    for low, high in DISTANCES:
        mine = [f for f in rows if low <= (f.distance or 0.0) < high]
        words = f"under {high:g}" if low == 0.0 else f"{low:g} and more" if high > 1e6 else f"{low:g} - {high:g}"
        if mine:
            lines.append((words, str(len(mine)), *_figures(mine)))
    return table(("distance", "campaigns", *_HEAD), lines)


def _by_form(rows: Sequence[Facts]) -> str:
    forms = sorted({f.unknown[2] for f in rows if f.unknown})
    lines = []
    for form in forms:
        mine = [f for f in rows if f.unknown[2:] == [form]]
        lines.append((form, str(len(mine)), *_figures(mine)))
    return table(("form", "campaigns", *_HEAD), lines) if lines else ""


def _by_law(rows: Sequence[Facts]) -> str:
    """Every law of the generator, by form and place."""
    lines = []
    for name in sorted({f.hidden[0] for f in rows}, key=lambda n: (_law(rows, n)[::-1], n)):
        mine = [f for f in rows if f.hidden[0] == name]
        place, variable, form = _law(rows, name)
        shares = [cell.partition(" (")[0] for cell in _figures(mine)[:4]]
        left = [f.removed for f in mine if f.removed is not None]
        lines.append((form, variable, place, name, str(len(mine)), *shares, f"{np.median(left):.0%}" if left else ""))
    head = ("form", "variable", "place", "law", "campaigns", *_HEAD[:4], "error removed, median")
    return table(head, lines) if lines else ""


def _law(rows: Sequence[Facts], name: str) -> tuple[str, str, str]:
    place, variable, form = next((f.unknown for f in rows if f.hidden[0] == name and f.unknown), ["", "", ""])
    return place, variable, form


def _figures(rows: Sequence[Facts]) -> list[str]:
    told = [f for f in rows if f.place is not None or f.discovered is None]
    flags = [[f.right for f in rows], [bool(f.false_names) for f in rows]]
    flags += [[bool(f.place) for f in told], [bool(f.law) for f in told]]
    return [ranged(flag) for flag in [*flags, [f.removed >= GOOD for f in rows if f.removed is not None]]]
