"""belt-sim check, compare, diagnose and report: what a campaign tells of a model."""

from collections.abc import Callable
from contextlib import suppress
from csv import DictWriter
from functools import partial
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.plot import draw_all, report_pictures, write_diagnosis, write_page
from belt_sim.api.simulate import effects_of, fitted_model, model_for_campaign, states_model
from belt_sim.campaign import Campaign, case_of, read_campaign
from belt_sim.commands.runs import RunDir
from belt_sim.curves import Curves
from belt_sim.errors import BeltError, whole
from belt_sim.io import write_json, write_text
from belt_sim.jax_setup import begin_in_thread, map_in_threads
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.files import file_json, read_diagnosis
from belt_sim.show.diagnosis import visible_picture
from belt_sim.show.terminal import in_stages, progress, resolve_watch, tell, tell_choice, tell_diagnosis


def tell_model(run_dir: RunDir, model: str) -> None:
    """Tell which model a campaign has and why, if none was stated; of a plan without runs, what is said of one case."""
    why = ""
    if not states_model(run_dir.config["model"]):
        with suppress(BeltError):
            why = model_for_campaign(read_campaign(run_dir.campaign)).partition(", as ")[2]
    tell_choice(run_dir.config, model, why)


def check_command(run_dir: RunDir) -> None:
    """Check a campaign or a plan and leave check.json and check.svg in the run folder."""
    from belt_sim.api.check import check

    config, folder = run_dir.config, run_dir.path
    asked = {k: config[k] for k in ("effects", "travel", "step", "advise")}
    found = check(run_dir.campaign, config["model"], **asked, config=config)
    write_json(folder / "check.json", file_json(found))
    if config["pictures"] and found.visible:
        visible_picture(folder / "check.svg", found.visible, found.campaign.title)
    tell_model(run_dir, found.base_model)
    tell(found.tables(), [*found.lines(), folder / "check.json"])


def compare_command(run_dir: RunDir) -> None:
    """Compare and leave comparison.json, summary.json, tables and pictures in the run folder."""
    from belt_sim.api.compare import compare

    config = run_dir.config
    asked, pictures = (run_dir.campaign, config["model"], config["effects"]), config["pictures"]
    with run_dir.outputs() as draft:
        found = compare(*asked, drawn=pictures, config=config)
        content = file_json(found)
        if found.per_run:
            rows = [{k: v for k, v in row.items() if not isinstance(v, dict)} for row in content["per_run"]]
            page = StringIO(newline="")
            table = DictWriter(page, rows[0], lineterminator="\n")
            table.writeheader()
            table.writerows(rows)
            write_text(draft / "per_run.csv", page.getvalue())
        for name in ("comparison.json", "summary.json"):  # which sweeps look for
            write_json(draft / name, content)
        if pictures:
            draw_all(draft, found)
    tell_model(run_dir, found.base_model)
    tell(found.tables(), [*found.lines(), run_dir.path])


#: what a diagnosis fits, draws and records with: it takes a second to load, beside the marches
FITS = ("scipy.optimize", "scipy.interpolate")
DRAWS = ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "matplotlib.figure", "matplotlib.style")
RECORDS = ("belt_sim.show.rerun", "pandas")


def diagnose_command(run_dir: RunDir) -> None:
    """Diagnose a campaign and leave diagnosis.json, report.html, effects.yaml and pictures in the run folder."""
    from belt_sim.api import inference

    config: Any = run_dir.config
    watch, model = resolve_watch(config["watch"], "auto", "rrd"), config["model"]
    asked = {k: config[k] for k in ("effects", "bootstraps", "seed", "leave_out", "checked")}
    whole("bootstraps", config["bootstraps"], inference.MIN_BOOTSTRAPS)
    ahead = [*FITS] + [*DRAWS] * config["pictures"] + [*RECORDS] * (watch == "rrd")
    with run_dir.outputs() as draft:
        campaign = read_campaign(run_dir.campaign)
        begin_in_thread(lambda: [*map(import_module, ahead)])
        drawn: list[Callable[[], dict[str, str]]] = []  # while the next run is chosen and the recording made
        with progress(1.0, "diagnosis", timed=False) as done:
            asked |= {"progress": in_stages(done), "tell": print, "config": config}
            if config["pictures"]:
                asked["shown"] = lambda found: drawn.append(begin_in_thread(partial(report_pictures, found)))
            found = inference.diagnose(campaign, model, **asked)
        tell_model(run_dir, found.base_model)
        tell_diagnosis(found, run_dir.path, verbose=config["verbose"])
        record = partial(write_recording, draft, campaign, found) if watch == "rrd" else lambda: None
        recorded = begin_in_thread(record)
        try:
            write_diagnosis(draft, found, *drawn)
        finally:
            recorded()  # before the folder goes, if that failed


def report_command(run_dir: RunDir) -> None:
    """Write report.html and pictures from diagnosis.json and drawings.json."""
    folder = Path(run_dir.text_setting("diagnosis", "the run folder of a diagnosis"))
    found = read_diagnosis(folder)
    print(write_page(folder, found, partial(report_pictures, found)))


def write_recording(folder: Path, campaign: Campaign, d: Diagnosis) -> None:
    """comparison.rrd, a tab a run: what was measured, the base model and, where effects were found, the final model."""
    from belt_sim.diagnosis.samples import samples_of
    from belt_sim.show.rerun import Overlay, record_runs, run_title

    samples, model, effects = samples_of(campaign), fitted_model(d.base_model), effects_of(d.effects)
    variants = {model.name: ()} | ({"with " + ", ".join(e.id for e in effects): effects} if effects else {})

    def overlay(r: int) -> Overlay:
        case, end = case_of(campaign, samples.runs[r]), float(samples.travel[r].max())
        y, tilt = np.full((4, samples.y.shape[2]), np.nan), np.full((2, samples.y.shape[2]), np.nan)
        for s, signal in enumerate(samples.signals):
            if signal.at.startswith("point_"):
                y[int(signal.at[-1]) - 1] = samples.y[r, s]
            elif signal.kind == "tilt":
                tilt[0 if signal.at.startswith("upper") else 1] = samples.y[r, s]
        measured = Curves(travel=samples.travel[r], y=y, tilt=tilt if np.isfinite(tilt).any() else None)
        modelled = {name: model.run(case, acting, travel=end) for name, acting in variants.items()}
        return Overlay(modelled=modelled, measured=measured, case=case)

    runs = range(len(samples.runs))
    first = [overlay(r) for r in runs[:1]]  # compiles, before there are several threads
    overlays = [*first, *map_in_threads(overlay, runs[1:])]
    titles = [f"{run.name}, {run_title(o.case)}" for run, o in zip(samples.runs, overlays, strict=True)]
    record_runs(folder / "comparison.rrd", dict(zip(titles, overlays, strict=True)), name=campaign.title)
