"""What the sliders ask for, computed at once: one march over the longest travel, of which a shorter one is the start.

So that nothing is compiled while a slider moves, numbers only are changed from one computation to the next.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim.api.simulate import simulate
from belt_sim.config import make_case
from belt_sim.curves import Curves
from belt_sim.effects.base import Effect, Parameter
from belt_sim.effects.library import library, title_of
from belt_sim.registry import ANALYTIC, model_named
from belt_sim.results.simulation import Simulation

LONGEST = 200.0  # [m]
KEEP = 0.2  # [m]
MODELS = tuple(name for name in ANALYTIC if name != "ritzinger")  # those that have curves
SCALES = 10.0  # how far a slider of an effect reaches, in scales of its parameter


@dataclass(frozen=True)
class SliderSettings:
    """Tension [N/mm2], yaw [degrees], travel [m]; effects: id -> parameter -> number; rig, belt: names or numbers."""

    model: str
    tension: float
    yaw: float
    travel: float
    effects: Mapping[str, Mapping[str, float]]
    rig: Any = "test_rig"
    belt: Any = "paper_belt"


def simulated(asked: SliderSettings) -> Simulation:
    """The simulation; raises InputError, CannotRepresent, RunFailed."""
    case = make_case(rig=asked.rig, belt=asked.belt, tension=asked.tension, yaw=asked.yaw)
    acting = [made(i, numbers) for i, numbers in asked.effects.items()]
    whole = simulate(case, model={"name": asked.model, "keep": KEEP}, effects=acting, travel=LONGEST)
    assert whole.curves is not None
    return replace(whole, travel=asked.travel, curves=until(whole.curves, asked.travel))


def until(curves: Curves, travel: float) -> Curves:
    """The curves up to ``travel`` [m]."""
    keep = np.asarray(curves.travel) <= travel + 1e-9
    along = ("travel", "y", "angle", "moment", "edge_stress", "tilt")
    cut = {n: np.asarray(getattr(curves, n))[..., keep] for n in along if getattr(curves, n) is not None}
    return replace(curves, **cut, extra=None)


def made(effect_id: str, numbers: Mapping[str, float]) -> Effect:
    """An effect of the library with numbers; those not given stand at null."""
    cls = library()[effect_id]
    return cls(**{n: float(numbers.get(n, p.null)) for n, p in cls.parameters.items()})


def choices(model: str) -> dict[str, str]:
    """Effects that a model can have: id -> words."""
    chosen = model_named(model)
    return {i: words(i) for i, cls in library().items() if chosen.refusal(cls) is None}


def words(effect_id: str) -> str:
    """Return an effect of the library in a few words."""
    return title_of(library()[effect_id])


def reach(p: Parameter) -> tuple[float, float, float]:
    """Lowest and highest value of a parameter's slider, and where it starts."""
    low, high = (max(p.plausible[0], -SCALES * p.scale), min(p.plausible[1], SCALES * p.scale))
    return low, high, min(max(p.null if p.modifier else p.scale, low), high)


def slack(simulation: Simulation) -> str:
    """What is to be said of a slack edge; empty when none is."""
    return next((line for line in simulation.lines() if "edge goes slack" in line), "")


def warnings(simulation: Simulation) -> list[str]:
    """Everything to beware of, a sentence each."""
    beyond = [f"{x.words} ({x.load:.2g} times the limit)" for x in simulation.beyond]
    return [*filter(None, [slack(simulation)]), *beyond]
