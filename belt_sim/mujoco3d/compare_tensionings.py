"""The three ways to tension a 3D belt side by side: python -m belt_sim.mujoco3d.compare_tensionings --belt flex ...

Prints a row for each: tension at the upper run-up over the wanted one and place of the tail pulley over the first
metre (mean and standard deviation), sags at travel 0, y of points 1 and 3. --picture draws Koller's procedure.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.frame import Frame
from belt_sim.mujoco3d import simulate
from belt_sim.mujoco3d.options import TENSIONINGS
from belt_sim.mujoco3d.study import options_from, paper_case
from belt_sim.pictures.tensioning import tensioning_picture
from belt_sim.si import MM

_UM = 1e-6
_FIRST = 1.0  # [m] of travel over which tension and place are averaged


class Before:
    """Keeps the frames before travel 0: those of the tensioning."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []

    def start(self, case: Case, travel: float) -> None:
        """Forget the last run."""
        self.frames.clear()

    def frame(self, frame: Frame) -> None:
        """Keep it if it is early."""
        if frame.travel < 0.0:
            self.frames.append(frame)

    def finish(self, curves: Curves) -> None:
        """Nothing to close."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--belt", default="flex")
    parser.add_argument("--a", type=float, default=2.0, help="centre distance, m")
    parser.add_argument("--tension", type=float, default=60.0, help="N/mm2")
    parser.add_argument("--yaw", type=float, default=-0.042, help="deg")
    parser.add_argument("--travel", type=float, default=3.0, help="m")
    parser.add_argument("--only", nargs="*", default=TENSIONINGS, choices=TENSIONINGS)
    parser.add_argument("--set", nargs="*", default=[], metavar="OPTION=VALUE")
    parser.add_argument("--picture", type=Path)
    a = parser.parse_args()
    case, watcher = paper_case(a.a, a.tension, a.yaw), Before()
    for name in a.only:
        started, options = time.process_time(), options_from([*a.set, f"tensioning={name}"])
        curves = simulate(case, belt=a.belt, travel=a.travel, options=options, observers=(watcher,))
        print(name, *_row(case, curves), f"cpu {time.process_time() - started:.0f} s", sep=" | ", flush=True)
        if a.picture and watcher.frames:
            radii = float(case.rig.head_radius), float(case.rig.tail_radius)
            title = f"Koller's procedure: a = {a.a:g} m, {a.tension:g} N/mm$^2$"
            tensioning_picture(a.picture, watcher.frames, radii, float(case.belt.area), title)


def _row(case: Case, curves: Curves) -> list[str]:
    extra, early = dict(curves.extra or {}), curves.travel <= _FIRST
    tension = np.asarray(extra["tension"])[early] / float(case.tension_force)
    place = (np.asarray(extra["tail_x"])[early] - float(case.rig.centre_distance)) / _UM
    row = [f"tension {tension.mean():.4f} +- {tension.std():.4f}", f"tail {place.mean():.1f} +- {place.std():.1f} um"]
    row.append("sag {:.3f} / {:.3f} mm".format(*(np.asarray(curves.sag) / MM)))
    for travel in np.arange(1.0, curves.travel[-1] + 0.1, 1.0):
        y = [np.interp(travel, curves.travel, np.asarray(curves.y)[k]) / MM for k in (0, 2)]
        row.append(f"{travel:.0f} m {y[0]:.4f} / {y[1]:.4f} mm")
    return row


if __name__ == "__main__":
    main()
