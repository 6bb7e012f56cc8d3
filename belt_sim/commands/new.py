"""belt-sim new: an empty, commented campaign with the runs that a diagnosis needs."""

from pathlib import Path

from belt_sim.commands.run_dir import RunDir
from belt_sim.use_cases.new import new


def run(run_dir: RunDir) -> None:
    """Write the folder and say what each run is good for."""
    config = run_dir.config
    folder = Path(config["out"]) if config["out"] else run_dir.path / "campaign"
    new(folder, config)
