"""One small campaign shape for every test of the diagnosis, made by the independent generator.

Six runs of 30 m, read every half metre: one compilation of the forward model serves all of them. Diagnoses are kept,
so that several tests may look at the same one.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from belt_sim.api.simulate import candidates_of
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.describe import describe, drawings_of
from belt_sim.diagnosis.examine import Findings, examine
from belt_sim.diagnosis.workbench import Workbench, workbench
from belt_sim.discovery.selection import LawSearch
from belt_sim.model import analytic_model
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.units import N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import TEST_YAWS, Plan, grid

SHAPE = {"length": 30.0, "spacing": 0.5}
TENSIONS = tuple(t * N_PER_MM2 for t in (7.0, 14.0, 40.0))
#: three tensions at both signs of yaw: tells most effects apart
SPREAD = Plan(runs=grid(TENSIONS, TEST_YAWS, repeats=0), **SHAPE)
#: two tensions at both signs and two repeats: noise levels can be read off
REPEATED = Plan(runs=grid(TENSIONS[::2], TEST_YAWS, repeats=2), **SHAPE)
MODEL = analytic_model("beam_th2")
#: few candidates, since every one is compiled: those that are hidden, and those most like them
NAMES = (
    "sag_roll", "taper", "cant", "crown", "yaw_offset_tail", "sensor_gain", "tension_bias", "slip", "edge_profile",
)  # fmt: skip
CLASSES = tuple(candidates_of(NAMES, MODEL))
SEED = 5

HIDDEN = {
    "nothing": [],
    "sag_roll": [{"id": "sag_roll", "strength": 1.0}],
    "sensor_gain": [{"id": "sensor_gain", "g1": 0.1}],
    "two": [{"id": "taper", "kappa_t": 1e-4}, {"id": "yaw_offset_tail", "beta_0": 5e-4}],
    "stranger": [{"id": "wind_steps", "pressure": 0.1}],
}


BARE = ("two", "sensor_gain")


def campaign(name: str, seed: int = 1) -> Campaign:
    """A campaign that hides HIDDEN[name]."""
    return _campaign(name, seed)


def examined(name: str, seed: int = 1) -> Findings:
    """What was found under beam_th2 with CLASSES, on its workbench; laws are sought but in BARE, which take longest."""
    return _examined(name, seed)


def diagnosed(name: str, seed: int = 1) -> Diagnosis:
    """The same as a result, without drawings."""
    return _diagnosed(name, seed)


@cache
def drawn(name: str) -> Diagnosis:
    """The same with its drawings."""
    return replace(diagnosed(name), drawings=drawings_of(examined(name)))


@cache
def _campaign(name: str, seed: int) -> Campaign:
    return make_campaign(hidden=HIDDEN[name], seed=seed, plan=SPREAD, title=name)[0]


@cache
def _examined(name: str, seed: int) -> Findings:
    return examine(campaign(name, seed), MODEL, CLASSES, seed=SEED, laws=None if name in BARE else LawSearch())


@cache
def _diagnosed(name: str, seed: int) -> Diagnosis:
    return describe(examined(name, seed), seed=SEED)


@cache
def repeated_bench() -> Workbench:
    """A workbench on a campaign with repeats in which nothing is hidden."""
    return workbench(make_campaign(seed=2, plan=REPEATED)[0], MODEL, CLASSES)


@cache
def bench() -> Workbench:
    """A workbench on a campaign without repeats in which nothing is hidden."""
    return workbench(campaign("nothing"), MODEL, CLASSES)


def q_of(bench: Workbench, effect: str, **numbers: float) -> np.ndarray:
    """The point q with one effect's parameters off null, in SI."""
    q = bench.forward.null()
    for k in bench.forward.index(effect):
        slot = bench.forward.slots[k]
        q[k] = numbers.get(slot.name, slot.parameter.null) / slot.scale
    return q
