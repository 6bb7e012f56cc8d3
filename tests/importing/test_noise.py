"""Noise that was put in is read off again from repeats; what a fault does is none."""

import numpy as np
import pytest

from belt_sim.campaign import Run
from belt_sim.importing.sheets import noise_of

WHITE, WANDER, LENGTH, ZERO = 1e-5, 4e-5, 3.0, 1e-4


def run(name: str, rng, *, yaw: float = 1e-3, repeat_of: str | None = None, spacing: float = 0.25) -> Run:
    """A run of a smooth movement with white noise, an Ornstein-Uhlenbeck wander, a zero of its own and a yaw error."""
    travel = np.arange(0.0, 60.0, spacing)
    wander, keep = np.empty(len(travel)), np.exp(-spacing / LENGTH)
    wander[0] = rng.standard_normal()
    for k in range(1, len(travel)):
        wander[k] = keep * wander[k - 1] + np.sqrt(1.0 - keep**2) * rng.standard_normal()
    y = 0.3 * yaw * travel + 5.0 * yaw * (1.0 - np.exp(-travel / 5.0))
    y += 1e-6 * rng.standard_normal() * travel + ZERO * rng.standard_normal()
    y += WHITE * rng.standard_normal(len(travel)) + WANDER * wander
    return Run(name=name, tension=1e7, yaw=yaw, repeat_of=repeat_of, travel=travel, signals={"y1": y})


def test_levels_come_back_from_repeats():
    rng = np.random.default_rng(5)
    found = []
    for _ in range(12):
        runs = [run("a", rng), run("b", rng, repeat_of="a"), run("c", rng, repeat_of="a")]
        found.append(noise_of("y1", runs, span=11.28))
    assert np.median([n.white for n in found]) == pytest.approx(WHITE, rel=0.25)
    assert np.median([n.wander for n in found]) == pytest.approx(WANDER, rel=0.3)
    assert 1.2 < np.median([n.length for n in found]) < 5.0
    assert np.median([n.zero for n in found]) == pytest.approx(ZERO, rel=0.5)
    assert "repeats" in found[0].wander_from


def test_a_fault_that_moves_the_belt_at_zero_yaw_is_no_noise():
    """Guard: zero 0.118 and wander 0.048 mm over 14 m were read off such runs, for 0.03 and 0.012 mm over 2 m."""
    rng = np.random.default_rng(6)
    still = [run(name, rng, yaw=0.0) for name in "abc"]
    drift = 1e-3 * (1.0 - np.exp(-still[0].travel / 10.0))
    for one in still:
        one.signals["y1"] += drift
    found = noise_of("y1", still, span=11.28)
    assert found.wander < 1.5 * WANDER
    assert found.zero < 1.5 * WANDER


def test_without_repeats_it_is_a_lower_bound_and_says_so():
    found = noise_of("y1", [run("a", np.random.default_rng(1))], span=11.28)
    assert "lower bound" in found.wander_from
    assert found.wander < 1.5 * WANDER
    assert found.zero > 0.0  # no sensor is perfect


def test_readings_rounded_to_steps_have_the_noise_of_rounding_at_least():
    still = run("a", np.random.default_rng(1))
    coarse = np.round(still.signals["y1"] / 1e-3) * 1e-3
    found = noise_of("y1", [Run(name="a", tension=1e7, yaw=1e-3, travel=still.travel, signals={"y1": coarse})], 11.28)
    assert found.white >= 1e-3 / np.sqrt(12.0) * 0.99


def test_a_travel_that_jumps_leaves_the_noise_of_the_rest():
    """Guard: a code for no reading in the column of the travel ended the import with a traceback."""
    travel = np.append(np.arange(40) * 0.01, 50.0)
    y = WHITE * np.random.default_rng(2).standard_normal(len(travel))
    found = noise_of("y1", [Run(name="a", tension=1e7, yaw=0.0, travel=travel, signals={"y1": y})], span=11.28)
    assert found.white == pytest.approx(WHITE, rel=0.5)
