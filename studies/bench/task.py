"""The task that the contenders share: 100 m of travel after a yaw step, four curves kept every 0.1 m."""

from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case
from belt_sim.jax_setup import in_float64
from belt_sim.line.march import march_case
from belt_sim.line.span import response
from belt_sim.model import AnalyticModel as Model
from belt_sim.model import analytic_model
from belt_sim.units import DEGREE, N_PER_MM2

TRAVEL = 100.0  # [m]
KEEP = 0.1  # [m]
FINE = 0.0125  # [m], step of the march that stands for the truth: its own error is some 1e-6
TENSIONS = np.linspace(4.0, 100.0, 100) * N_PER_MM2
YAWS = np.linspace(-0.1, 0.1, 100) * DEGREE
START = 10  # record at 1 m of travel, where first-order stepping is at its worst


@dataclass(frozen=True)
class Linear:
    """A case as six numbers: curvature per unit of y_u - y_o, theta_o, theta_u; yaw [rad]; wrapped arc [m]."""

    ky: float
    ko: float
    ku: float
    yaw: float
    wrap: float


def strip() -> Model:
    """The model that all contenders compute."""
    return analytic_model("strip")


@in_float64
def linear(case: Case) -> Linear:
    """What a plain program needs to know of a case."""
    ky, ko, ku = (float(x) for x in response(strip().span(case)).runup[:3])
    return Linear(ky=ky, ko=ko, ku=ku, yaw=float(case.settings.yaw.last()), wrap=float(case.rig.wrap_tail))


def truth(case: Case) -> np.ndarray:
    """y (4, n) of a march in fine steps [m]."""
    return march_case(case, strip(), travel=TRAVEL, step=FINE, keep=KEEP).y


def errors(y: np.ndarray, fine: np.ndarray) -> dict[str, float]:
    """Of all four points over all travel, against the largest |y|; and of point 1 at 1 m, against itself."""
    return {
        "largest": float(np.abs(y - fine).max() / np.abs(fine).max()),
        "at_1_m": float(abs(y[0, START] / fine[0, START] - 1.0)),
    }
