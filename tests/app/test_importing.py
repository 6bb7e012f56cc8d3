"""An import as the page drives it: answers are taken, taken back, and refused in a line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the app needs NiceGUI: pip install 'belt-sim[app]'")

from belt_sim.app.session import Import
from belt_sim.campaign import CampaignError, read_campaign
from belt_sim.importing import write
from belt_sim.importing.mapping import parse_mapping

MACHINE = {("machine",): "test_rig", ("belt",): "paper_belt"}


def answer(now, answers) -> None:
    """As the page does: what stands in its fields, and another look."""
    for place, text in sorted(answers.items(), key=lambda pair: len(pair[0])):
        now.note(place, text)
    now.understand()


@pytest.fixture
def logged(tmp_path) -> list[Path]:
    """Two runs as a German logger writes them; the second says nothing of its yaw."""
    travel = np.arange(0.0, 20.0, 0.5)
    paths = []
    for k, name in enumerate(("lauf1_10Nmm2_-0,042grad.csv", "lauf2_20Nmm2.csv")):
        y1 = (-1) ** k * 2.0 * (1.0 - np.exp(-travel / 5.0))
        rows = [f"{s:.2f};{a:.3f};{b:.3f}".replace(".", ",") for s, a, b in zip(travel, y1, 0.1 * y1, strict=True)]
        path = tmp_path / name
        path.write_text("\n".join(["Bandweg [m];Kante 1 [mm];Kante 4 [mm]", *rows]) + "\n", encoding="utf-8")
        paths.append(path)
    return paths


def test_answers_lead_to_a_campaign(logged, tmp_path):
    now = Import(logged)
    assert now.lacks
    assert {place[0] for place in now.questions} == {"machine", "belt", "runs"}
    answer(now, MACHINE)
    (run,) = [r for r in now.runs if not now.runs[r].get("yaw")]
    answer(now, {("runs", run, "yaw"): "0.042 deg"})
    assert not now.lacks
    write(now.proposal, tmp_path / "out")
    campaign = read_campaign(tmp_path / "out")
    assert [round(r.tension / 1e6) for r in campaign.runs] == [10, 20]
    assert campaign.runs[0].yaw == pytest.approx(-campaign.runs[1].yaw)


def test_why_no_campaign_can_be_made_is_said(logged):
    now = Import(logged)
    assert now.lacks.startswith("Not yet: ")
    assert any(q.text in now.lacks for q in now.proposal.missing)
    answer(now, {**MACHINE, ("runs", "lauf2_20Nmm2", "yaw"): "0.042 furlong"})
    assert "furlong" in now.lacks
    answer(now, {("runs", "lauf2_20Nmm2", "yaw"): "0.042 deg"})
    assert not now.lacks
    assert now.lacks == ""


def test_what_is_proposed_is_taken_unless_it_is_changed(logged):
    """What stands in a field of a question counts when the page looks again."""
    now = Import(logged)
    (open_question, *_) = [q for q in now.proposal.missing if q.path[0] == "belt"]
    proposed = replace(open_question, proposed="7850 kg/m^3", options=())
    now.proposal = replace(now.proposal, missing=(proposed,))
    now.understand()
    assert now.answers == {proposed.path: "7850 kg/m^3"}
    now.proposal = replace(now.proposal, missing=(proposed,))
    answer(now, {proposed.path: ""})
    assert now.answers == {proposed.path: ""}


def test_a_wrong_answer_is_said_and_can_be_taken_back(logged):
    now = Import(logged)
    answer(now, {**MACHINE, ("columns", "Kante 1 [mm]", "unit"): "furlong"})
    assert any("furlong" in line for line in now.errors)
    assert now.lacks
    answer(now, {("columns", "Kante 1 [mm]", "unit"): ""})
    assert not now.errors


def test_a_column_moved_to_another_place_is_another_signal(logged):
    now = Import(logged)
    answer(now, {**MACHINE, ("columns", "Kante 4 [mm]", "at"): "point_3"})
    assert {u.name: u.at for u in now.proposal.columns}["Kante 4 [mm]"] == "point_3"


def test_a_machine_by_its_name_needs_no_numbers(logged):
    now = Import(logged)
    answer(now, {("belt", "density"): "7800 kg/m^3"})
    answer(now, MACHINE | {("belt", "density"): "7800 kg/m^3"})
    assert now.answers == MACHINE
    now.note(("belt",), "")
    answer(now, {("belt", "density"): "7800 kg/m^3"})
    assert now.proposal.mapping["belt"] == {"density": "7800 kg/m^3"}


@pytest.mark.parametrize("data", [b"&a [*a]", b"- 1", b"a: &x 1\nb: *x", b"\x00"])
def test_a_mapping_that_is_none_is_one_line(data):
    with pytest.raises(CampaignError) as caught:
        parse_mapping(data.decode(errors="replace"), "mapping.yaml")
    assert "\n" not in str(caught.value)
