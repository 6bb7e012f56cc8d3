"""python -m studies.paper, and docs/data/paper.md against what it computes."""

import html
import json
import re

import pytest

from belt_sim.errors import InputError
from belt_sim.io import ROOT
from studies.paper.__main__ import paper
from studies.paper.report import answer, criteria, verdicts
from studies.paper.statements import judge_models

DOCUMENT = ROOT / "docs" / "data" / "paper.md"
LAST_DIGIT = 0.02  # relative, beside the 0.02 below: another processor may round a written number the other way
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def same(told: str, written: str) -> bool:
    """The same words, and numbers that differ in their last digit at most."""
    if NUMBER.sub("#", told) != NUMBER.sub("#", written):
        return False
    pairs = zip(NUMBER.findall(told), NUMBER.findall(written), strict=True)
    return all(float(a) == pytest.approx(float(b), rel=LAST_DIGIT, abs=0.02) for a, b in pairs)


def test_a_changed_number_is_seen():
    assert same("0.20 and 0.37", "0.20 and 0.37")
    assert not same("0.20 and 0.37", "0.20 and 0.47")
    assert not same("reproduced: 1", "contradicted: 1")


@pytest.fixture(scope="module")
def judged():
    return judge_models(in_space=True)


def test_the_documents_table_is_what_is_computed(judged):
    text = DOCUMENT.read_text(encoding="utf-8")
    lines = text.splitlines()
    for row in (verdicts(judged).markdown() + "\n" + criteria().markdown()).splitlines():
        assert any(same(row, line) for line in lines), row


def test_the_documents_answer_is_what_is_computed(judged):
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    for paragraph in answer(judged):
        assert any(same(paragraph, line) for line in lines), paragraph


def test_it_leaves_pictures_numbers_and_a_page(tmp_path, configuration):
    folder = tmp_path / "run"
    document = tmp_path / "paper.md"
    paper(configuration("paper", "figures=[2,6,14]", f"document={document}", f"folder={folder}"))
    numbers = json.loads((folder / "paper.json").read_text(encoding="utf-8"))
    page = html.unescape((folder / "index.html").read_text(encoding="utf-8"))
    assert set(numbers["figures"]) == {"2", "6", "14"}
    for number in (2, 6, 14):
        name = f"figure_{number:02d}.png"
        assert (folder / name).stat().st_size > 10_000
        assert f'src="{name}"' in page
    assert numbers["figures"]["14"]["stored_runs"]["flex_10_tilted"]["command"] in page
    assert "http" not in re.sub(r"<code>.*?</code>", "", page)
    assert numbers["statements"]["M2"]["strip"]["verdict"] == "reproduced"
    assert "not asked for" in document.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("wrong", "says"),
    [("figures=[11]", "photograph"), ("figures=[99]", "figures = 99"), ("fast=7", "fast = 7"),
     ("document=paper.txt", "document = paper.txt")],
)  # fmt: skip
def test_what_cannot_be_is_one_line(wrong, says, tmp_path, configuration):
    with pytest.raises(InputError) as raised:
        paper(configuration("paper", wrong, f"folder={tmp_path}"))
    assert says in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1
