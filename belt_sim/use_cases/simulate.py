"""Simulate: one case, one model, with or without effects."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from belt_sim.analytic.model import AnalyticModel
from belt_sim.case import Case
from belt_sim.config import case_asked
from belt_sim.effects.base import Effect
from belt_sim.errors import InputError
from belt_sim.frame import Observer
from belt_sim.model import Model, SteadyModel
from belt_sim.results.simulation import Simulation
from belt_sim.use_cases.asked import effects_of, model_of, refuse
from belt_sim.use_cases.beyond import beyond


def simulate(
    case: Case | None = None,
    *,
    model: Any = "strip",
    effects: Any = None,
    travel: float = 60.0,
    engine: str | None = None,
    observers: Sequence[Observer] = (),
    scene_path: Path | None = None,
    computed: Any = None,
    **settings: Any,
) -> Simulation:
    """Run ``case`` (in SI), or the case that ``settings`` describe, for ``travel`` [m].

    settings: as on the command line: rig and belt (a name, a mapping or an object), tension [N/mm2], yaw and yaw_head
    [degrees, or a list of {at, over, yaw}], speed [m/s], direction. model: a name, {name: ..., further settings} or a
    Model; engine: of a 3D model, "native" (None), "mjx" or "quasi_static"; effects: ids, mappings, .py files or
    objects. scene_path: where a 3D model writes its scene (MJCF); computed: what a batch has found for the case as
    driven (``belt_sim.use_cases.batched``), so that no engine runs. A 3D model's setting ``scene`` is an MjSpec that
    ``bs.scene`` made, edited, or the path of an XML: that is run instead, by MuJoCo's contacts.
    """
    if case is not None and settings:
        name, value = next(iter(settings.items()))
        raise InputError(name, value, "", "give either a case or its settings")
    case = case_asked(travel=travel, **settings) if case is None else case
    chosen, acting = on_engine(model_of(model), engine), effects_of(effects)
    common: dict[str, Any] = {"case": case, "model": chosen.name, "effects": acting, "travel": float(travel)}
    common["beyond"] = beyond(case, chosen, [e.id for e in acting])
    steady = chosen.steady_rate(case) if isinstance(chosen, SteadyModel) and not acting else None
    if not isinstance(chosen, Model):
        refuse(chosen, acting, "; leave it out or use model=beam_th2 or strip")
        return Simulation(**common, curves=None, steady_rate=steady)
    if isinstance(chosen, AnalyticModel):
        curves = chosen.run(case, acting, travel=travel, observers=observers)
        return Simulation(**common, curves=curves, steady_rate=steady)
    return _in_space(chosen, acting, common, observers, scene_path, computed)


def _in_space(
    model: Any,
    effects: Sequence[Effect],
    common: dict[str, Any],
    observers: Sequence[Observer],
    scene: Path | None,
    computed: Any,
) -> Simulation:
    """A run in three dimensions, with its numerical settings; its steady rate is its late rate once it has settled."""
    if computed is None:
        curves = model.run(common["case"], effects, travel=common["travel"], observers=observers, scene_path=scene)
    else:
        curves = model.indicated(computed, common["case"], effects, common["travel"])
    scene = scene if scene and scene.is_file() else None
    details = {"options": asdict(model.options), "engine": model.engine, "contact": model.contact}
    details |= {"scene": scene.name} if scene else {}
    found = Simulation(**common, curves=curves, details=details)
    return replace(found, steady_rate=float(found.rates.mean())) if found.settled else found


def on_engine(model: Model | SteadyModel, engine: str | None) -> Model | SteadyModel:
    """The model run by ``engine``; raises InputError for an analytic model asked for anything but "native"."""
    if engine is None or (engine == "native" and not hasattr(model, "engine")):
        return model
    from belt_sim.mujoco3d.model import SpaceModel, engine_named

    if not isinstance(model, SpaceModel):
        raise InputError("engine", engine, "", f"leave it out: model={model.name} is not a belt in three dimensions")
    return replace(model, engine=engine_named(engine))
