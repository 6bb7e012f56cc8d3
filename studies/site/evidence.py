"""How far each effect was checked: ``python -m studies.site.evidence`` writes the table of docs/how_far.md.

A test that is evidence for an effect says so itself, and within what:

    @pytest.mark.evidence("camber", route="elements", what="end curvatures and tilt, {FIELDS}")

{FIELDS} is that constant of the test's file, so that page and test cannot differ. The markers are read without
importing the tests.
"""

import ast
import math
import re
from contextlib import suppress
from dataclasses import dataclass

from belt_sim.io import ROOT
from studies.application import show_help

TESTS, PAGE = ROOT / "tests", ROOT / "docs" / "how_far.md"
BEGIN, END = "<!-- evidence -->", "<!-- end -->"
#: what the routes are called on the page
ROUTES = {
    "shell": "shell",
    "3d": "3D belt",
    "against": "3D belt, against it",
    "elements": "elements",
    "formula": "formula",
    "symmetry": "turned machine",
    "code": "second code",
    "definition": "by definition",
}
#: routes that share neither the effect's code nor its formula
INDEPENDENT = ("shell", "3d", "elements", "formula")
CONSISTENCY = "consistency only"
#: what the page says once for all effects
USUAL = ("readings, 1.5 um", "turned machines, 1e-9", "machine turned about the vertical, 1e-9")
#: what the page says once of all 3D belts: the rig, and of what y a difference is a share
SAID_ONCE = re.compile(r" of the largest( y)?\b| on a (narrow )?short rig\b| of all (four )?points\b(?= on| as)")
#: constants of tests that are lengths [m], or plain numbers; all others are shares
LENGTHS, PLAIN = ("AGREE", "PASSING"), ("RMS",)


@dataclass(frozen=True)
class Check:
    """One check of one effect: by which route, of what (tolerances put in)."""

    route: str
    what: str


def evidence() -> dict[str, list[Check]]:
    """The checks of every effect that a test is marked with, in the order of ROUTES."""
    found: dict[str, list[Check]] = {}
    for path in sorted(TESTS.glob("*/test_*.py")):
        text = path.read_text(encoding="utf-8")
        if "mark.evidence(" not in text:
            continue
        module = ast.parse(text)
        constants: dict[str, str] = {}  # of the file, in words
        for node in module.body:
            if isinstance(node, ast.Assign):
                names = [n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
                with suppress(ValueError):  # no constant
                    value = ast.literal_eval(node.value)
                    values = value if isinstance(value, tuple) and len(names) > 1 else [value]
                    constants |= {n: _in_words(n, v) for n, v in zip(names, values, strict=False)}
        for decorator in (d for part in module.body for d in getattr(part, "decorator_list", [])):
            if isinstance(decorator, ast.Call) and getattr(decorator.func, "attr", "") == "evidence":
                given = {k.arg: ast.literal_eval(k.value) for k in decorator.keywords}
                what = re.sub(r"\{(\w+)\}", lambda m: constants[m.group(1)], given["what"])  # noqa: B023
                for effect in decorator.args:
                    found.setdefault(ast.literal_eval(effect), []).append(Check(given["route"], what))
    order = list(ROUTES)
    return {effect: sorted(checks, key=lambda c: order.index(c.route)) for effect, checks in found.items()}


def _in_words(name: str, value: object) -> str:
    if not isinstance(value, int | float):
        return str(value)
    if name in LENGTHS:
        return f"{1e6 * value:g} um"
    if name in PLAIN:
        return f"{value:g}"
    return f"{100 * value:g} %" if value > 1e-5 or value <= 0 else f"1e{math.floor(math.log10(value))}"


def table() -> str:
    """A Markdown table, an effect a row: its independent checks or, where there are none, those of consistency."""
    lines = ["| effect | checked by |", "| --- | --- |"]
    for name, checks in sorted(evidence().items()):
        independent = [c for c in checks if c.route in INDEPENDENT or c.route == "against"]
        if not independent:
            said = [c.what for c in checks if c.what not in USUAL]
            lines.append(f"| {name} | {CONSISTENCY}: {'; '.join(said) or ROUTES['code']} |")
            continue
        by_route: dict[str, list[str]] = {}
        for check in independent:
            by_route.setdefault(check.route, []).append(SAID_ONCE.sub("", check.what))
        cell = "<br>".join(f"**{ROUTES[route]}**: {'; '.join(whats)}" for route, whats in by_route.items())
        lines.append(f"| {name} | {cell} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    show_help(__doc__)
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN, 1)
    PAGE.write_text(f"{before}{BEGIN}\n{table()}{END}{rest.split(END, 1)[1]}", encoding="utf-8")
