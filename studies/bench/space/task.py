"""The two belts that are measured: the short rig over 25 m, the full test rig over 60 m."""

from dataclasses import dataclass

import numpy as np

from belt_sim.case import Case, Rig
from belt_sim.curves import Curves, late_rates
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.native import SpaceRun
from belt_sim.space.options import STEP, fit_options
from belt_sim.units import N_PER_MM2
from studies.paper.case import ROPE_EXAMPLE, TEST_RIG, paper_case


@dataclass(frozen=True)
class Task:
    """rig; tension [N/mm2]; travel [m] of the whole run; limit [s]: what it may cost on one core."""

    rig: Rig
    tension: float
    travel: float
    limit: float

    def case(self) -> Case:
        """The paper's belt after a yaw step at travel 0."""
        return paper_case(self.tension * N_PER_MM2, rig=self.rig)

    def begin(self, dt: float = STEP) -> tuple[SpaceRun, Options]:
        """The membrane laid on its pulleys, ready to go, and its resolved options; dt [s]."""
        case = self.case()
        options = fit_options(Options(dt=dt), case, "flex")
        return SpaceRun(case, "flex", options), options


SHORT = Task(rig=ROPE_EXAMPLE, tension=60.0, travel=25.0, limit=30.0)
FULL = Task(rig=TEST_RIG, tension=40.0, travel=60.0, limit=600.0)
TASKS = {"short": SHORT, "full": FULL}


def off_the_law(task: Task, curves: Curves) -> float:
    """Largest relative deviation of the late rates of points 1-4 from the strip law's over the same travel."""
    law = late_rates(march_case(task.case(), analytic_model("strip"), travel=float(curves.travel[-1])))
    return float(np.abs(late_rates(curves) / law - 1.0).max())
