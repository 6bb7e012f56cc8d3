"""belt-sim diagnose: which physical effect the model lacks."""

from typing import Any

from belt_sim.commands.run_dir import RunDir


def run(run_dir: RunDir) -> None:
    """Diagnose a campaign and leave diagnosis.json, report.html, effects.yaml and pictures in the run folder."""
    from belt_sim.api.inference import MIN_BOOTSTRAPS, diagnose
    from belt_sim.campaign import read_campaign
    from belt_sim.commands.outputs import draw_diagnosis, write_diagnosis, write_recording
    from belt_sim.errors import whole
    from belt_sim.reports.terminal import tell_choice, tell_diagnosis
    from belt_sim.watch.observers import in_stages, progress, resolve_watch

    config: Any = run_dir.config
    watch = resolve_watch(config["watch"], "auto", "rrd")
    asked = {k: config[k] for k in ("effects", "bootstraps", "seed", "leave_out", "checked")}
    count = whole("bootstraps", config["bootstraps"], MIN_BOOTSTRAPS)
    with run_dir.outputs() as draft:
        campaign = read_campaign(run_dir.text_setting("campaign", "the folder of a campaign"))
        with progress(1.0, f"diagnosing {campaign.title}") as done:
            stages = in_stages(done, count)
            found = diagnose(campaign, config["model"]["name"], **asked, progress=stages, tell=print, config=config)
        tell_choice(config, found.base_model)
        tell_diagnosis(found, run_dir.path)
        write_diagnosis(draft, found)
        if config["pictures"]:
            draw_diagnosis(draft, found)
        if watch == "rrd":
            write_recording(draft, campaign, found)
