"""Discover: a law that no library holds, sought in a campaign beside a model and the effects that are known to act."""

from collections.abc import Callable
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.discovery.describe import describe
from belt_sim.discovery.discover import discover as search
from belt_sim.discovery.gate import DRAWS
from belt_sim.errors import InputError
from belt_sim.results.discovery import Discovery
from belt_sim.use_cases.asked import effects_of, fitted_model, refuse


def discover(
    campaign: Campaign,
    model: Any = "strip",
    effects: Any = None,
    *,
    draws: int = DRAWS,
    seed: int = 0,
    tell: Callable[[str], None] = lambda stage: None,
    config: Any = None,
) -> Discovery:
    """What the analytic ``model`` lacks beside ``effects``, whose numbers are fitted anew together.

    effects: as for ``compare``; draws: campaigns simulated with nothing missing; tell: hears every stage; config: what
    asked for it, for the provenance. Raises InputError, CannotRepresent.
    """
    if not any(s.kind == "lateral" for s in campaign.signals):
        raise InputError("signals", "no point", "", "a discovery needs the lateral position of one of points 1-4")
    chosen, acting = fitted_model(model), effects_of(effects)
    refuse(chosen, acting)
    bench = workbench(campaign, chosen, [type(e) for e in acting])
    vector = bench.forward.null()
    numbers = {type(e): e for e in acting}
    for k, slot in enumerate(bench.forward.slots):
        vector[k] = float(getattr(numbers[slot.effect], slot.name)) / slot.scale
    bench = bench.moved_to(vector)
    fit: Fit = bench.fit([bench.start([e.id for e in acting], vector)])[0]
    tell("fitted what is known")
    return describe(search(bench, fit, draws=draws, seed=seed, tell=tell), config=config)
