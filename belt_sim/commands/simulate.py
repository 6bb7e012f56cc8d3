"""belt-sim simulate: one model, one case."""

import sys
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.case import Case
from belt_sim.commands.run_folder import done_before, plain, run_folder
from belt_sim.config import case_from, ranged
from belt_sim.curves import Curves, late_rates, offsets
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.files import write_json
from belt_sim.model import Model, SteadyModel
from belt_sim.provenance import provenance
from belt_sim.registry import IN_SPACE, model_named
from belt_sim.tables import write_curves
from belt_sim.watch.asked import watch_asked

SUMMARY = "belt-summary/1"


def run(cfg: Any) -> None:
    """Run one simulation and leave summary.json, curves.csv and pictures in the run folder."""
    config, folder = plain(cfg), run_folder()
    watch_asked(config["watch"], "rrd", "rerun")
    if not isinstance(config["pictures"], bool):
        raise InputError("pictures", config["pictures"], "", "use true or false")
    if done_before(folder, config):
        print(f"done before, kept: {folder}")
        return
    case = case_from(config)
    name = str(config["model"]["name"])
    curves: Curves | None
    if name in IN_SPACE:
        from belt_sim.commands.simulate_3d import simulate_3d

        curves, extra = simulate_3d(case, config, folder)
    else:
        curves, extra = _analytic(case, config)
    _leave(case, curves, extra, config, folder)


def _analytic(case: Case, config: dict[str, Any]) -> tuple[Curves | None, dict[str, Any]]:
    from belt_sim.effects.load import load_effects

    settings = {k: v for k, v in config["model"].items() if k != "name"}
    for k in ("step", "keep"):
        if k in settings:
            ranged({f"model.{k}": settings[k]}, f"model.{k}")
    model, effects = model_named(config["model"]["name"], settings), load_effects(config["effects"])
    for e in effects:
        reason = model.refusal(e)
        if reason:
            raise CannotRepresent(f"effects = {e.id}: {reason}; leave it out or use model=beam_th2 or strip")
    extra: dict[str, Any] = {"effects": [_named(e) for e in effects]}
    if not effects and isinstance(model, SteadyModel):
        extra["steady_rate_mm_per_m"] = model.steady_rate(case) / si.MM_PER_M
    if not isinstance(model, Model):
        extra["note"] = f"{model.name} is a formula for the steady rate: it gives no curves and no offsets"
        return None, extra
    return model.run(case, effects, travel=float(config["travel"])), extra


def _named(effect) -> dict[str, Any]:
    return {"id": effect.id, "parameters": {n: float(getattr(effect, n)) for n in effect.parameters}}


def _leave(case: Case, curves: Curves | None, extra: dict[str, Any], config: dict[str, Any], folder: Path) -> None:
    summary = summarise(case, curves, extra, config)
    if curves is not None:
        write_curves(folder / "curves.csv", curves)
        if config["pictures"]:
            from belt_sim.pictures import curves_picture

            title = f"{config['model']['name']}, {float(config['tension']):g} N/mm²"
            curves_picture(folder / "curves.png", {config["model"]["name"]: curves}, title)
        if config["watch"] and config["model"]["name"] not in IN_SPACE:
            _watch(config, case, curves, folder)
    write_json(folder / "summary.json", summary)
    _tell(summary, folder)


def _watch(config: dict[str, Any], case: Case, curves: Curves, folder: Path) -> None:
    """Show an analytic run: a recording in the run folder, or the live viewer."""
    if config["watch"] == "rrd":
        from belt_sim.watch.record import record_curves

        record_curves(folder / "belt.rrd", {config["model"]["name"]: curves}, case=case)
        return
    from belt_sim.watch.drawn_curves import frames
    from belt_sim.watch.rerun import live

    viewer = live()
    viewer.start(case, float(config["travel"]))
    for frame in frames(case, curves):
        viewer.frame(frame)
    viewer.finish(curves)
    if sys.stdin.isatty():
        input("press Enter to close the viewer")


def summarise(case: Case, curves: Curves | None, extra: dict[str, Any], config: dict[str, Any]) -> dict[str, Any]:
    """The content of summary.json; rates in mm per m of travel, offsets in mm."""
    ends: tuple[float | None, float | None]
    if curves is None:
        rates, ends = np.full(4, extra["steady_rate_mm_per_m"] * si.MM_PER_M), (None, None)
    else:
        rates, ends = late_rates(curves), offsets(curves)
    summary: dict[str, Any] = {
        "schema": SUMMARY,
        "model": config["model"]["name"],
        "tension_n_per_mm2": float(config["tension"]),
        "yaw_deg": config["yaw"],
        "travel_m": float(config["travel"]),
        "rate_mm_per_m": {str(k + 1): float(r) / si.MM_PER_M for k, r in enumerate(rates)},
        "offset_mm": {k: None if e is None else e / si.MM for k, e in zip(("upper", "lower"), ends, strict=True)},
    }
    if curves is not None and curves.sag is not None:
        summary["sag_mm"] = float(np.asarray(curves.sag)[0]) / si.MM
    if curves is not None and curves.edge_stress is not None:
        slack = float(np.asarray(curves.edge_stress).min())
        summary["slackest_edge_n_per_mm2"] = slack / si.N_PER_MM2
        summary["slack_edge"] = slack < 0
    return summary | extra | {"provenance": provenance(config)}


def _tell(summary: dict[str, Any], folder: Path) -> None:
    rates = "  ".join(f"{k}: {v:+.4f}" for k, v in summary["rate_mm_per_m"].items())
    print(f"{summary['model']}, {summary['tension_n_per_mm2']:g} N/mm2: late rates in mm per m at points {rates}")
    if summary.get("slack_edge"):
        stress = summary["slackest_edge_n_per_mm2"]
        print(f"a belt edge goes slack ({stress:.1f} N/mm2): linear models overrate its bending there")
    if "note" in summary:
        print(summary["note"])
    print(folder)
