"""Random campaigns: the plans there are, the noise as it is, what is hidden in which words."""

from collections import Counter

import numpy as np
import pytest

from belt_sim.errors import InputError
from belt_sim.virtual_rig import Noise, Plan, hidden, random_campaign
from belt_sim.virtual_rig.hidden import (
    BLIND_FAULTS,
    DEVELOPMENT_FAULTS,
    LIBRARY_SIZES,
    MIX,
    OUTSIDE,
    RANDOM_LIBRARY,
    UNMODELLED,
    Detectability,
    fault_from_spec,
    library_distance,
)
from belt_sim.virtual_rig.make import MACHINE_SHARES, POOL, plan_by_number, true_noise

PLANS = [plan_by_number(k) for k in range(POOL)]
QUICK = min(range(POOL), key=lambda k: len(PLANS[k][1].runs) * PLANS[k][1].length)


def test_plans_are_of_every_kind_in_their_shares():
    kinds = Counter(kind for kind, _, _ in PLANS)
    assert {k: pytest.approx(n / POOL, abs=0.03) for k, n in kinds.items()} == MACHINE_SHARES


def test_plans_are_as_wide_as_they_are_said_to_be():
    runs = [len(plan.runs) for _, plan, _ in PLANS]
    assert 4 <= min(runs) <= 5
    assert 15 <= max(runs) <= 20
    assert {len(plan.signals) for _, plan, _ in PLANS} == {1, 2, 3, 4}
    assert {10.0, 100.0} <= {plan.length for _, plan, _ in PLANS}
    for has in (
        lambda p: any(r.repeat_of is not None for r in p.runs),
        lambda p: any(r.yaw == 0.0 for r in p.runs),
        lambda p: any(r.direction < 0 for r in p.runs),
        lambda p: len({r.speed for r in p.runs}) > 1,
        lambda p: len({r.tension for r in p.runs}) == 1,
        lambda p: any(r.yaw_at > 0 for r in p.runs),
    ):
        assert 2 <= sum(has(plan) for _, plan, _ in PLANS) < POOL


def test_a_repeat_is_a_repeat_and_no_edge_goes_slack():
    for _, plan, _ in PLANS:
        for run in plan.runs:
            slack = run.tension * plan.machine.centre_distance.value / 2 / plan.belt.width.value
            assert abs(run.yaw) * plan.belt.youngs_modulus.value < slack
            if run.repeat_of is not None:
                first = plan.runs[run.repeat_of]
                assert first.repeat_of is None
                assert {**vars(run), "repeat_of": None} == vars(first)


def test_noise_is_far_off_only_where_repeats_tell():
    rng = np.random.default_rng(0)
    scales: dict[bool, list[float]] = {True: [], False: []}
    lengths, heavy = [], []
    for _ in range(10):
        for _, plan, stated in PLANS:
            noise = true_noise(plan, stated, rng)
            scales[any(r.repeat_of is not None for r in plan.runs)].append(noise.scale)
            lengths.append(noise.true_length)
            heavy.append(noise.heavy_tails)
            assert noise.wander_length == 3.0
    assert 0.3 <= min(scales[True]) < 0.4
    assert 2.5 < max(scales[True]) <= 3.0
    assert min(scales[False]) >= 0.6
    assert max(scales[False]) <= 1.4
    assert 1.0 <= min(lengths) < 1.2
    assert 9.0 < max(lengths) <= 10.0
    assert 0.05 < np.mean(heavy) < 0.15


def test_true_noise_is_what_is_measured():
    noise = Detectability(Plan(length=5.0, spacing=1.0), Noise(scale=2.0, true_length=7.0), "beam_th2").noise
    assert (noise.white, noise.wander_sd, noise.wander_length) == (4e-5, 1e-4, 7.0)
    assert noise.scale == 1.0


@pytest.mark.parametrize("kind", ["library", "two"])
def test_the_same_seed_makes_the_same_campaign(kind):
    (one, first), (two, again) = (random_campaign(5, kind=kind, plan=QUICK) for _ in range(2))
    assert first == again
    assert first.kind == kind
    assert first.plan == f"{PLANS[QUICK][0]} {QUICK}"
    assert len(first.effects) == {"library": 1, "two": 2}[kind]
    for effect in first.effects:
        assert effect["id"] in {cls.id for cls in RANDOM_LIBRARY if not cls.part_of}
        assert min(abs(effect["d"] - d) for d in LIBRARY_SIZES) < 0.2 * effect["d"]
    for a, b in zip(one.runs, two.runs, strict=True):
        assert all(np.array_equal(a.signals[n], b.signals[n]) for n in a.signals)


@pytest.mark.parametrize("blind", [True, False])
def test_an_unmodelled_fault_has_its_words_and_its_distance(blind):
    _, truth = random_campaign(3, kind="outside", blind=blind, plan=QUICK)
    name = truth.effects[0]["id"]
    assert name in (BLIND_FAULTS if blind else DEVELOPMENT_FAULTS)
    cls = UNMODELLED[name]
    assert (truth.place, truth.variable, truth.form) == (cls.place, cls.variable, cls.form)
    assert 0.8 * OUTSIDE[0] < truth.distance < 1.5 * OUTSIDE[1]
    assert truth.effects[0]["d"] > 0.9 * truth.distance


@pytest.mark.long
def test_unmodelled_faults_come_by_their_own_name():
    assert [random_campaign(seed, kind="outside")[1].kind for seed in range(3)] == ["outside"] * 3


def test_nothing_is_nothing():
    _, truth = random_campaign(1, kind="nothing")
    assert (truth.kind, truth.effects, truth.place) == ("nothing", [], "")


def test_kinds_come_as_in_the_mix():
    assert sum(MIX.values()) == pytest.approx(1.0)
    with pytest.raises(InputError):
        plan_by_number(POOL)


def test_three_library_effects_explain_any_three_of_themselves():
    """Small, so that they are linear: what is left over is nothing; of four, something."""
    _, plan, noise = plan_by_number(QUICK)
    rule = Detectability(plan, noise, "strip")
    three = [fault_from_spec({"id": "taper", "kappa_t": 1e-6}), fault_from_spec({"id": "cant", "gamma": 1e-5})]
    three.append(fault_from_spec({"id": "yaw_offset_tail", "beta_0": 1e-6}))
    near = library_distance(rule, three)
    assert near.triple < 0.01 * near.single + 1e-3
    far = library_distance(rule, [*three, fault_from_spec({"id": "strange_wave", "amplitude": 1e-3})])
    assert far.triple > 3.0


@pytest.mark.parametrize("name", ["frame_twist", "tension_beat"])
def test_the_distance_to_the_library_does_not_hang_on_rounding(name, monkeypatch):
    """Readings are off by a billionth at random. Of some effects the plan's one sensor shows nothing else."""
    _, plan, noise = plan_by_number(QUICK)
    fault, exact, random = fault_from_spec(name), hidden.observe, np.random.default_rng(0)

    def distances(observed) -> list[float]:
        monkeypatch.setattr(hidden, "observe", observed)
        hidden.sensitivities.cache_clear()
        hidden.library_signatures.cache_clear()
        near = library_distance(Detectability(plan, noise, "strip"), [fault])
        return [near.single, near.triple]

    def off(*asked):
        seen = exact(*asked)
        return seen * (1 + 1e-9 * random.standard_normal(seen.shape))

    assert distances(off) == pytest.approx(distances(exact), rel=0.01)
