"""Campaigns for fresh judging: their plans, starts anywhere on the belt, mistakes in the sheet, habits of plants."""

from dataclasses import replace

import numpy as np
import pytest
from virtual_bench import ARC, SPAN, YAW, plan_of

from belt_sim.errors import InputError
from belt_sim.virtual_rig.hidden import fault_class
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import RunSetting
from studies.challenge.campaigns import (
    FRESH_MIX,
    FRESH_PLANS,
    FRESH_POOL,
    PLANT_KINDS,
    StandingFault,
    fresh_campaign,
    fresh_plan,
    mistaken,
    plant_campaign,
    start_anywhere,
)  # fmt: skip

BOTH_WAYS = next(  # a plan with yaw to both sides and more than two sensors
    plan
    for plan, _ in (fresh_plan("stiff_short", k) for k in range(FRESH_POOL))
    if any(run.yaw < 0 for run in plan.runs) and len(plan.signals) > 2
)
BELT = 2 * (SPAN + ARC)


def readings(fault, start: float, length: float = 30.0) -> np.ndarray:
    plan = plan_of(RunSetting(tension=20e6, yaw=YAW, start=start), length=length, spacing=0.5)
    return observe(plan, true_line(plan, "strip", TrueErrors()), [fault])


def test_the_plans_are_what_they_are_called():
    assert sum(FRESH_MIX.values()) == pytest.approx(1.0)
    plans = {name: [fresh_plan(name, k) for k in range(FRESH_POOL)] for name in FRESH_PLANS}
    for plan, _ in plans["stiff_short"]:
        assert 3.0 <= plan.machine.centre_distance.value <= 6.4
        assert (plan.belt.width.value, plan.belt.thickness.value) == (0.4, 8e-4)
        assert all(8e6 <= run.tension <= 60e6 for run in plan.runs)
    assert all(plan.belt.thickness.value >= 1.2e-3 for plan, _ in plans["wide_thick"])
    for plan, noise in plans["drift_before"]:
        assert all(0.19 * plan.length <= run.yaw_at <= 0.51 * plan.length for run in plan.runs)
        assert plan.zero_at_start == (noise.zero > 1e-3)
    for name, all_of_them in plans.items():
        for plan, _ in all_of_them:
            slack = plan.machine.centre_distance.value / 2 / plan.belt.width.value / plan.belt.youngs_modulus.value
            assert all(abs(run.yaw) < run.tension * slack for run in plan.runs), name
    with pytest.raises(InputError):
        fresh_plan("stiff", 0)


@pytest.mark.parametrize(
    ("name", "parameters", "period"),
    [
        ("edge_profile", {"cos2": 1e-3}, BELT),
        ("weld", {"angle": 1e-3}, BELT),
        ("wobble", {"beta_1": 1e-3}, 2 * ARC),
        ("soft_joint", {"share": 0.5}, BELT),
        ("tension_beat", {"share": 0.1}, BELT),
    ],
)
def test_a_start_elsewhere_shows_elsewhere_and_one_revolution_on_the_same(name, parameters, period):
    fault = fault_class(name)(**parameters)
    here, there, again = (readings(fault, start) for start in (0.0, 0.37 * period, period))
    np.testing.assert_allclose(again, here, atol=1e-9)
    assert np.abs(there - here).max() > 1e-6


def test_the_weld_passes_earlier_by_the_start():
    late, early = fault_class("weld")(angle=1e-3, at=3.0), fault_class("weld")(angle=1e-3, at=8.0)
    np.testing.assert_allclose(readings(late, 5.0), readings(early, 0.0), atol=1e-12)


def test_every_run_starts_at_its_own_place_and_no_file_says_where():
    plan = start_anywhere(fresh_plan("anywhere", 0)[0], np.random.default_rng(0))
    assert len({run.start for run in plan.runs}) == len(plan.runs)
    campaign, truth = fresh_campaign(2, "anywhere", kind="nothing")
    assert len(truth.settings["start"]) == len(campaign.runs)
    assert all(run.start is None for run in campaign.runs)


def test_zeros_at_the_start_of_the_record():
    plan = plan_of(RunSetting(tension=20e6, yaw=YAW, yaw_at=10.0), length=20.0, spacing=1.0)
    taper = fault_class("taper")(kappa_t=1e-4)
    line = true_line(plan, "strip", TrueErrors())
    at_yaw, at_start = observe(plan, line, [taper]), observe(replace(plan, zero_at_start=True), line, [taper])
    assert np.abs(at_start[:, 0]).max() < 1e-12
    assert np.abs(at_yaw[0, 0]).max() > 1e-5
    np.testing.assert_allclose(at_start - at_yaw, np.broadcast_to(-at_yaw[:, :1], at_yaw.shape), atol=1e-9)


def test_what_each_mistake_changes():
    plan, rng = BOTH_WAYS, np.random.default_rng(1)
    for name in ("lost_direction", "diameter_for_radius", "exchanged_points"):
        true, stated, _, run = mistaken(name, plan, rng)
        changed = {n for n in vars(plan) if getattr(true, n) != getattr(stated, n)}
        expected = {"diameter_for_radius": {"machine"}, "exchanged_points": {"signals"}}
        assert changed == expected.get(name, {"runs"})
        differ = [k for k, (a, b) in enumerate(zip(true.runs, stated.runs, strict=True)) if a != b]
        assert differ == ([] if run is None else [run])


def test_a_seed_makes_a_campaign_of_a_plant_again_and_its_file_tells_the_habits():
    told = set()
    once = len(PLANT_KINDS)
    for seed in [*range(once, once + 6), once + PLANT_KINDS.index(("mistake", "inch"))]:
        campaign, truth = plant_campaign(seed)
        assert (truth.kind, truth.dirty["kind"] if truth.dirty else "") == PLANT_KINDS[seed - once]
        assert 3 <= len(campaign.runs) <= 12
        assert 2 <= len(campaign.signals) <= 4
        first, settings = campaign.runs[0], truth.settings
        told |= {n for n in ("started", "y0", "run_in", "start") if getattr(first, n)}
        begins, stated = settings["run_in"]
        assert first.run_in == (begins if stated else 0.0)
        assert first.travel[0] == pytest.approx(first.run_in, abs=campaign.runs[0].travel[1] - first.travel[0])
    assert told == {"started", "y0", "run_in", "start"}
    assert plant_campaign(seed)[0] == campaign


def test_a_belt_that_starts_beside_the_middle_shows_only_what_acts_there():
    plan = plan_of(RunSetting(tension=20e6, yaw=YAW), length=30.0, spacing=0.5)
    line = true_line(plan, "strip", TrueErrors())
    beside = StandingFault(y0=np.array([5e-3]))
    np.testing.assert_allclose(observe(plan, line, [beside]), observe(plan, line, []), atol=1e-10)
    crown = fault_class("crown")(c=0.01)
    cone = observe(plan, line, [fault_class("taper")(kappa_t=-0.01 * 5e-3), crown])
    np.testing.assert_allclose(observe(plan, line, [crown, beside]), cone, atol=1e-10)
