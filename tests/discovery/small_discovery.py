"""Small campaigns for every test of the discovery, and what was discovered in them."""

from dataclasses import replace
from functools import cache

import numpy as np
from small_campaign import SHAPE, TENSIONS

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.discovery.search_data import SearchData, search_data_of
from belt_sim.discovery.selection import SearchOutcome, search_law
from belt_sim.discovery.words import describe_discovery
from belt_sim.effects.base import Effect
from belt_sim.effects.generic_law import ID, GenericLaw, law_effect
from belt_sim.effects.law import Law, SizedLaw
from belt_sim.model import analytic_model
from belt_sim.results.diagnosis import Discovery
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import TEST_YAWS, Plan, grid

MODEL = analytic_model("strip")
#: three tensions at both signs of yaw, and two repeats, off which noise levels can be read
PLAN = Plan(runs=grid(TENSIONS, TEST_YAWS, repeats=2), **SHAPE)
D = 25.0  # sigma: nobody could overlook it


@cache
def campaign(hidden: str = "", seed: int = 3) -> Campaign:
    """A campaign that hides a stranger of size D, or nothing."""
    what = [{"id": hidden, "d": D}] if hidden else []
    return make_campaign(hidden=what, base="strip", seed=seed, plan=PLAN)[0]


@cache
def fitted(hidden: str = "", seed: int = 3) -> tuple[Workbench, Fit]:
    """The base model on its workbench."""
    bench = workbench(campaign(hidden, seed), MODEL, [])
    return bench, bench.fit([bench.start((), bench.forward.null())])[0]


@cache
def surveyed(hidden: str = "", seed: int = 3) -> SearchData:
    """The survey beside the base model."""
    return search_data_of(*fitted(hidden, seed))


@cache
def surveyed_at_one_tension() -> SearchData:
    """The survey of a campaign in which nothing is hidden, all of it at one tension."""
    plan = replace(PLAN, runs=grid(TENSIONS[:1], TEST_YAWS, repeats=4))
    bench = workbench(make_campaign(hidden=[], base="strip", seed=3, plan=plan)[0], MODEL, [])
    return search_data_of(bench, bench.fit([bench.start((), bench.forward.null())])[0])


@cache
def both_ways() -> tuple[Workbench, SearchData]:
    """A campaign in which nothing is hidden, half of it in reverse, and what is seen beside the base model."""
    runs = tuple(replace(r, direction=d) for r, d in zip(PLAN.runs, (1.0, -1.0) * len(PLAN.runs), strict=False))
    bench = workbench(make_campaign(hidden=[], base="strip", seed=3, plan=replace(PLAN, runs=runs))[0], MODEL, [])
    return bench, search_data_of(bench, bench.fit([bench.start((), bench.forward.null())])[0])


def at_few_places(data: SearchData, *names: str) -> SearchData:
    """The same survey at some of its places: what a search does with forms does not take all of them."""
    return replace(data, places=tuple(p for p in data.places if p.name in names), kept={})


@cache
def discovered(hidden: str = "", seed: int = 3) -> SearchOutcome:
    """The whole search."""
    return search_law(surveyed(hidden, seed))


@cache
def described(hidden: str = "", seed: int = 3) -> Discovery:
    """Its result."""
    return describe_discovery(discovered(hidden, seed), 1.0)


def forward_with(bench: Workbench, *classes: type[Effect]) -> Forward:
    """Predictions with laws in the march, runs set as they are on a workbench."""
    return Forward(bench.forward.samples, MODEL, classes, bench.forward.step)


def effect_of(data: SearchData, law: Law, sizes, id: str = ID) -> type[GenericLaw]:
    """The effect of a law with these sizes."""
    return law_effect(SizedLaw(law, tuple(map(float, sizes)), data.tension), id)


def marched(data: SearchData, law: Law, sizes) -> np.ndarray:
    """Whitened readings (R, m) that a law adds in the march."""
    cls = effect_of(data, law, sizes)
    forward = forward_with(data.bench, cls)
    names, vector = [slot.name for slot in forward.slots], forward.null()
    for name in (n for n, p in cls.parameters.items() if not p.modifier):
        position = names.index(name)
        vector[position] = getattr(cls, name) / forward.slots[position].scale
    there = forward.values(np.stack([vector, forward.null()]))
    return data.projector.whiten((there[0] - there[1])[None])[0]
