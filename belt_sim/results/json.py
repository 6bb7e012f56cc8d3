"""Write results as JSON in the units of users, and read a diagnosis back; belt_sim/schemas describes the files."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.campaign import Suspicion
from belt_sim.case import Schedule
from belt_sim.errors import InputError
from belt_sim.results.comparison import Comparison
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.discovery import Against, Discovery, FoundLaw, PlaceEvidence, RivalLaw, UnknownCourse
from belt_sim.results.drawings import Drawings, Drift, FailureMap, Panel
from belt_sim.results.errors import UNITS, CampaignLabel, Change, Errors, Features, OwnChange, RunError, Where, Worst
from belt_sim.results.found import (
    Candidate,
    Confusable,
    Estimate,
    Explanation,
    FoundEffect,
    LeftOver,
    NextRun,
    NoiseLevels,
    RequiredAngle,
    RunSettings,
    Tried,
    Unknown,
)
from belt_sim.results.simulation import POINTS, SPANS, Simulation
from belt_sim.results.verdict import Verdict
from belt_sim.results.words import KILO

DIAGNOSIS, COMPARISON, SUMMARY = "belt-diagnosis/1", "belt-comparison/1", "belt-summary/1"
RUNS = "belt-run-errors/2"  # version 1 called every unit mm
DRAWINGS, DISCOVERY = "belt-drawings/1", "belt-discovery/1"
MICRO = 1e6
DIGITS, DISCOVERY_DIGITS = 6, 8  # significant digits of a drawing, of a discovery

Json = dict[str, Any]


def summary_json(s: Simulation, provenance: Mapping[str, Any]) -> Json:
    """Return the content of summary.json; rates in mm per m of travel, offsets in mm."""
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
    """Return the content of comparison.json."""
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
    """Return the content of diagnosis.json; parameters in SI."""
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
    """Return the content of drawings.json, so that a report can be written again without the diagnosis."""
    content: Json = {"schema": DRAWINGS}
    return content | {name: _rounded(rows) for name, rows in asdict(drawn).items()}


def run_json(r: RunError) -> Json:
    """Return one row of per_run; before, after and floor in ``unit``."""
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
    """Return the degrees of a step at travel 0, otherwise the list of {at, over, yaw} that ``yaw=`` takes."""
    at, over = np.asarray(schedule.at, float), np.asarray(schedule.over, float)
    degrees = [_as_set(a) for a in np.cumsum(schedule.change) / si.DEGREE]
    if len(at) == 1 and at[0] == over[0] == 0.0:
        return degrees[0]
    return [{"at": a, "over": o, "yaw": d} for a, o, d in zip(at.tolist(), over.tolist(), degrees, strict=True)]


def _as_set(value: float) -> float:
    """Round off the last digits that a change of units leaves."""
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
    """Return numbers that JSON does not know (inf) as words."""
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


KINDS = {unit: kind for kind, unit in UNITS.items()}


def read_diagnosis(folder: Path) -> Diagnosis:
    """Read the diagnosis of a run folder; raise InputError if it holds none, or one of another version."""
    try:
        content = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
        drawn = json.loads((folder / "drawings.json").read_text(encoding="utf-8"))
        if not (isinstance(content, dict) and isinstance(drawn, dict)):
            raise ValueError("no mapping")
    except (OSError, ValueError, RecursionError) as error:
        remedy = "give the run folder of a diagnosis (it holds diagnosis.json and drawings.json)"
        raise InputError("diagnosis", str(folder), "", remedy) from error
    return diagnosis_of(content, drawn, str(folder / "diagnosis.json"))


def diagnosis_of(content: dict[str, Any], drawn: dict[str, Any], where: str) -> Diagnosis:
    """Build a diagnosis from the contents of diagnosis.json and drawings.json.

    Raises InputError, naming ``where``, if they are damaged or of another version.
    """
    try:
        for key, wanted in (("schema", DIAGNOSIS), ("runs_schema", RUNS)):
            if content[key] != wanted:
                raise ValueError(f"{key} is {content[key]!r}, not {wanted}")
        if drawn["schema"] != DRAWINGS:
            raise ValueError(f"drawings.json has the schema {drawn['schema']!r}")
        return _read_diagnosis(content, _read_drawings(drawn))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        remedy = f"written by another version of belt-sim or damaged ({error}); run belt-sim diagnose again"
        raise InputError("diagnosis", where, "", remedy) from error


def _read_next_run(n: dict[str, Any]) -> NextRun:
    settings = n.get("settings")
    return NextRun(**n | {"separates": tuple(n["separates"]), "settings": settings and RunSettings(**settings)})


def _read_diagnosis(c: dict[str, Any], drawings: Drawings) -> Diagnosis:
    return Diagnosis(
        base_model=c["base_model"],
        campaign=CampaignLabel(**c["campaign"]),
        verdict=Verdict(c["verdict"]),
        sentence=c["sentence"],
        effects=tuple(_read_found(e) for e in c["effects"]),
        ranking=tuple(_read_candidate(r) for r in c["ranking"]),
        considered=tuple(_read_explanation(e) for e in c.get("considered", ())),
        rounds=tuple(tuple(Tried(**_read_tried(t)) for t in trials) for trials in c["rounds"]),
        error=_read_errors(c["error"]),
        where=_read_where(c["where"]),
        confusables=tuple(Confusable(effect=p["a"], other=p["b"], sigma=p["sigma"]) for p in c["confusables"]),
        next_runs=tuple(_read_next_run(n) for n in c["next_runs"]),
        unknown=None if c["unknown"] is None else _read_unknown(c["unknown"]),
        open_set=LeftOver(**c["open_set"] | {"failed": tuple(c["open_set"]["failed"])}),
        noise=NoiseLevels(**{k: v for k, v in c["noise"].items() if k != "source"}),
        suspicions=tuple(_read_suspicion(s) for s in c["suspicions"]),
        per_run=tuple(_read_run(r) for r in c["per_run"]),
        provenance=c["provenance"],
        admitted=tuple(c.get("admitted", ())),
        beyond=tuple(c.get("beyond_validity", ())),
        discovery=read_discovery(c["discovery"]) if "discovery" in c else None,
        drawings=drawings,
    )


def _read_suspicion(s: dict[str, Any]) -> Suspicion:
    """Return a suspicion; in the file the two signals of some kinds stand in one text, "y1 and y4"."""
    signal, of_two = s["signal"], s["kind"] in ("swapped", "same_place")
    signals = tuple(signal.split(" and ", 1) if of_two else [signal]) if signal else ()
    return Suspicion(run=s["run"], signals=signals, kind=s["kind"], sentence=s["sentence"], severity=s["severity"])


def _read_found(e: dict[str, Any]) -> FoundEffect:
    return FoundEffect(
        id=e["id"],
        numbers=e["numbers"],
        parameters=_read_estimates(e["parameters"]),
        probability=e["probability"],
        confusable_with=tuple(e["confusable_with"]),
        rejected="stamp" in e,
        source_file=e.get("source_file"),
        alone=_read_estimates(e.get("alone", {})),
    )


def _read_estimates(parameters: dict[str, Any]) -> dict[str, Estimate]:
    return {n: _read_estimate(p) for n, p in parameters.items()}


def _read_estimate(p: dict[str, Any]) -> Estimate:
    even, told = Estimate(*(p[k] for k in ("value", "u", "unit", "plausible"))), tuple(p["interval_95"])
    return even if told == even.interval_95 else replace(even, interval=told)


def _read_tried(t: dict[str, Any]) -> dict[str, Any]:
    return {k: t[k] for k in ("id", "gain", "threshold")} | {"held_out_rms": t["held_out_rms_mm"] * si.MM}


def _read_explanation(e: dict[str, Any]) -> Explanation:
    row = {k: e[k] for k in ("gain", "by_chance", "rarity")}
    return Explanation(effects=tuple(e["effects"]), **row, refused=e.get("refused", ""))


def _read_candidate(r: dict[str, Any]) -> Candidate:
    more = {k: r[k] for k in ("plausible", "selection_frequency", "note")}
    return Candidate(**_read_tried(r), parameters=_read_estimates(r["parameters"]), **more)


def _read_errors(e: dict[str, Any]) -> Errors:
    return Errors(
        noise_floor=e["noise_floor_mm"] * si.MM,
        fit=_read_change(e.get("fit")),
        held_out=_read_change(e.get("held_out")),
        by_condition={n: _read_pair(p) for n, p in e.get("held_out_by_condition", {}).items()},
        untestable=tuple(e.get("held_out_untestable", ())),
        own=_read_own(e.get("beside_settings")),
    )


def _read_change(pair: dict[str, float] | None) -> Change | None:
    return None if pair is None else _read_pair(pair)


def _read_own(own: dict[str, float] | None) -> OwnChange | None:
    return None if own is None else OwnChange(**vars(_read_pair(own)), floor=own["noise_floor_mm"] * si.MM)


def _read_pair(pair: dict[str, float]) -> Change:
    return Change(before=pair["before_mm"] * si.MM, after=pair["after_mm"] * si.MM)


def _read_where(w: dict[str, Any]) -> Where:
    worst, at = w["worst"], w["boundary_n_per_mm2"]
    place = {k: worst[k] for k in ("run", "signal", "ratio")}
    return Where(
        worst=Worst(**place, travel=tuple(worst["travel_m"])),
        sentence=w["sentence"],
        boundary=None if at is None else at * si.N_PER_MM2,
        boundary_sentence=w["boundary_sentence"],
    )


def _read_unknown(u: dict[str, Any]) -> Unknown:
    angle = u["required_contact_angle_urad"]
    return Unknown(
        failed_tests=tuple(u["failed_tests"]),
        onset=u["onset_m"],
        wavelength=u["wavelength_m"],
        required_angle=None
        if angle is None
        else RequiredAngle(travel=np.array(angle["travel_m"]), angle=np.array(angle["angle"]) / MICRO),
        **{k: u[k] for k in ("parity", "tension_exponent", "nearest", "why")},
    )


def _read_run(r: dict[str, Any]) -> RunError:
    as_written: dict[str, Any] = {k: r[k] for k in ("run", "signal", "use", "worse")}
    return RunError(
        **as_written,
        kind=KINDS[r["unit"]],
        tension=r["tension_n_per_mm2"] * si.N_PER_MM2,
        yaw=r["yaw_deg"] * si.DEGREE,
        **{k: r[k] / KILO for k in ("before", "after", "floor")},
        measured=_read_features(r["measured"], r["unit"]),
        modelled=_read_features(r["modelled"], r["unit"]),
    )


def _read_features(f: dict[str, Any], unit: str) -> Features:
    rate, overshoot = f[f"late_rate_{unit}_per_m"], f[f"overshoot_{unit}"]
    return Features(
        late_rate=None if rate is None else rate / KILO,
        first_move=f[f"travel_to_first_0.1{unit}_m"],
        overshoot=None if overshoot is None else overshoot / KILO,
    )


def _read_drawings(content: dict[str, Any]) -> Drawings:
    def drift(row: dict[str, Any] | None) -> Drift | None:
        return None if row is None else Drift(**_read_arrays(row))

    return Drawings(
        overlays=tuple(Panel(**_read_arrays(p)) for p in content["overlays"]),
        maps=tuple(FailureMap(**_read_arrays(m)) for m in content["maps"]),
        drifts=tuple((Drift(**_read_arrays(a)), drift(b)) for a, b in content["drifts"]),
    )


def _read_arrays(row: dict[str, Any]) -> dict[str, Any]:
    return {k: np.array(v, dtype=float) if isinstance(v, list) else v for k, v in row.items()}


def discovery_json(d: Discovery) -> dict[str, Any]:
    """Return the content of discovery.json."""
    content: dict[str, Any] = _plain(d)
    return {"schema": DISCOVERY} | content


def read_discovery(content: Mapping[str, Any]) -> Discovery:
    """Build a discovery from the content of discovery.json; raise InputError if damaged or of another version."""
    try:
        if content["schema"] != DISCOVERY:
            raise KeyError("schema")
        return _to_discovery({k: v for k, v in content.items() if k != "schema"})
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remedy = f"written by another version of belt-sim or damaged ({error}); run it again"
        raise InputError("discovery", "discovery.json", "", remedy) from error


def _plain(x: Any) -> Any:
    if is_dataclass(x) and not isinstance(x, type):
        told = [f.name for f in fields(x) if not (isinstance(x, Estimate) and f.name == "interval")]  # a law's are even
        return {name: _plain(getattr(x, name)) for name in told}
    if isinstance(x, Mapping):
        return {str(k): _plain(v) for k, v in x.items()}
    if isinstance(x, np.ndarray | list | tuple):
        return [_plain(v) for v in x]
    if isinstance(x, bool | np.bool_):
        return bool(x)
    if isinstance(x, float | np.floating):
        return float(f"{x:.{DISCOVERY_DIGITS}g}") if np.isfinite(x) else None
    return int(x) if isinstance(x, np.integer) else x


def _to_discovery(c: dict[str, Any]) -> Discovery:
    return Discovery(
        **c
        | {
            "campaign": CampaignLabel(**c["campaign"]),
            "beside": tuple(c["beside"]),
            "places": tuple(PlaceEvidence(**p) for p in c["places"]),
            "courses": tuple(UnknownCourse(**_read_arrays(u)) for u in c["courses"]),
            "law": None if c["law"] is None else _to_law(c["law"]),
            "rivals": tuple(RivalLaw(**r) for r in c["rivals"]),
            "against": tuple(Against(**_read_arrays(a)) for a in c["against"]),
            "curve": None if c["curve"] is None else Against(**_read_arrays(c["curve"])),
            "error": None if c["error"] is None else _discovery_errors(c["error"]),
            "limits": tuple(c["limits"]),
        }
    )


def _to_law(c: dict[str, Any]) -> FoundLaw:
    exponent = None if c["exponent"] is None else Estimate(**c["exponent"])
    return FoundLaw(**c | {"exponent": exponent, "parameters": {n: Estimate(**e) for n, e in c["parameters"].items()}})


def _discovery_errors(c: dict[str, Any]) -> Errors:
    change = {n: None if c[n] is None else Change(**c[n]) for n in ("fit", "held_out")}
    return Errors(
        noise_floor=c["noise_floor"],
        by_condition={n: Change(**v) for n, v in c["by_condition"].items()},
        untestable=tuple(c.get("untestable", ())),
        own=None if c.get("own") is None else OwnChange(**c["own"]),
        **change,
    )
