"""An independent belt line to test the diagnosis on: its truth is hidden until it is revealed."""

from belt_sim.virtual_rig.folder import run_reveal, run_virtual_rig
from belt_sim.virtual_rig.lot import random_campaign, random_nothing_campaign, random_stranger_campaign
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, Setting, grid
from belt_sim.virtual_rig.seal import Truth, reveal

__all__ = [
    "Noise",
    "Plan",
    "Setting",
    "Truth",
    "grid",
    "make_campaign",
    "random_campaign",
    "random_nothing_campaign",
    "random_stranger_campaign",
    "reveal",
    "run_reveal",
    "run_virtual_rig",
]
