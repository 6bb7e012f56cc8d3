"""A sweep that is killed at any moment takes up where it was: only what is missing is run, nothing is half-written."""

import json
import random
import signal
import subprocess
import sys
import time

import pandas as pd
import pytest

from belt_sim.io import ROOT, clear_drafts

TENSIONS = tuple(range(10, 34, 2))
RECORDS = 21  # 2 m, every 0.1 m
IMPOSSIBLE = 2000  # N/mm2
PATIENCE = 300.0  # s


def start(folder) -> subprocess.Popen:
    tensions = ",".join(str(t) for t in (IMPOSSIBLE, *TENSIONS))
    command = [sys.executable, "-m", "belt_sim", "simulate", "-m", f"tension={tensions}", "model=rope"]
    command += ["travel=2", "pictures=false", f"hydra.sweep.dir={folder}"]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finished(folder) -> dict:
    """Summary of each case -> what tells whether its results were written again."""
    return {p: (p.parent / "curves.csv").stat().st_ino for p in folder.glob("*/summary.json")}


def kill_after(folder, cases: int, then: float) -> None:
    """Start the sweep and kill it ``then`` seconds after it has done so many cases."""
    process, limit = start(folder), time.monotonic() + PATIENCE
    while len(finished(folder)) < cases and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.005)
    time.sleep(then)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert process.returncode == -signal.SIGKILL, "it had come to its end before it was killed"


def test_killed_at_a_random_moment_and_run_again(tmp_path):
    moments = random.Random(9)
    kill_after(tmp_path, cases=moments.randint(1, 2), then=moments.uniform(0.0, 0.1))
    done = finished(tmp_path)
    for path in done:
        assert json.loads(path.read_text(encoding="utf-8"))["travel_m"] == 2.0
        assert len((path.parent / "curves.csv").read_text(encoding="utf-8").splitlines()) == 1 + RECORDS
    assert 0 < len(done) < len(TENSIONS)
    last = start(tmp_path)
    out, err = last.communicate(timeout=PATIENCE)
    assert last.returncode == 1, err  # for the impossible case
    now = finished(tmp_path)
    assert {p: now[p] for p in done} == done
    assert out.count("done before, kept") == len(done)
    assert sorted(json.loads(p.read_text(encoding="utf-8"))["tension_n_per_mm2"] for p in now) == list(TENSIONS)
    assert not [p for p in tmp_path.rglob(".*") if p.is_file()]
    table = pd.read_csv(tmp_path / "sweep.csv")
    assert len(table) == len(TENSIONS) + 1
    failed = table[table["failed"].notna()]
    assert failed["run"].str.contains(f"tension={IMPOSSIBLE}").tolist() == [True]
    assert failed["failed"].item().startswith(f"tension = {IMPOSSIBLE} N/mm2")


def test_killed_while_it_writes(tmp_path):
    target = tmp_path / "summary.json"
    program = (
        "import os, signal; from pathlib import Path; from belt_sim.io import write_with\n"
        f"write_with(Path({str(target)!r}), lambda p: (p.write_text('{{half'), os.kill(os.getpid(), signal.SIGKILL)))"
    )
    killed = subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False)
    assert killed.returncode == -signal.SIGKILL
    assert len(list(tmp_path.iterdir())) == 1  # the half that was written, under another name
    (tmp_path / ".keep").touch()
    clear_drafts(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == [".keep"]


@pytest.mark.parametrize("launcher", [(), ("hydra/launcher=joblib", "hydra.launcher.n_jobs=2")])
def test_a_case_that_fails_is_listed_and_stops_nothing(belt, launcher):
    answer = belt("simulate", "-m", "tension=2000,30,40", "model=rope", "travel=2", "pictures=false", *launcher)
    assert answer.status == 1
    assert "3 runs, 1 of them failed" in answer.out
    table = pd.read_csv(belt.folder / "sweep.csv").set_index("run")
    assert table["failed"].notna().sum() == 1
    assert table["rate1_mm_per_m"].notna().sum() == 2
