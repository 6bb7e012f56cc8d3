"""A diagnosis read back from its folder: diagnosis.json and drawings.json."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim import si
from belt_sim.campaign.quality.record import Suspicion
from belt_sim.errors import InputError
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.discovery_json import read_discovery
from belt_sim.results.drawings import Drawings, Drift, FailureMap, Panel
from belt_sim.results.errors import UNITS, Change, Errors, Features, OwnChange, RunError, Where, Worst
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
from belt_sim.results.label import CampaignLabel
from belt_sim.results.verdict import Verdict
from belt_sim.results.words import KILO
from belt_sim.results.written import DIAGNOSIS, DRAWINGS, MICRO, RUNS

KINDS = {unit: kind for kind, unit in UNITS.items()}


def read_diagnosis(folder: Path) -> Diagnosis:
    """The diagnosis of a run folder; raises InputError when it holds none, or one of another version."""
    try:
        content = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
        drawn = json.loads((folder / "drawings.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        remedy = "give the run folder of a diagnosis (it holds diagnosis.json and drawings.json)"
        raise InputError("diagnosis", str(folder), "", remedy) from error
    return diagnosis_of(content, drawn, str(folder / "diagnosis.json"))


def diagnosis_of(content: dict[str, Any], drawn: dict[str, Any], where: str) -> Diagnosis:
    """The diagnosis of what diagnosis.json and drawings.json hold; raises InputError, naming ``where``, if damaged."""
    try:
        for key, wanted in (("schema", DIAGNOSIS), ("runs_schema", RUNS)):
            if content[key] != wanted:
                raise ValueError(f"{key} is {content[key]!r}, not {wanted}")
        if drawn["schema"] != DRAWINGS:
            raise ValueError(f"drawings.json has the schema {drawn['schema']!r}")
        return _diagnosis(content, _drawings(drawn))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remedy = f"written by another version of belt-sim or damaged ({error}); run belt-sim diagnose again"
        raise InputError("diagnosis", where, "", remedy) from error


def _next_run(n: dict[str, Any]) -> NextRun:
    settings = n.get("settings")
    return NextRun(**n | {"separates": tuple(n["separates"]), "settings": settings and RunSettings(**settings)})


def _diagnosis(c: dict[str, Any], drawings: Drawings) -> Diagnosis:
    return Diagnosis(
        base_model=c["base_model"],
        campaign=CampaignLabel(**c["campaign"]),
        verdict=Verdict(c["verdict"]),
        sentence=c["sentence"],
        effects=tuple(_found(e) for e in c["effects"]),
        ranking=tuple(_candidate(r) for r in c["ranking"]),
        considered=tuple(_explanation(e) for e in c["considered"]),
        rounds=tuple(tuple(Tried(**_tried(t)) for t in trials) for trials in c["rounds"]),
        error=_errors(c["error"]),
        where=_where(c["where"]),
        confusables=tuple(Confusable(effect=p["a"], other=p["b"], sigma=p["sigma"]) for p in c["confusables"]),
        next_runs=tuple(_next_run(n) for n in c["next_runs"]),
        unknown=None if c["unknown"] is None else _unknown(c["unknown"]),
        open_set=LeftOver(**c["open_set"] | {"failed": tuple(c["open_set"]["failed"])}),
        noise=NoiseLevels(**{k: v for k, v in c["noise"].items() if k != "source"}),
        suspicions=tuple(_suspicion(s) for s in c["suspicions"]),
        per_run=tuple(_run(r) for r in c["per_run"]),
        provenance=c["provenance"],
        admitted=tuple(c.get("admitted", ())),
        beyond=tuple(c.get("beyond_validity", ())),
        discovery=read_discovery(c["discovery"]) if "discovery" in c else None,
        drawings=drawings,
    )


def _suspicion(s: dict[str, Any]) -> Suspicion:
    """Return a suspicion; in the file the two signals of some kinds stand in one text, "y1 and y4"."""
    signal, of_two = s["signal"], s["kind"] in ("swapped", "same_place")
    signals = tuple(signal.split(" and ", 1) if of_two else [signal]) if signal else ()
    return Suspicion(run=s["run"], signals=signals, kind=s["kind"], sentence=s["sentence"], severity=s["severity"])


def _found(e: dict[str, Any]) -> FoundEffect:
    return FoundEffect(
        id=e["id"],
        numbers=e["numbers"],
        parameters=_estimates(e["parameters"]),
        probability=e["probability"],
        confusable_with=tuple(e["confusable_with"]),
        rejected="stamp" in e,
        source_file=e.get("source_file"),
        alone=_estimates(e.get("alone", {})),
    )


def _estimates(parameters: dict[str, Any]) -> dict[str, Estimate]:
    return {n: _estimate(p) for n, p in parameters.items()}


def _estimate(p: dict[str, Any]) -> Estimate:
    even, told = Estimate(*(p[k] for k in ("value", "u", "unit", "plausible"))), tuple(p["interval_95"])
    return even if told == even.interval_95 else replace(even, interval=told)


def _tried(t: dict[str, Any]) -> dict[str, Any]:
    return {k: t[k] for k in ("id", "gain", "threshold")} | {"held_out_rms": t["held_out_rms_mm"] * si.MM}


def _explanation(e: dict[str, Any]) -> Explanation:
    row = {k: e[k] for k in ("gain", "by_chance", "rarity")}
    return Explanation(effects=tuple(e["effects"]), **row, refused=e.get("refused", ""))


def _candidate(r: dict[str, Any]) -> Candidate:
    more = {k: r[k] for k in ("plausible", "selection_frequency", "note")}
    return Candidate(**_tried(r), parameters=_estimates(r["parameters"]), **more)


def _errors(e: dict[str, Any]) -> Errors:
    return Errors(
        noise_floor=e["noise_floor_mm"] * si.MM,
        fit=_change(e.get("fit")),
        held_out=_change(e.get("held_out")),
        by_condition={n: _pair(p) for n, p in e.get("held_out_by_condition", {}).items()},
        untestable=tuple(e.get("held_out_untestable", ())),
        own=_own(e.get("beside_settings")),
    )


def _change(pair: dict[str, float] | None) -> Change | None:
    return None if pair is None else _pair(pair)


def _own(own: dict[str, float] | None) -> OwnChange | None:
    return None if own is None else OwnChange(**vars(_pair(own)), floor=own["noise_floor_mm"] * si.MM)


def _pair(pair: dict[str, float]) -> Change:
    return Change(before=pair["before_mm"] * si.MM, after=pair["after_mm"] * si.MM)


def _where(w: dict[str, Any]) -> Where:
    worst, at = w["worst"], w["boundary_n_per_mm2"]
    place = {k: worst[k] for k in ("run", "signal", "ratio")}
    return Where(
        worst=Worst(**place, travel=tuple(worst["travel_m"])),
        sentence=w["sentence"],
        boundary=None if at is None else at * si.N_PER_MM2,
        boundary_sentence=w["boundary_sentence"],
    )


def _unknown(u: dict[str, Any]) -> Unknown:
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


def _run(r: dict[str, Any]) -> RunError:
    as_written: dict[str, Any] = {k: r[k] for k in ("run", "signal", "use", "worse")}
    return RunError(
        **as_written,
        kind=KINDS[r["unit"]],
        tension=r["tension_n_per_mm2"] * si.N_PER_MM2,
        yaw=r["yaw_deg"] * si.DEGREE,
        **{k: r[k] / KILO for k in ("before", "after", "floor")},
        measured=_features(r["measured"], r["unit"]),
        modelled=_features(r["modelled"], r["unit"]),
    )


def _features(f: dict[str, Any], unit: str) -> Features:
    rate, overshoot = f[f"late_rate_{unit}_per_m"], f[f"overshoot_{unit}"]
    return Features(
        late_rate=None if rate is None else rate / KILO,
        first_move=f[f"travel_to_first_0.1{unit}_m"],
        overshoot=None if overshoot is None else overshoot / KILO,
    )


def _drawings(content: dict[str, Any]) -> Drawings:
    def drift(row: dict[str, Any] | None) -> Drift | None:
        return None if row is None else Drift(**_arrays(row))

    return Drawings(
        overlays=tuple(Panel(**_arrays(p)) for p in content["overlays"]),
        maps=tuple(FailureMap(**_arrays(m)) for m in content["maps"]),
        drifts=tuple((Drift(**_arrays(a)), drift(b)) for a, b in content["drifts"]),
    )


def _arrays(row: dict[str, Any]) -> dict[str, Any]:
    return {k: np.array(v, dtype=float) if isinstance(v, list) else v for k, v in row.items()}
