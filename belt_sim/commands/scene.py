"""belt-sim scene: a case as MJCF that runs in plain MuJoCo."""

from pathlib import Path

from belt_sim.api.resolve import model_of
from belt_sim.api.simulate import scene_text
from belt_sim.commands.run_dir import RunDir
from belt_sim.config import case_from, model_settings
from belt_sim.errors import InputError
from belt_sim.files import write_text

_NO_END = 1e5  # [m]: a scene has no end of travel that a schedule could overrun


def run(run_dir: RunDir) -> None:
    """Write the scene and say how to look at it."""
    config = dict(run_dir.config)
    out = Path(str(config["out"]))
    if out.suffix != ".xml":
        raise InputError("out", config["out"], "", "give a file name that ends in .xml")
    write_text(out, scene_text(case_from(config | {"travel": _NO_END}), model_of(model_settings(config["model"]))))
    print(f"{out}: python -m mujoco.viewer --mjcf={out}, load the key frame running, press play, move the sliders")
