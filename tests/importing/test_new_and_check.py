"""A template can be checked before anything is measured; what it cannot tell is what kinematics and sign say."""

import json

import numpy as np
import pytest
from shipped_schema import check as follows_its_schema

from belt_sim.api.check import check
from belt_sim.campaign import CampaignError, read_campaign
from belt_sim.campaign.folder import is_plan, read_plan
from belt_sim.commands.campaigns import new_command
from belt_sim.commands.runs import RunDir
from belt_sim.diagnosis.foresight import harm_warnings
from belt_sim.errors import BeltError
from belt_sim.results.files import file_json

SETTINGS = {
    "rig": "test_rig",
    "belt": "paper_belt",
    "tensions": [10],
    "yaw": 0.04,
    "speed": 0.5,
    "signals": ["point_1", "point_4"],
    "title": "a plan",
}
FEW = ["taper", "camber", "yaw_offset_tail", "sensor_gain", "yaw_backlash"]


def new_campaign(folder, config):
    new_command(RunDir(folder.parent, "new", config | {"out": str(folder)}))


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan") / "campaign"
    new_campaign(folder, SETTINGS)
    return folder


@pytest.fixture(scope="module")
def checked(plan):
    rows = (plan / "runs.csv").read_text().splitlines()
    few = plan.parent / "few"
    few.mkdir()
    for name in ("campaign.yaml", "signals.csv"):
        (few / name).write_text((plan / name).read_text())
    (few / "runs.csv").write_text("\n".join(rows[:4]))  # both signs of one yaw, and a repeat
    return check(few, effects=FEW, travel=40.0, step=0.5)


def test_a_template_is_a_plan_with_every_kind_of_run(plan):
    assert is_plan(plan)
    campaign = read_plan(plan, travel=60.0, step=0.5)
    assert {np.sign(r.yaw) for r in campaign.runs} == {-1.0, 0.0, 1.0}
    assert {r.direction for r in campaign.runs} == {1.0, -1.0}
    assert any(r.repeat_of for r in campaign.runs)
    assert len({r.speed for r in campaign.runs}) == 3
    assert all(s.zero > 0.0 for s in campaign.signals)
    text = (plan / "plan.md").read_text()
    assert all(r.name in text for r in campaign.runs)


#: what stands in signals.csv -> whether this is a plan; None: there is no such file
SIGNALS = {
    "no_file": (None, True),
    "header": ("run,travel_m,y1\n\n", True),
    "empty": ("", False),
    "blank": ("\n\n", False),
}


@pytest.mark.parametrize(("text", "planned"), SIGNALS.values(), ids=SIGNALS)
def test_a_plan_has_no_readings_yet_but_no_empty_file(plan, tmp_path, text, planned):
    for name in ("campaign.yaml", "runs.csv"):
        (tmp_path / name).write_text((plan / name).read_text())
    if text is not None:
        (tmp_path / "signals.csv").write_text(text)
    if planned:
        found = check(tmp_path, effects=FEW[:1], travel=40.0, step=0.5, advise=False)
        assert f"is planned, {len(found.runs)} runs, without readings yet" in found.lines()[0]
    else:
        with pytest.raises(CampaignError, match=r"^signals\.csv: the file is empty; begin with the line run,travel_m"):
            check(tmp_path)


def test_tensions_follow_the_sag_of_the_belt(tmp_path, capsys):
    new_campaign(tmp_path / "a", SETTINGS | {"tensions": None, "yaw": None})
    tensions = sorted({r.tension / 1e6 for r in read_plan(tmp_path / "a", travel=60.0, step=0.5).runs})
    assert tensions == pytest.approx([7.6, 16.0, 35.0])  # Lambda = (rho g L)^2 E / 12 sigma^3 = 30, 3, 0.3
    assert "r14" in capsys.readouterr().out


WIDE = {
    "rig": {"centre_distance": 6.4, "pulley_radius": 0.25, "head_radius": None, "tail_radius": None, "gravity": 9.81},
    "belt": {"width": 0.4, "thickness": 0.8e-3, "youngs_modulus": 210e9, "density": 7850.0, "poisson_ratio": 0.3},
}


def test_a_plan_by_itself_takes_no_edge_slack_and_a_stated_yaw_that_does_is_warned_of(tmp_path, capsys):
    new_campaign(tmp_path / "a", SETTINGS | WIDE | {"tensions": None, "yaw": None})
    plan = read_plan(tmp_path / "a", travel=60.0, step=0.5)
    assert not any(kind in " ".join(harm_warnings(plan)) for kind in ("edge", "laws"))
    assert max(abs(r.yaw) for r in plan.runs) > 1e-4  # and still moves the belt by millimetres
    new_campaign(tmp_path / "b", SETTINGS | WIDE | {"tensions": [5, 11], "yaw": 0.13})
    assert "off one edge" in capsys.readouterr().out
    assert "**Warning**" in (tmp_path / "b" / "plan.md").read_text()
    harm = [d for d in check(tmp_path / "b", effects=["taper"], advise=False).doubts if d.kind == "harm"]
    assert any("too large for the models' laws" in d.sentence for d in harm)


def test_a_plan_is_no_campaign_yet_and_the_loader_says_so(plan):
    with pytest.raises(CampaignError, match=r"signals\.csv: has a header but no rows"):
        read_campaign(plan)


def test_what_looks_alike_at_one_tension_is_found_with_the_run_that_tells(checked):
    alike = {frozenset(p.effects): p for p in checked.pairs}
    assert frozenset({"sensor_gain", "yaw_backlash"}) in alike  # play takes the same share of one yaw every time
    assert frozenset({"taper", "camber"}) in alike
    assert "turn the belt over" in alike[frozenset({"taper", "camber"})].action
    assert alike[frozenset({"taper", "camber"})].sigma_after > 3.0
    assert all((p.action is None) == (p.sigma_after is None) for p in checked.pairs)
    assert all(p.sigma_after >= 3.0 for p in checked.pairs if p.action)  # less is no advice
    assert frozenset({"taper", "sensor_gain"}) not in alike


def test_sizes_are_those_that_the_response_gives(checked):
    taper = next(v for v in checked.visible if v.effect == "taper")
    assert taper.smallest is not None
    assert 1e-8 < taper.smallest < 1e-5
    assert taper.word == "well"


def test_noise_twice_as_large_takes_a_larger_effect(checked, plan):
    louder = plan.parent / "louder"
    louder.mkdir()
    few = plan.parent / "few"
    text = (few / "campaign.yaml").read_text()
    for old, twice in (("white: 0.02", "white: 0.2"), ("zero: 0.1", "zero: 1"), ("sd: 0.05", "sd: 0.5")):
        assert old in text
        text = text.replace(old, twice)
    (louder / "campaign.yaml").write_text(text)
    for name in ("runs.csv", "signals.csv"):
        (louder / name).write_text((few / name).read_text())
    loud = check(louder, effects=FEW, travel=40.0, step=0.5, advise=False)
    sizes = [{v.effect: v.smallest for v in c.visible} for c in (checked, loud)]
    assert all(1.0 < sizes[1][n] / sizes[0][n] < 10.5 for n in FEW)
    assert sizes[1]["taper"] / sizes[0]["taper"] > 4.0


def test_what_the_plan_lacks_is_said(checked):
    said = " ".join(d.sentence for d in checked.doubts)
    for words in ("one tension", "zero yaw", "one direction"):
        assert words in said
    assert "repeated" not in said
    assert checked.planned


def test_check_json_follows_its_schema(checked):
    follows_its_schema(file_json(checked))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tensions": []}, "tensions"),
        ({"tensions": ["x"]}, "tensions"),
        ({"yaw": -1}, "yaw"),
        ({"signals": ["point1"]}, "did you mean point_1"),
        ({"speed": True}, "speed"),
    ],
)
def test_settings_of_a_template_that_cannot_be(change, words, tmp_path):
    with pytest.raises(BeltError, match=words):
        new_campaign(tmp_path / "a", SETTINGS | change)
    assert list(tmp_path.iterdir()) == []


def test_a_broken_folder_is_refused_with_every_fault(plan, tmp_path):
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "campaign.yaml").write_text((plan / "campaign.yaml").read_text().replace("unit: mm", "unit: furlong", 1))
    (broken / "runs.csv").write_text("run,tension_N_per_mm2,yaw_deg\nr01,ten,0.04\n")
    with pytest.raises(CampaignError) as error:
        check(broken)
    assert "furlong" in str(error.value)
    assert "ten" in str(error.value)


@pytest.mark.parametrize("name", ["travel", "step"])
def test_a_length_that_is_no_number_is_refused(plan, name):
    with pytest.raises(BeltError, match=f"{name} = a m: give a length in metres"):
        check(plan, "strip", **{name: "a"})


def test_check_json_is_json(checked):
    assert json.loads(json.dumps(file_json(checked), allow_nan=False))["schema"] == "belt-check/1"


def test_a_half_measured_campaign_says_what_is_there_what_is_missing_and_what_it_can_tell(plan, tmp_path):
    folder = tmp_path / "half"
    folder.mkdir()
    for name in ("campaign.yaml", "runs.csv"):
        (folder / name).write_text((plan / name).read_text())
    every = read_plan(plan, travel=40.0, step=0.5).runs
    repeat = next(r for r in every if r.repeat_of)
    there = [r.name for r in every[:2]] + [repeat.name]
    there.remove(repeat.repeat_of)  # so that a repeat stands there without its first run
    rows = [f"{n},{s / 2},0.0,0.0" for n in there for s in range(61)]
    (folder / "signals.csv").write_text("\n".join(["run,travel_m,y1,y4", *rows, ""]))
    with pytest.raises(CampaignError, match="add them or remove the run"):
        read_campaign(folder)  # to compare with, a campaign is to be whole
    found = check(folder, effects=FEW, advise=False)
    assert not found.planned
    assert (set(found.runs), len(found.missing)) == (set(there), len(every) - len(there))
    assert f"{len(there)} of {len(every)} runs are there" in str(found)
    assert f"still missing: {', '.join(found.missing)}" in str(found)
    assert {v.effect for v in found.visible} == set(FEW)
    assert not any("is repeated" not in d.sentence and "repeat_of" in d.sentence for d in found.doubts)
    follows_its_schema(file_json(found))
