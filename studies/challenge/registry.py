"""Who draws the campaigns of a challenge, and who answers them: functions by name."""

import importlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign, read_campaign
from belt_sim.errors import InputError
from belt_sim.virtual_rig import Truth, random_campaign
from studies.challenge.campaigns import (
    FRESH_PLANS,
    fresh_campaign,
    plant_campaign,
    plant_span_campaign,
    random_span_campaign,
)  # fmt: skip
from studies.challenge.space_campaigns import random_space_campaign

Draw = Callable[[int], tuple[Campaign, Truth]]
SOURCES: dict[str, Draw] = {
    "mix": random_campaign,
    "strangers": partial(random_campaign, kind="outside"),
    "nothing": partial(random_campaign, kind="nothing"),
    "space": random_space_campaign,
    "span": random_span_campaign,
    "plant": plant_campaign,
    "plant_span": plant_span_campaign,
    **{name: partial(fresh_campaign, name=name) for name in FRESH_PLANS},
}


def source(name: str) -> Draw:
    """A source by its name, or one's own as ``module:function``; raises InputError when there is none."""
    if name in SOURCES:
        return SOURCES[name]
    return import_function(name, "source", SOURCES)


#: answer(folder of the campaign, bootstraps, seed, base model) -> content of diagnosis.json
Answer = Callable[[Path, int, int, str], dict[str, Any]]
#: parts of an answer that no score looks at, and that are long
_LONG = ("per_run", "runs_schema", "schema", "where", "provenance", "admitted")
_CURVES = ("courses", "against", "curve", "effect_file", "law_file", "campaign", "base_model")


def diagnose_folder(folder: Path, bootstraps: int, seed: int, base: str) -> dict[str, Any]:
    """What the diagnosis says of a campaign on disk."""
    from belt_sim.api.inference import diagnose
    from belt_sim.results.files import file_json

    content = file_json(diagnose(read_campaign(folder), base, bootstraps=bootstraps, seed=seed))
    kept = {key: value for key, value in content.items() if key not in _LONG}
    if "discovery" in kept:
        kept["discovery"] = {k: v for k, v in kept["discovery"].items() if k not in (*_LONG, *_CURVES)}
    return kept


OWN = "diagnosis"


def answerer(name: str) -> Answer:
    """Who answers, by name, or one's own as ``module:function``; raises InputError when there is none."""
    return diagnose_folder if name == OWN else import_function(name, "ablation", [OWN])


def import_function(name: str, key: str, known) -> Callable:
    """A function of one's own by ``module:function``; raises InputError naming what else there is."""
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError):
        raise InputError(key, name, "", f"use one of {', '.join(known)}, or module:function") from None
