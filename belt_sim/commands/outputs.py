"""The files that results leave in the folder of a run, and who watches a run meanwhile."""

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, case_of
from belt_sim.curves import Curves, Frame, Observer, write_curves
from belt_sim.errors import BeltError, InputError, SimulationError
from belt_sim.io import write_json, write_text, write_with
from belt_sim.jax_setup import map_in_threads
from belt_sim.model import AnalyticModel, Model, SteadyModel
from belt_sim.results.diagnosis import Diagnosis, Discovery
from belt_sim.results.errors import Comparison
from belt_sim.results.json import diagnosis_json, discovery_json, file_json, summary_json, to_json
from belt_sim.results.simulation import Simulation

PARTIAL = "curves_partial.csv"
EVERY = 10.0  # [s] between two writings of what a run in 3D has so far


def write_simulation(folder: Path, s: Simulation, *, pictures: bool, provenance: Mapping[str, Any]) -> None:
    """summary.json, curves.csv and a picture."""
    if s.written_curves is not None:
        write_curves(folder / "curves.csv", s.written_curves)
    write_json(folder / "summary.json", summary_json(s, provenance))
    if pictures:
        draw(folder, s)


@contextmanager
def partial_curves_kept(folder: Path, observers: Sequence[Observer] = ()) -> Iterator[None]:
    """A run that diverges or is stopped leaves what it had as curves_partial.csv, which a run to the end removes."""
    partial = folder / PARTIAL
    partial.unlink(missing_ok=True)
    try:
        yield
    except SimulationError as failure:
        if failure.curves is not None and len(failure.curves.travel):
            write_curves(partial, failure.curves)
        raise
    except KeyboardInterrupt:
        for observer in observers:
            if isinstance(observer, CurvesSoFar):
                observer.write()
        raise
    partial.unlink(missing_ok=True)


class CurvesSoFar(Observer):
    """Writes positions and tilts of a run that goes on to curves_partial.csv, every ``EVERY`` seconds."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / PARTIAL
        self.rows: list[np.ndarray] = []
        self.written = time.monotonic()

    def frame(self, frame: Frame) -> None:
        """Keep this instant; before travel 0 the belt is still laid and tensioned."""
        if frame.travel < 0.0:
            return
        self.rows.append(np.array([frame.travel, *frame.points[:, 1]]))
        if time.monotonic() - self.written >= EVERY:
            self.write()

    def write(self) -> None:
        """What there is so far; y counts from travel 0."""
        self.written = time.monotonic()
        if self.rows:
            travel, *y = np.array(self.rows).T
            write_curves(self.path, Curves(travel=travel, y=np.array([row - row[0] for row in y])))


def write_comparison(folder: Path, c: Comparison, *, pictures: bool) -> None:
    """comparison.json (and the same as summary.json, which sweeps look for), per_run.csv and pictures."""
    from belt_sim.results.display import frame

    content = file_json(c)
    if c.per_run:
        rows = [{k: v for k, v in to_json(r).items() if not isinstance(v, dict)} for r in c.per_run]
        write_with(folder / "per_run.csv", lambda path: frame(rows).to_csv(path, index=False))
    write_json(folder / "comparison.json", content)
    write_json(folder / "summary.json", content)
    if pictures:
        draw(folder, c)


def write_diagnosis(folder: Path, d: Diagnosis, *, pictures: bool) -> None:
    """diagnosis.json, drawings.json, effects.yaml; what was discovered; report.html and, with pictures, those in it."""
    from belt_sim.api.resolve import effects_of
    from belt_sim.effects.load import save_effects

    write_json(folder / "drawings.json", file_json(d.drawings))
    spread = {e.id: {n: p.u for n, p in e.parameters.items()} for e in d.effects}
    write_text(folder / "effects.yaml", save_effects(effects_of(d.effects), spread))
    if d.discovery is not None and d.discovery.found:
        write_discovery(folder, d.discovery)
    write_json(folder / "diagnosis.json", diagnosis_json(d))
    write_page(folder, d, pictures=pictures)


def write_page(folder: Path, d: Diagnosis, *, pictures: bool) -> Path:
    """report.html and, with pictures, those in it as SVG files; each is drawn once."""
    from belt_sim.api.plot import report_pictures
    from belt_sim.show.report import write_report

    drawn: dict[str, str] = {}
    with numbers_first("the pictures of the report"):
        drawn = report_pictures(d) if pictures else {}
    for kind, svg in drawn.items():
        write_text(folder / f"{kind}.svg", svg)
    return write_report(folder / "report.html", d, drawn)


@contextmanager
def numbers_first(what: str) -> Iterator[None]:
    """Around the drawing of ``what``: a picture that cannot be drawn is told, and the numbers are kept."""
    try:
        yield
    except BeltError:
        raise
    except Exception as error:
        reason = (str(error).strip().splitlines() or [""])[0]
        print(f"belt-sim: {what}: not drawn ({type(error).__name__}: {reason})", file=sys.stderr)


def write_discovery(folder: Path, d: Discovery) -> None:
    """discovery.json, and found_law.yaml where a law was found."""
    if d.law_file:
        write_text(folder / "found_law.yaml", d.law_file)
    write_json(folder / "discovery.json", discovery_json(d))


def draw(folder: Path, result: Simulation | Comparison) -> None:
    """Every picture of a result, named by its kind."""
    from belt_sim.api.plot import drawings_by_kind

    for kind, drawn in drawings_by_kind(result).items():
        with numbers_first(f"{kind}.png"):
            drawn(folder / f"{kind}.png")


RECORDING = "belt.rrd"
WATCHED = ("native", "mjx")  # engines that show their instants as they go


def in_time(model: Model | SteadyModel) -> bool:
    """Whether a run of the model goes through its instants one by one, so that it can be watched meanwhile."""
    by_formula = isinstance(model, AnalyticModel) or not isinstance(model, Model)
    return not by_formula and getattr(model, "engine", "native") in WATCHED


def observers_of(model: Model | SteadyModel, watch: str | None, title: str, folder: Path) -> list[Observer]:
    """Who looks on while ``model`` runs in time: progress, curves so far, with watch = "rrd" a recording, "rerun" and
    "viewer" the live viewers of Rerun and MuJoCo."""
    if watch == "viewer" and getattr(model, "engine", None) != "native":
        raise InputError("watch", watch, "", "only a 3D belt of engine=native is MuJoCo's; use watch=rerun")
    if not in_time(model):
        return []
    from belt_sim.show.observers import ProgressObserver, ViewerObserver

    watching: list[Observer] = [ProgressObserver(title), CurvesSoFar(folder)]
    if watch == "viewer":
        watching.append(ViewerObserver())
    elif watch is not None:
        from belt_sim.show.rerun import RerunObserver

        watching.append(RerunObserver(folder / RECORDING if watch == "rrd" else None, model=model.name))
    return watching


def record(s: Simulation, model: Model | SteadyModel, watch: str | None, folder: Path) -> None:
    """Leave the recording of a finished run that was not watched meanwhile."""
    if watch == "rrd" and s.curves is not None and not in_time(model):
        from belt_sim.show.rerun import Overlay, record_runs, run_title

        title = run_title(s.case)
        overlay = Overlay(modelled={s.model: s.curves}, case=s.case)
        record_runs(folder / RECORDING, {title: overlay}, name=f"{s.model}, {title}")


def stay(s: Simulation, model: Model | SteadyModel, watching: Sequence[Observer], watch: str | None) -> None:
    """Show a run whose results are written: in the Rerun viewer until Enter is pressed, as a web page of this process
    until Ctrl-C; in MuJoCo's viewer until its window is closed."""
    from belt_sim.show.observers import ViewerObserver, has_display

    for observer in watching:
        if isinstance(observer, ViewerObserver):
            observer.wait()
    if watch != "rerun" or s.curves is None:
        return
    if not in_time(model):
        from belt_sim.show.geometry import frames
        from belt_sim.show.rerun import RerunObserver

        viewer = RerunObserver(model=s.model)
        viewer.start(s.case, s.travel)
        for frame in frames(s.case, s.curves):
            viewer.frame(frame)
        viewer.finish(s.curves)
    if not has_display():
        print("the page is served until Ctrl-C", flush=True)
        with suppress(KeyboardInterrupt):
            while True:
                time.sleep(1.0)
        print()
    elif not in_time(model) and sys.stdin.isatty():
        input("press Enter to close the viewer")


def write_recording(folder: Path, campaign: Campaign, d: Diagnosis) -> None:
    """comparison.rrd, a tab a run: what was measured, the base model and, where effects were found, the final model."""
    from belt_sim.api.resolve import effects_of, fitted_model
    from belt_sim.diagnosis.readings.samples import samples_of
    from belt_sim.show.rerun import Overlay, record_runs, run_title

    samples, model, effects = samples_of(campaign), fitted_model(d.base_model), effects_of(d.effects)
    variants = {model.name: ()} | ({"with " + ", ".join(e.id for e in effects): effects} if effects else {})

    def overlay(r: int) -> Overlay:
        case, end = case_of(campaign, samples.runs[r]), float(samples.travel[r].max())
        modelled = {name: model.run(case, acting, travel=end) for name, acting in variants.items()}
        return Overlay(modelled=modelled, measured=_measured_curves(samples, r), case=case)

    runs = range(len(samples.runs))
    first = [overlay(r) for r in runs[:1]]  # compiles, before there are several threads
    overlays = [*first, *map_in_threads(overlay, runs[1:])]
    titles = [f"{run.name}, {run_title(o.case)}" for run, o in zip(samples.runs, overlays, strict=True)]
    record_runs(folder / "comparison.rrd", dict(zip(titles, overlays, strict=True)), name=campaign.title)


def _measured_curves(samples: Any, r: int) -> Curves:
    y, tilt = np.full((4, samples.y.shape[2]), np.nan), np.full((2, samples.y.shape[2]), np.nan)
    for s, signal in enumerate(samples.signals):
        if signal.at.startswith("point_"):
            y[int(signal.at[-1]) - 1] = samples.y[r, s]
        elif signal.kind == "tilt":
            tilt[0 if signal.at.startswith("upper") else 1] = samples.y[r, s]
    return Curves(travel=samples.travel[r], y=y, tilt=tilt if np.isfinite(tilt).any() else None)
