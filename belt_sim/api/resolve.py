"""Resolve what people name (models, effects, candidates) to objects, and say where a model stops being valid."""

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from belt_sim.campaign.types import Campaign, case_of, sensor_place
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.diagnosis.forward import default_candidates
from belt_sim.effects.base import Effect, library
from belt_sim.effects.load import load_classes, load_effects
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.line.march import KEEP, STEP, march
from belt_sim.line.spans import RitzingerFormula
from belt_sim.model import (
    BY_TENSION,
    LAYER_TENSION,
    AnalyticModel,
    Model,
    ModelName,
    SteadyModel,
    model_for,
    model_named,
)
from belt_sim.results.diagnosis import FoundEffect
from belt_sim.settings import model_settings
from belt_sim.units import N_PER_MM2
from belt_sim.validity import Limit, exceeded_limits, geometric, run_limits

#: a model by name, by name and settings, or as an object
ModelSpec = ModelName | str | Mapping[str, Any] | Model | SteadyModel


def campaign_of(spec: Campaign | str | Path) -> Campaign:
    """A campaign by the name of one that ships, by its folder, or as it is; raises CampaignError, InputError."""
    if not isinstance(spec, Campaign | str | Path):
        remedy = "give a campaign, its folder, or the name of one that ships"
        raise InputError("campaign", type(spec).__name__, "", remedy)
    from belt_sim.campaign.folder import read_campaign  # files of a campaign: a run of a model has none

    return spec if isinstance(spec, Campaign) else read_campaign(spec)


def by_tension(spec: Any, tensions: Iterable[float]) -> Any:
    """``spec``, or where it states no model (None, "by_tension") the one for runs of these tensions [Pa]."""
    name = spec.get("name") if isinstance(spec, Mapping) else spec
    if name not in (None, BY_TENSION):
        return spec
    return {**(spec if isinstance(spec, Mapping) else {}), "name": model_for(tensions)}


def model_for_campaign(campaign: Campaign) -> str:
    """The model of a campaign for which none is stated, and after a comma why it is this one."""
    places = [place for s in campaign.signals if (place := sensor_place(s.at)) is not None]
    if campaign.source.kind == "synthetic":
        return "strip, as the virtual rig's belts leave their pulleys like a thread"
    name = model_for(run.tension for run in campaign.runs)
    if name != "strip" and not all(place.on_wrap for place in places):
        return "strip, as a sensor stands inside a span, of which strip_lift_off says nothing"
    slackest = min((run.tension for run in campaign.runs), default=0.0) / N_PER_MM2
    side = "below" if name != "strip" else "not below"
    return f"{name}, as the slackest run ({slackest:.4g} N/mm2) is {side} {LAYER_TENSION / N_PER_MM2:g} N/mm2"


def campaign_model(spec: Any, campaign: Campaign) -> Model | SteadyModel:
    """The model of ``spec``, or where it states none the one for all runs of a campaign; raises InputError.

    A synthetic campaign is judged by strip: belts of the virtual rig leave their pulleys like a thread.
    """
    if isinstance(spec, Mapping):
        model_settings(spec)
    name = spec.get("name") if isinstance(spec, Mapping) else spec
    if name in (None, BY_TENSION):
        own = model_for_campaign(campaign).partition(",")[0]
        spec = {**(spec if isinstance(spec, Mapping) else {}), "name": own}
    chosen = model_of(spec)
    if isinstance(chosen, AnalyticModel):
        for name, standard in (("step", STEP), ("keep", KEEP)):
            if (given := getattr(chosen, name)) != standard:
                remedy = "a campaign's march is as fine as its readings ask for; leave it out"
                raise InputError(f"model.{name}", given, "m", remedy)
    return chosen


def model_of(spec: Any) -> Model | SteadyModel:
    """A model by name, by mapping {name: strip, step: 0.05}, or as it is; raises InputError for anything else."""
    if isinstance(spec, Mapping) and "name" in spec:
        return model_named(str(spec["name"]), {k: v for k, v in spec.items() if k != "name"})
    if not isinstance(spec, str | Model | SteadyModel):
        raise InputError("model", spec, "", "give a name, as model=strip, or a mapping {name: strip, step: 0.05}")
    return model_named(spec) if isinstance(spec, str) else spec


def fitted_model(spec: Any) -> AnalyticModel:
    """A model that can be fitted to curves; raises CannotRepresent for the others."""
    model = closed_form_model(spec)
    if isinstance(model, RitzingerFormula):
        raise CannotRepresent(f"model = {model.name}: it gives a steady rate and no curves; use e.g. model=beam_th2")
    return model


def closed_form_model(spec: Any) -> AnalyticModel | RitzingerFormula:
    """A model in closed form; raises CannotRepresent for the others."""
    model = model_of(spec)
    if not isinstance(model, AnalyticModel | RitzingerFormula):
        raise CannotRepresent(f"model = {model.name}: an analytic model is needed here, e.g. model=strip")
    return model


def effects_of(asked: Any) -> tuple[Effect, ...]:
    """Effects with numbers.

    asked: None, an effects.yaml, or a list of ids, .py files, mappings {id: taper, kappa_t: 2e-5}, Effect objects and
    the effects that a diagnosis found.
    """
    made = [asked] if isinstance(asked, Effect | FoundEffect) else asked
    if not isinstance(made, Sequence) or isinstance(made, str):
        return load_effects(made)
    made = [e.as_setting() if isinstance(e, FoundEffect) else e for e in made]
    for cls in (e for e in made if isinstance(e, type) and issubclass(e, Effect)):
        example = f"{cls.__name__}({next(iter(cls.parameters))}=...)"
        raise InputError("effects", cls.__name__, "", f"give it numbers: {example}")
    if not any(isinstance(e, Effect) for e in made):
        return load_effects(made)
    found = tuple(e if isinstance(e, Effect) else load_effects([e])[0] for e in made)
    for twice in {e.id for e in found if sum(o.id == e.id for o in found) > 1}:
        raise InputError("effects", twice, "", "name each effect once")
    return found


def candidates_of(asked: Any, model: AnalyticModel, leave_out: Sequence[str] | None = None) -> list[type[Effect]]:
    """Effect classes to try, all of which the model can honour.

    asked: a list of ids, .py files and Effect classes, all of which must be possible; or None for the library without
    ``leave_out`` (None: without what is tried only when it is named). Raises InputError, CannotRepresent.
    """
    for name in leave_out or ():
        if name not in library():
            raise InputError("leave_out", name, "", f"use ids of the library: {', '.join(library())}")
    if asked is None:
        return [c for c in default_candidates(leave_out).values() if model.refusal(c) is None]
    entries = asked if isinstance(asked, Sequence) and not isinstance(asked, str) else [asked]
    classes: dict[str, type[Effect]] = {}
    for entry in entries:
        is_class = isinstance(entry, type) and issubclass(entry, Effect)
        classes |= {entry.id: entry} if is_class else load_classes([entry])
    if not classes:
        raise InputError("effects", "[]", "", "name at least one candidate, or null for the library")
    refuse_effects(model, list(classes.values()))
    return list(classes.values())


def refuse_effects(model: Model | SteadyModel, effects: Sequence[Effect | type[Effect]], remedy: str = "") -> None:
    """Raise CannotRepresent for the first effect that the model cannot represent."""
    for e in effects:
        reason = model.refusal(e)
        if reason:
            raise CannotRepresent(f"effects = {e.id}: {reason}{remedy}")


#: limits that a belt in three dimensions does not have: it moves, turns far and hangs as it is
_NOT_IN_SPACE = ("flat_belt", "second_order", "deep_sag", "fast_belt")


def validity_limits(case: Case, model: Any, effects: Sequence[str] = ()) -> tuple[Limit, ...]:
    """The limits that ``model`` with ``effects`` (ids) is used beyond in one case, the worst first.

    A limp rope and formulas without curves claim no more than their limiting case: what machine and belt are beyond
    whatever the model is said of all.
    """
    found: tuple[Limit, ...] = ()
    in_space = hasattr(model, "options")  # asking for its class would load MuJoCo
    if isinstance(model, AnalyticModel) and model.moments:
        found = exceeded_limits(case, {*model.contains, *effects})
    elif in_space and "sag_roll" in model.contains:
        slips = ("slip",) if math.isfinite(model.options.friction) else ()
        lifts = "the belt's own stiffness lifts it off the pulleys, which a belt in 3D has only with effects=[lift_off]"
        beyond = exceeded_limits(case, {*model.contains, *effects, *_NOT_IN_SPACE, *slips})
        found = tuple(replace(limit, words=lifts) if limit.id == "bending_layer" else limit for limit in beyond)
    there = {x.id for x in found} | ({*_NOT_IN_SPACE, "short_span", "edge_stretch"} if in_space else set())
    there |= {"edge_stretch"} if any(x.id == "slack_edge" for x in found) else set()
    return (*found, *(x for x in geometric(case) if x.id not in there))


def with_run(
    beyond: tuple[Limit, ...], case: Case, model: Any, curves: Curves, effects: Sequence[Effect] = ()
) -> tuple[Limit, ...]:
    """Return the limits that a case is beyond, and those that its run left with all its effects; one of a kind."""
    left, known = run_limits(case, curves, isinstance(model, AnalyticModel), effects), {x.id for x in beyond}
    return (*beyond, *(x for x in left if x.id not in known))


def validity_warnings(
    campaign: Campaign, model: AnalyticModel, effects: Sequence[Effect | FoundEffect]
) -> tuple[str, ...]:
    """A sentence a limit that some runs of a campaign are beyond; with effects of the library runs are marched."""
    acting = [e for e in effects if isinstance(e, Effect)]
    found = []
    for run in campaign.runs:
        case = case_of(campaign, run)
        beyond = validity_limits(case, model, [e.id for e in effects])
        if acting and len(run.travel):
            with suppress(SimulationError):  # what diverges is told by its errors
                curves = march(case, model, acting, travel=float(run.travel[-1]))
                beyond = with_run(beyond, case, model, curves, acting)
        found += [(run.name, limit) for limit in beyond]
    sentences = []
    for name in dict.fromkeys(limit.id for _, limit in found):
        runs = [run for run, limit in found if limit.id == name]
        worst = max((limit for _, limit in found if limit.id == name), key=lambda x: x.load)
        many = f"{len(runs)} of {len(campaign.runs)} runs" if len(runs) > 1 else f"run {runs[0]}"
        sentences.append(f"in {many} {worst.words} ({name}, up to {worst.exceeded_by})")
    return tuple(sentences)
