"""The controllers of docs/controller.md on the linear plant: ``python -m studies.controller folder=docs/images``.

A lead at point 1, and an LQG controller (steady Kalman filter and state feedback) at point 4, which a belt with
sensors at the head pulley only must use. Both get a sensor delay, noise, a limit and backlash of the drive.
"""

from pathlib import Path
from typing import Any

import control
import numpy as np
from scipy.linalg import solve_continuous_are

import belt_sim as bs
from belt_sim.linear.plant import LinearBelt, state_space
from belt_sim.units import DEGREE, MM
from studies.application import application

REAL: dict[str, Any] = {  # a machine: 5 mm off, tail pulley askew by 0.01 deg, drive of 0.1 deg
    "y_start": 5 * MM, "askew": 0.01 * DEGREE, "limits": 0.1 * DEGREE, "backlash": 0.002 * DEGREE,
    "noise": 0.02 * MM, "delay": 0.2, "travel": 240.0,
}  # fmt: skip
DRIFT, NOISE = 2e-5, 1e-4  # [m/sqrt(s)] and [m sqrt(s)]: what the Kalman filter takes for drift and sensor noise
YAW_FOR_Y = 0.15 * DEGREE / (5 * MM)  # [rad/m]: yaw that is worth so much of y in the LQG's criterion


def lead() -> Any:
    """0.2 rad/m, or 0.011 deg for each mm off, with a lead from 0.1 to 1 rad/s."""
    s = control.tf("s")
    return 0.2 * (1 + 10 * s) / (1 + s)


def lqg(plant: LinearBelt, point: int) -> Any:
    """Yaw from the error at ``point``: x' = (A - B K - L C) x - L e, yaw = K x, by two Riccati equations."""
    space = state_space(plant, order=2)
    a, b, c = space.a, space.b[:, :1], space.c[point - 1 : point]
    pushed = np.zeros((len(a), 1))
    pushed[0] = DRIFT
    noise = np.array([[NOISE**2]])
    cost = solve_continuous_are(a, b, c.T @ c, np.array([[1.0 / YAW_FOR_Y**2]]))
    spread = solve_continuous_are(a.T, c.T, pushed @ pushed.T + 1e-18 * np.eye(len(a)), noise)
    feedback, gain = YAW_FOR_Y**2 * b.T @ cost, spread @ c.T / NOISE**2
    return control.ss(a - b @ feedback - gain @ c, gain, feedback, 0.0)


def controller(config: dict[str, Any]) -> None:
    """Print the table of margins, and draw both loops at one tension."""
    schedule: Any = bs.linearise(model="strip_lift_off", tension=[7, 10, 14, 20, 40], speed=config["speed"])
    print("| N/mm2 | controller | phase margin deg | gain margin | further delay s | nearest to -1 | largest yaw deg |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    design = schedule.plant_at(config["tension"])
    for tension in config["tensions"]:
        plant = schedule.plant_at(tension)
        for name, steer, point in (("lead, point 1", lead(), 1), ("LQG, point 4", lqg(design, 4), 4)):
            loop = bs.close_loop(plant, steer, point=point, **REAL)
            m = loop.margins
            assert m is not None
            print(
                f"| {tension:g} | {name} | {np.rad2deg(m.phase_margin):.0f} | {m.gain_margin:.3g} | "
                f"{m.delay_margin:.2g} | {m.nearest:.2f} | {np.abs(loop.yaw).max() / DEGREE:.3f} |"
            )
            if tension == config["tension"] and config["folder"]:
                print(loop.plot(Path(config["folder"]) / f"controller_{name.split(',')[0].lower()}.png"))


if __name__ == "__main__":
    application("controller", controller)
