"""belt-sim simulate model=mujoco_rope | mujoco_grid | mujoco_flex: the belt in three dimensions."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from belt_sim.analytic.indicated import indicate
from belt_sim.analytic.march import as_driven
from belt_sim.case import Case
from belt_sim.commands.run_folder import job_title
from belt_sim.curves import Curves
from belt_sim.effects.base import Effect, uses
from belt_sim.effects.load import load_effects
from belt_sim.effects.scene import has_scene, scene_refusal
from belt_sim.errors import CannotRepresent, InputError, RunFailed
from belt_sim.tables import write_curves


def simulate_3d(case: Case, config: dict[str, Any], folder: Path) -> tuple[Curves, dict[str, Any]]:
    """Curves of a 3D run, and what summary.json says of it; the scene is written to the run folder.

    A run that diverges leaves what it had as curves_partial.csv and raises RunFailed.
    """
    from belt_sim.mujoco3d import simulate
    from belt_sim.watch.progress import ProgressObserver

    model = dict(config["model"])
    options, control = options_from(model), bool(model.get("control", False))
    effects = load_effects(config["effects"])
    name = str(model["name"])
    geometric = in_the_scene(effects, name)
    observers: list[Any] = [ProgressObserver(job_title(config))]
    if config["watch"] == "rrd":
        from belt_sim.watch.rerun import to_file

        observers.append(to_file(folder / "belt.rrd"))
    elif config["watch"] == "rerun":
        from belt_sim.watch.rerun import live

        observers.append(live())
    try:
        curves = simulate(
            as_driven(case, effects),
            belt=name.removeprefix("mujoco_"),
            travel=float(config["travel"]),
            options=options,
            scene_path=folder / "scene.xml",
            observers=observers,
            effects=geometric,
            control=control,
        )
    except RunFailed as failure:
        partial = getattr(failure, "curves", None)
        if partial is not None and len(partial.travel):
            write_curves(folder / "curves_partial.csv", partial)
        raise
    if uses(effects, "encoder") + uses(effects, "sensor"):
        curves = indicate(curves, case, effects, float(config["travel"]))
    settings = {k: v if not isinstance(v, float) or v != float("inf") else "inf" for k, v in asdict(options).items()}
    return curves, {"options": settings, "effects": [e.id for e in effects], "scene": "scene.xml"}


def in_the_scene(effects: Sequence[Effect], model: str) -> list[Effect]:
    """Effects that change the scene; raises CannotRepresent for one that ``model`` cannot show."""
    for e in effects:
        reason = scene_refusal(e, rope=model == "mujoco_rope")
        if reason:
            raise CannotRepresent(f"effects = {e.id}: {reason}; leave it out")
    return [e for e in effects if has_scene(e)]


def options_from(model: dict[str, Any]):
    """Options of a model group; null keeps the recommended value. Raises InputError for anything else."""
    from belt_sim.mujoco3d.options import Options

    known = {f.name: f for f in fields(Options)}
    given: dict[str, Any] = {}
    for key, value in model.items():
        if key in ("name", "control") or value is None:
            continue
        if key not in known:
            raise InputError(f"model.{key}", value, "", f"use one of {', '.join(known)}")
        given[key] = _converted(f"model.{key}", value, known[key].default)
    return Options(**given)


def _converted(name: str, value: Any, default: Any) -> Any:
    if isinstance(default, tuple):
        if not isinstance(value, (list, tuple)):
            raise InputError(name, value, "", "give a list")
        return tuple(str(v) for v in value)
    if isinstance(default, str):
        return str(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(name, value, "", "give a number")
    return int(value) if isinstance(default, int) else float(value)
