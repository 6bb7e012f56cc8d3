"""belt-sim compare: a model against measurements; with effects, before and after."""

from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.commands.laid_out import campaign_from, model_from
from belt_sim.commands.run_folder import done_before, plain, run_folder
from belt_sim.commands.tell import tell_comparison
from belt_sim.errors import CannotRepresent
from belt_sim.files import write_json
from belt_sim.provenance import provenance

SCHEMA = "belt-comparison/1"


def run(cfg: Any) -> None:
    """Compare and leave comparison.json, summary.json, tables and pictures in the run folder."""
    config, folder = plain(cfg), run_folder()
    if done_before(folder, config):
        print(f"done before, kept: {folder}")
        return
    compare_into(config, folder)


def compare_into(config: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The work itself; returns the content of comparison.json."""
    from belt_sim.effects.load import load_effects

    campaign = campaign_from(config)
    model = model_from(config, curves=any(len(r.travel) for r in campaign.runs))
    effects = load_effects(config["effects"])
    for e in effects:
        reason = model.refusal(e)
        if reason:
            raise CannotRepresent(f"effects = {e.id}: {reason}")
    steady = _steady(campaign, model, effects, config, folder)
    if not any(len(r.travel) for r in campaign.runs) and steady:
        content = {"schema": SCHEMA, "base_model": model.name, "steady": steady, "provenance": provenance(config)}
        write_json(folder / "comparison.json", content)
        write_json(folder / "summary.json", content)
        return content
    return _curves(campaign, model, effects, config, folder) | {"steady": steady}


def _steady(campaign, model, effects, config, folder: Path) -> list[dict[str, Any]]:
    from belt_sim.commands.compare_steady import compare_steady, draw_steady, tell_steady

    rows = compare_steady(campaign, model, effects)
    if rows:
        name = model.name + "".join(f" + {e.id}" for e in effects)
        tell_steady(rows, name)
        if config["pictures"]:
            draw_steady(folder / "steady.png", rows, name, campaign.title)
    return rows


def _curves(campaign, model, effects, config, folder: Path) -> dict[str, Any]:
    """The comparison of curves."""
    from belt_sim.diagnose.workbench import workbench

    bench = workbench(campaign, model, [type(e) for e in effects])
    base = bench.forward.null()
    final = base.copy()
    for k, slot in enumerate(bench.forward.slots):
        owner = next(e for e in effects if type(e) is slot.effect)
        final[k] = float(getattr(owner, slot.name)) / slot.scale
    values = bench.forward.values(np.stack([base, final]))
    content = _content(bench, effects, values[0], values[1], config)
    _leave(bench, content, (base, values[0]), (final, values[1]) if effects else None, config, folder)
    tell_comparison(content, folder)
    return content


def _content(bench, effects, before, after, config) -> dict[str, Any]:
    from belt_sim.diagnose.describe import error_rows, rms_rows
    from belt_sim.diagnose.features import features
    from belt_sim.diagnose.where import where

    rows = error_rows(bench, before, after)
    names = [r.name for r in bench.samples.runs]
    places = [s.name for s in bench.samples.signals]
    for row in rows:
        r, s = names.index(row["run"]), places.index(row["signal"])
        travel = bench.samples.travel[r]
        row["measured"] = features(travel, bench.samples.y[r, s])
        row["modelled"] = features(travel, (after if effects else before)[r, s])
    return {
        "schema": SCHEMA,
        "base_model": bench.forward.model.name,
        "campaign": {"title": bench.campaign.title, "sha256": bench.campaign.sha256},
        "effects": [{"id": e.id, "parameters": {n: float(getattr(e, n)) for n in e.parameters}} for e in effects],
        "error": rms_rows(bench, before, after),
        "where": where(bench, after if effects else before),
        "per_run": rows,
        "provenance": provenance(config) | {"data_sha256": bench.campaign.sha256},
    }


def _leave(bench, content, before, after, config, folder: Path) -> None:
    import pandas as pd

    from belt_sim.diagnose.drawings import maps, overlays
    from belt_sim.diagnose.drift_chart import stiffness_drift
    from belt_sim.files import write_with

    flat = [{k: v for k, v in row.items() if not isinstance(v, dict)} for row in content["per_run"]]
    write_with(folder / "per_run.csv", lambda path: pd.DataFrame(flat).to_csv(path, index=False))
    if config["pictures"]:
        from belt_sim import pictures

        names = {
            "base": content["base_model"],
            "final": "with " + ", ".join(e["id"] for e in content["effects"]),
        }
        title, shown = content["campaign"]["title"], after or before
        panels = overlays(bench, before[1], after[1] if after else None)
        pictures.overlay_picture(folder / "overlay.png", panels, title, names=names)
        pictures.where_map_picture(folder / "where.png", maps(bench, shown[1]), title, content["where"]["sentence"])
        drifts = (stiffness_drift(bench, before[0]), stiffness_drift(bench, after[0]) if after else None)
        if drifts[0] is not None:
            pictures.drift_chart_picture(folder / "drift.png", [drifts], title)
            content["drift"] = [_drift(d) for d in drifts if d is not None]
    write_json(folder / "comparison.json", content)
    write_json(folder / "summary.json", content)


def _drift(d) -> dict[str, Any]:
    plain_arrays = {k: v.tolist() for k, v in vars(d).items() if isinstance(v, np.ndarray)}
    return {"parameter": d.parameter, "unit": d.unit, "stated": d.stated, **plain_arrays}
