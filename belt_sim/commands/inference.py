"""belt-sim check, compare, diagnose and report: what a campaign tells of a model."""

from pathlib import Path
from typing import Any

from belt_sim.api import inference
from belt_sim.campaign import read_campaign
from belt_sim.commands.outputs import write_comparison, write_diagnosis, write_page, write_recording
from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import finite, whole
from belt_sim.io import write_json
from belt_sim.results.json import file_json, read_diagnosis
from belt_sim.show.diagnosis import visible_picture
from belt_sim.show.observers import in_stages, progress, resolve_watch
from belt_sim.show.terminal import tell, tell_choice, tell_diagnosis


def check(run_dir: RunDir) -> None:
    """Check a campaign or a plan and leave check.json and check.png in the run folder."""
    config, folder = run_dir.config, run_dir.path
    for key in ("travel", "step"):
        finite(key, config[key], "m", "give a length in metres", lambda x: x > 0)
    asked = {k: config[k] for k in ("effects", "travel", "step", "advise")}
    found = inference.check(run_dir.campaign, config["model"], **asked, config=config)
    write_json(folder / "check.json", file_json(found))
    if config["pictures"] and found.visible:
        visible_picture(folder / "check.png", found.visible, found.campaign.title)
    tell_choice(config, found.base_model)
    tell(found.tables(), [*found.lines(), folder / "check.json"])


def compare(run_dir: RunDir) -> None:
    """Compare and leave comparison.json, summary.json, tables and pictures in the run folder."""
    config = run_dir.config
    asked, pictures = (run_dir.campaign, config["model"], config["effects"]), config["pictures"]
    with run_dir.outputs() as draft:
        found = inference.compare(*asked, drawn=pictures, config=config)
        write_comparison(draft, found, pictures=pictures)
    tell_choice(config, found.base_model)
    tell(found.tables(), [*found.lines()[1:], run_dir.path])  # the first line is the title of the table


def diagnose(run_dir: RunDir) -> None:
    """Diagnose a campaign and leave diagnosis.json, report.html, effects.yaml and pictures in the run folder."""
    config: Any = run_dir.config
    watch, model = resolve_watch(config["watch"], "auto", "rrd"), config["model"]
    asked = {k: config[k] for k in ("effects", "bootstraps", "seed", "leave_out", "checked")}
    count = whole("bootstraps", config["bootstraps"], inference.MIN_BOOTSTRAPS)
    with run_dir.outputs() as draft:
        campaign = read_campaign(run_dir.campaign)
        with progress(1.0, f"diagnosing {campaign.title}") as done:
            stages = in_stages(done, count)
            found = inference.diagnose(campaign, model, **asked, progress=stages, tell=print, config=config)
        tell_choice(config, found.base_model)
        tell_diagnosis(found, run_dir.path, verbose=config["verbose"])
        write_diagnosis(draft, found, pictures=config["pictures"])
        if watch == "rrd":
            write_recording(draft, campaign, found)


def report(run_dir: RunDir) -> None:
    """Write report.html and pictures from diagnosis.json and drawings.json."""
    folder = Path(run_dir.text_setting("diagnosis", "the run folder of a diagnosis"))
    diagnosis = read_diagnosis(folder)
    print(write_page(folder, diagnosis, pictures=True))
