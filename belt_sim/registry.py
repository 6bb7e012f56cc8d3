"""Every model by its name, the analytic ones and those in three dimensions."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal, get_args

from belt_sim.analytic.model import MODELS
from belt_sim.analytic.steady import RitzingerFormula
from belt_sim.errors import InputError, finite, flag
from belt_sim.model import Model, SteadyModel
from belt_sim.si import N_PER_MM2

ModelName = Literal[
    "rope",
    "beam_th1",
    "beam_th2",
    "ritzinger",
    "ernst_beam",
    "strip",
    "strip_lift_off",
    "mujoco_rope",
    "mujoco_grid",
    "mujoco_flex",
]
MODEL_NAMES: tuple[str, ...] = get_args(ModelName)
IN_SPACE = {"mujoco_rope": "rope", "mujoco_grid": "grid", "mujoco_flex": "flex"}
ANALYTIC = tuple(name for name in MODEL_NAMES if name not in IN_SPACE)
#: the model that is chosen by the tension of what is simulated or measured
BY_TENSION = "by_tension"
LAYER_TENSION = 22.0 * N_PER_MM2  # [Pa]: where the test rig reaches the limit bending_layer (docs/validity.md)


def model_for(tensions: Iterable[float]) -> ModelName:
    """The model of runs whose model is not stated: one for all of them, by the lowest of their tensions [Pa]."""
    return "strip_lift_off" if min(tensions, default=math.inf) < LAYER_TENSION else "strip"


def models() -> dict[str, str]:
    """The title of every model by its name."""
    return {name: model_named(name).title for name in MODEL_NAMES}


def model_named(name: str, settings: Mapping[str, Any] | None = None) -> Model | SteadyModel:
    """The model of a name; settings: its own numbers (step, keep; dx, dt, friction ...), None keeps the default.

    Raises InputError for an unknown model or setting.
    """
    given = {k: v for k, v in (settings or {}).items() if v is not None}
    if name in IN_SPACE:
        from belt_sim.space.model import SpaceModel  # MuJoCo takes a while to load

        flag("model.control", given.get("control", False))
        return SpaceModel.from_settings(IN_SPACE[name], given)
    if name not in ANALYTIC:
        raise InputError("model", name, "", f"use one of {', '.join(MODEL_NAMES)}")
    known = () if name == "ritzinger" else ("step", "keep")
    for key, value in given.items():
        if key not in known:
            raise InputError(f"model.{key}", value, "", f"use one of {', '.join(known)}" if known else "leave it out")
        finite(f"model.{key}", value, "m", "give a positive length", lambda x: x > 0)
    return RitzingerFormula() if name == "ritzinger" else replace(MODELS[name], **given)
