"""One 3D run and what it cost: python -m studies.space_run name=r40 tension=40 travel=70 model.friction=0.15 ...

Leaves OUT/NAME.csv (the curves, as of belt-sim simulate) and OUT/NAME.json: configuration, resolved options, late
rates, sags, cost. The tables of studies/notes are made of these files. ``shapes=[0,10]`` leaves the belt in
space at those travels as well (NAME_shapes.csv). Says every tenth of the way how far it is; asked to stop (SIGTERM,
Ctrl-C, ``limit``) it leaves what it has.
"""

import json
import resource
import signal
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.simulate import model_named
from belt_sim.case import Case
from belt_sim.curves import Curves, Frame, late_rates, write_curves
from belt_sim.effects.load import load_effects
from belt_sim.errors import InputError, SimulationError
from belt_sim.io import provenance, write_text, write_with
from belt_sim.settings import case_from
from belt_sim.show.terminal import ProgressObserver
from belt_sim.space.model import SpaceModel
from belt_sim.units import MM, MM_PER_M
from studies.application import application


@dataclass
class Shapes:
    """The belt's edges in space at chosen places of its travel, kept while it runs (an observer).

    at [m]: wanted travels; kept: for each of them the first frame that is not before it, or the last there is.
    """

    at: tuple[float, ...]
    kept: dict[float, Frame] = field(default_factory=dict)
    last: Frame | None = None

    def start(self, case: Case, travel: float) -> None:
        """Nothing to do."""

    def frame(self, frame: Frame) -> None:
        """Keep it where it is the first at or beyond a wanted travel."""
        self.last = frame
        for wanted in self.at:
            if wanted not in self.kept and frame.travel >= wanted - 1e-9:
                self.kept[wanted] = frame

    def finish(self, curves: Curves) -> None:
        """A travel at the very end has no frame beyond it."""
        if self.last is not None and self.at and max(self.at) not in self.kept:
            self.kept[max(self.at)] = self.last

    def write(self, path: Path) -> Path:
        """One row a station and travel: both edges [m], the tail pulley's axis [m] and yaw [rad]."""
        rows = []
        for f in self.kept.values():
            same = np.tile([f.travel, f.tail_x, f.yaw_tail], (len(f.left), 1))
            rows.append(np.hstack([same, f.left, f.right]))
        table, edges = np.concatenate(rows) + 0.0, [f"{s}_{axis}_m" for s in ("left", "right") for axis in "xyz"]
        header = ",".join(["travel_m", "tail_x_m", "yaw_tail_rad", *edges])
        return write_with(path, lambda p: np.savetxt(p, table, "%.7g", ",", header=header, comments=""))


def space_run(config: dict[str, Any]) -> None:
    """Run, write, print the late rates; a run that fails leaves what it had."""
    for number in (signal.SIGALRM, signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _stop)
    signal.alarm(int(config["limit"]))
    case, effects, settings = case_from(config), load_effects(config["effects"]), dict(config["model"])
    model = model_named(name := settings.pop("name"), settings)
    if not isinstance(model, SpaceModel):
        raise InputError("model", name, "", "name one in three dimensions, as model=mujoco_flex")
    begun, failure = time.process_time(), None
    shapes = Shapes(tuple(float(s) for s in config["shapes"]))
    watch = (ProgressObserver(config["name"]), shapes)
    try:
        curves = model.run(case, effects, travel=float(config["travel"]), observers=watch)
    except SimulationError as error:
        curves, failure = error.curves, str(error)
    signal.alarm(0)
    cpu = time.process_time() - begun
    report = {"config": config, "options": asdict(model.options), "failure": failure, "cpu_s": cpu, **figures(curves)}
    path = Path(config["out"]) / f"{config['name']}.json"
    write_curves(path.with_suffix(".csv"), curves)
    if shapes.kept:
        shapes.write(path.with_name(f"{path.stem}_shapes.csv"))
    write_text(path, json.dumps(report | {"provenance": provenance(config)}, indent=2))
    print(path, "late mm/m", report["late_rates_mm_per_m"], f"cpu {cpu:.0f} s", failure or "")


def figures(curves: Curves) -> dict[str, Any]:
    """Late rates of points 1-4 (None of a short record), sags, steps and memory."""
    rates = np.round(late_rates(curves) / MM_PER_M, 4).tolist() if len(curves.travel) > 10 else None
    steps = float(curves.extra["steps"][-1]) if curves.extra and len(curves.travel) else 0.0
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    sags = (np.asarray(curves.sag) / MM).tolist() if curves.sag is not None else None
    return {"late_rates_mm_per_m": rates, "sag_mm": sags, "steps": steps, "memory_bytes": memory}


def _stop(number: int, _: object) -> None:
    raise SimulationError(f"stopped by {signal.Signals(number).name}")


if __name__ == "__main__":
    application("space_run", space_run)
