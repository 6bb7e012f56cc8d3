"""What ``belt-sim simulate`` leaves behind, and that a sweep takes up where it stopped."""

import json

import numpy as np
import pytest

from belt_sim.io import CONF
from belt_sim.model import BY_TENSION, MODEL_NAMES
from belt_sim.settings import schedule_from

COLUMNS = (
    "travel_m,y1_mm,y2_mm,y3_mm,y4_mm,angle1_mrad,angle2_mrad,angle3_mrad,angle4_mrad,"
    "moment_upper_Nm,moment_lower_Nm,edge_stress_upper_N_per_mm2,edge_stress_lower_N_per_mm2,"
    "tilt_upper_mrad,tilt_lower_mrad"
)
#: keys of summary.json
ALWAYS = {
    "schema",
    "model",
    "tension_n_per_mm2",
    "yaw_deg",
    "travel_m",
    "rate_mm_per_m",
    "offset_mm",
    "settled",
    "effects",
}
ALWAYS |= {"provenance"}
SOMETIMES = {"sag_mm", "slackest_edge_n_per_mm2", "slack_edge", "steady_rate_mm_per_m", "note", "beyond_validity"}
SOMETIMES |= {"options", "engine", "contact", "scene"}  # of a belt in 3D


def summary(folder) -> dict:
    """summary.json of a run."""
    content = json.loads((folder / "summary.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert set(content) - SOMETIMES == ALWAYS
    return content


def test_summary_and_curves(belt):
    answer = belt.simulate("tension=40", "travel=20", "yaw=0.042")
    assert answer.status == 0, answer.err
    assert answer.err == ""
    assert str(answer.folder) in answer.out
    content = summary(answer.folder)
    assert content["schema"] == "belt-summary/1"
    assert content["model"] == "strip"
    assert content["tension_n_per_mm2"] == 40.0
    assert set(content["rate_mm_per_m"]) == {"1", "2", "3", "4"}
    assert set(content["offset_mm"]) == {"upper", "lower"}
    assert content["steady_rate_mm_per_m"] == pytest.approx(0.15201, abs=1e-5)
    assert content["sag_mm"] == pytest.approx(30.6, abs=0.1)
    assert content["slack_edge"] is False
    provenance = content["provenance"]
    assert set(provenance["versions"]) >= {"belt-sim", "jax", "numpy", "python"}
    assert len(provenance["config_sha256"]) == 64
    header, *rows = (answer.folder / "curves.csv").read_text(encoding="utf-8").splitlines()
    assert header == COLUMNS
    values = np.array([r.split(",") for r in rows], float)
    assert values.shape == (201, 15)
    assert np.isfinite(values).all()
    assert values[10, 0] == pytest.approx(1.0)
    assert values[10, 1] == pytest.approx(0.1320, rel=5e-3)  # y_1 at 1 m, table of transients
    assert values[100, 1] == pytest.approx(4.0047, rel=5e-3)
    assert (answer.folder / ".hydra" / "config.yaml").is_file()
    assert not list(answer.folder.glob(".*.csv"))  # no temporary file is left


def test_formula_without_curves(belt):
    answer = belt.simulate("model=ritzinger")
    assert answer.status == 0, answer.err
    content = summary(answer.folder)
    assert content["offset_mm"] == {"upper": None, "lower": None}
    assert "no curves" in content["note"]
    assert not (answer.folder / "curves.csv").exists()


def test_effects_are_named_and_act(belt):
    answer = belt.simulate("effects=[{id: sensor_offset, c1: 1.0e-3}]", "yaw=0")
    assert answer.status == 0, answer.err
    assert summary(answer.folder)["effects"][0]["parameters"]["c1"] == 1e-3
    last = (answer.folder / "curves.csv").read_text(encoding="utf-8").splitlines()[-1].split(",")
    assert [float(x) for x in last[1:5]] == [1.0, 0.0, 0.0, 0.0]  # a sensor effect is not dropped in silence


def test_an_effects_file_is_read_back(belt, tmp_path):
    path = tmp_path / "effects.yaml"
    path.write_text("schema: belt-effects/1\neffects:\n  - {id: crown, parameters: {c: 0.01}}\n", encoding="utf-8")
    answer = belt.simulate(f"effects={path}")
    assert answer.status == 0, answer.err
    assert summary(answer.folder)["effects"] == [{"id": "crown", "parameters": {"c": 0.01, "c_head": 0.0}}]


def test_sweep_takes_up_where_it_stopped(belt):
    sweep = ("simulate", "-m", "model=rope", "travel=2", "pictures=false")
    first, second = belt(*sweep, "tension=20,40"), belt(*sweep, "tension=20,30")
    assert first.status == second.status == 0, first.err + second.err
    assert "done before" not in first.out
    assert second.out.count("done before") == 1
    assert len(list(belt.folder.glob("*/summary.json"))) == 3


def test_a_sweep_goes_on_after_a_bad_job(belt):
    answer = belt("simulate", "-m", "model=rope", "travel=2", "pictures=false", "tension=-1,40")
    assert answer.status == 1
    assert answer.err.strip() == "belt-sim: tension = -1 N/mm2: must be 0.1 to 1500 N/mm2; check the value and its unit"
    assert len(list(belt.folder.glob("*/summary.json"))) == 1


def test_a_yaw_sequence_reaches_its_angles():
    schedule = schedule_from([{"at": 0, "yaw": 1.0}, {"at": 5, "over": 2, "yaw": -1.0}], "yaw")
    np.testing.assert_allclose(np.cumsum(schedule.change), np.radians([1.0, -1.0]))
    assert schedule.last() == pytest.approx(np.radians(-1.0))


def test_every_model_has_its_file_and_every_file_its_model():
    assert {p.stem for p in (CONF / "model").glob("*.yaml")} == {*MODEL_NAMES, BY_TENSION}
