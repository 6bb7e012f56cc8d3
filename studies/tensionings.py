"""The three ways to tension a 3D belt side by side: python -m studies.tensionings tension=60 model=mujoco_flex ...

Prints a row for each: tension at the upper run-up over the wanted one and place of the tail pulley over the first
metre (mean and standard deviation), sags at travel 0, y of points 1 and 3. picture=FILE.png draws Koller's procedure.
"""

import time
from typing import Any

import numpy as np

from belt_sim.case import Case
from belt_sim.config import case_from
from belt_sim.curves import Curves, Frame
from belt_sim.si import MM
from studies.application import application
from studies.space_run import space_model
from studies.tensioning_picture import tensioning_picture

_UM = 1e-6
_FIRST = 1.0  # [m] of travel over which tension and place are averaged


class EarlyFrames:
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


def tensionings(config: dict[str, Any]) -> None:
    """Run the case once for each way, print a row each."""
    case, watcher = case_from(config), EarlyFrames()
    for name in config["only"]:
        begun, model = time.process_time(), space_model(config["model"] | {"tensioning": name})
        curves = model.run(case, travel=float(config["travel"]), observers=(watcher,))
        print(name, *_row(case, curves), f"cpu {time.process_time() - begun:.0f} s", sep=" | ", flush=True)
        if config["picture"] and watcher.frames:
            radii = float(case.rig.head_radius), float(case.rig.tail_radius)
            title = f"Koller's procedure: a = {case.rig.centre_distance:g} m, {config['tension']:g} N/mm$^2$"
            tensioning_picture(config["picture"], watcher.frames, radii, title)


def _row(case: Case, curves: Curves) -> list[str]:
    extra, early = dict(curves.extra or {}), curves.travel <= _FIRST
    tension = np.asarray(extra["tension"])[early] / float(case.settings.tension)
    place = (np.asarray(extra["tail_x"])[early] - float(case.rig.centre_distance)) / _UM
    row = [f"tension {tension.mean():.4f} +- {tension.std():.4f}", f"tail {place.mean():.1f} +- {place.std():.1f} um"]
    row.append("sag {:.3f} / {:.3f} mm".format(*(np.asarray(curves.sag) / MM)))
    for travel in np.arange(1.0, curves.travel[-1] + 0.1, 1.0):
        y = [np.interp(travel, curves.travel, np.asarray(curves.y)[k]) / MM for k in (0, 2)]
        row.append(f"{travel:.0f} m {y[0]:.4f} / {y[1]:.4f} mm")
    return row


if __name__ == "__main__":
    application("tensionings", tensionings)
