"""What is hidden, at random or by name."""

import numpy as np
import pytest

from belt_sim.errors import InputError
from belt_sim.virtual_rig import Plan, RunSetting, hidden, make, make_campaign
from belt_sim.virtual_rig.hidden import (
    CATALOGUE,
    CORRUPTIONS,
    UNMODELLED,
    damage,
    random_fault,
)
from belt_sim.virtual_rig.plan import Noise

SMALL = Plan(
    runs=tuple(RunSetting(tension=t, yaw=y) for t in (10e6, 40e6) for y in (-7e-4, 7e-4)),
    length=30.0,
    spacing=0.5,
)


@pytest.mark.parametrize("kind", ["nothing", "below_noise", "dirty"])
def test_every_kind_makes_a_campaign(kind, monkeypatch):
    """The other kinds are drawn in test_random_campaigns.py."""
    monkeypatch.setattr(hidden, "MIX", {kind: 1.0})
    campaign, truth = make_campaign(hidden="random", seed=11, plan=SMALL)
    assert truth.kind == kind
    assert all(np.all(np.isfinite(run.signals["y1"])) for run in campaign.runs)
    assert len(truth.effects) == (kind == "below_noise")
    if kind == "below_noise":
        assert truth.effects[0]["d"] <= hidden._BELOW[1]
    if kind == "dirty":
        assert truth.dirty is not None


@pytest.mark.parametrize("name", [n for n, f in UNMODELLED.items() if "seed" in f.__dataclass_fields__])
def test_a_fault_with_a_random_course_is_drawn_and_runs(name):
    drawn = random_fault(name, SMALL, np.random.default_rng(0))
    campaign, _ = make_campaign(hidden=[{"id": name, **vars(drawn)}], seed=0, plan=SMALL)
    assert all(np.all(np.isfinite(run.signals["y1"])) for run in campaign.runs)


def test_the_same_seed_draws_the_same():
    first, again = (make_campaign(hidden="random", seed=21, plan=SMALL)[1] for _ in range(2))
    assert first == again


def test_noise_by_lot_stays_within_its_bounds(monkeypatch):
    monkeypatch.setattr(make, "random_hidden", lambda *asked: None)
    monkeypatch.setattr(make, "measure_campaign", lambda plan, noise, *rest: noise)
    drawn: list[Noise] = [make_campaign(hidden="random", seed=k, plan=SMALL) for k in range(300)]
    scales = np.array([n.scale for n in drawn])
    assert scales.min() > 0.6 - 1e-9
    assert scales.max() < 1.4 + 1e-9
    assert scales.std() > 0.2
    assert 0.05 < np.mean([n.heavy_tails for n in drawn]) < 0.15


def test_every_fault_can_be_drawn():
    for name in sorted(CATALOGUE | UNMODELLED):
        fault = random_fault(name, SMALL, np.random.default_rng(0))
        assert any(vars(fault)[n] != 0.0 for n in fault.sizes), name


def test_dirt_spoils_one_run():
    for name in CORRUPTIONS:
        clean = np.random.default_rng(0).normal(size=(2, 50, 3)) + 3.0
        spoilt = clean.copy()
        damage(spoilt, name, 1, 2)
        assert np.any(spoilt[1, :, 2] != clean[1, :, 2]), name
        assert np.all(spoilt[:, :, :2] == clean[:, :, :2]), name


def test_a_stated_size_is_reached():
    _, truth = make_campaign(hidden=[{"id": "cant", "d": 6}], seed=1, plan=SMALL)
    assert truth.kind == "stated"
    assert truth.effects[0]["d"] == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("hidden", "says"),
    [
        (["tapper"], "tapper"),
        ([{"id": "taper", "kappa": 1.0}], "kappa_t"),
        ([{"id": "taper", "kappa_t": "big"}], "number"),
        ([{"id": "taper", "kappa_t": 1.0}], "between"),
        ([{"id": "soft_cover", "c": -1e-6}], "between"),
        ([{"kappa_t": 1.0}], "use one of"),
        ([{"id": "taper", "d": -3}], "positive"),
        ([3], "ids"),
        ("often", "random"),
    ],
)
def test_wrong_wishes_are_one_line(hidden, says):
    with pytest.raises(InputError) as caught:
        make_campaign(hidden=hidden, seed=1, plan=SMALL)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_sag_roll_is_hidden_under_th2_only():
    assert make_campaign(hidden=["sag_roll"], seed=1, plan=SMALL)[1].base == "beam_th2"
    with pytest.raises(InputError, match="beam_th2"):
        make_campaign(hidden=["sag_roll"], base="strip", seed=1, plan=SMALL)


@pytest.mark.parametrize("wrong", [{"seed": -1}, {"seed": 1.5}, {"base": "rope"}])
def test_wrong_settings_are_one_line(wrong):
    with pytest.raises(InputError):
        make_campaign(plan=SMALL, **wrong)


@pytest.mark.long
def test_forty_campaigns_by_lot_do_not_crash():
    kinds = {make_campaign(hidden="random", seed=seed)[1].kind for seed in range(40)}
    assert len(kinds) >= 4
