"""How far each effect was checked: ``python -m studies.site.evidence`` writes the table of docs/how_far.md.

What was checked stands in docs/evidence.yaml; its tolerances are read off the tests, so that they cannot differ.
"""

import ast
import math
import re
from dataclasses import dataclass

import yaml

from belt_sim.effects.library import library
from belt_sim.paths import ROOT

SOURCE, PAGE = ROOT / "docs" / "evidence.yaml", ROOT / "docs" / "how_far.md"
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
#: constants of tests that are lengths [m], or plain numbers; all others are shares
LENGTHS, PLAIN = ("AGREE", "PASSING"), ("RMS",)


@dataclass(frozen=True)
class Check:
    """One check: by which route, of what (tolerances put in), in which test."""

    route: str
    what: str
    file: str
    test: str


def evidence() -> dict[str, list[Check]]:
    """The checks of every effect that docs/evidence.yaml names."""
    told = yaml.safe_load(SOURCE.read_text(encoding="utf-8"))
    return {effect: [_check(*row) for row in rows] for effect, rows in told.items()}


def _check(route: str, what: str, where: str) -> Check:
    file, test = where.split("::")
    return Check(route, re.sub(r"\{(\w+)\}", lambda m: _tolerance(file, m.group(1)), what), file, test)


def _tolerance(file: str, name: str) -> str:
    """A constant of a test's file in words."""
    for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body:
        names = [n.id for n in ast.walk(node) if isinstance(n, ast.Name)] if isinstance(node, ast.Assign) else []
        if name in names:
            assert isinstance(node, ast.Assign)
            value = ast.literal_eval(node.value)
            return _in_words(name, value[names.index(name)] if isinstance(value, tuple) else value)
    raise KeyError(f"{file} has no constant {name}")


def _in_words(name: str, value: float) -> str:
    if name in LENGTHS:
        return f"{1e6 * value:g} um"
    if name in PLAIN:
        return f"{value:g}"
    return f"{100 * value:g} %" if value > 1e-5 else f"1e{math.floor(math.log10(value))}"


def table() -> str:
    """A Markdown table, an effect a row: the independent routes, if any, all checks, the source."""
    lines = ["| effect | stands on | checked | source of the equation |", "| --- | --- | --- | --- |"]
    for name, checks in sorted(evidence().items()):
        said = "<br>".join(f"**{ROUTES[c.route]}**: {c.what}" for c in checks)
        routes = dict.fromkeys(ROUTES[c.route] for c in checks if c.route in INDEPENDENT)
        stands = ", ".join(routes) or "consistency only"
        if any(c.route == "against" for c in checks):
            stands += "; **3D disagrees**"
        lines.append(f"| {name} | {stands} | {said} | {library()[name].reference} |")
    return "\n".join(lines) + "\n"


def write() -> None:
    """Put the table into the page."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN, 1)
    PAGE.write_text(f"{before}{BEGIN}\n{table()}{END}{rest.split(END, 1)[1]}", encoding="utf-8")


if __name__ == "__main__":
    write()
