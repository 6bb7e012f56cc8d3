"""User pages are short and hold no laboratory history."""

import re

from belt_sim.effects.base import library
from belt_sim.io import ROOT
from studies.site.words import count, faults, history


def test_the_pages_keep_their_limits():
    assert not faults()


def test_history_is_found_in_prose_and_seeds_are_allowed_in_commands():
    assert history("until commit b302763 it was slow") == ["a commit hash: b302763", "a commit: until commit"]
    assert history("campaign 9930052 and other seeds") == ["a seed: 9930052", "a seed: seeds"]
    assert not history("`belt-sim virtual-rig seed=3`, 10.1115/1.4004975, 1234567.8 N, a decade, faded")


def test_words_are_counted_as_wc_counts_them():
    assert count("| a | b |\ntwo words\n") == 7


def test_every_equivalence_of_the_theory_page_has_its_test():
    named = set(re.findall(r"`(test_\w+)`", (ROOT / "docs" / "theory.md").read_text().split("## Equivalences")[1]))
    there = "".join(path.read_text() for path in (ROOT / "tests" / "agreement").glob("test_*.py"))
    assert len(named) >= 10
    assert not {name for name in named if f"def {name}(" not in there}


def test_the_theory_page_has_every_law_of_the_catalogue():
    page = (ROOT / "docs" / "theory.md").read_text()
    below = re.search(r"`_lower`: on the lower", page)
    assert below
    assert not {i for i in library() if f"`{i.removesuffix('_lower')}`" not in page and f'"id": "{i}"' not in page}
