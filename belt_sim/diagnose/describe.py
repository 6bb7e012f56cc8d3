"""A diagnosis as diagnosis.json, which other programs read (schema belt-diagnosis/1)."""

from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.diagnose.candidate import Estimate, estimates
from belt_sim.diagnose.confusable import probabilities, selection_frequency
from belt_sim.diagnose.diagnosis import Diagnosis
from belt_sim.diagnose.heldout import held_out
from belt_sim.diagnose.openset import shape_card
from belt_sim.diagnose.verdict import sentence
from belt_sim.diagnose.where import validation_uncertainty, where
from belt_sim.diagnose.workbench import Workbench
from belt_sim.provenance import provenance

SCHEMA = "belt-diagnosis/1"
COVERAGE_95 = 1.96
WORSE = 1.5  # a run counts as worse only beyond this many times its floor


def describe(d: Diagnosis, *, seed: int, config: Any = None) -> dict[str, Any]:
    """The content of diagnosis.json; lengths in mm, parameters in SI."""
    campaign, chosen = d.bench.campaign, d.found.chosen
    ids = chosen.ids if d.verdict != "cannot_say" else ()
    frequency = selection_frequency(d.found, seed)
    source = provenance(config) | {"seed": seed, "data_sha256": campaign.sha256}
    return {
        "schema": SCHEMA,
        "base_model": d.bench.forward.model.name,
        "campaign": {"title": campaign.title, "sha256": campaign.sha256, "source": campaign.source.kind},
        "verdict": d.verdict,
        "sentence": sentence(d.verdict, d.bench.forward.model.name, ids, d.suspicions),
        "effects": _effects(d) if ids else [],
        "ranking": [_ranked(d, t, frequency) for t in d.ranking],
        "rounds": [[_tried(t) for t in trials] for trials in d.found.rounds],
        "error": _errors(d),
        "where": where(d.bench, d.found.base.values),
        "confusables": [{"a": r.effect, "b": r.other, "sigma": r.sigma} for r in d.rivals],
        "next_runs": _next_runs(d),
        "unknown": _unknown(d),
        "open_set": {
            "failed": list(d.left.failed),
            "gain": d.left.gain,
            "threshold": _finite(d.left.threshold),
        },
        "noise": _noise(d),
        "suspicions": [
            {"run": s.run, "signal": s.signal, "kind": s.kind, "sentence": s.sentence} for s in d.suspicions
        ],
        "per_run": error_rows(d.found.bench, d.found.base.values, d.found.chosen.values),
        "provenance": source,
    }


def _next_runs(d: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "action": a.action,
            "separates": list(a.separates),
            "sigma_before": a.sigma_before,
            "sigma_after": a.sigma_after,
        }
        for a in d.advice
    ]


def _noise(d: Diagnosis) -> dict[str, Any]:
    return {
        "white_factor": d.bench.levels.white,
        "wander_factor": d.bench.levels.wander,
        "repeats": d.bench.levels.repeats,
        "source": "repeated runs" if d.bench.levels.repeats else "as stated in the campaign",
    }


def _effects(d: Diagnosis) -> list[dict[str, Any]]:
    weights = probabilities(d.found)
    found = estimates(d.bench.forward, d.found.chosen)
    rejected = d.verdict in ("partly", "none_known")
    rows = []
    for name in d.found.chosen.ids:
        row: dict[str, Any] = {
            "id": name,
            "parameters": {n: _number(e) for n, e in found[name].items()},
            "probability": weights.get(name, 1.0),
            "confusable_with": [r.other for r in d.rivals if r.effect == name],
        }
        if rejected:
            row["stamp"] = "effective value, model rejected"
        rows.append(row)
    return rows


def _number(e: Estimate) -> dict[str, Any]:
    interval = [e.value - COVERAGE_95 * e.u, e.value + COVERAGE_95 * e.u]
    return {"value": e.value, "u": e.u, "unit": e.unit, "interval_95": interval, "plausible": e.plausible}


def _ranked(d: Diagnosis, t, frequency: dict[str, float]) -> dict[str, Any]:
    return _tried(t) | {
        "parameters": {n: _number(e) for n, e in estimates(d.bench.forward, t.fit)[t.id].items()},
        "plausible": t.plausible,
        "selection_frequency": frequency.get(t.id, 0.0),
        "note": _note(t, d.found.base_held_out.chi2),
    }


def _note(t, base_chi2: float) -> str:
    if t.gain <= t.threshold:
        return "not needed"
    if not t.plausible:
        return "implausible value"
    return "held-out error falls" if t.held_out.chi2 < base_chi2 else "held-out error stays"


def _tried(t) -> dict[str, Any]:
    threshold = t.threshold if np.isfinite(t.threshold) else None
    return {"id": t.id, "gain": t.gain, "threshold": threshold, "held_out_rms_mm": t.held_out.rms / si.MM}


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    return {k: v if np.isfinite(v) else None for k, v in values.items()}


def _errors(d: Diagnosis) -> dict[str, Any]:
    rows = rms_rows(d.found.bench, d.found.base.values, d.found.chosen.values)
    before, after = d.found.base_held_out, held_out(d.found.bench, d.found.chosen)
    return {
        "fit": rows["fit"],
        "held_out": {"before_mm": before.rms / si.MM, "after_mm": after.rms / si.MM},
        "held_out_by_condition": {
            name: {
                "before_mm": before.by_condition[name] / si.MM,
                "after_mm": after.by_condition[name] / si.MM,
            }
            for name in after.by_condition
        },
        "noise_floor_mm": rows["noise_floor_mm"],
    }


def _unknown(d: Diagnosis) -> dict[str, Any] | None:
    if d.verdict not in ("partly", "none_known", "cannot_say"):
        return None
    if not d.left.failed:
        return None
    last = max(d.found.rounds[-1] if d.found.rounds else [], key=lambda t: t.gain, default=None)
    nearest = None
    if last is not None:
        missing = max(d.left.gain.values(), default=0.0)
        nearest = (
            last.id,
            f"it takes a chi2 of {last.gain:.0f} of what stands out ({missing:.0f} in the worst test)",
        )
    return shape_card(d.found.bench, d.found.chosen, d.left, nearest)


def error_rows(bench: Workbench, before: np.ndarray, after: np.ndarray) -> list[dict[str, Any]]:
    """rms before and after of every run and signal [mm or mrad], with its floor; worse: it got worse beyond that."""
    floor = validation_uncertainty(bench)
    rows = []
    for r, run in enumerate(bench.samples.runs):
        for s, signal in enumerate(bench.samples.signals):
            y = bench.samples.y[r, s]
            if not np.isfinite(y).any():
                continue
            first, then = (_rms(y - values[r, s]) for values in (before, after))
            least = _rms(np.where(np.isfinite(y), floor[r, s], np.nan))
            rows.append(
                {
                    "run": run.name,
                    "signal": signal.name,
                    "tension": run.tension / si.N_PER_MM2,
                    "yaw_deg": run.yaw / si.DEGREE,
                    "use": run.use,
                    "before_mm": first,
                    "after_mm": then,
                    "floor_mm": least,
                    "worse": bool(then > first and then > WORSE * least),
                }
            )
    return rows


def rms_rows(bench: Workbench, before: np.ndarray, after: np.ndarray) -> dict[str, Any]:
    """rms of the lateral signals [mm] before and after, over fitted and hold-out runs, and the noise floor."""
    lateral = np.array([s.kind == "lateral" for s in bench.samples.signals])
    fitted = np.array([r.use == "fit" for r in bench.samples.runs])
    floor = validation_uncertainty(bench)[:, lateral][np.isfinite(bench.samples.y[:, lateral])]
    rows: dict[str, Any] = {"noise_floor_mm": float(np.sqrt(np.mean(floor**2)) / si.MM)}
    for name, mask in (("fit", fitted), ("held_out", ~fitted)):
        if mask.any():
            y = bench.samples.y[mask][:, lateral]
            first, then = (_rms(y - values[mask][:, lateral]) for values in (before, after))
            rows[name] = {"before_mm": first, "after_mm": then}
    return rows


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(x**2)) * 1e3)
