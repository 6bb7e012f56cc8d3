"""One 3D run or a piece of one, in a process of its own: ``python -m studies.bench.space.piece short 25 [dt]``."""

import json
import resource
import sys
import time
from typing import Any

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, Frame, late_rates
from belt_sim.jax_setup import prepare
from belt_sim.space.options import STEP
from belt_sim.units import MM_PER_M
from studies.bench.space.task import TASKS, Task, off_the_law

STEADY_SHARE = 0.25  # the last part of a run, at full speed, that gives steps a metre and time a step


class Marks:
    """Observer: (travel [m], steps, CPU [s], Newton iterations of the last step) at every frame."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, float, float, float]] = []
        self.data: mujoco.MjData | None = None

    def start(self, case: Case, travel: float) -> None:
        """Nothing to do before the run."""

    def frame(self, frame: Frame) -> None:
        """Read the clock."""
        iterations = float(np.max(self.data.solver_niter)) if self.data is not None else 0.0
        self.rows.append((frame.travel, frame.scalars["steps"], time.process_time(), iterations))

    def finish(self, curves: Curves) -> None:
        """Nothing to do after it."""


def measure(task: Task, travel: float, dt: float = STEP) -> dict[str, Any]:
    """Cost of the first ``travel`` [m] of a task with steps of ``dt`` [s], and what the whole would cost.

    cpu_s: measured, building the scene included; whole_cpu_s: with the rest of the travel at the pace of the last
    STEADY_SHARE of what was run; late rates only of whole runs.
    """
    begun, marks = time.process_time(), Marks()
    run, options = task.begin(dt)
    marks.data = run.solver.data
    curves = run.go(travel, (marks,))
    cpu = time.process_time() - begun
    at, steps, clock, iterations = np.array(marks.rows).T
    late = at >= at[-1] - STEADY_SHARE * travel
    metres, made, spent = (float(np.ptp(v[late])) for v in (at, steps, clock))
    figures = {
        "travel_m": travel,
        "dt_s": options.dt,
        "belt_speed_m_per_s": options.run_speed,
        "nodes": int(run.scene.mesh.stations * run.scene.mesh.lines),
        "steps": float(curves.extra["steps"][-1]) if curves.extra else 0.0,
        "cpu_s": cpu,
        "ms_per_step": 1e3 * spent / made,
        "steps_per_m": made / metres,
        "cpu_s_per_m": spent / metres,
        "newton_iterations": float(iterations.mean()),
        "memory_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "whole_travel_m": task.travel,
        "whole_cpu_s": cpu + (task.travel - travel) * spent / metres,
    }
    if travel < task.travel:
        return figures
    rates = [float(r) / MM_PER_M for r in late_rates(curves)]
    return figures | {"late_rates_mm_per_m": rates, "off_the_strip_law": off_the_law(task, curves)}


if __name__ == "__main__":  # the figures as one line of JSON
    prepare()
    name, travel, *dt = sys.argv[1:]
    print(json.dumps(measure(TASKS[name], float(travel), *map(float, dt))))
