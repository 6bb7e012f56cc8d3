"""belt-sim new: an empty, commented campaign with the runs that a diagnosis needs."""

from pathlib import Path
from typing import Any

from belt_sim.commands.run_folder import plain, run_folder
from belt_sim.use_cases.new import new


def run(cfg: Any) -> None:
    """Write the folder and say what each run is good for."""
    config = plain(cfg)
    folder = Path(config["out"]) if config["out"] else run_folder() / "campaign"
    new(folder, config)
