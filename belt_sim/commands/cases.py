"""belt-sim simulate, scene, export and map: one model, one case; its scene; its linear plant; a table of many cases."""

import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.simulate import SLACK_SCENE, Model, effects_of, model_of, scene_text, simulate
from belt_sim.commands.runs import RunDir
from belt_sim.curves import Curves, Observer, read_curves, write_curves
from belt_sim.errors import BeltError, InputError, finite
from belt_sim.io import provenance, write_json, write_text, write_with
from belt_sim.results.simulation import Simulation, summary_json
from belt_sim.settings import case_from, make_case
from belt_sim.show.terminal import (
    ProgressObserver,
    ViewerObserver,
    has_display,
    progress,
    resolve_watch,
    tell,
    tell_choice,
)
from belt_sim.space.options import WATCHED
from belt_sim.units import MM

PARTIAL, RECORDING = "curves_partial.csv", "belt.rrd"
TRAVEL_PER_MM_OVERSHOT = 50.0  # [m] that every millimetre of overshoot beyond what is allowed counts for
TRAVEL_PER_MM_LEFT = 10.0  # [m] that every millimetre counts for by which the belt is not centred at the end
_NO_END = 1e5  # [m]: a scene has no end of travel that a schedule could overrun
#: settings of a map
MAP_SETTINGS = ("tension", "yaw", "yaw_head", "speed", "direction", "rig", "belt", "travel", "effects", "at", "workers")
MOST_CASES_DRAWN = 2_000_000  # in the picture of a map


@dataclass(frozen=True, kw_only=True)
class CentringGoal:
    """What is wanted. start [m]: where all four points lie before the run; within [m] of the middle they are to stay;
    beyond [m] it, on the other side, none may go."""

    start: float
    within: float
    beyond: float

    @staticmethod
    def from_setting(asked: Any) -> "CentringGoal | None":
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

    def measures(self, travel: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
        """Return the travel [m] from which all of y (4, n) [m] stay within, the last where they do not; how far they go
        beyond the middle [m]; and what a search makes small: that travel, and more for going too far beyond and for
        what is left at the end."""
        farthest = np.abs(y + self.start).max(axis=0)
        late = np.flatnonzero(farthest > self.within)
        centred = float(travel[0] if not len(late) else travel[min(late[-1] + 1, len(travel) - 1)])
        overshoot = max(float((-(y + self.start) * np.sign(self.start)).max()), 0.0)
        over, left = max(overshoot - self.beyond, 0.0), max(float(farthest[-1]) - self.within, 0.0)
        return centred, overshoot, centred + (TRAVEL_PER_MM_OVERSHOT * over + TRAVEL_PER_MM_LEFT * left) / MM


def simulate_command(run_dir: RunDir, *, computed: Any = None, done: bool = False) -> float | None:
    """Run one simulation and leave summary.json, curves.csv and pictures in the run folder.

    computed: curves that a batch has found for the case; done: the result is there. Returns what ``objective`` makes
    of the run, for a search.
    """
    config, folder = run_dir.config, run_dir.path
    wanted = CentringGoal.from_setting(config["objective"])
    if not done:
        watch = resolve_watch(config["watch"], "rrd", "rerun", "viewer")
        if watch == "rerun" and run_dir.case is not None and not has_display():
            raise InputError("watch", watch, "", "without a display a sweep has no page to serve; use watch=rrd")
        case, acting = case_from(config), effects_of(config["effects"])
        model = model_of(config["model"], [case], [e.id for e in acting], config["engine"])
        title = f"{model.name}, {float(config['tension']):g} N/mm2"
        title += "" if run_dir.case is None else f", job {run_dir.case}"  # several may run at once
        observers = observers_of(model, watch, title, folder)
        with run_dir.outputs(RECORDING) as draft:
            (folder / PARTIAL).unlink(missing_ok=True)  # of an earlier run
            asked: dict[str, Any] = {"effects": acting, "travel": config["travel"], "computed": computed}
            asked |= {"observers": [*observers, CurvesSoFar(folder)] if observers else []}
            found = simulate(case, model=model, **asked, scene_path=draft / "scene.xml")
            (folder / PARTIAL).unlink(missing_ok=True)
            if (curves := found.written_curves) is not None:
                write_curves(draft / "curves.csv", curves)
            write_json(draft / "summary.json", summary_json(found, provenance(config)))
            if config["pictures"]:
                from belt_sim.api.plot import draw_all  # Matplotlib takes a while

                draw_all(draft, found)
            if watch == "rrd" and found.curves is not None and not in_time(model):  # nobody has watched it meanwhile
                from belt_sim.show.rerun import Overlay, record_runs, run_title

                of_case = run_title(found.case)
                overlay = Overlay(modelled={found.model: found.curves}, case=found.case)
                record_runs(folder / RECORDING, {of_case: overlay}, name=f"{found.model}, {of_case}")
        tell_choice(config, model.name)
        tell([], [*found.lines(), folder])
        stay(found, model, observers, watch)
    if wanted is None:
        return None
    curves = read_curves(folder / "curves.csv")
    objective = wanted.measures(curves.travel, curves.y)[-1]
    print(f"objective {objective:.4g}")
    return objective


def scene_command(run_dir: RunDir) -> None:
    """Write a case as MJCF that runs in plain MuJoCo, and say how to look at it."""
    config = dict(run_dir.config)
    out = Path(str(config["out"]))
    if out.suffix != ".xml":
        raise InputError("out", config["out"], "", "give a file name that ends in .xml")
    text = _scene_of(config)
    write_text(out, text)
    if SLACK_SCENE in text:
        print(SLACK_SCENE, file=sys.stderr)
    print(f"{out}: python -m mujoco.viewer --mjcf={out}, press play, move the sliders")


def view_command(run_dir: RunDir) -> None:
    """Play a case's scene in MuJoCo's viewer until its window is closed."""
    from belt_sim.space import scene_looks

    text = _scene_of(run_dir.config)
    if not has_display():
        raise InputError("view", "DISPLAY", "", "there is no display here; use belt-sim scene, or simulate watch=rrd")
    scene_looks.play(text)


def _scene_of(config: Mapping[str, Any]) -> str:
    asked = {name: config[name] for name in ("rig", "belt", "tension", "yaw", "yaw_head", "speed", "direction")}
    case = make_case(**asked, travel=_NO_END)
    return scene_text(case, config["model"], config["effects"], config["speed"])


def export_command(run_dir: RunDir) -> None:
    """Leave the plant for the design of a controller: the FMU, the MAT file, plant.json and bode.png."""
    from belt_sim.api.simulate import export, linearise
    from belt_sim.linear.plant import LinearBelt

    config = run_dir.config
    case = case_from({**config, "yaw": 0.0, "yaw_head": 0.0, "travel": 1.0})
    linear = linearise(case, model=config["model"], effects=config["effects"])
    assert isinstance(linear, LinearBelt)  # a schedule needs several tensions, which the command does not take
    files = {key: config[key] for key in ("order", "delay", "highest", "fmu", "fmi", "libraries", "mat")}
    with run_dir.outputs() as draft:
        lines = export(linear, draft, **files, config=config)
    tell_choice(config, linear.model)
    tell((), [line.replace(str(draft), str(run_dir.path)) for line in lines])


def map_command(run_dir: RunDir) -> None:
    """Leave map.parquet, a row a case, and map.png in the run folder."""
    config: Any = run_dir.config
    try:
        import pyarrow  # noqa: F401
    except ImportError as missing:
        raise BeltError("a map needs PyArrow: pip install 'belt-sim[sweeps]'") from missing
    from belt_sim.api.plot import plot
    from belt_sim.api.sweep import sweep, sweep_columns

    if config["show"] is not None and not config["pictures"]:
        raise InputError("show", config["show"], "", "is the column of the picture, and pictures=false draws none")
    places = [s for s in config["at"] if isinstance(s, int | float)] if isinstance(config["at"], list) else None
    closed = ("steady_rate_mm_per_m",) if config["effects"] else ()  # closed forms read no effects
    drawn = [c for c in sweep_columns(config["travel"], places) if c not in ("settled", *closed)]
    if config["show"] not in (None, *drawn):
        raise InputError("show", config["show"], "", f"use one of {', '.join(drawn)}")
    began = time.monotonic()
    with run_dir.outputs() as draft:
        with progress(1.0, "map") as done:
            table = sweep(**{k: config[k] for k in MAP_SETTINGS}, model=config["model"], tell=done)
        seconds = time.monotonic() - began
        print(
            f"{len(table)} cases in {seconds:.1f} s, {len(table) / seconds:.0f} a second, start-up counted",
            *table.attrs["beyond"],
            sep="\n",
        )
        write_with(draft / "map.parquet", lambda path: table.to_parquet(path, index=False))
        if config["pictures"] and len(table.attrs["axes"]) <= 2 and len(table) <= MOST_CASES_DRAWN:
            plot(table, draft / "map.png", kind=config["show"])
        elif config["pictures"]:
            print(f"no picture: at most 2 may vary ({len(table.attrs['axes'])} do), in {MOST_CASES_DRAWN} cases")
    print(f"a row a case, for pandas.read_parquet:\n{run_dir.path / 'map.parquet'}")


# ---- who watches a run


class CurvesSoFar(Observer):
    """Leaves curves_partial.csv of a run in time that diverges or is stopped; a run to its end removes it."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / PARTIAL

    def finish(self, curves: Curves) -> None:
        """Write what there is."""
        if len(curves.travel):
            write_curves(self.path, curves)


def in_time(model: Model) -> bool:
    """Whether a run of the model goes through its instants one by one, so that it can be watched meanwhile."""
    return getattr(model, "engine", None) in WATCHED


def observers_of(model: Model, watch: str | None, title: str, folder: Path) -> list[Observer]:
    """Who looks on while ``model`` runs in time: progress, and by ``watch`` a recording (rrd), Rerun's or MuJoCo's
    viewer."""
    if watch == "viewer" and getattr(model, "engine", None) != "native":
        raise InputError("watch", watch, "", "only a 3D belt of engine=native is MuJoCo's; use watch=rerun")
    if not in_time(model):
        return []
    watching: list[Observer] = [ProgressObserver(title)]
    if watch == "viewer":
        watching.append(ViewerObserver())
    elif watch is not None:
        from belt_sim.show.rerun import RerunObserver

        watching.append(RerunObserver(folder / RECORDING if watch == "rrd" else None, model=model.name))
    return watching


def stay(s: Simulation, model: Model, watching: Sequence[Observer], watch: str | None) -> None:
    """Show a run whose results are written: in the Rerun viewer until Enter is pressed, as a web page of this process
    until Ctrl-C; in MuJoCo's viewer until its window is closed."""
    for observer in watching:
        if isinstance(observer, ViewerObserver):
            observer.wait()
    if watch != "rerun" or s.curves is None:
        return
    if not in_time(model):
        from belt_sim.show.geometry import frames
        from belt_sim.show.rerun import RerunObserver

        viewer = RerunObserver(model=s.model)
        viewer.start(s.case, s.travel)
        for frame in frames(s.case, s.curves):
            viewer.frame(frame)
        viewer.finish(s.curves)
    if not has_display():
        print("the page is served until Ctrl-C", flush=True)
        with suppress(KeyboardInterrupt):
            while True:
                time.sleep(1.0)
        print()
    elif not in_time(model) and sys.stdin.isatty():
        input("press Enter to close the viewer")
