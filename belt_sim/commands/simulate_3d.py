"""belt-sim simulate model=mujoco_rope | mujoco_grid | mujoco_flex: the belt in three dimensions."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from belt_sim.case import Case
from belt_sim.commands.run_folder import job_title
from belt_sim.curves import Curves
from belt_sim.effects.load import load_effects
from belt_sim.errors import RunFailed
from belt_sim.registry import IN_SPACE
from belt_sim.tables import write_curves


def simulate_3d(case: Case, config: dict[str, Any], folder: Path) -> tuple[Curves, dict[str, Any]]:
    """Curves of a 3D run, and what summary.json says of it; the scene is written to the run folder.

    A run that diverges leaves what it had as curves_partial.csv and raises RunFailed.
    """
    from belt_sim.mujoco3d.model import SpaceModel
    from belt_sim.watch.progress import ProgressObserver

    settings = {k: v for k, v in config["model"].items() if k != "name" and v is not None}
    model = SpaceModel.of(IN_SPACE[str(config["model"]["name"])], settings)
    options, effects = model.options, load_effects(config["effects"])
    model.admit(effects)
    observers: list[Any] = [ProgressObserver(job_title(config))]
    if config["watch"] == "rrd":
        from belt_sim.watch.rerun import to_file

        observers.append(to_file(folder / "belt.rrd"))
    elif config["watch"] == "rerun":
        from belt_sim.watch.rerun import live

        observers.append(live())
    try:
        curves = model.run(
            case,
            effects,
            travel=float(config["travel"]),
            observers=observers,
            scene_path=folder / "scene.xml",
        )
    except RunFailed as failure:
        partial = getattr(failure, "curves", None)
        if partial is not None and len(partial.travel):
            write_curves(folder / "curves_partial.csv", partial)
        raise
    settings = {k: v if not isinstance(v, float) or v != float("inf") else "inf" for k, v in asdict(options).items()}
    return curves, {"options": settings, "effects": [e.id for e in effects], "scene": "scene.xml"}
