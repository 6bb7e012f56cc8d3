"""belt-sim simulate: one model, one case."""

from pathlib import Path
from typing import Any

from belt_sim.commands.run_folder import done_before, job_title, plain, run_folder
from belt_sim.config import case_from, model_settings
from belt_sim.errors import InputError
from belt_sim.provenance import provenance
from belt_sim.reports.terminal import tell_simulation
from belt_sim.use_cases.asked import model_of
from belt_sim.use_cases.centring import Centring, centred_after, centring_asked
from belt_sim.use_cases.leave import leave_simulation, partial_curves_kept
from belt_sim.use_cases.simulate import on_engine, simulate
from belt_sim.use_cases.watched import observers_of, show
from belt_sim.watch.asked import watch_asked


def run(cfg: Any) -> float | None:
    """Run one simulation and leave summary.json, curves.csv and pictures in the run folder.

    Returns what ``objective`` makes of the run, for a sweeper that searches.
    """
    config, folder = plain(cfg), run_folder()
    wanted = centring_asked(config["objective"])
    watch, pictures = watch_asked(config["watch"], "rrd", "rerun", "viewer"), config["pictures"]
    if not isinstance(pictures, bool):
        raise InputError("pictures", pictures, "", "use true or false")
    if done_before(folder, config):
        print(f"done before, kept: {folder}")
        return _reached(folder, wanted)
    case, model = case_from(config), on_engine(model_of(model_settings(config["model"])), config["engine"])
    asked = {k: config[k] for k in ("effects", "travel")}
    observers = observers_of(model, watch, job_title(config), folder)
    with partial_curves_kept(folder):
        found = simulate(case, model=model, **asked, observers=observers, scene_path=folder / "scene.xml")
    leave_simulation(folder, found, pictures=pictures, provenance=provenance(config))
    show(found, model, watch, folder)
    tell_simulation(found, folder)
    return _reached(folder, wanted)


def _reached(folder: Path, wanted: Centring | None) -> float | None:
    if wanted is None:
        return None
    travel = centred_after(folder / "curves.csv", wanted)
    print(f"objective {travel:.4g}")
    return travel
