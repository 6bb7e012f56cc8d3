"""belt-sim reveal: what was hidden in a campaign of the virtual rig."""

import json
from dataclasses import asdict

from belt_sim.commands.run_dir import RunDir


def run(run_dir: RunDir) -> None:
    """Print the truth of a campaign, checked against its published hash."""
    from belt_sim.campaign.read import campaign_folder
    from belt_sim.virtual_rig.sealed_truth import reveal

    truth = reveal(campaign_folder(run_dir.text_setting("campaign", "the folder of a campaign of the virtual rig")))
    print(f"sha256 {truth.sha256()} matches")
    print(json.dumps(asdict(truth), indent=2))
