"""belt-sim export: the plant for whoever designs the controller."""

from typing import Any

from belt_sim.commands.run_folder import plain, run_folder
from belt_sim.config import case_from, model_settings
from belt_sim.use_cases.export import export
from belt_sim.use_cases.linearise import linearise


def run(cfg: Any) -> None:
    """Leave the FMU, the MAT file, plant.json and bode.png in the run folder."""
    config, folder = plain(cfg), run_folder()
    case = case_from({**config, "yaw": 0.0, "yaw_head": 0.0, "travel": 1.0})
    plant = linearise(case, model=model_settings(config["model"]), effects=config["effects"])
    files = {key: config[key] for key in ("order", "delay", "highest", "fmu", "fmi", "mat")}
    for line in export(plant, folder, **files, config=config):
        print(line)
