"""belt-sim reveal: what was hidden in a campaign of the virtual rig."""

import json
from dataclasses import asdict
from typing import Any

from belt_sim.commands.run_folder import plain


def run(cfg: Any) -> None:
    """Print the truth of a campaign, checked against its published hash."""
    from belt_sim.campaign.read import campaign_folder
    from belt_sim.virtual_rig.blinding import reveal

    truth = reveal(campaign_folder(plain(cfg)["campaign"]))
    print(f"sha256 {truth.sha256()} matches")
    print(json.dumps(asdict(truth), indent=2))
