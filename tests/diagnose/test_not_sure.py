"""What is named is not called sure where it rests on one run that is unlike its repeats, or has no size."""

from dataclasses import replace

import pytest
from small_campaign import CLASSES, MODEL, REPEATED

from belt_sim.diagnosis.decide import POLICY
from belt_sim.diagnosis.describe import describe, held_back
from belt_sim.diagnosis.examine import examine
from belt_sim.effects.pulley import Taper
from belt_sim.results.estimates import Estimate
from belt_sim.results.words import join_words
from belt_sim.virtual_rig.make import make_campaign

CANDIDATES = tuple(c for c in CLASSES if c.id in ("taper", "crown", "edge_profile"))


def diagnosed(hidden: list, *, spoilt: bool):
    """A campaign whose last repeat, where it is spoilt, was made at another tension than its sheet states."""
    campaign, again = (make_campaign(hidden=hidden, seed=seed, plan=REPEATED)[0] for seed in (2, 3))
    *others, last = campaign.runs
    if spoilt:
        other = next(r for r in again.runs if r.tension != last.tension and r.yaw == last.yaw)
        last = replace(last, signals=other.signals)
    return describe(examine(replace(campaign, runs=(*others, last)), MODEL, CANDIDATES, checked=True), seed=0)


TAPER = [{"id": "taper", "kappa_t": 2e-4}]


def test_what_only_a_spoilt_repeat_shows_is_not_sure():
    found = diagnosed(TAPER, spoilt=True)
    sure = {e.id: e.probability > POLICY.unsure for e in found.effects}
    assert sure.pop("taper")  # the other runs show it
    assert sure
    assert not any(sure.values())
    assert f"which differs from its repeats, {join_words(sorted(sure))} would not be named" in found.sentence


def test_what_all_runs_show_is_sure():
    found = diagnosed(TAPER, spoilt=False)
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
