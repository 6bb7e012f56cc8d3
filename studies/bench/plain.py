"""The plain way: a Python loop over floats, first order at 20 mm."""

import numpy as np

from studies.bench.task import KEEP, TRAVEL, Linear

STEP = 0.02  # [m]


def plain_march(case: Linear) -> np.ndarray:
    """y (4, n) [m] by explicit first-order steps; run-off values of one wrapped arc ago by straight lines."""
    back = int(case.wrap / STEP)
    part = case.wrap / STEP - back
    y1, a1, y3, a3 = ([0.0] * (back + 2) for _ in range(4))
    ky, ko, ku, yaw = case.ky, case.ko, case.ku, case.yaw
    near, far = -1 - back, -2 - back
    steps, every = round(TRAVEL / STEP), round(KEEP / STEP)
    kept = [(0.0, 0.0, 0.0, 0.0)]
    for k in range(1, steps + 1):
        y2, y4 = _interpolate(y1, near, far, part), _interpolate(y3, near, far, part)
        upper = ky * (y1[-1] - y4) + ko * _interpolate(a3, near, far, part) + ku * (yaw + a1[-1])
        lower = ky * (y3[-1] - y2) + ko * (_interpolate(a1, near, far, part) - yaw) + ku * a3[-1]
        y1.append(y1[-1] - STEP * a1[-1])
        y3.append(y3[-1] - STEP * a3[-1])
        a1.append(a1[-1] - STEP * upper)
        a3.append(a3[-1] - STEP * lower)
        if k % every == 0:
            kept.append((y1[-1], _interpolate(y1, near, far, part), y3[-1], _interpolate(y3, near, far, part)))
    return np.array(kept).T


def _interpolate(row: list[float], near: int, far: int, part: float) -> float:
    return (1 - part) * row[near] + part * row[far]
