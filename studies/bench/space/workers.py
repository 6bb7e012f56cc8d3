"""Four 3D cases by one worker and by two, as a user runs them: Hydra sweeps, the second with hydra/launcher=joblib."""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from belt_sim.io import ROOT

TENSIONS = "60,61,62,63"  # N/mm2
CASES = 4
TRAVEL = 3.0  # [m] each
TWO = ("hydra/launcher=joblib", "hydra.launcher.n_jobs=2")
WANTED = 1.8


def workers_figures() -> dict[str, Any]:
    """Seconds of both sweeps, their ratio, and how much of a core other programs took meanwhile.

    cpu_ratio: what the ratio of wall times would be on two cores of one's own, 2 x CPU seconds of one worker / of two;
    start-up of the workers and contention for memory are in it, waiting at the end of the sweep is not.
    """
    one, two = _sweep(), _sweep(*TWO)
    return {
        "cases": CASES,
        "travel_m": TRAVEL,
        "one_worker": one,
        "two_workers": two,
        "ratio": one["wall_s"] / two["wall_s"],
        "cpu_ratio": 2.0 * one["cpu_s"] / two["cpu_s"],
    }


def _sweep(*more: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["model=mujoco_flex", "rig=rope_example", f"tension={TENSIONS}", f"travel={TRAVEL}"]
        arguments += ["pictures=false", f"hydra.sweep.dir={folder}", *more]
        command = [sys.executable, "-c", "from belt_sim.cli import main; main()", "simulate", "-m", *arguments]
        busy, cpu, wall = _machine_busy(), _children_cpu(), time.perf_counter()
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
        wall, cpu = time.perf_counter() - wall, _children_cpu() - cpu
        others = max((_machine_busy() - busy - cpu) / wall, 0.0) if busy else None
        found = len(list(Path(folder).glob("*/summary.json")))
    if found != CASES:
        raise RuntimeError(f"the sweep left {found} of {CASES} runs")
    return {"wall_s": wall, "cpu_s": cpu, "cores_taken_by_others": others}


def _children_cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _machine_busy() -> float:
    """CPU seconds that all programs have used since the machine was started; 0 where Linux does not tell."""
    try:
        first = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0]
    except OSError:
        return 0.0
    user, nice, system = (float(n) for n in first.split()[1:4])
    return (user + nice + system) / os.sysconf("SC_CLK_TCK")
