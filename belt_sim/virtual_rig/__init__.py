"""An independent belt line to test the diagnosis on: its truth is hidden until it is revealed."""

from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting, grid
from belt_sim.virtual_rig.random_campaigns import random_campaign
from belt_sim.virtual_rig.sealed_truth import Truth, reveal, write_blind

__all__ = [
    "Noise",
    "Plan",
    "RunSetting",
    "Truth",
    "grid",
    "make_campaign",
    "random_campaign",
    "reveal",
    "write_blind",
]
