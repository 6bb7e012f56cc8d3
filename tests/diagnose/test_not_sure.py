"""What is named is not called sure where it rests on one run that is unlike its repeats, or has no size."""

from dataclasses import replace

import pytest
from small_campaign import CLASSES, MODEL, REPEATED

from belt_sim.diagnosis.decide import POLICY
from belt_sim.diagnosis.describe import describe, held_back
from belt_sim.diagnosis.examine import examine
from belt_sim.effects.pulley_shape import Taper
from belt_sim.results.estimates import Estimate
from belt_sim.virtual_rig.make import make_campaign

CANDIDATES = tuple(c for c in CLASSES if c.id in ("taper", "crown", "edge_profile"))


def diagnosed(hidden: list, factor: float):
    """A campaign whose last repeat was made at ``factor`` times the tension that its sheet states."""
    campaign = make_campaign(hidden=hidden, seed=2, plan=REPEATED)[0]
    *others, last = campaign.runs
    other = next(r for r in others if r.tension != last.tension and r.yaw == last.yaw)
    spoilt = replace(last, signals=other.signals) if factor != 1.0 else last
    return describe(examine(replace(campaign, runs=(*others, spoilt)), MODEL, CANDIDATES, checked=True), seed=0)


def test_what_only_a_spoilt_repeat_shows_is_not_sure():
    found = diagnosed([], 10.0)
    assert all(e.probability <= POLICY.unsure for e in found.effects)
    assert not found.effects or "differs from its repeats" in found.sentence


def test_what_the_other_runs_show_stays_sure():
    found = diagnosed([{"id": "taper", "kappa_t": 2e-4}], 1.0)
    assert {e.id: e.probability > POLICY.likely for e in found.effects} == {"taper": True}
    assert "differs from its repeats" not in found.sentence


@pytest.mark.parametrize(
    ("value", "u", "interval", "sure"), [(3.0, 3.6, None, False), (3.0, 1.0, None, True), (3.0, 3.6, (0.5, 20.0), True)]
)
def test_an_effect_of_which_no_size_is_off_nothing_is_not_sure(value, u, interval, sure):
    size = {"kappa_t": Estimate(value, u, "1/m", True, interval)}
    assert held_back(0.99, Taper, size) == (0.99 if sure else POLICY.unsure)
    assert held_back(0.99, Taper, size, {"kappa_t_head": Estimate(9.0, 1.0, "1/m", True)}) == 0.99
    assert held_back(0.99, Taper, {}) == 0.99
