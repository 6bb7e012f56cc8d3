"""belt-sim compare: a model against measurements; with effects, before and after."""

from belt_sim.commands.run_dir import RunDir


def run(run_dir: RunDir) -> None:
    """Compare and leave comparison.json, summary.json, tables and pictures in the run folder."""
    from belt_sim.api.inference import compare
    from belt_sim.campaign import read_campaign
    from belt_sim.commands.outputs import write_comparison
    from belt_sim.reports.terminal import tell_choice, tell_comparison

    config = run_dir.config
    with run_dir.outputs() as draft:
        campaign = read_campaign(run_dir.text_setting("campaign", "the folder of a campaign"))
        model, pictures = config["model"]["name"], config["pictures"]
        found = compare(campaign, model, config["effects"], drawn=pictures, config=config)
        write_comparison(draft, found, pictures=pictures)
    tell_choice(config, found.base_model)
    tell_comparison(found, run_dir.path)
