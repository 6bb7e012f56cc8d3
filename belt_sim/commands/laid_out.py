"""What compare and diagnose share: reading the campaign and choosing model and candidates."""

from typing import Any

from belt_sim.analytic.model import AnalyticModel
from belt_sim.analytic.ritzinger import RitzingerFormula
from belt_sim.campaign import Campaign, read_campaign
from belt_sim.effects.base import Effect
from belt_sim.effects.library import tried
from belt_sim.effects.load import load_classes
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.model import Model
from belt_sim.registry import model_named


def campaign_from(config: dict[str, Any]) -> Campaign:
    """The campaign of a configuration."""
    return read_campaign(str(config["campaign"]))


def model_from(config: dict[str, Any], *, curves: bool = True) -> Any:
    """An analytic model, which must give curves unless ``curves`` is False; raises CannotRepresent for the others."""
    name = str(config["model"]["name"])
    model = model_named(name)
    if not isinstance(model, AnalyticModel | RitzingerFormula):
        raise CannotRepresent(f"model = {name}: too slow to be fitted; use an analytic model, e.g. model=strip")
    if curves and not isinstance(model, Model):
        raise CannotRepresent(f"model = {name}: it gives a steady rate and no curves; use e.g. model=beam_th2")
    return model


def candidates(config: dict[str, Any], model: AnalyticModel) -> list[type[Effect]]:
    """Effect classes to try: those named, or the library without what is left out; all that the model can honour."""
    classes = load_classes(config["effects"])
    if not classes:
        raise InputError("effects", "[]", "", "name at least one candidate, or null for the library")
    if config["effects"] is None:
        return [c for c in tried(config["leave_out"]).values() if model.refusal(c) is None]
    for cls in classes.values():
        reason = model.refusal(cls)
        if reason:
            raise CannotRepresent(f"effects = {cls.id}: {reason}")
    return list(classes.values())
