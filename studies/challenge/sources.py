"""Where campaigns come from: functions that draw one, and the truth behind it, from a seed."""

import importlib
from collections.abc import Callable

from belt_sim.campaign import Campaign
from belt_sim.errors import InputError
from belt_sim.virtual_rig import Truth, random_campaign, random_nothing_campaign, random_stranger_campaign
from belt_sim.virtual_rig.space_lot import random_space_campaign

Draw = Callable[[int], tuple[Campaign, Truth]]


SOURCES: dict[str, Draw] = {
    "mix": random_campaign,
    "strangers": random_stranger_campaign,
    "nothing": random_nothing_campaign,
    "space": random_space_campaign,
}


#: Processor seconds that a campaign takes, coarsely: to draw it, and to answer it.
SECONDS = {"mix": (1.0, 25.0), "nothing": (1.0, 25.0), "strangers": (3.0, 60.0), "space": (30.0, 20.0)}


def cost(name: str, count: int, workers: int) -> str:
    """What ``count`` campaigns of a source take, in a sentence; empty for a source of one's own."""
    if name not in SECONDS:
        return ""
    draw, answer = SECONDS[name]
    minutes = max(count * (draw + answer) / workers / 60.0, 1.0)
    many = f"{count} campaigns, {workers} process{'es' if workers > 1 else ''}"
    return f"{many}: some {minutes:.0f} min on quiet cores ({draw:.0f} s each to draw, {answer:.0f} s to answer)"


def source(name: str) -> Draw:
    """A source by its name, or one's own as ``module:function``; raises InputError when there is none."""
    if name in SOURCES:
        return SOURCES[name]
    return function(name, "source", SOURCES)


def function(name: str, key: str, known) -> Callable:
    """A function of one's own by ``module:function``; raises InputError naming what else there is."""
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError):
        raise InputError(key, name, "", f"use one of {', '.join(known)}, or module:function") from None
