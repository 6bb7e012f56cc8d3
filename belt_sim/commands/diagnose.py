"""belt-sim diagnose: which physical effect the model lacks."""

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from belt_sim.commands.run_folder import done_before, plain, run_folder


def run(cfg: Any) -> None:
    """Diagnose a campaign and leave diagnosis.json, report.html, effects.yaml and pictures in the run folder."""
    config, folder = plain(cfg), run_folder()
    if done_before(folder, config):
        print(f"done before, kept: {folder}")
        return
    from belt_sim.use_cases.draw_apart import drawing_apart

    with drawing_apart() if config["pictures"] else nullcontext() as draw:  # imports what it needs beside this process
        found = _diagnosed(config, folder, draw)
    from belt_sim.reports.terminal import tell_diagnosis

    tell_diagnosis(found, folder)


def _diagnosed(config: Any, folder: Path, draw: Callable[..., None] | None) -> Any:
    """The diagnosis, and all that it leaves but the pictures, which ``draw`` begins to draw."""
    from belt_sim.campaign import read_campaign
    from belt_sim.commands.ahead import recorder_imported
    from belt_sim.use_cases.diagnose import MIN_BOOTSTRAPS, diagnose
    from belt_sim.use_cases.leave import leave_diagnosis, leave_recording
    from belt_sim.watch.asked import watch_asked
    from belt_sim.watch.progress import in_stages, progress
    from belt_sim.whole_number import whole

    watch = watch_asked(config["watch"], "auto", "rrd")
    asked = {k: config[k] for k in ("effects", "bootstraps", "seed", "leave_out")}
    campaign = read_campaign(str(config["campaign"]))
    count = whole("bootstraps", config["bootstraps"], MIN_BOOTSTRAPS)
    with progress(1.0, f"diagnosing {campaign.title}") as done:
        stages = in_stages(done, count)
        stages = recorder_imported(stages) if watch == "rrd" else stages
        shown = partial(draw, folder) if draw else lambda found: None
        found = diagnose(
            campaign, config["model"]["name"], **asked, progress=stages, tell=print, shown=shown, config=config
        )
        stages(0, "writing the report")
        beside = found.effects and found.discovery is not None and found.discovery.found  # else it is drawn already
        leave_diagnosis(folder, found, draw=draw if beside else None)
        if watch == "rrd":
            leave_recording(folder, campaign, found)
    return found
