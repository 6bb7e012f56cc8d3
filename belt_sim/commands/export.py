"""belt-sim export: the plant for whoever designs the controller."""

from typing import Any

from belt_sim.commands.run_folder import plain, run_folder
from belt_sim.provenance import provenance
from belt_sim.use_cases.export import export


def run(cfg: Any) -> None:
    """Leave the FMU, the MAT file, plant.json and bode.png in the run folder."""
    config, folder = plain(cfg), run_folder()
    for line in export(folder, config, provenance(config)):
        print(line)
