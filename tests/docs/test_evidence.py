"""docs/how_far.md says of every effect what was checked: the table is made of the tests' own markers."""

from belt_sim.effects.base import library
from studies.site.evidence import BEGIN, END, INDEPENDENT, PAGE, evidence, table


def test_every_effect_of_the_library_is_judged_and_no_other():
    assert set(evidence()) == set(library())


def test_a_second_code_or_a_definition_alone_is_called_consistency():
    said = dict(row.removeprefix("| ").split(" | ")[:2] for row in table().splitlines()[2:])
    for name, checks in evidence().items():
        assert said[name].startswith("consistency only: ") != any(c.route in INDEPENDENT for c in checks)


def test_the_page_has_the_table():
    inside = PAGE.read_text(encoding="utf-8").split(BEGIN, 1)[1].split(END, 1)[0]
    assert inside.strip() == table().strip(), "run: python -m studies.site.evidence"
