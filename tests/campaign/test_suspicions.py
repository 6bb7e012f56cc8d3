"""Dirty data is named before anything is fitted, and clean data is left alone."""

import dataclasses

import numpy as np
import pytest
from roped_campaign import damaged, roped_campaign

from belt_sim.campaign import leave_out_bad_readings, suspicions
from belt_sim.campaign.quality import NOISE_FACTOR, SPIKE, check_travel, records_of, spike_sizes

#: Clean campaigns looked at; the thresholds leave room for one false alarm in thousands, none is expected.
CLEAN = 40


def seen(campaign):
    return [(s.run, s.signal, s.kind) for s in suspicions(campaign)]


@pytest.mark.parametrize("length", [5.0, 50.0])
def test_clean_campaigns_raise_no_suspicion(length):
    for seed in range(CLEAN // 3):
        assert seen(roped_campaign(seed, length)) == []


def test_noise_off_by_forty_percent_and_coarse_digits_are_clean():
    campaign = roped_campaign(1)
    for scale in (0.6, 1.4):
        sheets = tuple(dataclasses.replace(s, white=s.white * scale) for s in campaign.signals)
        assert seen(dataclasses.replace(campaign, signals=sheets)) == []
    assert seen(damaged(campaign, lambda y: {n: np.round(v, 5) for n, v in y.items()})) == []


def test_heavy_tails_are_clean():
    rng = np.random.default_rng(3)
    assert seen(damaged(roped_campaign(2), lambda y: {"y1": y["y1"] + 1e-5 * rng.standard_t(3, len(y["y1"]))})) == []


def test_a_pulley_that_stands_askew_is_no_dirt():
    """An offset of the tail pulley 1.5 times the yaw turns one yaw sign's curves round; that is an effect."""
    campaign = roped_campaign(4)
    plus = campaign.runs[0].signals
    shift = {name: 1.5 * y for name, y in plus.items()}
    shifted = damaged(campaign, lambda y: {n: v + shift[n] for n, v in y.items()})
    assert [s for s in suspicions(shifted) if s.severity == "stop"] == []


@pytest.mark.parametrize("factor", [25.4, 1e-3])
def test_a_slipped_unit_is_named(factor):
    campaign = roped_campaign(5)
    assert seen(damaged(campaign, lambda y: {"y4": factor * y["y4"]}, 2)) == [("r2", "y4", "unit_slip")]
    everywhere = suspicions(damaged(campaign, lambda y: {"y4": factor * y["y4"]}))
    assert [(s.run, s.signal, s.kind) for s in everywhere] == [(None, "y4", "unit_slip")]


def test_a_slipped_unit_of_which_only_the_last_digits_are_left_is_named():
    """Metres in a column of millimetres, written with four digits: most neighbours read the same."""
    slipped = damaged(roped_campaign(5), lambda y: {"y4": np.round(1e-3 * y["y4"], 7)}, 2)
    assert seen(slipped) == [("r2", "y4", "unit_slip")]
    record = next(r for r in records_of(slipped) if (r.run.name, r.sheet.name) == ("r2", "y4"))
    assert record.measured_noise == 0.0


def test_scatter_that_all_runs_share_is_no_slip_of_some_of_them():
    """A sheet that states a sixth of the scatter: half of the runs lie a little beyond the limit, half within."""
    rng, campaign = np.random.default_rng(1), roped_campaign(5)
    noisy = damaged(campaign, lambda y: {"y4": y["y4"] + 1.14e-4 * rng.standard_normal(len(y["y4"]))})
    ratios = [r.measured_noise / r.stated_noise for r in records_of(noisy) if r.sheet.name == "y4"]
    assert min(ratios) < NOISE_FACTOR < max(ratios)
    found = suspicions(noisy)
    assert [(s.run, s.signal, s.severity) for s in found] == [(None, "y4", "look")]
    slipped = damaged(noisy, lambda y: {"y4": 25.4 * y["y4"]}, 2)
    assert ("r2", "y4", "unit_slip") in seen(slipped)


@pytest.mark.parametrize("factor", [57.3, 1 / 17.45])
def test_a_yaw_in_another_unit_is_named(factor):
    campaign = roped_campaign(6)
    runs = list(campaign.runs)
    runs[1] = dataclasses.replace(runs[1], yaw=runs[1].yaw * factor)
    found = suspicions(dataclasses.replace(campaign, runs=tuple(runs)))
    assert [(s.run, s.kind, s.severity) for s in found] == [("r1", "unit_slip", "stop")]


def test_travel_in_another_unit_is_named():
    campaign = roped_campaign(7)
    runs = list(campaign.runs)
    runs[3] = dataclasses.replace(runs[3], travel=runs[3].travel * 1000.0)
    assert ("r3", None, "unit_slip") in seen(dataclasses.replace(campaign, runs=tuple(runs)))
    timed = dataclasses.replace(campaign.runs[0], time=campaign.runs[0].travel * 2000.0)
    found = seen(dataclasses.replace(campaign, runs=(timed, *campaign.runs[1:])))
    assert found == [("r0", None, "unit_slip")]


def test_a_tenfold_travel_is_named_and_one_that_is_none_is_not():
    """Over speed times time: 10 is a slip, 7 may be a belt that was driven faster than stated."""
    campaign = roped_campaign(7)
    for factor, kinds in ((10.0, {"unit_slip"}), (7.0, set())):
        runs = [dataclasses.replace(r, time=r.travel / r.speed) for r in campaign.runs]
        runs[3] = dataclasses.replace(runs[3], time=runs[3].time / factor)
        found = check_travel(dataclasses.replace(campaign, runs=tuple(runs)))
        assert {s.kind for s in found if s.run == "r3"} == kinds


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_a_clipped_sensor_is_named(share):
    campaign = roped_campaign(8)
    limit = share * campaign.runs[0].signals["y1"].max()
    found = seen(damaged(campaign, lambda y: {"y1": np.minimum(y["y1"], limit)}, 0))
    assert found == [("r0", "y1", "clipped")]


def test_a_belt_at_rest_before_a_coarse_sensor_is_not_clipped():
    step = 4e-5
    begun = {"y1": lambda y: np.round((np.concatenate([np.zeros(15), y[:-15]]) + 3 * step) / step) * step}
    found = seen(damaged(roped_campaign(8), lambda y: {n: begun[n](y[n]) for n in begun}))
    assert "clipped" not in {kind for _, _, kind in found}


@pytest.mark.parametrize("value", [0.0, np.nan, -9.999, "hold"])
def test_a_dropout_is_named(value):
    def drop(y):
        out = y["y1"].copy()
        out[300:400] = out[299] if value == "hold" else value
        return {"y1": out}

    assert seen(damaged(roped_campaign(9), drop, 3)) == [("r3", "y1", "dropout")]


@pytest.mark.parametrize("rows", [40, 1000])
def test_a_sensor_that_is_moved_is_told(rows):
    def step(y):
        out = y["y1"].copy()
        out[500 : 500 + rows] -= 15e-3
        return {"y1": out}

    campaign = damaged(roped_campaign(9), step, 3)
    (found,) = suspicions(campaign)
    assert (found.run, found.signals, found.kind, found.severity) == ("r3", ("y1",), "shifted", "look")
    assert "-15 mm" in found.sentence or "+15 mm" in found.sentence


def test_spikes_are_named():
    def spike(y):
        out = y["y1"].copy()
        out[[200, 500, 800]] = 0.0
        return {"y1": out}

    assert seen(damaged(roped_campaign(10), spike, 3)) == [("r3", "y1", "dropout")]


def test_steep_ends_of_a_quiet_record_are_no_spikes_and_spikes_there_are():
    """A reading every half metre of a belt that runs off by 4 mm/m, with a tenth of the stated noise."""
    slope = 0.5 * 4e-3 * np.arange(60.0)
    noise = 1e-7 * np.random.default_rng(0).standard_normal(60)
    assert not spike_sizes(4.0 * (slope + noise), 1e-6, lone=SPIKE).any()  # a quarter of a spike at most
    spike = np.zeros(60)
    spike[[0, 59]] = 1e-3
    assert np.flatnonzero(spike_sizes(slope + noise + spike, 1e-6, lone=SPIKE)).tolist() == [0, 59]


def broken(stuck, spiky):
    """One run with so many stuck readings and so many that jump, its clean twin, and the places of either."""
    rows = [*range(300, 300 + stuck)], [600 + 7 * k for k in range(spiky)]

    def fail(y):
        out = y["y1"].copy()
        out[rows[0]], out[rows[1]] = out[299], out[rows[1]] + 5e-3
        return {"y1": out}

    clean = roped_campaign(10)
    return damaged(clean, fail, 3), clean, [*rows[0], *rows[1]]


@pytest.mark.parametrize(("stuck", "spiky"), [(0, 4), (60, 0), (60, 4)])
def test_a_few_bad_readings_are_left_out_and_listed(stuck, spiky):
    campaign, clean, rows = broken(stuck, spiky)
    mended, said = leave_out_bad_readings(campaign)
    there = np.isfinite(mended.runs[3].signals["y1"])
    assert set(rows) <= set(np.flatnonzero(~there))
    assert (~there).sum() <= len(rows) + 1  # the reading that it stuck at looks no other
    assert np.array_equal(mended.runs[3].signals["y1"][there], clean.runs[3].signals["y1"][there])
    assert [(s.run, s.signal, s.severity) for s in said] == [("r3", "y1", "look")] * ((stuck > 0) + (spiky > 0))
    assert f"{mended.runs[3].travel[rows[-1]]:.6g} m" in str(said[-1]) or stuck
    assert all(str(s).startswith("run r3, y1: ") for s in said)
    assert leave_out_bad_readings(mended) == (mended, ())
    assert [s.severity for s in suspicions(campaign)] == ["look"] * len(suspicions(campaign))


@pytest.mark.parametrize(("stuck", "spiky"), [(200, 0), (0, 56)])
def test_a_sensor_that_fails_for_long_is_broken(stuck, spiky):
    campaign, _, _ = broken(stuck, spiky)
    assert leave_out_bad_readings(campaign) == (campaign, ())
    assert [s.severity for s in suspicions(campaign)] == ["stop"]


def test_exchanged_columns_are_named():
    campaign = damaged(roped_campaign(11), lambda y: {}, 0)
    ends = [dataclasses.replace(r, signals={n: r.signals[n] for n in ("y1", "y4")}) for r in campaign.runs]
    campaign = dataclasses.replace(campaign, runs=tuple(ends))
    swap = damaged(campaign, lambda y: {"y1": y["y4"], "y4": y["y1"]}, 4)
    assert seen(swap) == [("r4", "y1 and y4", "swapped")]
    assert "or the yaw has the wrong sign" in str(suspicions(swap)[0])
    swap = damaged(campaign, lambda y: {"y1": y["y4"], "y4": y["y1"]})
    assert seen(swap) == [(None, "y1 and y4", "swapped")]


def test_columns_exchanged_across_a_wrap_are_named():
    swap = damaged(roped_campaign(12), lambda y: {"y1": y["y2"], "y2": y["y1"]}, 4)
    assert seen(swap) == [("r4", "y1 and y2", "swapped")]


def test_a_turned_sign_is_named():
    campaign = roped_campaign(13)
    whole = damaged(campaign, lambda y: {n: -v for n, v in y.items()}, 1)
    assert seen(whole) == [("r1", None, "wrong_sign")]
    for name in ("y1", "y4"):
        ends = [dataclasses.replace(r, signals={n: r.signals[n] for n in ("y1", "y4")}) for r in campaign.runs]
        turned = damaged(dataclasses.replace(campaign, runs=tuple(ends)), lambda y, n=name: {n: -y[n]}, 2)
        assert {(s.run, s.kind) for s in suspicions(turned)} == {("r2", "wrong_sign")}
        column = damaged(dataclasses.replace(campaign, runs=tuple(ends)), lambda y, n=name: {n: -y[n]})
        assert {s.kind for s in suspicions(column)} == {"wrong_sign"}


def test_every_suspicion_is_one_sentence():
    broken = damaged(roped_campaign(14), lambda y: {"y1": -y["y1"], "y2": 1000.0 * y["y2"]}, 0)
    found = suspicions(broken)
    assert found
    for suspicion in found:
        assert suspicion.sentence.isprintable()
        assert suspicion.severity in ("stop", "look")


def test_campaigns_too_small_to_judge_pass():
    campaign = roped_campaign(15)
    short = [
        dataclasses.replace(r, travel=r.travel[:n], signals={k: v[:n] for k, v in r.signals.items()})
        for n, r in zip((0, 1, 2, 3, 4, 5), campaign.runs, strict=True)
    ]
    empty = dataclasses.replace(short[0], signals={})
    assert seen(dataclasses.replace(campaign, runs=(empty, *short[1:]))) == []
