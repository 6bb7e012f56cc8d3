"""Sweeps of 3D belts on JAX: cases of a mesh at once or shared over workers, and never lost when they are killed."""

import json
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from belt_sim.api import simulate as module
from belt_sim.io import ROOT
from belt_sim.space import quasi_static

COARSE = (
    "rig=rope_example",
    "model=mujoco_flex",
    "engine=quasi_static",
    "model.dx=0.04",
    "model.steps=4",
    "model.run_in=0.1",
)
ASKED = ("-m", *COARSE, "travel=0.3", "pictures=false")
RECORDS = 14  # 0.3 m, every 25 mm, and as far beyond it as a row reaches
IMPOSSIBLE = 2000  # N/mm2
KILLS = 3
PATIENCE = 300.0  # s


def results(folder) -> dict:
    """Summary of each case -> what tells whether its results were written again."""
    return {p: (p.parent / "curves.csv").stat().st_ino for p in folder.glob("*/summary.json")}


def check(folder, tensions) -> None:
    """All cases have their files, the impossible one is listed, nothing is half-written."""
    found = results(folder)
    assert sorted(json.loads(p.read_text(encoding="utf-8"))["tension_n_per_mm2"] for p in found) == list(tensions)
    for path in found:
        assert {"summary.json", "curves.csv"} <= {p.name for p in path.parent.iterdir()}
        assert len((path.parent / "curves.csv").read_text(encoding="utf-8").splitlines()) == 1 + RECORDS
    assert not [p for p in folder.glob("*/.*") if p.is_file()]
    table = pd.read_csv(folder / "sweep.csv")
    assert len(table) == len(tensions) + 1
    assert table["failed"].notna().sum() == 1


def test_cases_at_once_leave_their_files_and_only_missing_ones_run(belt):
    rope = (*(a for a in ASKED if a != "model=mujoco_flex"), "model=mujoco_rope")  # as in tests/space/test_limp.py
    first = belt("simulate", *rope, "tension=40,60", "hydra.launcher.batch=2")
    assert first.status == 0, first.err
    assert "2 cases at once" in first.out
    done = results(belt.folder)
    more = belt("simulate", *rope, f"tension=40,{IMPOSSIBLE},50,55,60", "hydra.launcher.batch=2")
    assert more.status == 1, more.err
    assert more.out.count("done before, kept") == 2
    check(belt.folder, [40, 50, 55, 60])
    now = results(belt.folder)
    assert {p: now[p] for p in done} == done
    y = [np.loadtxt(p.parent / "curves.csv", delimiter=",", skiprows=1)[-1, 1] for p in sorted(now)]
    assert len(set(y)) == 4  # each has its own curves ...
    assert np.ptp(y) < 0.02 * abs(np.mean(y))  # ... of belts that differ by little


def test_unlike_meshes_are_batches_of_their_own(monkeypatch):
    seen = []

    def recorded(ready, batch, observers):
        seen.append([float(r.case.settings.tension) / 1e6 for r in ready])
        yield from ([r.stations] for r in ready)

    monkeypatch.setattr(quasi_static, "QUASI_STATIC", replace(quasi_static.QUASI_STATIC, in_batches=recorded))
    fine = {"model": {"name": "mujoco_flex", "dx": 0.03}}
    kinds = [{}, fine, {}, fine, {"model": {"name": "mujoco_flex", "control": True}}, {"tension": IMPOSSIBLE}]
    base = {
        "rig": "rope_example",
        "belt": "paper_belt",
        "model": {"name": "mujoco_flex", "dx": 0.04},
        "engine": "quasi_static",
        "travel": 0.3,
    }
    base |= {"watch": None, "effects": None, "yaw": -0.042, "yaw_head": 0.0, "speed": 0.5, "direction": 1}
    found = list(module.run_in_batches([{**base, "tension": 40 + k, **c} for k, c in enumerate(kinds)], None))
    assert found[0] == ([4, 5], [None, None])  # their own runs say why
    assert seen == [[40, 42], [41, 43]]
    assert sorted(k for numbers, _ in found for k in numbers) == list(range(6))
    by_case = {k: c.curves for numbers, curves in found[1:] for k, c in zip(numbers, curves, strict=True)}
    assert by_case[0] == by_case[2] < by_case[1] == by_case[3]  # stations


@pytest.mark.long
def test_every_case_of_a_watched_batch_is_recorded(belt):
    """At once, and each with a recording of its own."""
    watched = ("-m", *COARSE[:2], "engine=mjx", "model.dx=0.04", "model.dt=1.5e-3", "model.run_in=0.1", "travel=0.3")
    quick = ("model.settle=0.05", "pictures=false", "watch=rrd", "hydra.launcher.batch=2")
    found = belt("simulate", *watched, *quick, "tension=40,60")
    assert found.status == 0, found.err
    assert "2 cases at once" in found.out
    recordings = sorted(belt.folder.glob("*/*.rrd"))
    assert len(recordings) == 2
    assert all(path.stat().st_size > 10_000 for path in recordings)
    assert len({path.read_bytes() for path in recordings}) == 2


@pytest.mark.parametrize("asked", ["batch=many", "workers=0"])
def test_what_is_no_number_of_cases_is_said_in_a_line(belt, asked):
    answer = belt("simulate", *ASKED, "tension=40,60", f"hydra.launcher.{asked}")
    assert answer.status == 1
    assert answer.err.startswith(f"belt-sim: hydra.launcher.{asked.split('=')[0]} = ")
    assert len(answer.err.splitlines()) == 1


@pytest.mark.long
@pytest.mark.parametrize("how", ["batch=2", "workers=2"])
def test_killed_at_random_moments_and_run_again(tmp_path, how):
    tensions = list(range(40, 64, 2))

    def start() -> subprocess.Popen:
        cases = ",".join(str(t) for t in (IMPOSSIBLE, *tensions))
        command = [sys.executable, "-m", "belt_sim", "simulate", *ASKED, f"tension={cases}", f"hydra.launcher.{how}"]
        command.append(f"hydra.sweep.dir={tmp_path}")
        return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    moments, done = random.Random(9), {}
    for _ in range(KILLS):
        process, goal, limit = start(), len(done) + moments.randint(0, 2), time.monotonic() + PATIENCE
        while len(results(tmp_path)) < goal and process.poll() is None and time.monotonic() < limit:
            time.sleep(0.005)
        time.sleep(moments.uniform(0.0, 0.3))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        assert process.returncode == -signal.SIGKILL, "it had come to its end before it was killed"
        now = results(tmp_path)
        assert {p: now[p] for p in done} == done  # what was done is not done again
        done = now
    assert 0 < len(done) < len(tensions)
    time.sleep(1.0)  # workers see that their parent has gone
    done = results(tmp_path)
    last = start()
    out, err = last.communicate(timeout=PATIENCE)
    assert last.returncode == 1, err  # for the impossible case
    assert out.count("done before, kept") == len(done)
    now = results(tmp_path)
    assert {p: now[p] for p in done} == done
    check(tmp_path, tensions)
