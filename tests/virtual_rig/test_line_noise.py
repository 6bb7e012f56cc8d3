"""The noise of the virtual rig is what its campaign states, unless asked otherwise."""

import numpy as np
import pytest

from belt_sim.campaign.quality import check_noise, records_of
from belt_sim.virtual_rig import Noise, Plan, RunSetting, make_campaign
from belt_sim.virtual_rig.hidden import Detectability, changes, fault_from_spec, scale_to_size
from belt_sim.virtual_rig.march import TrueErrors, draw_errors, stated_data, true_line

RUNS = 200
STILL = Plan(runs=tuple(RunSetting(tension=20e6, yaw=0.0) for _ in range(RUNS)), length=30.0, spacing=0.5)
QUIET = Noise(white=0.0 + 1e-9, zero=0.0, wander_sd=0.0, tension_rel=0.0, yaw_u=0.0)
#: Four sigma of a standard deviation from this many independent numbers.
SPREAD = 4 / np.sqrt(2 * RUNS)


def readings(noise: Noise, seed: int = 5, plan: Plan = STILL) -> np.ndarray:
    """y1 of all runs, shape (runs, n) [m]."""
    campaign, _ = make_campaign(seed=seed, plan=plan, noise=noise)
    return np.stack([run.signals["y1"] for run in campaign.runs])


def only(**changes) -> Noise:
    return Noise(**(vars(QUIET) | changes))


def test_white_noise():
    y = readings(only(white=2e-5))
    assert np.std(y) == pytest.approx(2e-5, rel=SPREAD)
    assert abs(np.corrcoef(y[:, 10], y[:, 11])[0, 1]) < 4 / np.sqrt(RUNS)


def test_scale_leaves_the_stated_noise_alone():
    noise = only(white=2e-5, scale=1.4)
    campaign, truth = make_campaign(seed=1, plan=STILL, noise=noise)
    assert campaign.signals[0].white == 2e-5
    assert truth.noise["scale"] == 1.4
    assert np.std(readings(noise)) == pytest.approx(2.8e-5, rel=SPREAD)


def test_heavy_tails_have_the_stated_variance_and_more_outliers():
    gauss, heavy = readings(only(white=2e-5)), readings(only(white=2e-5, heavy_tails=True))
    assert np.std(heavy) == pytest.approx(2e-5, rel=0.15)  # t with 3 degrees of freedom converges slowly
    assert np.mean(np.abs(heavy) > 8e-5) > 10 * np.mean(np.abs(gauss) > 8e-5)


def test_zero_is_one_shift_a_run():
    y = readings(only(zero=1e-4))
    assert np.ptp(y, axis=1).max() < 1.5e-7  # one step of the resolution
    assert np.std(y[:, 0]) == pytest.approx(1e-4, rel=SPREAD)


def test_wander_is_correlated_over_its_length():
    y = readings(only(wander_sd=5e-5, wander_length=3.0))
    assert np.std(y[:, -1]) == pytest.approx(5e-5, rel=SPREAD)
    at_3_m = np.mean([np.corrcoef(y[:, k], y[:, k + 6])[0, 1] for k in range(0, 54, 6)])
    assert at_3_m == pytest.approx(np.exp(-1), abs=0.1)


def test_settings_miss_what_is_stated_and_repeats_differ():
    runs = (RunSetting(tension=20e6, yaw=7e-4), RunSetting(tension=20e6, yaw=7e-4, repeat_of=0))
    campaign, truth = make_campaign(seed=2, plan=Plan(runs=runs), noise=only(yaw_u=3e-5))
    first, again = (run.signals["y1"] for run in campaign.runs)
    assert np.abs(first - again).max() > 1e-5
    assert campaign.runs[1].repeat_of == "r01"
    ratio = first[-1] / again[-1]
    yaw = 7e-4 + np.array(truth.settings["yaw"])
    assert ratio == pytest.approx(yaw[0] / yaw[1], rel=1e-3)


def test_a_gain_error_is_one_factor_a_run():
    runs = tuple(RunSetting(tension=20e6, yaw=7e-4) for _ in range(RUNS))
    y = readings(only(gain=0.02), plan=Plan(runs=runs, length=10.0, spacing=1.0))
    assert np.std(y[:, -1]) / np.mean(y[:, -1]) == pytest.approx(0.02, rel=1.1 * SPREAD)
    np.testing.assert_allclose(y[:, 5] / y[:, -1], y[0, 5] / y[0, -1], rtol=2e-3)


def test_the_wander_is_scaled_too():
    assert np.std(readings(only(wander_sd=5e-5, scale=1.4))[:, -1]) == pytest.approx(7e-5, rel=SPREAD)


def test_machine_and_settings_miss_by_what_is_stated():
    """Drawn from their uncertainties, and true = stated + error."""
    rng = np.random.default_rng(0)
    drawn = [draw_errors(STILL, Noise(), rng) for _ in range(RUNS)]
    for name, quantity in stated_data(STILL).items():
        assert np.std([e.machine[name] for e in drawn]) == pytest.approx(quantity.u, rel=SPREAD)
    assert np.std(drawn[0].tension_rel) == pytest.approx(Noise().tension_rel, rel=SPREAD)
    assert np.std(drawn[0].yaw) == pytest.approx(Noise().yaw_u, rel=SPREAD)
    off = true_line(STILL, "strip", TrueErrors(machine={"width": 1e-3}, tension_rel=0.1, yaw=2e-5))
    np.testing.assert_allclose([off.width[0], off.stress[0], off.yaw[0]], [0.201, 22e6, 2e-5], rtol=1e-12)


def test_detectability_knows_white_noise():
    """A shift c of n readings of white noise w has d = sqrt(n) c/w when no nuisance is in its way."""
    plan = Plan(runs=(RunSetting(tension=20e6, yaw=0.0),), length=60.0)
    rule = Detectability(plan, only(white=2e-5, yaw_u=1e-12), "beam_th2")
    size = rule.sizes([fault_from_spec({"id": "sensor_offset", "c1": 1e-5})])[0]
    assert size == pytest.approx(np.sqrt(241) * 0.5, rel=1e-6)


def test_a_zero_error_hides_an_offset():
    """With the shift's own prior z in the way, d = c / sqrt(z^2 + w^2/n)."""
    plan = Plan(runs=(RunSetting(tension=20e6, yaw=0.0),), length=60.0)
    rule = Detectability(plan, only(white=2e-5, zero=1e-4, yaw_u=1e-12), "beam_th2")
    fault = fault_from_spec({"id": "sensor_offset", "c1": 1e-5})
    expected = 1e-5 / np.hypot(1e-4, 2e-5 / np.sqrt(241))
    assert rule.sizes([fault])[0] == pytest.approx(expected, rel=1e-4)
    assert np.linalg.norm(rule.reduce(changes(rule.plan, rule.base, rule.clean, [fault])[0])) == pytest.approx(
        expected, rel=1e-4
    )


@pytest.mark.parametrize("sigmas", [1.0, 3.0])
def test_an_error_of_the_tension_is_no_larger_than_what_settings_that_do_the_same_cost(sigmas):
    """At a low tension readings bend with it: to first order settings would miss most of what they can do."""
    plan = Plan(runs=tuple(RunSetting(tension=7e6, yaw=y) for y in (-7e-4, 7e-4)), length=20.0, spacing=0.5)
    noise = only(white=5e-7, tension_rel=0.016, yaw_u=1e-9)
    rule = Detectability(plan, noise, "strip")
    fault = fault_from_spec({"id": "tension_bias", "gain": 0.016 * sigmas})
    bound = np.sqrt(2.0) * sigmas
    assert np.linalg.norm(rule.reduce(changes(rule.plan, rule.base, rule.clean, [fault])[0])) > 1.5 * bound
    assert 0.9 * bound < rule.sizes([fault])[0] < 1.02 * bound


def test_an_effect_is_brought_to_size():
    rule = Detectability(Plan(length=20.0, spacing=0.5), Noise(), "strip")
    for name in ("taper", "soft_cover"):
        fault, size = scale_to_size(rule, fault_from_spec(name), 12.0)
        assert size == pytest.approx(12.0, rel=0.01)
        assert rule.sizes([fault])[0] == pytest.approx(size, rel=1e-6)  # said as it is, not as it was wanted


def test_a_quantum_rounds_the_readings_and_is_stated_as_white_noise():
    step = 1.29e-4
    campaign, _ = make_campaign(seed=5, plan=STILL, noise=only(white=2e-5, zero=1e-4, quantum=step))
    y = np.stack([run.signals["y1"] for run in campaign.runs])
    np.testing.assert_allclose(y / step, np.round(y / step), atol=1e-3)  # files keep a tenth of a micrometre
    assert campaign.signals[0].white == pytest.approx(np.hypot(2e-5, step / np.sqrt(12.0)))
    assert np.std(y.mean(axis=1)) == pytest.approx(1e-4, rel=0.25)  # a zero of its own in every run


def test_readings_in_steps_of_a_sensors_quantum_are_no_slip_of_a_unit():
    """Many second differences are then 0: the median says a scatter of 1e-15 of the stated one."""
    campaign, _ = make_campaign(hidden=[{"id": "taper", "kappa_t": 5e-5}], seed=0, noise=Noise(quantum=1.29e-4))
    assert check_noise(records_of(campaign)) == []
