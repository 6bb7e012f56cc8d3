"""Results as JSON: the one place where they become names and numbers of a file, in the units people read.

The files are described by belt_sim/schemas; belt_sim.results.read reads a diagnosis back.
"""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.campaign import Suspicion
from belt_sim.case import Schedule
from belt_sim.results.comparison import Comparison
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.discovery_json import discovery_json
from belt_sim.results.drawings import Drawings, Drift
from belt_sim.results.errors import Change, Errors, Features, RunError, Where
from belt_sim.results.found import Candidate, Estimate, Explanation, FoundEffect, Tried, Unknown
from belt_sim.results.label import CampaignLabel
from belt_sim.results.simulation import POINTS, SPANS, Simulation
from belt_sim.results.words import KILO

DIAGNOSIS, COMPARISON, SUMMARY = "belt-diagnosis/1", "belt-comparison/1", "belt-summary/1"
RUNS = "belt-run-errors/2"  # version 1 called every unit mm
DRAWINGS = "belt-drawings/1"
MICRO = 1e6
DIGITS = 6  # significant digits of a drawing

Json = dict[str, Any]


def summary_json(s: Simulation, provenance: Mapping[str, Any]) -> Json:
    """The content of summary.json; rates in mm per m of travel, offsets in mm."""
    ends = dict(zip(SPANS, s.offsets or (None, None), strict=True))
    content: Json = {
        "schema": SUMMARY,
        "model": s.model,
        "tension_n_per_mm2": _as_set(float(s.case.settings.tension) / si.N_PER_MM2),
        "yaw_deg": _yaw(s.case.settings.yaw),
        "travel_m": s.travel,
        "rate_mm_per_m": {str(k): float(r) / si.MM_PER_M for k, r in zip(POINTS, s.rates, strict=True)},
        "offset_mm": {k: None if e is None else e / si.MM for k, e in ends.items()},
    }
    content["settled"] = s.settled
    if s.sag is not None:
        content["sag_mm"] = s.sag / si.MM
    if s.slackest_edge is not None:
        content |= {"slackest_edge_n_per_mm2": s.slackest_edge / si.N_PER_MM2, "slack_edge": s.slackest_edge < 0}
    content["effects"] = [_set(e) for e in s.effects]
    if s.steady_rate is not None:
        content["steady_rate_mm_per_m"] = s.steady_rate / si.MM_PER_M
    if s.note:
        content["note"] = s.note
    if s.beyond:
        content["beyond_validity"] = {"limits": {x.id: x.load for x in s.beyond}, "sentence": s.warning}
    details = {name: _finite(value) for name, value in s.details.items()}
    return content | details | {"provenance": dict(provenance)}


def comparison_json(c: Comparison) -> Json:
    """The content of comparison.json."""
    content: Json = {
        "schema": COMPARISON,
        "base_model": c.base_model,
        "campaign": _label(c.campaign),
        "effects": [_set(e) for e in c.effects],
    }
    content |= {"error": _errors(c.error)} if c.error is not None else {}
    if c.where is not None:
        content |= {"where": _where(c.where), "runs_schema": RUNS, "per_run": [run_json(r) for r in c.per_run]}
    content |= {"beyond_validity": list(c.beyond)} if c.beyond else {}
    content["provenance"] = dict(c.provenance)
    drifts = [_drift(d) for pair in c.drawings.drifts for d in pair if d is not None]
    content |= {"drift": drifts} if drifts else {}
    return content | {
        "steady": [
            {
                "run": r.run,
                "point": r.point,
                "tension_n_per_mm2": _as_set(r.tension / si.N_PER_MM2),
                "measured_mm_per_m": r.measured / si.MM_PER_M,
                "modelled_mm_per_m": r.modelled / si.MM_PER_M,
                "u_mm_per_m": r.u / si.MM_PER_M,
                "ratio": r.ratio,
            }
            for r in c.steady
        ]
    }


def diagnosis_json(d: Diagnosis) -> Json:
    """The content of diagnosis.json; parameters in SI."""
    content: Json = {
        "schema": DIAGNOSIS,
        "base_model": d.base_model,
        "campaign": _label(d.campaign) | {"source": d.campaign.source},
        "verdict": str(d.verdict),
        "sentence": d.sentence,
        "effects": [_found(e) for e in d.effects],
        "ranking": [_candidate(c) for c in d.ranking],
        "considered": [_explanation(e) for e in d.considered],
        "rounds": [[_tried(t) for t in trials] for trials in d.rounds],
        "error": _errors(d.error),
        "where": _where(d.where),
        "confusables": [{"a": c.effect, "b": c.other, "sigma": c.sigma} for c in d.confusables],
        "next_runs": [asdict(n) | {"separates": list(n.separates)} for n in d.next_runs],
        "unknown": None if d.unknown is None else _unknown(d.unknown),
        "open_set": {
            "failed": list(d.open_set.failed),
            "gain": dict(d.open_set.gain),
            "threshold": dict(d.open_set.threshold),
        },
        "noise": asdict(d.noise) | {"source": d.noise.source},
        "suspicions": [_suspicion(s) for s in d.suspicions],
        "runs_schema": RUNS,
        "per_run": [run_json(r) for r in d.per_run],
        "provenance": dict(d.provenance),
    }
    content |= {"beyond_validity": list(d.beyond)} if d.beyond else {}
    content |= {"discovery": discovery_json(d.discovery)} if d.discovery is not None else {}
    return content | ({"admitted": list(d.admitted)} if d.admitted else {})


def _suspicion(s: Suspicion) -> Json:
    return {"run": s.run, "signal": s.signal, "kind": s.kind, "sentence": s.sentence, "severity": s.severity}


def drawings_json(drawn: Drawings) -> Json:
    """The content of drawings.json, so that a report can be written again without the diagnosis."""
    content: Json = {"schema": DRAWINGS}
    return content | {name: _rounded(rows) for name, rows in asdict(drawn).items()}


def run_json(r: RunError) -> Json:
    """One row of per_run; before, after and floor in ``unit``."""
    return {
        "run": r.run,
        "signal": r.signal,
        "tension_n_per_mm2": _as_set(r.tension / si.N_PER_MM2),
        "yaw_deg": _as_set(r.yaw / si.DEGREE),
        "use": r.use,
        "unit": r.unit,
        "before": KILO * r.before,
        "after": KILO * r.after,
        "floor": KILO * r.floor,
        "worse": r.worse,
        "measured": _features(r.measured, r.unit),
        "modelled": _features(r.modelled, r.unit),
    }


def _yaw(schedule: Schedule) -> float | list[Json]:
    """Degrees of a step at travel 0, otherwise the list of {at, over, yaw} that ``yaw=`` takes."""
    at, over = np.asarray(schedule.at, float), np.asarray(schedule.over, float)
    degrees = [_as_set(a) for a in np.cumsum(schedule.change) / si.DEGREE]
    if len(at) == 1 and at[0] == over[0] == 0.0:
        return degrees[0]
    return [{"at": a, "over": o, "yaw": d} for a, o, d in zip(at.tolist(), over.tolist(), degrees, strict=True)]


def _as_set(value: float) -> float:
    """A number as somebody set it, without what a change of units left at its end."""
    return float(f"{value:.12g}")


def _label(c: CampaignLabel) -> Json:
    return {"title": c.title, "sha256": c.sha256}


def _set(effect: Any) -> Json:
    return {"id": effect.id, "parameters": {n: float(getattr(effect, n)) for n in effect.parameters}}


def _found(e: FoundEffect) -> Json:
    row = {
        "id": e.id,
        "parameters": {n: _estimate(p) for n, p in e.parameters.items()},
        "numbers": dict(e.numbers),
        "probability": e.probability,
        "confusable_with": list(e.confusable_with),
    }
    row |= {"alone": {n: _estimate(p) for n, p in e.alone.items()}} if e.alone else {}
    row |= {"stamp": e.stamp} if e.stamp else {}
    return row | ({"source_file": e.source_file} if e.source_file else {})


def _estimate(p: Estimate) -> Json:
    row = asdict(p) | {"interval_95": list(p.interval_95)}
    row.pop("interval")
    return row


def _tried(t: Tried) -> Json:
    return {"id": t.id, "gain": t.gain, "threshold": t.threshold, "held_out_rms_mm": t.held_out_rms / si.MM}


def _explanation(e: Explanation) -> Json:
    row: Json = {"effects": list(e.effects), "gain": e.gain, "by_chance": e.by_chance, "rarity": e.rarity}
    return row | {"worth": e.worth} | ({"refused": e.refused} if e.refused else {})


def _candidate(c: Candidate) -> Json:
    return _tried(c) | {
        "parameters": {n: _estimate(p) for n, p in c.parameters.items()},
        "plausible": c.plausible,
        "selection_frequency": c.selection_frequency,
        "note": c.note,
    }


def _errors(e: Errors) -> Json:
    content: Json = {name: _change(row) for name, row in e.rows().items()}
    if e.by_condition:
        content["held_out_by_condition"] = {name: _change(row) for name, row in e.by_condition.items()}
    if e.untestable:
        content["held_out_untestable"] = list(e.untestable)
    if e.own is not None:
        content["beside_settings"] = _change(e.own) | {"noise_floor_mm": e.own.floor / si.MM}
    return content | {"noise_floor_mm": e.noise_floor / si.MM}


def _change(c: Change) -> Json:
    return {"before_mm": c.before / si.MM, "after_mm": c.after / si.MM}


def _where(w: Where) -> Json:
    return {
        "worst": {"run": w.worst.run, "signal": w.worst.signal, "travel_m": list(w.worst.travel)}
        | {"ratio": w.worst.ratio},
        "sentence": w.sentence,
        "boundary_n_per_mm2": None if w.boundary is None else w.boundary / si.N_PER_MM2,
        "boundary_sentence": w.boundary_sentence,
    }


def _features(f: Features, unit: str) -> Json:
    return {
        f"late_rate_{unit}_per_m": None if f.late_rate is None else KILO * f.late_rate,
        f"travel_to_first_0.1{unit}_m": f.first_move,
        f"overshoot_{unit}": None if f.overshoot is None else KILO * f.overshoot,
    }


def _unknown(u: Unknown) -> Json:
    angle = u.required_angle
    return {
        "failed_tests": list(u.failed_tests),
        "parity": u.parity,
        "tension_exponent": u.tension_exponent,
        "onset_m": u.onset,
        "wavelength_m": u.wavelength,
        "required_contact_angle_urad": None
        if angle is None
        else {"travel_m": angle.travel.tolist(), "angle": (MICRO * angle.angle).tolist()},
        "nearest": u.nearest,
        "why": u.why,
    }


def _drift(d: Drift) -> Json:
    arrays = {n: getattr(d, n).tolist() for n in ("tension", "value", "u")}
    return {"parameter": d.parameter, "unit": d.unit, "stated": d.stated} | arrays


def _finite(value: Any) -> Any:
    """Numbers that JSON does not know (inf) as words."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value


def _rounded(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _rounded(v) for k, v in x.items()}
    if isinstance(x, np.ndarray | list | tuple):
        return [_rounded(v) for v in x]
    if isinstance(x, float | np.floating):
        return float(f"{x:.{DIGITS}g}") if np.isfinite(x) else None
    return x
