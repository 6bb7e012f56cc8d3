"""What results leave in the folder of a run."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.errors import RunFailed
from belt_sim.files import write_json, write_text, write_with
from belt_sim.results.comparison import Comparison
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.discovery import Discovery
from belt_sim.results.json import comparison_json, diagnosis_json, discovery_json, drawings_json, run_json, summary_json
from belt_sim.results.simulation import Simulation
from belt_sim.tables import write_curves

OVERLAY = "overlay"
#: picture of a diagnosis -> its file
_OF_DIAGNOSIS = {
    OVERLAY: "overlay.png",
    "headline": "headline.png",
    "where": "where.png",
    "ranking": "ranking.png",
    "drift": "drift_1.png",
}


def leave_simulation(folder: Path, s: Simulation, *, pictures: bool, provenance: Mapping[str, Any]) -> None:
    """summary.json, curves.csv and a picture."""
    if s.curves is not None:
        write_curves(folder / "curves.csv", s.curves)
    if pictures:
        draw(folder, s, {"curves": "curves.png"})
    write_json(folder / "summary.json", summary_json(s, provenance))


@contextmanager
def partial_curves_kept(folder: Path) -> Iterator[None]:
    """A run that diverges leaves what it had as curves_partial.csv."""
    try:
        yield
    except RunFailed as failure:
        if failure.curves is not None and len(failure.curves.travel):
            write_curves(folder / "curves_partial.csv", failure.curves)
        raise


def leave_comparison(folder: Path, c: Comparison, *, pictures: bool) -> None:
    """comparison.json (and the same as summary.json, which sweeps look for), per_run.csv and pictures."""
    from belt_sim.results.display import frame

    content = comparison_json(c)
    if c.per_run:
        rows = [{k: v for k, v in run_json(r).items() if not isinstance(v, dict)} for r in c.per_run]
        write_with(folder / "per_run.csv", lambda path: frame(rows).to_csv(path, index=False))
    if pictures:
        draw(folder, c, {kind: f"{kind}.png" for kind in ("overlay", "where", "drift", "steady")})
    write_json(folder / "comparison.json", content)
    write_json(folder / "summary.json", content)


def leave_diagnosis(folder: Path, d: Diagnosis, *, draw: Callable[[Path, Diagnosis], None] | None) -> None:
    """diagnosis.json, drawings.json, report.html, effects.yaml, pictures; what was discovered, with its effect file.

    draw: draws the pictures (``draw_diagnosis``, or a process beside this one); None: there are none.
    """
    from belt_sim.effects.load import save_effects
    from belt_sim.reports.page import write_report
    from belt_sim.use_cases.asked import effects_of

    if draw is not None:
        draw(folder, d)
    write_json(folder / "drawings.json", drawings_json(d.drawings))
    spread = {e.id: {n: p.u for n, p in e.parameters.items()} for e in d.effects}
    write_text(folder / "effects.yaml", save_effects(effects_of(d.effects), spread))
    write_report(folder / "report.html", d)
    if d.discovery is not None and d.discovery.found:
        leave_discovery(folder, d.discovery)
    write_json(folder / "diagnosis.json", diagnosis_json(d))


def leave_discovery(folder: Path, d: Discovery) -> None:
    """discovery.json, and found_effect.py where a law was found."""
    if d.effect_file:
        write_text(folder / "found_effect.py", d.effect_file)
    write_json(folder / "discovery.json", discovery_json(d))


def leave_recording(folder: Path, campaign: Campaign, d: Diagnosis) -> None:
    """comparison.rrd: what was measured, the base model and the final model."""
    from belt_sim.diagnosis.answer.recording import record_campaign
    from belt_sim.use_cases.asked import effects_of, fitted_model

    record_campaign(folder / "comparison.rrd", campaign, fitted_model(d.base_model), effects_of(d.effects))


def draw_diagnosis(folder: Path, d: Diagnosis) -> None:
    """The still pictures of a diagnosis, and of what was discovered."""
    draw_own(folder, d)
    draw_found(folder, d)


def draw_own(folder: Path, d: Diagnosis, wanted: Callable[[str], bool] = lambda kind: True) -> None:
    """The pictures of a diagnosis itself, of those kinds that are wanted."""
    draw(folder, d, {kind: name for kind, name in _OF_DIAGNOSIS.items() if wanted(kind)})


def draw_found(folder: Path, d: Diagnosis) -> None:
    """The pictures of what was discovered, where something was."""
    from belt_sim.use_cases.plot import draw_discovery

    if d.discovery is not None and d.discovery.found:
        draw_discovery(folder, d.discovery)


def draw(folder: Path, result: Simulation | Comparison | Diagnosis, files: Mapping[str, str]) -> None:
    """Every picture of ``files`` (kind -> file name) that the result has."""
    from belt_sim.use_cases.plot import drawings_by_kind

    there = drawings_by_kind(result)
    for kind, name in files.items():
        if kind in there:
            there[kind](folder / name)
