"""belt-sim export: the plant for whoever designs the controller."""

from belt_sim.api.plant import export, linearise
from belt_sim.commands.run_dir import RunDir
from belt_sim.config import case_from, model_settings
from belt_sim.linear.plant import LinearBelt


def run(run_dir: RunDir) -> None:
    """Leave the FMU, the MAT file, plant.json and bode.png in the run folder."""
    config = run_dir.config
    case = case_from({**config, "yaw": 0.0, "yaw_head": 0.0, "travel": 1.0})
    plant = linearise(case, model=model_settings(config["model"]), effects=config["effects"])
    assert isinstance(plant, LinearBelt)  # a schedule needs several tensions, which the command does not take
    files = {key: config[key] for key in ("order", "delay", "highest", "fmu", "fmi", "mat")}
    with run_dir.outputs() as draft:
        lines = export(plant, draft, **files, config=config)
    print("\n".join(lines).replace(str(draft), str(run_dir.path)))
