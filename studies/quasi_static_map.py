"""The 3D belt over tension x yaw (x friction): ``python -m studies.quasi_static_map FILE.csv [side] [travel] [mu ..]``.

side: tensions, and as many yaws; friction: inf, as it is by itself, is a belt that sticks. A row a case: late rates of
the points, overshoot and retreat of point 1; and how long it took.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.curves import late_rates
from belt_sim.errors import SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import prepare
from belt_sim.scene_parts import SceneParts
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2
from studies.paper.case import PAPER_BELT, TEST_RIG

HEADER = "tension_n_per_mm2,yaw_deg,rate1,rate2,rate3,rate4,y1_3m_mm,y1_10m_mm,y1_end_mm,most_mm,retreat_mm,worst_um"
HEADER += ",friction"


def cases_of(rig: Rig, belt: Belt, tensions: np.ndarray, yaws: np.ndarray) -> list[Case]:
    """Every tension [N/mm2] with every yaw step [deg] of the tail pulley."""
    return [
        Case(rig=rig, belt=belt, settings=Settings(tension=t * N_PER_MM2, yaw=Schedule.step(y * DEGREE)))
        for t in tensions
        for y in yaws
    ]


def row(case: Case, curves: Any, friction: float) -> str:
    """One line of the table; rates in mm/m."""
    tension, yaw = float(case.settings.tension) / N_PER_MM2, float(np.sum(case.settings.yaw.change)) / DEGREE
    if isinstance(curves, SimulationError):
        return f"{tension:g},{yaw:g}" + "," * 11 + f"{friction:g}"
    y1 = curves.y[0] / MM
    at = [float(np.interp(s, curves.travel, y1)) for s in (3.0, 10.0, curves.travel[-1])]
    ahead = y1 * np.sign(y1[len(y1) // 10])
    highest = np.maximum.accumulate(ahead)
    values = [*(late_rates(curves) / MM_PER_M), *at, float(ahead.max()), float((highest - ahead).max())]
    return f"{tension:g},{yaw:g}," + ",".join(
        f"{v:.6g}" for v in (*values, 1e6 * curves.extra["correction"].max(), friction)
    )


def quasi_static_map(cases: Sequence[Case], frictions: Sequence[float], travel: float, out: Path) -> None:
    """Run every case with every friction and write ``out``; prints the time and the device's memory used at most."""
    from belt_sim.space.quasi_static import simulate_batch

    begun, lines, failed = time.perf_counter(), [HEADER], 0
    for friction in frictions:  # belts that stick make a batch of their own: it is cheaper
        parts = [SceneParts.from_case(case, friction) for case in cases]
        found = simulate_batch(cases, travel=travel, parts=parts)
        lines += [row(c, f, friction) for c, f in zip(cases, found, strict=True)]
        failed += sum(isinstance(f, SimulationError) for f in found)
    wall = time.perf_counter() - begun
    write_text(out, "\n".join(lines) + "\n")
    memory = (jax.devices()[0].memory_stats() or {}).get("peak_bytes_in_use", 0) / 1e9
    count, device = len(lines) - 1, jax.devices()[0]
    print(f"{count} cases of {travel:g} m on {device}: {wall:.1f} s, {failed} failed, {memory:.2f} GB")


if __name__ == "__main__":
    side, far = (int(sys.argv[2]) if len(sys.argv) > 2 else 16), (float(sys.argv[3]) if len(sys.argv) > 3 else 60.0)
    steps = -0.042 * np.arange(1, side + 1) / side
    asked = cases_of(TEST_RIG, PAPER_BELT, np.geomspace(5.0, 60.0, side), steps)
    prepare(space=True)
    quasi_static_map(asked, [float(f) for f in sys.argv[4:]] or [np.inf], far, Path(sys.argv[1]))
