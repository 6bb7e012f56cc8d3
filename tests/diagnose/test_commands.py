"""virtual-rig, compare, diagnose, report and reveal from the command line."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from shipped_schema import check
from small_campaign import NAMES, SPREAD, campaign

from belt_sim.api.compare import compare
from belt_sim.campaign import SteadyRate, read_campaign, write_campaign
from belt_sim.effects.load import load_effects
from belt_sim.virtual_rig.make import make_campaign

QUICK = ("model=beam_th2", "bootstraps=100", "pictures=false", "watch=null")
TRUTH = "schema: belt-effects/1\neffects:\n  - id: sag_roll\n    parameters: {strength: 1.0}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The slack belt on disk."""
    place = tmp_path_factory.mktemp("campaigns") / "slack"
    write_campaign(campaign("sag_roll"), place)
    return place


def read(path) -> dict:
    def refuse(name):
        raise AssertionError(f"{name} in {path}")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def test_compare_shows_before_and_after(belt, folder, tmp_path):
    effects = tmp_path / "effects.yaml"
    effects.write_text(TRUTH, encoding="utf-8")
    answer = belt("compare", f"campaign={folder}", "model=beam_th2", f"effects={effects}", "pictures=false")
    assert (answer.status, answer.err) == (0, "")
    content = read(answer.folder / "comparison.json")
    check(content)
    assert content == read(answer.folder / "summary.json")
    assert content["schema"] == "belt-comparison/1"
    assert content["effects"] == [{"id": "sag_roll", "parameters": {"strength": 1.0}}]
    error = content["error"]["fit"]
    assert error["before_mm"] > 3 * error["after_mm"]
    assert len(content["per_run"]) == len(SPREAD.runs) * len(SPREAD.signals)
    assert f"{error['before_mm']:.4f} -> {error['after_mm']:.4f}" in answer.out
    assert "no run got worse" in answer.out
    rows = pd.read_csv(answer.folder / "per_run.csv")
    assert set(rows["unit"]) == {"mm"}
    assert rows["before"].tolist() == pytest.approx([r["before"] for r in content["per_run"]])


def test_diagnose_then_compare_and_report(belt, folder):
    again = belt("diagnose", f"campaign={folder}", *QUICK, f"effects=[{', '.join(NAMES)}]")
    assert again.status == 0, again.err
    after = read(again.folder / "diagnosis.json")
    check(after)
    check(read(again.folder / "drawings.json"))
    assert (after["verdict"], [e["id"] for e in after["effects"]]) == ("explained", ["sag_roll"])
    assert after["campaign"]["sha256"] == read_campaign(folder).sha256
    assert "Explained" in again.out

    found = again.folder / "effects.yaml"
    (effect,) = load_effects(str(found))
    assert effect.strength == after["effects"][0]["parameters"]["strength"]["value"]
    assert effect.strength == after["effects"][0]["numbers"]["strength"]
    compared = belt("compare", f"campaign={folder}", "model=beam_th2", f"effects={found}", "pictures=false")
    error = read(compared.folder / "comparison.json")["error"]["fit"]
    # a diagnosis carries predictions from the likeliest settings back to the stated ones, to first order
    assert error["after_mm"] == pytest.approx(after["error"]["fit"]["after_mm"], rel=5e-3)

    report = again.folder / "report.html"
    report.unlink()
    answer = belt("report", f"diagnosis={again.folder}")
    assert (answer.status, answer.err) == (0, "")
    assert "sag_roll" in report.read_text(encoding="utf-8")
    assert (again.folder / "overlay.svg").is_file()


def test_tilt_alone_is_compared_in_milliradians_and_not_diagnosed(belt, tmp_path):
    """Without a lateral signal there is no error to fall: nan once ended in a traceback, and mrad were called mm."""
    plan = replace(SPREAD, signals={"roll": "upper_mid_span"}, runs=SPREAD.runs[:2])
    write_campaign(make_campaign(seed=1, plan=plan)[0], tmp_path / "tilt")
    answer = belt("compare", f"campaign={tmp_path / 'tilt'}", "model=strip", "pictures=false")
    assert (answer.status, answer.err) == (0, "")
    content = read(answer.folder / "comparison.json")
    check(content)
    assert {(r["signal"], r["unit"]) for r in content["per_run"]} == {("roll", "mrad")}
    assert "mrad" in answer.out
    assert "error" not in content
    assert "lateral position of at least one" in one_line(belt("diagnose", f"campaign={tmp_path / 'tilt'}"))


def test_steady_rates_alone_are_compared(belt, tmp_path):
    """A published table: no curves, so that a formula will do; the same table and picture as ever."""
    whole, nothing = campaign("nothing"), np.empty(0)
    runs = tuple(replace(r, travel=nothing, time=None, signals={}) for r in whole.runs[:2])
    rates = [np.array([rate, np.nan, np.nan, np.nan]) for rate in (1.0e-4, -1.2e-4)]
    steady = tuple(SteadyRate(run=run.name, rates=r, u=1e-5) for run, r in zip(runs, rates, strict=True))
    write_campaign(replace(whole, runs=runs, steady=steady), tmp_path / "table")
    answer = belt("compare", f"campaign={tmp_path / 'table'}", "model=ritzinger")
    assert (answer.status, answer.err) == (0, "")
    content = read(answer.folder / "comparison.json")
    check(content)
    assert [(r["run"], r["point"], r["measured_mm_per_m"]) for r in content["steady"]] == [
        ("r01", 1, pytest.approx(0.10)),
        ("r02", 1, pytest.approx(-0.12)),
    ]
    assert content["steady"][0]["ratio"] == pytest.approx(abs(content["steady"][0]["modelled_mm_per_m"] - 0.10) / 0.01)
    assert "per_run" not in content
    assert (answer.folder / "steady.svg").is_file()


def steady_table(tension):
    """A campaign of one late rate, without curves."""
    whole = campaign("nothing")
    run = replace(whole.runs[0], tension=tension, travel=np.empty(0), time=None, signals={})
    return replace(whole, runs=(run,), steady=(SteadyRate(run=run.name, rates=np.full(4, 1e-4), u=1e-5),))


@pytest.mark.parametrize("tension", [4e6, 10e6])
def test_a_steady_rate_with_a_null_effect_is_that_without(tension):
    """However long a slack belt takes to settle."""
    table = steady_table(tension)
    rows = [compare(table, "strip", acting).steady for acting in (None, [{"id": "taper", "kappa_t": 1e-13}])]
    plain, loaded = ([row.modelled for row in each] for each in rows)
    np.testing.assert_allclose(loaded, plain, atol=0.1 * 1e-5)


def test_a_rate_that_does_not_settle_is_told():
    table = steady_table(10e6)
    assert not compare(table, "strip", [{"id": "taper", "kappa_t": 1e-5}]).beyond
    (said,) = compare(table, "strip", [{"id": "yaw_drift", "rate": 1e-7}]).beyond
    assert "the rate of r01 has not settled after 1200 m" in said


def test_a_hidden_effect_is_revealed(belt, tmp_path):
    made = belt("virtual-rig", "hidden=[{id: taper, kappa_t: 3.0e-5}]", "seed=4", f"out={tmp_path / 'c'}")
    assert made.status == 0
    assert "taper" not in (tmp_path / "c" / "runs.csv").read_text()
    told = belt("reveal", f"campaign={tmp_path / 'c'}")
    assert told.status == 0
    first, rest = told.out.split("\n", 1)
    assert first.split()[1] in made.out
    assert json.loads(rest)["effects"][0]["parameters"] == {"kappa_t": 3e-5}


def one_line(answer) -> str:
    assert answer.status != 0
    assert answer.err.count("\n") == 1
    assert "Traceback" not in answer.err + answer.out
    return answer.err


@pytest.mark.parametrize("command", ["compare", "diagnose", "reveal"])
def test_no_such_campaign_is_one_line(belt, tmp_path, command):
    assert str(tmp_path / "nowhere") in one_line(belt(command, f"campaign={tmp_path / 'nowhere'}"))


def test_no_such_diagnosis_is_one_line(belt, tmp_path):
    assert "diagnosis.json" in one_line(belt("report", f"diagnosis={tmp_path}"))


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("bootstraps=10", "at least 100"),
        ("effects=[no_such_effect]", "use one of"),
        ("effects=[]", "at least one candidate"),
        ("model=ritzinger", "model = ritzinger: it gives a steady rate and no curves"),
        (
            "model=mujoco_flex",
            "model = mujoco_flex: an analytic model is needed here",
        ),
        ("seed=a", "seed = a: give a whole number"),
        ("model=strip effects=[sag_roll]", "built in already"),
        ("bootstrap=1000", "did you mean bootstraps?"),
    ],
)
def test_wrong_settings_of_diagnose(belt, folder, override, says):
    assert says in one_line(belt("diagnose", f"campaign={folder}", *override.split()))
