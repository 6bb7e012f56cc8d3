"""belt-sim new: an empty, commented campaign with the runs that a diagnosis needs."""

from pathlib import Path

from belt_sim.api.campaigns import new_campaign
from belt_sim.commands.run_dir import RunDir


def run(run_dir: RunDir) -> None:
    """Write the folder and say what each run is good for."""
    config = run_dir.config
    folder = Path(config["out"]) if config["out"] else run_dir.path / "campaign"
    new_campaign(folder, config)
