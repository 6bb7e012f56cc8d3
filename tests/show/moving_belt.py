"""A made-up belt that moves sideways on two pulleys: frames and curves with known numbers."""

from dataclasses import replace

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.show import geometry
from studies.paper.case import TEST_RIG, paper_case


def case(centre_distance: float = 11.28, tension: float = 10e6) -> Case:
    """The paper's rig and belt, yaw step at travel 0."""
    return paper_case(tension, rig=replace(TEST_RIG, centre_distance=centre_distance))


def curves(travel: float = 60.0, step: float = 0.1, rate: float = -1.2e-4, tilt: float = 8e-3) -> Curves:
    """Points that swing in and then drift at ``rate`` [m/m]; a tilt that rises to ``tilt`` [rad]."""
    s = np.arange(0.0, travel + 0.5 * step, step)
    rise = 1.0 - np.exp(-s / 6.0)
    lag = np.array([1.0, 0.93, 0.15, 0.05])[:, None]
    swing = np.sin(s / 4.0) * np.exp(-s / 15.0)
    y = rate * s * rise + lag * (-3.2e-3 * rise - 0.9e-3 * swing)
    roll = tilt * rise * (1.0 + 0.3 * swing)
    return Curves(travel=s, y=y, tilt=np.array([roll, -0.7 * roll]), sag=np.array([0.122, 0.122]))


def frames(travel: float = 60.0, every: float = 0.1, centre_distance: float = 11.28):
    """The frames of these curves."""
    return geometry.frames(case(centre_distance), curves(travel), every)
