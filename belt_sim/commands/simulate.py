"""belt-sim simulate: one model, one case."""

from pathlib import Path
from typing import Any

from belt_sim.api.resolve import model_of
from belt_sim.api.simulate import on_engine, simulate
from belt_sim.commands.objective import Centring, centred_after, centring_asked
from belt_sim.commands.outputs import RECORDING, observers_of, partial_curves_kept, show, write_simulation
from belt_sim.commands.run_dir import RunDir
from belt_sim.config import case_from, model_settings
from belt_sim.errors import InputError
from belt_sim.provenance import provenance
from belt_sim.reports.terminal import tell_simulation
from belt_sim.watch.observers import resolve_watch


def run(run_dir: RunDir, *, computed: Any = None, done: bool = False) -> float | None:
    """Run one simulation and leave summary.json, curves.csv and pictures in the run folder.

    computed: curves that a batch has found for the case; done: the result is there. Returns what ``objective`` makes
    of the run, for a search.
    """
    config, folder = run_dir.config, run_dir.path
    wanted = centring_asked(config["objective"])
    if done:
        return _reached(folder, wanted)
    watch, pictures = resolve_watch(config["watch"], "rrd", "rerun", "viewer"), config["pictures"]
    if not isinstance(pictures, bool):
        raise InputError("pictures", pictures, "", "use true or false")
    case, model = case_from(config), on_engine(model_of(model_settings(config["model"])), config["engine"])
    asked = {k: config[k] for k in ("effects", "travel")}
    observers = observers_of(model, watch, _title(run_dir), folder)
    with run_dir.outputs(RECORDING) as draft:
        with partial_curves_kept(folder, observers):
            scene = draft / "scene.xml"
            found = simulate(case, model=model, **asked, observers=observers, scene_path=scene, computed=computed)
        write_simulation(draft, found, pictures=pictures, provenance=provenance(config))
        show(found, model, watch, folder)
    tell_simulation(found, folder)
    return _reached(folder, wanted)


def _title(run_dir: RunDir) -> str:
    """What a run is called while it runs; in a sweep with its number, as several may run at once."""
    title = f"{run_dir.config['model']['name']}, {float(run_dir.config['tension']):g} N/mm2"
    return title if run_dir.case is None else f"{title}, job {run_dir.case}"


def _reached(folder: Path, wanted: Centring | None) -> float | None:
    if wanted is None:
        return None
    travel = centred_after(folder / "curves.csv", wanted)
    print(f"objective {travel:.4g}")
    return travel
