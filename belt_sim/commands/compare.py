"""belt-sim compare: a model against measurements; with effects, before and after."""

from typing import Any

from belt_sim.commands.run_folder import done_before, plain, run_folder


def run(cfg: Any) -> None:
    """Compare and leave comparison.json, summary.json, tables and pictures in the run folder."""
    config, folder = plain(cfg), run_folder()
    if done_before(folder, config):
        print(f"done before, kept: {folder}")
        return
    from belt_sim.campaign import read_campaign
    from belt_sim.reports.terminal import tell_comparison
    from belt_sim.use_cases.compare import compare
    from belt_sim.use_cases.leave import leave_comparison

    campaign, name = read_campaign(str(config["campaign"])), config["model"]["name"]
    found = compare(campaign, name, config["effects"], drawn=config["pictures"], config=config)
    leave_comparison(folder, found, pictures=config["pictures"])
    tell_comparison(found, folder)
