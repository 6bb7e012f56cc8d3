"""docs/how_far.md says of every effect what was checked, by tests that there are, within what those tests demand."""

import ast
import re

import pytest

from belt_sim.effects.library import library
from belt_sim.paths import ROOT
from studies.site.evidence import BEGIN, END, INDEPENDENT, PAGE, ROUTES, evidence, table

CHECKS = [(name, check) for name, checks in evidence().items() for check in checks]
#: what some tests call what an effect does
BY_ANOTHER_NAME = {
    "sag_roll": "strip",
    "taper": "SPACE_SAMPLES",
    "off_centre_load": "spread_roll",
    "idler_skew": "force_at",
    "side_drag": "couple_at",
    "machine_tilt": "spread_force",
}


def functions(file: str) -> dict[str, str]:
    """Tests of a file, by name, with their text."""
    text = (ROOT / file).read_text(encoding="utf-8")
    return {
        n.name: ast.get_source_segment(text, n) or "" for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)
    }


def test_every_effect_of_the_library_is_judged():
    assert set(evidence()) == set(library())
    assert all(evidence().values())


@pytest.mark.parametrize(("name", "check"), CHECKS, ids=[f"{n}-{c.test}" for n, c in CHECKS])
def test_a_check_is_a_test_that_there_is_and_knows_the_effect(name, check):
    assert check.route in ROUTES
    assert check.test in functions(check.file)
    text = (ROOT / check.file).read_text(encoding="utf-8")
    names = (name, library()[name].__name__, BY_ANOTHER_NAME.get(name, name))
    assert re.search("|".join(rf"\b{n}\b" for n in names), text), f"{check.file} says nothing of {name}"


def test_what_is_by_definition_or_by_a_second_code_counts_for_consistency_only():
    rows = dict(re.findall(r"^\| (\w+) \| ([^|]+) \|", table(), re.MULTILINE))
    for name, checks in evidence().items():
        independent = any(c.route in INDEPENDENT for c in checks)
        assert rows[name].startswith("consistency only") != independent
        assert ("disagrees" in rows[name]) == any(c.route == "against" for c in checks)


def test_the_page_has_the_table():
    text = PAGE.read_text(encoding="utf-8")
    inside = text.split(BEGIN, 1)[1].split(END, 1)[0]
    assert inside.strip() == table().strip(), "run: python -m studies.site.evidence"
