"""Write results as JSON in the units of users, read a diagnosis back, and give the JSON schemas of files."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from belt_sim.errors import BeltError, InputError
from belt_sim.io import read_json
from belt_sim.results.diagnosis import Diagnosis, Discovery
from belt_sim.results.errors import Check, Comparison, Drawings
from belt_sim.results.estimates import IN_SI
from belt_sim.units import round_digits

DIAGNOSIS, COMPARISON = "belt-diagnosis/1", "belt-comparison/1"
RUNS = "belt-run-errors/2"  # version 1 called every unit mm
DRAWINGS, DISCOVERY, CHECK = "belt-drawings/1", "belt-discovery/2", "belt-check/1"
DRAWING_DIGITS, DISCOVERY_DIGITS = 6, 8  # significant digits of a drawing, of a discovery
Json = dict[str, Any]

WRITTEN: dict[str, Any] = {CHECK: Check, COMPARISON: Comparison, DIAGNOSIS: Diagnosis, DISCOVERY: Discovery}
WRITTEN[DRAWINGS] = Drawings


@cache
def adapter(kind: Any) -> TypeAdapter[Any]:
    """Return pydantic's reader and writer of a type of results."""
    return TypeAdapter(kind)


def schema(name: str) -> Json:
    """Return the JSON schema (draft 2020-12) of the files that name themselves ``name``: belt-diagnosis/1 ..."""
    made: Json = adapter(WRITTEN[name]).json_schema(mode="serialization", by_alias=name != DISCOVERY)
    made["properties"] = {"schema": {"const": name}} | made["properties"]
    made["required"] = ["schema", *made.get("required", ())]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | made


def file_json(result: Check | Comparison | Drawings | Diagnosis | Discovery) -> Json:
    """Return the content of check.json, diagnosis.json (parameters in SI), discovery.json (our own names, SI
    throughout), comparison.json or drawings.json, from which a report can be written again without the diagnosis."""
    kind: Any = type(result)
    head: Json = {"schema": next(name for name, known in WRITTEN.items() if known is kind)}
    if isinstance(result, Discovery):
        content: Json = round_numbers(adapter(kind).dump_python(result, mode="json", by_alias=False), DISCOVERY_DIGITS)
        if content["error"] is not None:
            empty: Json = {"fit": None, "held_out": None, "by_condition": {}, "untestable": [], "own": None}
            content["error"] = empty | content["error"]
        return head | content

    content = adapter(kind).dump_python(result, mode="json", by_alias=True)
    if isinstance(result, Diagnosis):
        found = {} if result.discovery is None else {"discovery": file_json(result.discovery)}
        return head | {"runs_schema": RUNS} | content | found
    if isinstance(result, Drawings):
        content = round_numbers(content, DRAWING_DIGITS)
    return head | content | ({"runs_schema": RUNS} if "per_run" in content else {})


def round_numbers(x: Any, digits: int) -> Any:
    """Return nested mappings and lists with floats to so many significant digits; None for what is not finite."""
    if isinstance(x, Mapping):
        return {k: round_numbers(v, digits) for k, v in x.items()}
    if isinstance(x, list):
        return [round_numbers(v, digits) for v in x]
    if isinstance(x, float):
        return round_digits(x, digits) if np.isfinite(x) else None
    return x


def read_diagnosis(folder: Path) -> Diagnosis:
    """Read the diagnosis of a run folder; raise InputError if it holds none, or one of another version."""
    folder = Path(folder)
    try:
        content, drawn = (read_json(folder / f"{name}.json") for name in ("diagnosis", "drawings"))
    except (OSError, BeltError) as error:
        remedy = "give the run folder of a diagnosis (it holds diagnosis.json and drawings.json)"
        raise InputError("diagnosis", str(folder), "", remedy) from error
    return diagnosis_of(content, drawn, str(folder / "diagnosis.json"))


def diagnosis_of(content: Json, drawn: Json, where: str) -> Diagnosis:
    """Build a diagnosis from the contents of diagnosis.json and drawings.json; raises InputError, naming ``where``, if
    they are damaged or of another version."""
    versions = [(content, "schema", DIAGNOSIS), (content, "runs_schema", RUNS), (drawn, "schema", DRAWINGS)]
    parts: Json = {"discovery": None}
    try:
        if (found := content.get("discovery")) is not None:
            versions.append((found, "schema", DISCOVERY))
        for one, key, name in versions:
            if one[key] != name:
                raise ValueError(f"{key} is {one[key]!r}, not {name}")
        if found is not None:
            own: Json = {"by_alias": False, "by_name": True, "context": IN_SI}
            parts["discovery"] = adapter(Discovery).validate_python(dict(found), **own)
        parts["drawings"] = adapter(Drawings).validate_python(drawn)
        read: Diagnosis = adapter(Diagnosis).validate_python(content | parts)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        said = str(error)
        if isinstance(error, ValidationError):  # of many lines the first fault, with its place
            first = error.errors()[0]
            said = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        remedy = f"written by another version of belt-sim or damaged ({said}); run belt-sim diagnose again"
        raise InputError("diagnosis", where, "", remedy) from error
    return read
