"""belt-sim paper: the paper, figure by figure."""

from typing import Any

from belt_sim.commands.run_folder import plain, run_folder
from belt_sim.provenance import provenance
from belt_sim.use_cases.paper import paper


def run(cfg: Any) -> None:
    """Leave index.html, a picture a figure and paper.json in the run folder."""
    config = plain(cfg)
    for line in paper(run_folder(), config, provenance(config)):
        print(line)
