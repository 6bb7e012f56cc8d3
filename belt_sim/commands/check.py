"""belt-sim check: the linter, and what a campaign can and cannot tell."""

from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import finite


def run(run_dir: RunDir) -> None:
    """Check a campaign or a plan and leave check.json and check.png in the run folder."""
    from belt_sim.api.inference import check
    from belt_sim.files import write_json
    from belt_sim.reports.terminal import tell_check, tell_choice
    from belt_sim.results.json import check_json

    config, folder = run_dir.config, run_dir.path
    for key in ("travel", "step"):
        finite(key, config[key], "m", "give a length in metres", lambda x: x > 0)
    asked = {k: config[k] for k in ("effects", "travel", "step", "advise")}
    found = check(
        run_dir.text_setting("campaign", "the folder of a campaign"), config["model"]["name"], **asked, config=config
    )
    write_json(folder / "check.json", check_json(found))
    if config["pictures"] and found.visible:
        from belt_sim.pictures.diagnosis import visible_picture

        visible_picture(folder / "check.png", found.visible, found.campaign.title)
    tell_choice(config, found.base_model)
    tell_check(found, folder)
