"""The controller of docs/controller.md on the 3D belt: ``python -m studies.closed_loop``.

The tail pulley stands askew by an unknown angle from travel 0 on; the controller sees y1 alone and turns the pulley.
Beside it what the linear plant says of the same loop.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import belt_sim as bs
from belt_sim.io import write_with
from belt_sim.settings import make_case
from belt_sim.show.terminal import ProgressObserver
from belt_sim.space.native import NativeState, SpaceRun
from belt_sim.space.options import Options, fit_options
from belt_sim.units import DEGREE, MM
from studies.application import application


@dataclass
class Lead:
    """u = -gain (1 + lead s)/(1 + lag s) y1, s in 1/m of travel; gain [rad/m], lead and lag [m]."""

    gain: float
    lead: float
    lag: float
    travel: float = 0.0
    slow: float = 0.0
    zero: float | None = None

    def angle(self, travel: float, y1: float) -> float:
        """Yaw [rad] that it adds at ``travel`` [m], from y1 [m] there."""
        self.zero = y1 if self.zero is None else self.zero
        off, ratio = y1 - self.zero, self.lead / self.lag
        self.slow += (off - self.slow) * -np.expm1(-(travel - self.travel) / self.lag)
        self.travel = travel
        return -self.gain * (ratio * off - (ratio - 1.0) * self.slow)


def in_space(config: dict[str, Any]) -> dict[str, np.ndarray]:
    """travel [m], y1 [mm], y3 [mm] and the controller's yaw [deg] of the loop closed on the 3D belt."""
    case = make_case(tension=config["tension"], yaw=config["askew"], travel=config["travel"])
    run = SpaceRun(case, "flex", fit_options(Options(), case, "flex"))
    steering: list[tuple[float, float]] = []
    controller = Lead(config["gain"], config["lead"], config["lag"])

    def steer(state: NativeState) -> float:
        steering.append((float(state.instant[0]), controller.angle(float(state.instant[0]), float(state.readings[0]))))
        return steering[-1][1]

    curves = run.go(config["travel"], (ProgressObserver("closed loop"),), steer)
    at, angle = np.array(steering).T
    yaw = np.interp(np.asarray(curves.travel), at, angle) / DEGREE
    return {"travel_m": curves.travel, "y1_mm": curves.y[0] / MM, "y3_mm": curves.y[2] / MM, "yaw_deg": yaw}


def linear(config: dict[str, Any], travel: np.ndarray) -> np.ndarray:
    """y1 [mm] of the same loop by the linear plant at ``travel`` [m]."""
    import control

    from belt_sim.linear.plant import LinearBelt

    s, speed = control.tf("s"), 0.5
    plant = bs.linearise(model="strip", tension=config["tension"], speed=speed)
    assert isinstance(plant, LinearBelt)
    steer = config["gain"] * (1 + config["lead"] / speed * s) / (1 + config["lag"] / speed * s)
    loop = control.feedback(plant.to_control(order=6)[0, 0], steer)
    t = np.linspace(0.0, config["travel"] / speed, 6001)
    _, y = control.step_response(loop, t)
    return np.interp(travel, t * speed, y) * config["askew"] * DEGREE / MM


def closed_loop(config: dict[str, Any]) -> None:
    """Both, as a table of travels and a csv."""
    found = in_space(config)
    law = linear(config, found["travel_m"])
    table = np.column_stack([*found.values(), law])
    header = ",".join([*found, "y1_linear_mm"])
    write_with(Path(config["out"]), lambda p: np.savetxt(p, table, "%.6g", ",", header=header, comments=""))
    for at in config["at"]:
        row = [
            float(np.interp(at, found["travel_m"], v)) for v in (found["y1_mm"], law, found["y3_mm"], found["yaw_deg"])
        ]
        print(
            f"{at:5g} m: y1 {row[0]:+.4f} mm (linear plant {row[1]:+.4f}), y3 {row[2]:+.4f} mm, yaw {row[3]:+.5f} deg"
        )
    print(f"at most {np.abs(found['y1_mm'] - law).max():.4f} mm apart, of {np.abs(law).max():.4f} mm")


if __name__ == "__main__":
    application("closed_loop", closed_loop)
