"""Readings as arrays, what of a wave they show, and what a fit may take its numbers for."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_campaign import MODEL, campaign

from belt_sim.diagnosis.forward import Forward, Slot, bin_attenuation, significant_harmonics
from belt_sim.diagnosis.samples import Samples, samples_of
from belt_sim.effects.base import library
from belt_sim.effects.pulley import Taper
from belt_sim.effects.sensors import EdgeProfile
from belt_sim.effects.span import Weld
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Plan, RunSetting

SIGNALS = {"y1": "point_1", "phi": "upper_mid_span"}


def measured(yaw_at=0.0, spacing=0.5):
    runs = tuple(RunSetting(tension=2e7, yaw=yaw, yaw_at=yaw_at) for yaw in (-7e-4, 7e-4))
    return make_campaign(seed=1, plan=Plan(runs=runs, length=10.0, spacing=spacing, signals=SIGNALS))[0]


@pytest.mark.parametrize("yaw_at", [0.0, 2.0])
def test_a_tilt_is_not_judged_where_it_jumps_at_the_start_and_with_the_yaw(yaw_at):
    samples = samples_of(measured(yaw_at))
    here = np.isin(samples.travel[0], (0.0, yaw_at))
    assert here.sum() == len({0.0, yaw_at})
    np.testing.assert_array_equal(np.isnan(samples.y[:, 1]), np.tile(here, (2, 1)))
    assert np.isfinite(samples.y[:, 0]).all()  # the belt itself has not moved yet


def test_a_mean_of_before_and_after_is_not_judged_either():
    campaign = measured(2.01, spacing=0.02)
    samples = samples_of(campaign)
    assert samples.per_bin[0] == 2
    blank = samples.travel[0][np.isnan(samples.y[0, 1]) & (samples.travel[0] > 1.0)]
    assert blank.min() <= 2.01 <= blank.max()
    assert len(blank) <= 6
    plain = samples_of(replace(campaign, runs=tuple(replace(r, yaw_at=-1.0) for r in campaign.runs)))
    assert np.isfinite(plain.y[:, :, plain.travel[0] > 0.1]).all()


LENGTH, SPACING, MANY, BINS = 7.0, 0.06, 5, 100


def binned(travel):
    return travel.reshape(-1, MANY).mean(axis=1)


def test_the_average_of_a_wave_over_a_bin_is_as_large_as_the_fit_takes_it_for():
    dense = SPACING * np.arange(MANY * BINS)
    coarse = binned(dense)
    travel = np.stack([coarse, np.where(np.arange(BINS) < 70, coarse, coarse[69])])  # the second record is shorter
    samples = Samples(
        runs=(), signals=(), cases=SimpleNamespace(rig=SimpleNamespace(belt_length=LENGTH)), travel=travel, time=travel,
        y=np.zeros((2, 0, BINS)), yaw_at=np.zeros(2), per_bin=np.array([float(MANY), 1.0]),
    )  # fmt: skip
    asked = [Slot(Taper, "kappa_t"), *(Slot(EdgeProfile, name) for name in ("cos1", "sin9", "cos24", "sin40"))]
    shown = bin_attenuation(asked, samples)
    for share, k in zip(shown[0], (0, 1, 9, 24, 40), strict=True):
        wave = np.exp(2j * np.pi * k * dense / LENGTH)
        np.testing.assert_allclose(binned(wave), share * np.exp(2j * np.pi * k * coarse / LENGTH), atol=1e-9)
    assert shown[0, -1] < 0.2  # nothing like the whole
    np.testing.assert_allclose(shown[1], 1.0)


AROUND, N, RUNS, HARMONICS = 12.0, 240, 4, 12
NOISE = 1.0


def harmonics_of(seed, sizes, taken):
    """How many harmonics are asked for where noise is taken for ``taken`` times what it is."""
    travel = np.tile(np.linspace(0.0, 60.0, N), (RUNS, 1))
    phase = 2.0 * np.pi * travel / AROUND
    shapes = np.stack([f(k * phase) for k in range(1, HARMONICS + 1) for f in (np.cos, np.sin)])[:, :, None]
    y = np.tensordot(sizes, shapes, axes=1) + NOISE * np.random.default_rng(seed).normal(size=(RUNS, 1, N))
    roots = np.tile(np.eye(N) / (taken * NOISE), (RUNS, 1, 1, 1))
    samples = SimpleNamespace(travel=travel, y=y, cases=SimpleNamespace(rig=SimpleNamespace(belt_length=AROUND)))
    return significant_harmonics(samples, roots, shapes, y)


@pytest.mark.parametrize("taken", [1.0, 4.0])
def test_an_edge_that_passed_for_noise_does_not_hide_its_own_short_waves(taken):
    """Before any edge is fitted, noise may be taken for several times what it is."""
    sizes = np.zeros(2 * HARMONICS)
    sizes[:4], sizes[16:18] = 30.0, 0.4
    assert harmonics_of(4, sizes, taken) == 9


@pytest.mark.parametrize("taken", [1.0, 4.0])
def test_noise_alone_calls_for_the_fewest_however_large_it_was_taken(taken):
    assert harmonics_of(5, np.zeros(2 * HARMONICS), taken) == 3


@pytest.mark.parametrize("centres", [2.0, 11.28, 14.0])
def test_a_weld_is_looked_for_all_round_a_belt_of_any_length(centres):
    """Steps in metres that fit a long belt go round a short one in its own time, and find a few places again."""
    samples = samples_of(campaign("nothing"))
    cases = replace(samples.cases, rig=replace(samples.cases.rig, centre_distance=centres))
    forward = Forward(replace(samples, cases=cases), MODEL, (Weld,))
    (position, grid), *others = forward.grids("weld").items()
    assert not others
    around = float(cases.rig.belt_length)
    places = np.sort(np.mod(np.array(grid) * forward.slots[position].scale, around))
    gaps = np.diff([*places, places[0] + around])
    assert gaps == pytest.approx(around / len(grid))
    assert gaps.max() < 0.1 * around


SHAPES = [(e, n) for e in library().values() for n, p in e.parameters.items() if p.modifier]


def side(effect, name):
    """In SI units."""
    slot = Slot(library()[effect], name)
    return tuple(end * slot.scale for end in slot.side)


def test_a_weld_is_no_longer_and_no_shorter_than_welds_are_and_its_angle_is_free():
    assert side("weld", "length") == pytest.approx(library()["weld"].parameters["length"].plausible)
    assert side("weld", "angle") == (-np.inf, np.inf)


def test_a_stiffness_keeps_its_side_and_may_be_as_large_as_the_readings_say():
    assert side("yaw_compliance", "c_m") == (0.0, np.inf)


@pytest.mark.parametrize(("effect", "name"), SHAPES, ids=lambda x: getattr(x, "id", x))
def test_every_shape_is_bounded_and_null_is_within(effect, name):
    slot = Slot(effect, name)
    low, high = slot.side
    assert np.isfinite([low, high]).all()
    assert low <= slot.parameter.null / slot.scale <= high
