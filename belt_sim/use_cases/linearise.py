"""Linearise: the plant that a controller sees, at one tension or scheduled over several."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from belt_sim.case import Case
from belt_sim.config import case_asked
from belt_sim.errors import InputError
from belt_sim.linear.linearise import linear_belt
from belt_sim.linear.plant import LinearBelt, PlantSchedule
from belt_sim.si import N_PER_MM2
from belt_sim.use_cases.asked import effects_of, fitted_model


def linearise(
    case: Case | None = None, *, model: Any = "strip", effects: Any = None, **settings: Any
) -> LinearBelt | PlantSchedule:
    """The linear plant of ``case`` (in SI), or of the case that ``settings`` describe as for ``simulate``.

    A sequence of tensions [N/mm2] gives a ``PlantSchedule``, a plant at any tension between them. Raises InputError,
    CannotRepresent.
    """
    if case is not None and settings:
        name, value = next(iter(settings.items()))
        raise InputError(name, value, "", "give either a case or its settings")
    chosen, acting = fitted_model(model), effects_of(effects)
    tension = settings.get("tension")
    if not isinstance(tension, Sequence) or isinstance(tension, str):
        plant: LinearBelt = linear_belt(case_asked(**settings) if case is None else case, chosen, acting)
        return plant
    first = case_asked(**settings | {"tension": tension[0]})
    cases = [replace(first, settings=replace(first.settings, tension=float(t) * N_PER_MM2)) for t in tension]
    plants: list[LinearBelt] = [linear_belt(c, chosen, acting) for c in cases]
    return PlantSchedule.of(plants)
