"""Export as an FMU: the linear plant for co-simulation under FMI 3 (pythonfmu3 wraps a Python slave)."""

import json
import shutil
import tempfile
from pathlib import Path

from belt_sim.errors import InputError
from belt_sim.files import write_with
from belt_sim.linear.state_space import StateSpace
from belt_sim.si import N_PER_MM2


def write_fmu(space: StateSpace, path: Path | str) -> Path:
    """Write ``space`` (per metre of travel) as an FMU: inputs yaw, yaw_head [rad], speed [m/s]; outputs y1..y4 [m].

    Raises InputError when pythonfmu3 is not installed, the name does not end in .fmu, or the space is in seconds.
    """
    try:
        from pythonfmu3.builder import FmuBuilder
    except ImportError:
        raise InputError("fmu", "pythonfmu3 is not installed", "", "pip install belt-sim[control]") from None
    path = Path(path)
    if path.suffix != ".fmu":
        raise InputError("fmu", path.name, "", "end the name in .fmu")
    if not space.per_metre:
        raise InputError(
            "per_metre", False, "", "export a state space in metres of travel; speed is an input of the FMU"
        )
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        script = shutil.copy(Path(__file__).with_name("fmu_slave.py"), folder / "belt.py")
        plant = folder / "plant.json"
        content = {"a": space.a.tolist(), "b": space.b.tolist(), "c": space.c.tolist()}
        about = {"speed": space.plant.speed, "tension": space.plant.tension / N_PER_MM2, "model": space.plant.model}
        plant.write_text(json.dumps(content | about), encoding="utf-8")
        made = Path(FmuBuilder.build_FMU(script, dest=folder / "made", project_files=[plant]))
        return write_with(path, lambda temporary: shutil.copy(made, temporary))
