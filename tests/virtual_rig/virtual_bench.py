"""The paper's test rig for these tests: readings without noise."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np

from belt_sim.units import DEGREE, MM_PER_M, N_PER_MM2
from belt_sim.virtual_rig import march
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, RunSetting

YAW = 0.042 * DEGREE
SPAN, RADIUS = 11.28, 0.17
ARC = np.pi * RADIUS
ALL_POINTS = {f"y{k}": f"point_{k}" for k in (1, 2, 3, 4)}


def plan_of(*settings: RunSetting, length: float = 60.0, spacing: float = 0.25) -> Plan:
    """A plan that reads all four points."""
    return Plan(runs=settings, length=length, spacing=spacing, signals=ALL_POINTS)


@contextmanager
def steps_a_wrap(steps: int) -> Iterator[None]:
    """March in so many steps a wrap."""
    usual, march.STEPS_A_WRAP = march.STEPS_A_WRAP, steps
    try:
        yield
    finally:
        march.STEPS_A_WRAP = usual


@cache
def measured(*faults, base="beam_th2", length=60.0, spacing=0.25, steps=0, **setting) -> tuple[np.ndarray, np.ndarray]:
    """Travel (n,) [m] and noise-free readings of points 1-4, shape (4, n) [m], of one run.

    steps: of the march in a wrap; by default as usual, and one for runs of 100 m and more, of which tests read rates
    (0.3 um of the 10 mm that the belt moves in 60 m).
    """
    setting = {"tension": 40 * N_PER_MM2, "yaw": YAW} | setting
    plan = plan_of(RunSetting(**setting), length=length, spacing=spacing)
    with steps_a_wrap(steps or (1 if length >= 100.0 else march.STEPS_A_WRAP)):
        y = observe(plan, true_line(plan, base, TrueErrors()), faults)[:, :, 0]
    y.setflags(write=False)  # others read the same
    return plan.travel, y


def late_rate(travel: np.ndarray, y: np.ndarray, over: float) -> float:
    """Mean drift of the four points over the last ``over`` metres [mm per m]."""
    first = np.searchsorted(travel, travel[-1] - over)
    return float(np.mean(y[:, -1] - y[:, first]) / (travel[-1] - travel[first]) / MM_PER_M)
