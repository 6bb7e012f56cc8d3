"""``belt-sim map``: each row is what ``simulate`` says of its case; parts are resumed; memory stays flat."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import pytest

import belt_sim as bs
from belt_sim.commands.map import case_map
from belt_sim.config import _file
from belt_sim.files import ROOT

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
    "cases=-3": "cases = -3",
    "at=[1, 20]": "at = 20",
    "show=colour": "show = colour",
    "model=ritzinger": "ritzinger",
    "model=mujoco_flex": "mujoco_flex",
    "effects=[{id: sensor_gain, gain_1: 0.1}]": "sensor_gain",
    "effects=[{id: taper, kappa: [1e-5, 2e-5]}]": "kappa",
}


def rows(folder) -> pd.DataFrame:
    """The whole table, in the order of the cases."""
    return pd.read_parquet(folder / "cases").sort_values("case").set_index("case")


def test_a_row_says_what_simulate_says(belt):
    vary = (
        "tension=[8, 40]",
        "yaw={from: -0.04, to: 0.04, count: 3}",
        "rig.pulley_radius=[0.17, 0.25]",
        "at=[1, 3.05]",
    )
    answer = belt("map", *SMALL, *vary, "part=5", f"out={belt.folder}")
    assert answer.status == 0, answer.err
    table = rows(belt.folder)
    assert len(table) == 12
    assert len(list((belt.folder / "cases").glob("*.parquet"))) == 3
    row = table.loc[3]
    assert tuple(row[["tension_n_per_mm2", "yaw_deg", "rig_pulley_radius"]]) == (8.0, 0.0, 0.25)
    for number in (0, 5, 10):
        row = table.loc[number]
        rig = {"centre_distance": 11.28, "pulley_radius": row["rig_pulley_radius"], "gravity": 9.81}
        alone = bs.simulate(model="strip", tension=row["tension_n_per_mm2"], yaw=row["yaw_deg"], travel=12.0, rig=rig)
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
    answer = belt("map", *SMALL, "tension=10", "yaw=0.02", asked, f"out={belt.folder}")
    assert answer.status == 0, answer.err
    table = rows(belt.folder)
    assert "steady_rate_mm_per_m" not in table  # which knows of no effects
    last = bs.simulate(model="strip", tension=10, yaw=0.02, travel=12.0, effects=[{"id": "taper", "kappa_t": 2e-5}])
    assert table["taper_kappa_t"].tolist() == [0.0, 1e-5, 2e-5]
    assert last.rates[0] * 1e3 == pytest.approx(table["rate1_mm_per_m"].iloc[2], rel=1e-8)
    without = bs.simulate(model="strip", tension=10, yaw=0.02, travel=12.0)
    assert without.rates[0] * 1e3 == pytest.approx(table["rate1_mm_per_m"].iloc[0], rel=1e-8)


def test_closed_forms_alone(belt):
    answer = belt("map", "travel=null", "yaw=-0.042", "tension=[7, 40]", "pictures=true", f"out={belt.folder}")
    assert answer.status == 0, answer.err
    assert rows(belt.folder)["steady_rate_mm_per_m"].iloc[1] == pytest.approx(-0.15201, abs=1e-5)
    assert (belt.folder / "map.png").stat().st_size > 5000


def test_a_sample_is_even_and_any_stretch_of_it_comes_alone():
    config = {k: v for k, v in _file("map.yaml").items() if k not in ("defaults", "hydra")}
    config |= {"rig": _file("rig/test_rig.yaml"), "belt": _file("belt/paper_belt.yaml"), "model": {"name": "strip"}}
    config |= {"tension": {"from": 5.0, "to": 80.0, "spacing": "ratio"}, "yaw": [-1.0, 0.0, 1.0]}
    sample = case_map(config | {"cases": 1024, "seed": 3, "travel": 1.0})
    whole = sample.values(0, 1024)
    assert (sample.values(700, 900) == whole[:, 700:900]).all()
    assert np.histogram(np.log(whole[0]), bins=8, range=np.log([5.0, 80.0]))[0].tolist() == [128] * 8
    assert np.unique(whole[1], return_counts=True)[1] == pytest.approx(1024 / 3, abs=2)


@pytest.mark.parametrize("asked", BAD)
def test_what_cannot_be_is_told_in_one_line(belt, asked):
    varied = () if asked.startswith("tension") else ("tension=[10, 20]",)
    answer = belt("map", *SMALL, *varied, asked, f"out={belt.folder}")
    assert answer.status == 1
    lines = [line for line in answer.err.splitlines() if "map of" not in line]
    assert len(lines) == 1
    assert BAD[asked] in lines[0]
    assert not list(belt.folder.glob("cases/*"))


def test_another_map_is_not_mixed_into_the_same_folder(belt):
    assert belt("map", *SMALL, "tension=[10, 20]", "yaw=0.02", f"out={belt.folder}").status == 0
    other = belt("map", *SMALL, "tension=[10, 30]", "yaw=0.02", f"out={belt.folder}")
    assert other.status == 1
    assert "holds another map" in other.err
    again = belt("map", *SMALL, "tension=[10, 20]", "yaw=0.02", f"out={belt.folder}")
    assert again.status == 0
    assert "done before, kept: 2 cases" in again.out


def test_killed_it_goes_on_with_what_is_missing(tmp_path):
    grid = ["tension={from: 5, to: 60, count: 100}", "yaw={from: -0.06, to: 0.06, count: 41}"]
    command = [sys.executable, "-m", "belt_sim", "map", *grid, "pictures=false", "part=100", f"out={tmp_path}"]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    limit = time.monotonic() + 60.0
    while len(list(tmp_path.glob("cases/[!.]*.parquet"))) < 3 and time.monotonic() < limit:
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    before = {p: p.stat().st_ino for p in tmp_path.glob("cases/[!.]*.parquet")}
    assert 3 <= len(before) < 41
    again = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert f"done before, kept: {100 * len(before)} cases" in again.stdout
    assert {p: p.stat().st_ino for p in before} == before
    assert rows(tmp_path).index.tolist() == list(range(4100))
    assert not list(tmp_path.rglob(".*"))
    assert json.loads((tmp_path / "map.json").read_text(encoding="utf-8"))["cases"] == 4100


MEMORY = """
import resource, sys
from belt_sim.jax_setup import prepare
prepare()
from belt_sim.config import _file
from belt_sim.commands.map import case_map, write_map
from pathlib import Path
config = {k: v for k, v in _file("map.yaml").items() if k not in ("defaults", "hydra")}
config |= {"rig": _file("rig/test_rig.yaml"), "belt": _file("belt/paper_belt.yaml"), "model": {"name": "strip"}}
config |= {"tension": {"from": 5.0, "to": 60.0}, "travel": 1.0}
config |= {"at": [0.1 * k for k in range(1, 11)], "part": 4096, "workers": 1}
for cases in (3 * 4096, 60 * 4096):
    write_map(Path(sys.argv[1]) / str(cases), case_map(config | {"cases": cases}), {}, lambda n: None)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def test_memory_does_not_grow_with_the_number_of_cases(tmp_path):
    done = subprocess.run([sys.executable, "-c", MEMORY, str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    few, many = (float(line) for line in done.stdout.split())
    table = 57 * 4096 * 52 * 8 / 2**20  # MiB that the further cases have
    assert table > 90
    assert many - few < 0.25 * table
