"""plant.json: the linear plant as numbers, for programs without FMI or Matlab."""

from collections.abc import Mapping
from typing import Any

from belt_sim.linear.plant import INPUTS, OUTPUTS, StateSpace
from belt_sim.si import N_PER_MM2


def plant_json(space: StateSpace, highest: float, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Exact plant with its delays [per metre of travel, SI], and the state space with its error up to ``highest``."""
    plant = space.plant
    return {
        "schema": "belt-plant/1",
        "model": plant.model,
        "tension_n_per_mm2": plant.tension / N_PER_MM2,
        "inputs": list(INPUTS),
        "outputs": list(OUTPUTS),
        "delayed_plant": {
            "states": list(plant.states),
            "now": plant.now.tolist(),
            "delayed": plant.delayed.tolist(),
            "delay_m": plant.arcs.tolist(),
            "drive": plant.drive.tolist(),
            "constant": plant.constant.tolist(),
            "shown": [{"state": plant.states[k], "one_arc_late": late} for k, late in plant.places],
        },
        "state_space": {
            "a": space.a.tolist(),
            "b": space.b.tolist(),
            "c": space.c.tolist(),
            "d": space.d.tolist(),
            "delay": space.delay,
            "order": space.order,
            "highest_rad_per_m": highest,
            "relative_error": space.error(highest),
        },
        "provenance": dict(provenance),
    }
