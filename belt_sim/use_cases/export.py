"""Export: one linear plant as files that other tools read."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from belt_sim.config import case_from, model_settings
from belt_sim.errors import InputError
from belt_sim.files import write_json
from belt_sim.linear.linearise import linear_belt
from belt_sim.linear.plant import LinearBelt
from belt_sim.linear.state_space import StateSpace, state_space
from belt_sim.results.plant import plant_json
from belt_sim.use_cases.asked import effects_of, fitted_model


def export(folder: Path, config: Mapping[str, Any], provenance: Mapping[str, Any]) -> list[str]:
    """Write what ``config`` (conf/export.yaml) asks for into ``folder``; returns what to tell of it."""
    highest = config["highest"]
    if isinstance(highest, bool) or not isinstance(highest, int | float) or not 0 < highest < math.inf:
        raise InputError("highest", highest, "rad/m", "give a positive number")
    names = {kind: _name(config, kind) for kind in ("fmu", "mat")}
    case = case_from({**config, "yaw": 0.0, "yaw_head": 0.0, "travel": 1.0})
    plant = linear_belt(case, fitted_model(model_settings(config["model"])), effects_of(config["effects"]))
    metres = state_space(plant, order=config["order"], delay=config["delay"], per_metre=True)
    lines = [f"wrapped arcs by {metres.delay}, order {metres.order}: off by at most {metres.error(highest):.1e}"]
    lines[0] += f" of each response up to {highest:g} rad per metre of travel"
    made = _written(folder, names, plant, metres, config)
    write_json(folder / "plant.json", plant_json(metres, float(highest), provenance))
    return [*lines, *(str(p) for p in made), str(folder / "plant.json")]


def _written(
    folder: Path, names: Mapping[str, str | None], plant: LinearBelt, metres: StateSpace, config: Mapping[str, Any]
) -> list[Path]:
    """Picture, MAT file and FMU."""
    from belt_sim.linear.fmu import write_fmu
    from belt_sim.pictures.bode import bode_picture

    made = [bode_picture(folder / "bode.png", metres, float(config["highest"]))]
    if names["mat"]:
        seconds = state_space(plant, order=config["order"], delay=config["delay"])
        made.append(seconds.save_mat(folder / str(names["mat"])))
    if names["fmu"]:
        made.append(write_fmu(metres, folder / str(names["fmu"])))
    return made


def _name(config: Mapping[str, Any], kind: str) -> str | None:
    """A bare file name of the right kind, or None."""
    name = config[kind]
    if name is None:
        return None
    if not isinstance(name, str) or Path(name).name != name or Path(name).suffix != f".{kind}":
        raise InputError(kind, name, "", f"give a file name ending in .{kind} (it is put in the run folder), or null")
    return name
