"""A discovery as JSON, in SI, and back."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from belt_sim.errors import InputError
from belt_sim.results.discovery import Against, Discovery, FoundLaw, PlaceEvidence, RivalLaw, UnknownCourse
from belt_sim.results.errors import Change, Errors, OwnChange
from belt_sim.results.found import Estimate
from belt_sim.results.label import CampaignLabel

SCHEMA = "belt-discovery/1"
DIGITS = 8


def discovery_json(d: Discovery) -> dict[str, Any]:
    """The content of discovery.json."""
    content: dict[str, Any] = _plain(d)
    return {"schema": SCHEMA} | content


def read_discovery(content: Mapping[str, Any]) -> Discovery:
    """The discovery of a discovery.json; raises InputError for one of another version or a damaged one."""
    try:
        if content["schema"] != SCHEMA:
            raise KeyError("schema")
        return _discovery({k: v for k, v in content.items() if k != "schema"})
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
        return float(f"{x:.{DIGITS}g}") if np.isfinite(x) else None
    return int(x) if isinstance(x, np.integer) else x


def _discovery(c: dict[str, Any]) -> Discovery:
    return Discovery(
        **c
        | {
            "campaign": CampaignLabel(**c["campaign"]),
            "beside": tuple(c["beside"]),
            "places": tuple(PlaceEvidence(**p) for p in c["places"]),
            "courses": tuple(UnknownCourse(**_arrays(u)) for u in c["courses"]),
            "law": None if c["law"] is None else _law(c["law"]),
            "rivals": tuple(RivalLaw(**r) for r in c["rivals"]),
            "against": tuple(Against(**_arrays(a)) for a in c["against"]),
            "curve": None if c["curve"] is None else Against(**_arrays(c["curve"])),
            "error": None if c["error"] is None else _errors(c["error"]),
            "limits": tuple(c["limits"]),
        }
    )


def _law(c: dict[str, Any]) -> FoundLaw:
    exponent = None if c["exponent"] is None else Estimate(**c["exponent"])
    return FoundLaw(**c | {"exponent": exponent, "parameters": {n: Estimate(**e) for n, e in c["parameters"].items()}})


def _errors(c: dict[str, Any]) -> Errors:
    change = {n: None if c[n] is None else Change(**c[n]) for n in ("fit", "held_out")}
    return Errors(
        noise_floor=c["noise_floor"],
        by_condition={n: Change(**v) for n, v in c["by_condition"].items()},
        untestable=tuple(c.get("untestable", ())),
        own=None if c.get("own") is None else OwnChange(**c["own"]),
        **change,
    )


def _arrays(row: dict[str, Any]) -> dict[str, Any]:
    return {k: np.array(v, dtype=float) if isinstance(v, list) else v for k, v in row.items()}
