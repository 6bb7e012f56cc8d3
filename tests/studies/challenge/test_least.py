"""What the truth leaves of the readings: the noise that was drawn, and nothing of what is hidden."""

import numpy as np
import pytest
from small_challenge import PLAN, answer_of

from belt_sim.virtual_rig import Noise, make_campaign
from studies.challenge import oracle
from studies.challenge.oracle import least_error, left_by_named

#: white noise only: a perfect law leaves just that, whatever is hidden
WHITE = Noise(white=2e-5, zero=0.0, wander_sd=0.0, tension_rel=0.0, yaw_u=0.0)


def answer(untestable=()):
    held = {"before_mm": 2.0, "after_mm": 1.0}
    error = {"held_out": held, "noise_floor_mm": 0.02, "held_out_untestable": list(untestable)}
    return answer_of("taper") | {"error": error}


def test_a_law_that_knows_the_truth_leaves_the_noise():
    hidden = [{"id": "taper", "d": 40.0}, {"id": "sensor_gain", "d": 20.0}]
    campaign, truth = make_campaign(hidden=hidden, seed=5, base="strip", plan=PLAN, noise=WHITE)
    least = least_error(campaign, truth, answer())
    assert least is not None
    assert least["plain_mm"] == pytest.approx(0.02, rel=0.2)  # with the machine's own data a little off
    assert least["beside_settings_mm"] == pytest.approx(0.02, rel=0.05)
    only_low = least_error(campaign, truth, answer(untestable=("30 N/mm2", "yaw -", "yaw +")))
    assert only_low is not None
    assert only_low != least


def test_nothing_is_said_where_nothing_is_hidden_or_told():
    campaign, truth = make_campaign(hidden=[], seed=5, base="strip", plan=PLAN)
    assert least_error(campaign, truth, answer()) is None
    campaign, truth = make_campaign(hidden=["taper"], seed=5, base="strip", plan=PLAN)
    assert least_error(campaign, truth, answer_of("taper")) is None


def test_what_is_another_in_every_run_is_known_in_every_run():
    campaign, truth = make_campaign(
        hidden=[{"id": "walking_angle", "d": 40.0}], seed=5, base="strip", plan=PLAN, noise=WHITE
    )
    least = least_error(campaign, truth, answer())
    assert least is not None
    assert least["beside_settings_mm"] == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize(
    ("wrong", "numbers", "alike"),
    [("tension_bias", {"gain": -0.2, "bias": 0.0}, True), ("taper", {"kappa_t": 1e-5}, False)],
)
def test_a_stiffer_span_is_told_from_a_taper_and_not_from_a_load_cell_that_errs(wrong, numbers, alike):
    stiffer = [{"id": "span_stiffening", "c": 0.5, "bend": 1e-5}]  # so soon that it is as good as a constant
    campaign, truth = make_campaign(hidden=stiffer, seed=5, base="beam_th2", plan=PLAN, noise=WHITE)
    named = {"id": wrong, "numbers": numbers, "parameters": {name: {} for name in numbers}}
    left = left_by_named(campaign, truth, {"effects": [named]})
    assert left is not None
    assert left < 0.1 if alike else left > 10.0
    assert left_by_named(campaign, truth, {"effects": []}) is None


def test_the_rounding_of_a_processor_does_not_move_the_distance(monkeypatch):
    stiffer = [{"id": "span_stiffening", "c": 0.5, "bend": 1e-5}]
    campaign, truth = make_campaign(hidden=stiffer, seed=5, base="beam_th2", plan=PLAN, noise=WHITE)
    numbers = {"gain": -0.2, "bias": 0.0}
    named = {"id": "tension_bias", "numbers": numbers, "parameters": {name: {} for name in numbers}}
    random, exact = np.random.default_rng(0), oracle.observe

    def rounded(*asked):
        seen = exact(*asked)
        return seen * (1.0 + 1e-11 * random.standard_normal(seen.shape))

    monkeypatch.setattr(oracle, "observe", rounded)
    assert left_by_named(campaign, truth, {"effects": [named]}) == pytest.approx(0.00575, rel=0.01)
