"""``belt-sim map`` and ``bs.sweep``: each row is what ``simulate`` says of its case."""

import re

import numpy as np
import pandas as pd
import pytest
from command import refusal

import belt_sim as bs
from belt_sim.errors import InputError
from belt_sim.io import ROOT
from belt_sim.settings import case_from

SMALL = ("travel=12", "pictures=false")
BAD = {
    "tension=[]": "tension = []",
    "tension=7": "let something vary",
    "tension={from: 5, to: 60}": "write {from: low, to: high",
    "tension={from: 5, to: 60, count: 0}": "tension.count = 0",
    "tension={from: 0, to: 60, count: 3}": "tension = 0",
    "yaw={from: -0.1, to: 3, count: 3}": "yaw = 3",
    "tension={from: -5, to: 60, count: 3, spacing: ratio}": "tension.from = -5",
    "rig.centre_distance=[0.3, 11]": "rig.centre_distance",
    "belt.thickness=[0.0003, high]": "belt.thickness = high",
    "at=[1, 20]": "at = 20",
    "show=rate1_mm_per_m": "pictures=false draws none",
    "model.keep=5": "model.keep = 5",
    "workers=0": "workers = 0",
    "tension={from: 5, to: 60, count: 100000000000}": "at most 10000000",
    "yaw={from: 0.0, to: 0.1, count: 9000000}": "at most 10,000,000",
    "effects=[{id: sensor_gain, gain_1: 0.1}]": "sensor_gain",
    "effects=[{id: taper, kappa: [1e-5, 2e-5]}]": "kappa",
    "effects=[{id: taper, kappa_t: [1000, 2.0e-5]}]": "effects.taper.kappa_t = 1000 1/m: give at most",
    "effects=[{id: slip, inverse_friction: [-3, 2]}]": "effects.slip.inverse_friction = -3 1: must be 0 or more",
}


def rows(folder) -> pd.DataFrame:
    """The whole table, in the order of the cases."""
    return pd.read_parquet(folder / "map.parquet")


def test_a_row_says_what_simulate_says(belt):
    vary = (
        "tension=[8, 40]",
        "yaw={from: -0.04, to: 0.04, count: 3}",
        "rig.pulley_radius=[0.17, 0.25]",
        "at=[1, 3.05]",
    )
    answer = belt("map", *SMALL, *vary)
    assert answer.status == 0, answer.err
    table = rows(belt.folder)
    assert len(table) == 12
    assert set(table["model"]) == {"strip_lift_off", "strip"}  # as each case alone
    row = table.loc[3]
    assert tuple(row[["tension_n_per_mm2", "yaw_deg", "rig_pulley_radius"]]) == (8.0, 0.0, 0.25)
    for number in (0, 5, 10):
        row = table.loc[number]
        rig = {"centre_distance": 11.28, "pulley_radius": row["rig_pulley_radius"], "gravity": 9.81}
        given = {"model": row["model"], "tension": row["tension_n_per_mm2"], "yaw": row["yaw_deg"]}
        alone = bs.simulate(**given, travel=12.0, rig=rig)
        curves = alone.curves
        assert alone.rates * 1e3 == pytest.approx(row[[f"rate{k}_mm_per_m" for k in (1, 2, 3, 4)]], rel=1e-8)
        assert np.multiply(alone.offsets, 1e3) == pytest.approx(row[["offset_upper_mm", "offset_lower_mm"]], rel=1e-8)
        assert alone.steady_rate * 1e3 == pytest.approx(row["steady_rate_mm_per_m"], rel=1e-8)
        assert alone.slackest_edge / 1e6 == pytest.approx(row["slackest_edge_n_per_mm2"], rel=1e-8)
        there = np.interp(3.05, curves.travel, curves.y[2]) * 1e3
        assert there == pytest.approx(row["y3_mm_at_3.05_m"], rel=1e-8)
        out = curves.y[0] * np.sign(curves.y[0, -1]) * 1e3
        assert (np.maximum.accumulate(out) - out).max() == pytest.approx(row["retreat1_mm"], rel=1e-8, abs=1e-12)


def test_numbers_of_effects_vary_too(belt):
    asked = "effects=[{id: taper, kappa_t: {from: 0, to: 2.0e-5, count: 3}}]"
    answer = belt("map", *SMALL, "model=strip", "tension=10", "yaw=0.02", asked)
    assert answer.status == 0, answer.err
    table = rows(belt.folder)
    assert "steady_rate_mm_per_m" not in table  # which knows of no effects
    last = bs.simulate(model="strip", tension=10, yaw=0.02, travel=12.0, effects=[{"id": "taper", "kappa_t": 2e-5}])
    assert table["taper_kappa_t"].tolist() == [0.0, 1e-5, 2e-5]
    assert last.rates[0] * 1e3 == pytest.approx(table["rate1_mm_per_m"].iloc[2], rel=1e-8)
    without = bs.simulate(model="strip", tension=10, yaw=0.02, travel=12.0)
    assert without.rates[0] * 1e3 == pytest.approx(table["rate1_mm_per_m"].iloc[0], rel=1e-8)


def test_a_stated_radius_does_not_follow_the_common_one():
    rig = {"pulley_radius": [0.15, 0.2], "head_radius": 0.3}
    table = bs.sweep(rig=rig, model="strip", travel=12.0)
    one = bs.simulate(rig=rig | {"pulley_radius": 0.15}, model="strip", travel=12.0)
    assert table["rate1_mm_per_m"].iloc[0] == pytest.approx(one.rates[0] * 1e3, rel=1e-8)
    with pytest.raises(InputError, match=r"pulley_radius = .*changes nothing"):
        bs.sweep(rig=rig | {"tail_radius": 0.2}, model="strip", travel=12.0)


def test_an_engine_of_an_analytic_model_is_refused():
    with pytest.raises(InputError, match="engine = mjx: leave it out"):
        bs.sweep(tension=[10, 20], model="strip", engine="mjx", travel=12.0)


def test_the_worst_of_a_large_table_is_asked_at_the_ends_of_its_axes():
    """Of 6000 cases the stretch of the belt is worst by far at the largest yaw, near 5 N/mm2."""
    yaw = {"from": 0.0, "to": 0.4, "count": 60}
    both = [
        bs.sweep(tension={"from": 2, "to": 60, "count": 100}, yaw=turns, travel=20, model="strip_lift_off")
        for turns in (yaw, [0.4])
    ]
    times = [re.findall(r"second_order \(([0-9.]+) times", " ".join(b.attrs["beyond"])) for b in both]
    assert times[0] == times[1] != []


def test_numbers_of_an_effects_file_vary():
    own = str(ROOT / "models" / "effects" / "wind.py")
    table = bs.sweep(effects=[{"id": own, "load": [0.01, 0.02]}], model="strip", travel=12.0)
    one = bs.simulate(effects=[{"id": own, "load": 0.01}], model="strip", travel=12.0)
    assert table["wind_load"].tolist() == [0.01, 0.02]
    assert table["rate1_mm_per_m"].iloc[0] == pytest.approx(one.rates[0] * 1e3, rel=1e-8)


def test_closed_forms_alone(belt):
    answer = belt("map", "travel=null", "model=strip", "yaw=-0.042", "tension=[7, 40]", "pictures=true")
    assert answer.status == 0, answer.err
    assert rows(belt.folder)["steady_rate_mm_per_m"].iloc[1] == pytest.approx(-0.15201, abs=1e-5)
    assert (belt.folder / "map.png").stat().st_size > 5000


@pytest.mark.parametrize("asked", BAD)
def test_what_cannot_be_is_told_in_one_line(tmp_path, asked):
    varied = () if asked.startswith("tension") else ("tension=[10, 20]",)
    assert BAD[asked] in refusal("map", tmp_path, SMALL, *varied, asked)
    assert not list(tmp_path.glob("map*"))


EFFECT = "effects=[{id: taper, kappa_t: 1.0e-5}]"


@pytest.mark.parametrize("asked", [("travel=null", "show=colour"), (EFFECT, "show=steady_rate_mm_per_m")])
def test_a_picture_of_no_column_is_refused(asked, belt, monkeypatch):
    monkeypatch.setattr("belt_sim.api.sweep.sweep", lambda **given: pytest.fail("worked before it refused"))
    answer = belt("map", "tension=[10, 20]", *asked)
    assert answer.status == 1
    assert f"{asked[1].replace('=', ' = ')}: use one of" in answer.err


def test_a_list_of_tensions_gives_a_table_that_is_drawn(tmp_path):
    table = bs.sweep(model="rope", tension=[7, 10, 40], travel=12.0)
    one = bs.simulate(model="rope", tension=10, travel=12.0)
    assert table["rate1_mm_per_m"].iloc[1] == pytest.approx(one.rates[0] * 1e3, rel=1e-8)
    bs.plot(table, tmp_path / "a.png", kind="retreat1_mm")
    assert (tmp_path / "a.png").stat().st_size > 5000
    with pytest.raises(bs.InputError, match="use one of"):
        bs.plot(table, kind="colour")


def test_models_without_a_march_are_run_one_after_another():
    with pytest.raises(bs.InputError, match="a table of ritzinger needs a travel; write travel=60"):
        bs.sweep(tension=[7, 40], model="ritzinger", travel=None)
    table = bs.sweep(tension=[7, 40], model="ritzinger")
    assert table["rate1_mm_per_m"].iloc[1] * 1e-3 == pytest.approx(bs.simulate(tension=40, model="ritzinger").rates[0])


def test_many_axes_are_checked_by_their_ends(monkeypatch):
    """Every axis by itself: 2**17 corners, one after another, would take half a minute."""
    checked = []
    monkeypatch.setattr("belt_sim.api.sweep.case_from", lambda plain: checked.append(plain) or case_from(plain))
    near = {"width": 0.2, "thickness": 3e-4, "density": 7850.0, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}
    rig = {"centre_distance": [11.0, 11.3], "head_radius": [0.17, 0.18], "tail_radius": [0.17, 0.18]}
    effects = [{"id": "taper", "kappa_t": [0.0, 1e-7], "kappa_t_head": [0.0, 1e-7]}]
    effects += [{"id": "crown", "c": [0.0, 1e-3], "c_head": [0.0, 1e-3]}]
    belt = {name: [value, 1.01 * value] for name, value in near.items()}
    given = {"tension": [10, 11], "yaw": [0.0, 0.01], "yaw_head": [0.0, 0.01], "speed": [0.5, 0.6]}
    with pytest.raises(bs.InputError, match=r"rig\.gravity = -1"):
        bs.sweep(**given, rig=rig | {"gravity": [9.81, -1.0]}, belt=belt, effects=effects, travel=1.0)
    assert len(checked) < 100


def test_limits_are_asked_at_every_value_of_an_inner_axis():
    """At 0.1 degrees the belt slips between 10 and 40 N/mm2; of 381 rows, every third would never be of that yaw."""
    table = bs.sweep(tension={"from": 7, "to": 60, "count": 127}, yaw=[0.0, 0.1, 0.05], travel=5.0)
    assert any("slip (" in line for line in table.attrs["beyond"])


def test_values_and_counts_may_be_of_numpy():
    plain = bs.sweep(tension=[7.0, 10.0], model="strip", travel=1.0, at=[1.0])
    some = {"tension": np.array([7.0, 10.0]), "at": np.array([1.0])}
    for own in (some, some | {"tension": {"from": 7, "to": 10, "count": np.int64(2)}, "workers": np.int64(1)}):
        pd.testing.assert_frame_equal(bs.sweep(model="strip", travel=1.0, **own), plain)
