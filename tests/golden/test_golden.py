"""What belt-sim writes is what tests/golden holds, within the tolerances of studies/golden.py.

After a change that is meant: `python -m studies.golden write PART only=NAME`, and look at the difference in git.
"""

import pytest

from studies.golden import DIAGNOSED, PARTS, RUNS, compare, differences, golden, number_difference, table

QUICK = {"models": ["plain"], "diagnoses": ["nothing_hidden"]}
LONG = {
    "models": [name for name in RUNS if name not in QUICK["models"]],
    "diagnoses": [name for name in DIAGNOSED if name not in QUICK["diagnoses"]],
}


@pytest.mark.parametrize(
    ("part", "only"),
    [
        ("imports", "*"),
        pytest.param("commands", "*", marks=pytest.mark.long),
        *((part, name) for part, names in QUICK.items() for name in names),
        *(pytest.param(part, name, marks=pytest.mark.long) for part, names in LONG.items() for name in names),
    ],
)
def test_what_is_written_is_as_it_was(part, only, tmp_path):
    found = compare(part, only, tmp_path)
    assert not found, f"\n{table(found)}"


@pytest.mark.long
@pytest.mark.parametrize("source", ["mix", "nothing", "strangers"])
def test_a_published_campaign_is_answered_as_it_was(source, tmp_path):
    found = compare("scores", f"{source}_*", tmp_path, count=1)
    assert not found, f"\n{table(found)}"


def test_every_part_has_its_golden_entries():
    assert {part: len(golden(part)) for part in PARTS if part not in ("models", "commands")} == {
        "imports": 60, "diagnoses": len(DIAGNOSED), "scores": 60,
    }  # fmt: skip
    assert {name.split()[0] for name in golden("models")} == set(RUNS)


@pytest.mark.parametrize(
    ("field", "was", "now", "differs"),
    [
        ("models/plain strip 7/curves/y1_mm", [0.0, 2.0], [1e-6, 2.0], False),  # of the largest of the column
        ("models/plain strip 7/curves/y1_mm", [0.0, 2.0], [1e-5, 2.0], True),
        ("models/plain strip 7/curves/y1_mm", [0.0, 2.0], [0.0, float("nan")], True),
        ("diagnoses/x/verdict", "explained", "partly", True),
        ("diagnoses/x/sentence", "It lacks slip.", "Slip is missing.", False),
        ("diagnoses/x/effects", [{"id": "slip"}], [{"id": "slip"}, {"id": "taper"}], True),
        ("diagnoses/x", {"value": 0.1, "u": 1.0}, {"value": 0.14, "u": 1.0}, False),
        ("diagnoses/x", {"value": 0.1, "u": 1.0}, {"value": 0.16, "u": 1.0}, True),
        ("imports/x/runs", {"a": {"direction": 1.0}}, {"a": {"direction": -1.0}}, True),
        ("imports/x/runs", {"a": {}}, {}, True),
        ("scores/x/named", {"slip": 0.9}, {"slip": 0.85}, False),
        ("scores/x/named", {"slip": 0.9}, {"camber": 0.9}, True),
    ],
)
def test_a_difference_is_told_from_rounding(field, was, now, differs):
    assert bool(list(differences(was, now, field))) == differs


def test_a_pure_renaming_must_leave_every_word():
    assert list(differences("It lacks slip.", "Slip is missing.", "diagnoses/x/sentence", exact=True))
    assert list(number_difference([1.0], [1.0 + 1e-5], "diagnoses/x/value", exact=True))
    assert not list(number_difference([1.0], [1.0 + 1e-5], "diagnoses/x/value", exact=False))
