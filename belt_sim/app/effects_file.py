"""Effects from a dropped effects.yaml: numbers for effects of the library, never code."""

from collections.abc import Mapping
from typing import Any

import yaml

from belt_sim.campaign.marked_yaml import parse
from belt_sim.campaign.problems import CampaignError, Problem, quoted
from belt_sim.effects.library import library
from belt_sim.effects.load import SCHEMA, load_effects
from belt_sim.errors import InputError

LARGEST = 64 * 1024  # bytes; all effects at once have a tenth of it
NO_CODE = "code is not run from this page; name it on the command line: belt-sim diagnose effects=[my_effect.py]"


def read_effects(name: str, data: bytes) -> list[dict[str, Any]]:
    """Effects as [{id: taper, kappa_t: 2e-5}]; raises InputError, CampaignError for what is not of the library."""
    if name.lower().endswith(".py"):
        raise InputError("effects", name, "", NO_CODE)
    if len(data) > LARGEST:
        raise InputError("effects", name, "", f"must be at most {LARGEST // 1024} kB; is this an effects.yaml?")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("effects", name, "", "not UTF-8; save the file as UTF-8 text") from error
    problems: list[Problem] = []
    parse(text, name, problems)  # syntax, anchors, aliases
    if problems:
        raise CampaignError(problems[:1])
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:  # a tag
        raise InputError("effects", name, "", "not plain YAML; write names and numbers, without tags") from error
    if not isinstance(content, Mapping) or content.get("schema") != SCHEMA or not _is_list(content.get("effects")):
        raise InputError("effects", name, "", f"write 'schema: {SCHEMA}' and a list 'effects:'")
    found = [_flat(name, entry) for entry in content["effects"] or []]
    load_effects(found)  # names and numbers
    return found


def _is_list(entries: Any) -> bool:
    return entries is None or isinstance(entries, list)


def _flat(name: str, entry: Any) -> dict[str, Any]:
    """{id: taper, parameters: {kappa_t: 2e-5}} as {id: taper, kappa_t: 2e-5}."""
    if not isinstance(entry, Mapping) or not isinstance(entry.get("id"), str):
        raise InputError("effects", name, "", "every entry needs an id and its parameters")
    if entry["id"].endswith(".py"):
        raise InputError("effects", quoted(entry["id"]), "", NO_CODE)
    if entry["id"] not in library():
        raise InputError("effects", quoted(entry["id"]), "", f"use one of {', '.join(library())}")
    parameters = entry.get("parameters") or {}
    if not isinstance(parameters, Mapping):
        raise InputError(f"effects.{entry['id']}.parameters", quoted(parameters), "", "write name: number, one a line")
    return {str(k): v for k, v in entry.items() if k != "parameters"} | {str(k): v for k, v in parameters.items()}
