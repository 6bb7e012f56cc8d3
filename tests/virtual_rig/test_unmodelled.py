"""Every unmodelled fault does what its first line says."""

import numpy as np
import pytest
from virtual_bench import SPAN, YAW, late_rate, measured, plan_of

from belt_sim.virtual_rig.hidden import fault_class
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import TEST_BELT, RunSetting


def change(name: str, parameters: dict, **run) -> tuple[np.ndarray, np.ndarray]:
    """Travel [m] and what the unmodelled fault adds to points 1-4, shape (4, n) [m]."""
    s, y = measured(fault_class(name)(**parameters), **run)
    return s, y - measured(**run)[1]


def test_after_a_loss_of_adhesion_the_belt_climbs_faster():
    s, more = change("adhesion_loss", {"share": 0.2, "after": 20.0})
    assert np.all(more[:, s <= 20.0] == 0.0)
    assert np.all(more[0, s >= 20.5] > 0.0)


def test_quadratic_contact_drives_to_one_side_whatever_the_yaw():
    (_, plus), (_, minus) = (change("quadratic_contact", {"c": 1e-3}, yaw=yaw) for yaw in (YAW, -YAW))
    assert plus[0, -1] > 1e-6  # [m], as a taper does
    np.testing.assert_allclose(minus, plus, atol=2e-2 * plus.max())


def test_creep_ends_at_a_larger_yaw_and_takes_time_not_travel():
    run = {"length": 350.0, "spacing": 1.0}
    s, y = measured(fault_class("yaw_creep")(share=0.2), **run)
    assert late_rate(s, y, 100.0) == pytest.approx(1.2 * late_rate(*measured(**run), 100.0), rel=1e-2)
    slow = change("yaw_creep", {"share": 0.2, "time": 50.0})[1]
    fast = change("yaw_creep", {"share": 0.2, "time": 25.0}, speed=1.0)[1]
    np.testing.assert_allclose(fast, slow, atol=1e-12)
    assert np.abs(change("yaw_creep", {"share": 0.2}, speed=1e4)[1]).max() < 1e-6


def test_the_cubic_sensor_stands_at_point_1():
    _, clean = measured()
    _, more = change("sensor_cubic", {"c": 1000.0})
    np.testing.assert_allclose(more[0], 1000.0 * clean[0] ** 3, atol=1e-15)
    assert np.all(more[1:] == 0.0)


def test_the_strange_wave_has_its_own_wavelength():
    _, y = measured(fault_class("strange_wave")(amplitude=1e-4, wavelength=6.4), yaw=0.0, length=64.0, spacing=0.25)
    assert np.argmax(np.abs(np.fft.rfft(np.diff(y[0])))[4:]) + 4 == 10


def test_tension_decays_by_e_over_its_length():
    """So slowly that the belt settles at every tension: its rate is that of a belt at what is left."""
    run = {"length": 350.0, "spacing": 1.0}
    decaying = late_rate(*measured(fault_class("tension_decay")(share=0.6, length=1000.0), **run), 100.0)
    left = 1 - 0.6 * (1 - np.exp(-0.3))  # in the middle of the last 100 m
    settled = late_rate(*measured(tension=40e6 * left, **run), 100.0)
    assert settled < 0.97 * late_rate(*measured(**run), 100.0)
    assert decaying == pytest.approx(settled, rel=5e-3)


def test_the_stand_moves_with_the_root_of_time():
    s, more = change("warming_stand", {"c": 3e-5}, yaw_at=10.0)
    expected = 3e-5 * np.sqrt(np.maximum(s - 10.0, 0.0) / 0.5)
    np.testing.assert_allclose(more, np.broadcast_to(expected, more.shape), atol=1e-15)


@pytest.mark.parametrize("name", ["walking_angle", "wind_steps"])
def test_chance_is_another_in_every_run_and_the_same_for_a_seed(name):
    cls = fault_class(name)
    size = next(iter(cls.sizes))
    plan = plan_of(RunSetting(tension=40e6, yaw=0.0), RunSetting(tension=40e6, yaw=0.0), length=20.0, spacing=1.0)
    y, again, other, double = (
        observe(
            plan, true_line(plan, "beam_th2", TrueErrors()), [cls(**{size: k * cls.sizes[size].typical, "seed": seed})]
        )
        for k, seed in ((1, 5), (1, 5), (1, 6), (2, 5))
    )
    assert np.all(y == again)
    assert np.all(y[0, 2:] != other[0, 2:])
    assert np.abs(y[:, :, 0] - y[:, :, 1]).max() > 0.3 * np.abs(y).max()
    np.testing.assert_allclose(double, 2 * y, atol=1e-12)


def test_the_belt_that_sticks_runs_straight_for_a_while():
    s, y = measured(fault_class("mid_stick")(share=1.0, begin=20.0, length=6.0))
    held = (s >= 21.0) & (s <= 26.0)
    assert np.ptp(y[0, held]) < 3e-8  # [m], in a step of the march that began before
    assert np.ptp(measured()[1][0, held]) > 1e-4


def test_wind_bends_both_run_ups_as_on_a_clamped_span():
    """In the first 0.5 m the run-up turns by k s, k = p L^2/(12 EI), and moves by -k s^2/2."""
    pressure, seed = 0.5, 3
    gust = np.random.default_rng(seed).standard_normal()
    s, y = measured(fault_class("wind_steps")(pressure=pressure, seed=seed), yaw=0.0, length=0.5, spacing=0.05)
    belt = TEST_BELT
    bending = belt.youngs_modulus.value * belt.width.value**3 * belt.thickness.value / 12
    expected = pressure * gust * SPAN**2 / (12 * bending) * s**2 / 2
    np.testing.assert_allclose(y[[0, 2]], np.stack([expected, expected]), rtol=0.15, atol=1e-9)


def test_in_the_dead_zone_the_belt_does_not_turn():
    _, y = measured(fault_class("dead_zone")(kappa_d=5e-4))
    np.testing.assert_allclose(y, 0.0, atol=1e-15)
