"""The 3D belt over tension x yaw in one batch: ``python -m studies.mjx_map FILE.csv [cases a side] [travel]``.

A row a case: late rates of the points, overshoot and retreat of point 1; and how long the batch took.
"""

import sys
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np

from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import late_rates
from belt_sim.errors import RunFailed
from belt_sim.paper import PAPER_BELT, TEST_RIG
from belt_sim.rig import Belt, Rig
from belt_sim.si import DEGREE, MM, MM_PER_M, N_PER_MM2

HEADER = "tension_n_per_mm2,yaw_deg,rate1,rate2,rate3,rate4,y1_3m_mm,y1_10m_mm,y1_end_mm,most_mm,retreat_mm,worst_um"


def cases_of(rig: Rig, belt: Belt, tensions: np.ndarray, yaws: np.ndarray) -> list[Case]:
    """Every tension [N/mm2] with every yaw step [deg] of the tail pulley."""
    return [
        Case(rig=rig, belt=belt, settings=Settings(tension=t * N_PER_MM2, yaw=Schedule.step(y * DEGREE)))
        for t in tensions
        for y in yaws
    ]


def row(case: Case, curves: Any) -> str:
    """One line of the table; rates in mm/m."""
    tension, yaw = float(case.settings.tension) / N_PER_MM2, float(np.sum(case.settings.yaw.change)) / DEGREE
    if isinstance(curves, RunFailed):
        return f"{tension:g},{yaw:g}" + "," * 10
    y1 = curves.y[0] / MM
    at = [float(np.interp(s, curves.travel, y1)) for s in (3.0, 10.0, curves.travel[-1])]
    ahead = y1 * np.sign(y1[len(y1) // 10])
    highest = np.maximum.accumulate(ahead)
    values = [*(late_rates(curves) / MM_PER_M), *at, float(ahead.max()), float((highest - ahead).max())]
    return f"{tension:g},{yaw:g}," + ",".join(f"{v:.6g}" for v in (*values, 1e6 * curves.extra["correction"].max()))


def mjx_map(rig: Rig, belt: Belt, tensions: np.ndarray, yaws: np.ndarray, travel: float, chunk: int, out: Path) -> None:
    """Run all and write ``out``; prints the time and the memory that the device used at most."""
    from belt_sim.mjx.run import simulate_batch

    cases, begun = cases_of(rig, belt, tensions, yaws), time.perf_counter()
    found = simulate_batch(cases, travel=travel, chunk=chunk)
    wall = time.perf_counter() - begun
    out.write_text("\n".join([HEADER, *(row(c, f) for c, f in zip(cases, found, strict=True))]) + "\n")
    failed = sum(isinstance(f, RunFailed) for f in found)
    memory = (jax.devices()[0].memory_stats() or {}).get("peak_bytes_in_use", 0) / 1e9
    print(f"{len(cases)} cases of {travel:g} m on {jax.devices()[0]}: {wall:.1f} s, {failed} failed, {memory:.2f} GB")


if __name__ == "__main__":
    side, far = (int(sys.argv[2]) if len(sys.argv) > 2 else 16), (float(sys.argv[3]) if len(sys.argv) > 3 else 60.0)
    steps = -0.042 * np.arange(1, side + 1) / side
    mjx_map(TEST_RIG, PAPER_BELT, np.geomspace(5.0, 60.0, side), steps, far, 256, Path(sys.argv[1]))
