"""belt-sim compare: a model against measurements; with effects, before and after."""

from belt_sim.commands.run_dir import RunDir


def run(run_dir: RunDir) -> None:
    """Compare and leave comparison.json, summary.json, tables and pictures in the run folder."""
    from belt_sim.api.inference import compare
    from belt_sim.campaign import read_campaign
    from belt_sim.commands.outputs import write_comparison
    from belt_sim.reports.terminal import tell_comparison

    config = run_dir.config
    with run_dir.outputs() as draft:
        campaign, name = read_campaign(run_dir.named("campaign", "the folder of a campaign")), config["model"]["name"]
        found = compare(campaign, name, config["effects"], drawn=config["pictures"], config=config)
        write_comparison(draft, found, pictures=config["pictures"])
    tell_comparison(found, run_dir.path)
