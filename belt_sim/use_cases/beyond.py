"""Whether a model is used beyond its validity: one question of simulate and of diagnose."""

import math
from collections.abc import Sequence
from typing import Any

from belt_sim.analytic.model import AnalyticModel
from belt_sim.campaign import Campaign
from belt_sim.campaign.types import case_of
from belt_sim.case import Case
from belt_sim.validity import Limit, exceeded, geometric

#: limits that a belt in three dimensions does not have: it moves, shears, turns far and hangs as it is
_NOT_IN_SPACE = ("flat_belt", "second_order", "shear", "deep_sag", "fast_belt")


def beyond(case: Case, model: Any, effects: Sequence[str] = ()) -> tuple[Limit, ...]:
    """The limits that ``model`` with ``effects`` (ids) is used beyond in one case, the worst first.

    A limp rope and formulas without curves claim no more than their limiting case: what machine and belt are beyond
    whatever the model is said of all.
    """
    found = _of_model(case, model, effects)
    there = {x.id for x in found} | ({*_NOT_IN_SPACE, "short_span", "edge_stretch"} if _in_space(model) else set())
    there |= {"edge_stretch"} if any(x.id == "slack_edge" for x in found) else set()
    return (*found, *(x for x in geometric(case) if x.id not in there))


def _in_space(model: Any) -> bool:
    """Whether a model is a belt in three dimensions; asking for its class would load MuJoCo."""
    return hasattr(model, "options")


def _of_model(case: Case, model: Any, effects: Sequence[str]) -> tuple[Limit, ...]:
    if isinstance(model, AnalyticModel):
        return exceeded(case, {*model.contains, *effects}) if model.moments else ()
    if not _in_space(model) or "sag_roll" not in model.contains:
        return ()
    slips = ("slip",) if math.isfinite(model.options.friction) else ()
    return exceeded(case, {*model.contains, *effects, *_NOT_IN_SPACE, *slips})


def beyond_in_runs(campaign: Campaign, model: AnalyticModel, effects: Sequence[str]) -> tuple[str, ...]:
    """A sentence a limit that some runs of a campaign are beyond."""
    found = [(run.name, limit) for run in campaign.runs for limit in beyond(case_of(campaign, run), model, effects)]
    sentences = []
    for name in dict.fromkeys(limit.id for _, limit in found):
        runs = [run for run, limit in found if limit.id == name]
        worst = max((limit for _, limit in found if limit.id == name), key=lambda x: x.load)
        many = f"{len(runs)} of {len(campaign.runs)} runs" if len(runs) > 1 else f"run {runs[0]}"
        sentences.append(f"model used beyond {name} in {many} (up to {worst.load:.2g} times the limit): {worst.words}")
    return tuple(sentences)
