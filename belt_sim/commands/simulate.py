"""belt-sim simulate, scene and export: one model, one case; its scene; its linear plant."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api import simulate as simulation
from belt_sim.api.resolve import by_tension, model_of
from belt_sim.commands.outputs import RECORDING, observers_of, partial_curves_kept, record, stay, write_simulation
from belt_sim.commands.run_dir import RunDir
from belt_sim.curves import read_curves
from belt_sim.errors import InputError, finite
from belt_sim.io import provenance, write_text
from belt_sim.settings import case_from, model_settings
from belt_sim.show.observers import resolve_watch
from belt_sim.show.terminal import tell_choice
from belt_sim.units import MM

_NO_END = 1e5  # [m]: a scene has no end of travel that a schedule could overrun
OVERSHOT = 50.0  # [m] that every millimetre of overshoot beyond what is allowed counts for
SHORT = 10.0  # [m] that every millimetre counts for by which the belt is not centred at the end


@dataclass(frozen=True, kw_only=True)
class CentringGoal:
    """What is wanted. start [m]: where all four points lie before the run; within [m] of the middle they are to stay;
    beyond [m] it, on the other side, none may go."""

    start: float
    within: float
    beyond: float

    def largest_distance(self, y: np.ndarray) -> np.ndarray:
        """Distance of the farthest point from the middle [m], shape (n,), of y (4, n) [m]."""
        return np.asarray(np.abs(y + self.start).max(axis=0))

    def centring_travel(self, travel: np.ndarray, y: np.ndarray) -> float:
        """Travel [m] from which all of y (4, n) [m] stay within; the last where they do not."""
        late = np.flatnonzero(self.largest_distance(y) > self.within)
        return float(travel[0] if not len(late) else travel[min(late[-1] + 1, len(travel) - 1)])

    def overshoot(self, y: np.ndarray) -> float:
        """How far y (4, n) [m] go beyond the middle [m]."""
        return max(float((-(y + self.start) * np.sign(self.start)).max()), 0.0)

    def count(self, travel: np.ndarray, y: np.ndarray) -> float:
        """What a search makes small: travel until centred, and more for overshoot and for what is left at the end."""
        over = max(self.overshoot(y) - self.beyond, 0.0)
        left = max(float(self.largest_distance(y)[-1]) - self.within, 0.0)
        return self.centring_travel(travel, y) + (OVERSHOT * over + SHORT * left) / MM


def centring_asked(asked: Any) -> CentringGoal | None:
    """What ``objective`` asks for, in mm; None for nothing. Raises InputError."""
    if asked is None:
        return None
    names = ("start", "within", "beyond")
    if not isinstance(asked, Mapping) or set(asked) != set(names):
        raise InputError("objective", asked, "", "write {start: mm, within: mm, beyond: mm}, or null")
    goal = CentringGoal(**{name: finite(f"objective.{name}", asked[name], "mm") * MM for name in names})
    if not goal.within > 0 or goal.beyond < 0:
        raise InputError("objective.within", asked["within"], "mm", "must be above 0, and beyond not below it")
    return goal


def simulate(run_dir: RunDir, *, computed: Any = None, done: bool = False) -> float | None:
    """Run one simulation and leave summary.json, curves.csv and pictures in the run folder.

    computed: curves that a batch has found for the case; done: the result is there. Returns what ``objective`` makes
    of the run, for a search.
    """
    config, folder = run_dir.config, run_dir.path
    wanted = centring_asked(config["objective"])
    if done:
        return _report_objective(folder, wanted)
    watch, pictures = resolve_watch(config["watch"], "rrd", "rerun", "viewer"), config["pictures"]
    case, stated = case_from(config), model_settings(config["model"])
    model = simulation.on_engine(model_of(by_tension(stated, [float(case.settings.tension)])), config["engine"])
    asked = {k: config[k] for k in ("effects", "travel")}
    title = f"{model.name}, {float(config['tension']):g} N/mm2"
    title += "" if run_dir.case is None else f", job {run_dir.case}"  # several may run at once
    observers = observers_of(model, watch, title, folder)
    with run_dir.outputs(RECORDING) as draft:
        with partial_curves_kept(folder, observers):
            asked |= {"observers": observers, "scene_path": draft / "scene.xml", "computed": computed}
            found = simulation.simulate_one(case, model=model, **asked)
        write_simulation(draft, found, pictures=pictures, provenance=provenance(config))
        record(found, model, watch, folder)
    tell_choice(config, model.name)
    print(*found.lines(), folder, sep="\n", flush=True)
    stay(found, model, observers, watch)
    return _report_objective(folder, wanted)


def _report_objective(folder: Path, wanted: CentringGoal | None) -> float | None:
    if wanted is None:
        return None
    curves = read_curves(folder / "curves.csv")
    travel = wanted.count(curves.travel, curves.y)
    print(f"objective {travel:.4g}")
    return travel


def scene(run_dir: RunDir) -> None:
    """Write a case as MJCF that runs in plain MuJoCo, and say how to look at it."""
    config = dict(run_dir.config)
    out = Path(str(config["out"]))
    if out.suffix != ".xml":
        raise InputError("out", config["out"], "", "give a file name that ends in .xml")
    case, model = case_from(config | {"travel": _NO_END}), model_of(model_settings(config["model"]))
    write_text(out, simulation.scene_text(case, model, config["effects"]))
    print(f"{out}: python -m mujoco.viewer --mjcf={out}, press play, move the sliders")


def export(run_dir: RunDir) -> None:
    """Leave the plant for the design of a controller: the FMU, the MAT file, plant.json and bode.png."""
    from belt_sim.api import plant
    from belt_sim.linear.plant import LinearBelt

    config = run_dir.config
    case = case_from({**config, "yaw": 0.0, "yaw_head": 0.0, "travel": 1.0})
    linear = plant.linearise(case, model=model_settings(config["model"]), effects=config["effects"])
    assert isinstance(linear, LinearBelt)  # a schedule needs several tensions, which the command does not take
    files = {key: config[key] for key in ("order", "delay", "highest", "fmu", "fmi", "libraries", "mat")}
    with run_dir.outputs() as draft:
        lines = plant.export(linear, draft, **files, config=config)
    print("\n".join(lines).replace(str(draft), str(run_dir.path)))
