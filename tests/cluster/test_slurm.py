"""Forty cases on Slurm: a job is killed and the node drained while they run, nothing is lost for good.

``make test-cluster`` starts Debian's Slurm on this machine (tests/cluster/slurm.sh), runs this and stops it.
"""

import shutil
import subprocess
import sys
import time

import pandas as pd
import pytest

from belt_sim.io import ROOT

CASES = 40
PATIENCE = 1500.0  # s


def slurm(*command: str) -> list[str]:
    """Lines that a command of Slurm prints."""
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.split()


@pytest.fixture
def node() -> str:
    if not shutil.which("sinfo"):
        pytest.skip("there is no Slurm here: tests/cluster/slurm.sh start (root, Debian) starts one")
    try:
        return slurm("sinfo", "-h", "-N", "-o", "%N")[0]
    except subprocess.CalledProcessError as error:
        pytest.skip(f"Slurm does not answer ({error.stderr.strip()}): tests/cluster/slurm.sh start")


def sweep(folder) -> subprocess.Popen:
    tensions = ",".join(f"{10 + 0.3 * k:.1f}" for k in range(CASES))
    command = [sys.executable, "-m", "belt_sim", "simulate", "-m", f"tension={tensions}", "travel=5", "pictures=false"]
    command += ["hydra/launcher=submitit_slurm", f"hydra.sweep.dir={folder}"]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finished(folder) -> dict:
    return {p: (p.parent / "curves.csv").stat().st_ino for p in folder.glob("*/summary.json")}


def until(true) -> None:
    """Wait for ``true()``."""
    limit = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < limit
        time.sleep(0.2)


def running() -> set[str]:
    return set(slurm("squeue", "-h", "-r", "-t", "R", "-o", "%i"))


def kill_a_job_that_begins() -> None:
    """SIGKILL for a job that has just begun, so that none of its cases is done."""
    before = running()
    until(lambda: running() - before)
    subprocess.run(["scancel", "--full", "--signal=KILL", sorted(running() - before)[0]], check=True)


def drained_and_resumed(node: str, folder) -> None:
    """The node finishes what it runs and takes nothing new, until it is resumed."""
    subprocess.run(["scontrol", "update", f"nodename={node}", "state=drain", "reason=test"], check=True)
    until(lambda: not running())
    still = finished(folder)
    time.sleep(10.0)
    assert finished(folder) == still
    assert slurm("squeue", "-h", "-r", "-t", "PD", "-o", "%i")
    subprocess.run(["scontrol", "update", f"nodename={node}", "state=resume"], check=True)


@pytest.mark.cluster
def test_a_killed_job_and_a_drained_node(tmp_path, node):
    first = sweep(tmp_path)
    until(lambda: len(finished(tmp_path)) > 4)
    kill_a_job_that_begins()
    drained_and_resumed(node, tmp_path)
    out, err = first.communicate(timeout=PATIENCE)
    assert first.returncode == 1, out
    assert err.splitlines()[-1].startswith("belt-sim: UncompletedJobError")
    until(lambda: not slurm("squeue", "-h", "-r", "-o", "%i"))  # those that were submitted go on
    done = finished(tmp_path)
    assert CASES - 2 <= len(done) < CASES

    again = sweep(tmp_path)
    out, err = again.communicate(timeout=PATIENCE)
    assert again.returncode == 0, err
    now = finished(tmp_path)
    assert {p: now[p] for p in done} == done  # what was done is not done again
    table = pd.read_csv(tmp_path / "sweep.csv")
    assert len(now) == len(table) == CASES
    assert table["rate1_mm_per_m"].notna().all()
