"""An independent belt line to test the diagnosis on: its truth is hidden until it is revealed."""

from belt_sim.virtual_rig.make import Truth, make_campaign, random_campaign, reveal, write_blind
from belt_sim.virtual_rig.plan import Noise, Plan, RunSetting, grid

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
