"""What changes with time, travel, tension or speed: by superposition, in limits and in closed form."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from virtual_bench import ARC, SPAN, YAW, late_rate, measured, plan_of

from belt_sim.virtual_rig.faults import (
    FIRST_HARMONIC,
    PROFILE_DECAY,
    PROFILE_HARMONICS,
    BuildUpFault,
    PulleyDeflectionFault,
    SensorDelayFault,
    TaperDriftFault,
    TaperFault,
    TractionLossFault,
    UnequalTensionFault,
    YawDriftFault,
    YawOffsetTailFault,
)
from belt_sim.virtual_rig.hidden import random_fault

FORCE = 40e6 * 0.2 * 3e-4  # [N]
LINEAR = 1e5  # [s]


def ramp_of(step) -> np.ndarray:
    """What a cause that grows by 1 a metre does, from what a cause of 1 does: its integral (Duhamel)."""
    s, y = measured(step, yaw=0.0, spacing=0.05)
    return cumulative_trapezoid(y, s, initial=0.0)[:, ::20]


@pytest.mark.evidence("build_up", route="definition", what="the integral of a taper that grows")
def test_a_growing_cause_is_the_integral_of_a_constant_one():
    run = {"yaw": 0.0, "spacing": 1.0}
    np.testing.assert_allclose(
        measured(BuildUpFault(rate=2e-6), **run)[1], 2e-6 * ramp_of(TaperFault(kappa_t=1.0)), atol=2e-8
    )
    slow = measured(TaperDriftFault(rate=1e-6, time_constant=1e9), **run)[1]
    np.testing.assert_allclose(slow, 2e-6 * ramp_of(TaperFault(kappa_t=1.0)), atol=2e-8)  # 0.5 m/s
    turning = measured(YawDriftFault(rate=1e-6, time_constant=1e9), **run)[1]
    np.testing.assert_allclose(turning, 2e-6 * ramp_of(YawOffsetTailFault(beta_0=1.0)), atol=2e-8)


def test_a_warm_machine_stands_still():
    run = {"yaw": 0.0, "length": 400.0, "spacing": 1.0}
    for drift, steady in (
        (YawDriftFault(rate=1e-5, time_constant=20.0), YawOffsetTailFault(beta_0=2e-4)),
        (TaperDriftFault(rate=1e-6, time_constant=20.0), TaperFault(kappa_t=2e-5)),
    ):
        found, wanted = (late_rate(*measured(fault, **run), 100.0) for fault in (drift, steady))
        assert found == pytest.approx(wanted, rel=2e-3)


@pytest.mark.parametrize("fault", [YawDriftFault(rate=1e-6), TaperDriftFault(rate=1e-6)])
def test_warmth_comes_with_time_and_dirt_with_travel(fault):
    slow, fast = (measured(fault, yaw=0.0, speed=v)[1] for v in (0.5, 1.0))
    np.testing.assert_allclose(fast, slow / 2, atol=1e-6 * np.abs(slow).max() + 1e-8, rtol=2e-3)
    dirt = [measured(BuildUpFault(rate=1e-6), yaw=0.0, speed=v)[1] for v in (0.5, 1.0)]
    np.testing.assert_array_equal(*dirt)


@pytest.mark.long
def test_bent_pulleys_bring_the_belt_to_where_they_are_parallel():
    """Axes of curvature k: the tail is yawed by beta - k y, the head by k y, parallel at beta/2k."""
    bow = 5e-6 * FORCE
    s, y = measured(PulleyDeflectionFault(compliance=5e-6), yaw=YAW, length=1200.0, spacing=2.0)
    ahead = measured(length=1200.0, spacing=2.0)[1]
    rate = late_rate(s, ahead, 300.0) * 1e-3
    wanted = YAW / (2 * bow) * (1 - np.exp(-2 * bow * rate / YAW * s))  # the rate per yaw, of the yaw that is left
    np.testing.assert_allclose(y[0, 100:], wanted[100:], atol=0.08 * YAW / (2 * bow))
    assert y[[0, 2], -1].mean() == pytest.approx(YAW / (2 * bow), rel=0.02)


def test_without_yaw_a_symmetric_machine_keeps_the_belt():
    assert np.all(measured(PulleyDeflectionFault(compliance=5e-6), yaw=0.0)[1] == 0.0)


def test_lost_traction_slows_the_drift_by_what_the_spans_need_more():
    """dy/ds = f alpha: in steady drift both span laws give w = beta L (w1 - w0)/(2 (L/f + pi R))."""
    kl = np.sqrt(12 * 40e6 / 210e9) / 0.2 * SPAN
    w1 = (kl * np.cosh(kl) - np.sinh(kl)) / (kl * (np.cosh(kl) - 1))
    follows = 1 - 0.4 * (1.5 - 0.5)
    w = YAW * SPAN * (2 * w1 - 1) / (2 * (SPAN / follows + ARC))
    s, y = measured(TractionLossFault(loss=0.4, onset=0.5), speed=1.5, length=500.0, spacing=1.0)
    assert late_rate(s, y, 100.0) == pytest.approx(1e3 * w, rel=2e-3)
    slow = measured(TractionLossFault(loss=0.4, onset=0.5), speed=0.4)[1]
    np.testing.assert_array_equal(slow, measured(speed=0.4)[1])


@pytest.mark.parametrize("tension", [10e6, 40e6])
def test_unequal_tension_is_a_yaw_in_proportion_to_the_force(tension):
    pulled = measured(UnequalTensionFault(yaw_per_force=1e-7), tension=tension)[1]
    turned = measured(YawOffsetTailFault(beta_0=1e-7 * tension * 0.2 * 3e-4), tension=tension)[1]
    np.testing.assert_allclose(pulled, turned, atol=1e-12)


def test_a_late_reading_shows_the_past_at_every_point():
    _, clean = measured()
    _, y = measured(SensorDelayFault(delay=2.0))  # 1 m at 0.5 m/s: four readings
    np.testing.assert_allclose(y[:, 4:], clean[:, :-4], atol=1e-15)
    assert np.all(y[:, :4] == 0.0)


def test_edges_are_drawn_with_the_measured_spectrum():
    plan, rng = plan_of(), np.random.default_rng(0)
    edges = [vars(random_fault("edge_profile", plan, rng)) for _ in range(300)]
    order = np.arange(1, PROFILE_HARMONICS + 1)
    squares = [np.mean([e[f"cos{k}"] ** 2 + e[f"sin{k}"] ** 2 for e in edges]) for k in order]
    slope, level = np.polyfit(np.log(order), np.log(squares) / 2, 1)
    assert slope == pytest.approx(-PROFILE_DECAY, abs=0.05)
    assert np.exp(level) == pytest.approx(np.sqrt(2) * FIRST_HARMONIC, rel=0.1)
    assert 0.3e-3 < np.sqrt(np.sum(squares) / 2) < 0.6e-3  # [m]; 0.49 mm measured
