"""What was accepted in silence is refused or told."""

import csv
import json
import re
from importlib.metadata import version

import pytest
import yaml
from command import refusal

TYPED = [
    (["simulate", "+foo=1"], "foo: no such key"),
    (["simulate", "tension=0.01"], "tension = 0.01 N/mm2"),
    (["import", "a.csv", "draft=d.yaml", "out=zz"], "out = zz: goes without draft"),
    (["completion", "foo=3"], "completion = foo=3: it takes no settings"),
]
REFUSED = [
    ("simulate travel=10", "yaw=[{at: 50, yaw: 0.03}]", "yaw.at = 50 m: the travel ends at 10 m"),
    ("simulate travel=5", "yaw=[{at: 0, yaw: 0.01}, {at: 0, yaw: 0.05}]", "yaw.at = 0.0 m: entries must follow"),
    ("diagnose campaign=slack_belt", "bootstraps=1000000000", "give a whole number of at most"),
    ("diagnose campaign=slack_belt", "leave_out=[nosuch]", "leave_out = nosuch: use ids of the library"),
    ("virtual-rig belt.width=0.3", "plan=3", "belt.width = 0.3: goes with engine=line and plan=null"),
    ("virtual-rig", "rig.gravity=1.6", "rig.gravity = 1.6 m/s2"),
    ("virtual-rig", "hidden=[{id: taper, kappa_t: 1e-4, d: 5}]", "give kappa_t or d"),
    ("virtual-rig", "hidden=[{kappa_t: 1e-4, d: 5}]", "hidden = : use one of"),
    ("import files=[a.csv] draft=d.yaml", "overwrite=true", "overwrite = true: goes without draft"),
    ("scene", "model.scene=belt.xml", "model.scene = belt.xml: leave it out"),
]


@pytest.mark.parametrize(("arguments", "says"), TYPED, ids=[" ".join(a) for a, _ in TYPED])
def test_refused_in_a_line(belt, arguments, says):
    answer = belt(*arguments)
    assert answer.status == 1
    assert says in answer.err
    assert len(answer.err.strip().splitlines()) == 1


@pytest.mark.parametrize(("command", "value", "says"), REFUSED)
def test_a_value_is_refused_in_a_line(tmp_path, command, value, says):
    command, *base = command.split()
    assert says in refusal(command, tmp_path, tuple(base), value)


def test_a_key_given_twice_is_told_and_the_last_counts(belt):
    answer = belt("simulate", "travel=2", "pictures=false", "tension=10", "tension=20")
    assert "tension is given twice, 10 before: tension=20 counts" in answer.out
    assert json.loads((belt.folder / "summary.json").read_text())["tension_n_per_mm2"] == 20.0


def test_version(belt):
    answer = belt("--version")
    assert (answer.status, answer.out.strip()) == (0, f"belt-sim {version('belt-sim')}")


def test_late_rates_that_have_not_settled_are_told(belt):
    answer = belt("simulate", "model=strip", "tension=10", "travel=20", "pictures=false")
    assert "not settled" in answer.out
    assert re.search(r"the steady rate is -0\.09\d* mm per m", " ".join(answer.out.split()))
    assert json.loads((belt.folder / "summary.json").read_text())["settled"] is False
    settled = belt("simulate", "model=rope", "tension=40", "travel=100", "pictures=false")
    assert "not settled" not in settled.out
    assert json.loads((belt.folder / "summary.json").read_text())["settled"] is True


def test_a_model_that_is_not_stated_is_chosen_by_tension_and_named(belt):
    """In a sweep case by case; a stated model stays, and nothing is said of it."""
    answer = belt("simulate", "-m", "tension=22.3,22.4", "travel=2", "pictures=false")
    for chosen in ("strip_lift_off", "strip"):
        assert f"model {chosen}, as the belt is" in answer.out
    rows = list(csv.DictReader((belt.folder / "sweep.csv").open(encoding="utf-8")))
    assert sorted(r["model"] for r in rows) == ["strip", "strip_lift_off"]
    stated = belt("simulate", "model=strip", "tension=7", "travel=2", "pictures=false")
    assert "; or model=NAME" not in stated.out


def test_the_command_stands_in_the_provenance(belt):
    belt("simulate", "travel=2", "pictures=false")
    summary = json.loads((belt.folder / "summary.json").read_text())
    assert summary["provenance"]["command"].startswith("belt-sim simulate travel=2")


def test_the_virtual_rig_is_the_machine_that_was_asked_for(belt):
    answer = belt("virtual-rig", "rig.centre_distance=5", "belt.width=0.5")
    assert answer.status == 0, answer.err
    sheet = yaml.safe_load((belt.folder / "campaign" / "campaign.yaml").read_text(encoding="utf-8"))
    assert float(sheet["machine"]["centre_distance"]["value"]) == 5.0
    assert float(sheet["belt"]["width"]["value"]) == 500.0  # mm


@pytest.mark.parametrize(("settings", "model"), [([], " model=beam_th2"), (["base=strip"], " model=strip")])
def test_the_virtual_rig_says_beside_which_model_to_look(belt, settings, model):
    assert model in belt("virtual-rig", *settings).out


def test_what_is_drawn_by_lot_is_not_told(belt):
    assert "model=" not in belt("virtual-rig", "hidden=random", "plan=random", "seed=3").out


def test_a_sweep_is_drawn_and_recorded_as_what_it_swept(belt):
    from belt_sim.show.curves import read_run, swept_keys

    belt("simulate", "-m", "model=strip", "tension=20,30,40", "yaw=-0.03,0.042", "travel=2", "watch=rrd")
    rows = list(csv.DictReader((belt.folder / "sweep.csv").open(encoding="utf-8")))
    runs = [read_run(belt.folder / row["run"]) for row in rows]
    assert swept_keys(runs) == ["tension", "yaw"]
    assert [run.late * 1e3 for run in runs] == pytest.approx([float(row["rate1_mm_per_m"]) for row in rows])
    assert [str(run.settled) for run in runs] == [row["settled"] for row in rows] == ["False"] * 6  # after 2 m
    assert [run.steady * 1e3 for run in runs] == pytest.approx([float(row["steady_rate_mm_per_m"]) for row in rows])
    made = {p.name for p in belt.folder.iterdir() if p.is_file()}
    assert {"sweep_curves.png", "sweep_rates.png", "sweep.rrd"} <= made


def test_compare_tells_of_slack_edges(belt):
    answer = belt("compare", "campaign=slack_belt", "model=beam_th2")
    summary = json.loads((belt.folder / "comparison.json").read_text(encoding="utf-8"))
    for sentence in summary.get("beyond_validity", []):
        assert " ".join(sentence.split()) in " ".join(answer.out.split())
    assert summary.get("beyond_validity")
