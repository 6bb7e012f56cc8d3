"""What goes wrong when a campaign is set up is said before anything is fitted: units, zeros, places, guides."""

import dataclasses
import math

import numpy as np
import pytest
from roped_campaign import LENGTH, RADIUS, SPACING, WHITE, YAW, damaged, roped_campaign

from belt_sim.campaign import Quantity, suspicions
from belt_sim.campaign.kinematics import check_guide, check_repeats
from belt_sim.campaign.quality import records_of
from belt_sim.virtual_rig.make import make_campaign


def stops(campaign):
    return [(s.run, s.signal, s.kind) for s in suspicions(campaign) if s.severity == "stop"]


def with_yaws(campaign, factor):
    return dataclasses.replace(campaign, runs=tuple(dataclasses.replace(r, yaw=r.yaw * factor) for r in campaign.runs))


@pytest.mark.parametrize("factor", [math.pi / 180.0, 1e3 * math.pi / 180.0, 1e-3])
def test_a_yaw_typed_in_another_unit_throughout_stops(factor):
    """rad, mrad or millidegrees written into yaw_deg: every run says the same wrong factor."""
    found = stops(with_yaws(roped_campaign(1), factor))
    assert [kind for _, _, kind in found] == ["unit_slip"]
    assert found[0][0] is None


def test_an_offset_of_the_yaw_is_no_other_unit():
    """Twice the yaw at one sign and none at the other is a pulley that stands askew."""
    campaign = roped_campaign(2)
    plus = campaign.runs[0].signals
    assert stops(damaged(campaign, lambda y: {n: v + plus[n] for n, v in y.items()})) == []


@pytest.mark.parametrize("shift", [-0.05, 0.02])
def test_one_run_that_is_shifted_stops(shift):
    found = stops(damaged(roped_campaign(3), lambda y: {"y1": y["y1"] + shift}, 2))
    assert found == [("r2", "y1", "shifted")]


def offsets(campaign, size, zero):
    """Every run and signal off by its own ``size`` (rms) while the sheet states ``zero``."""
    rng = np.random.default_rng(4)
    runs = [
        dataclasses.replace(r, signals={n: y - y[:20].mean() + rng.normal(0, size) for n, y in r.signals.items()})
        for r in campaign.runs
    ]
    sheets = tuple(dataclasses.replace(s, zero=zero) for s in campaign.signals)
    return dataclasses.replace(campaign, runs=tuple(runs), signals=sheets)


def test_offsets_that_the_sheet_does_not_state_are_told_and_stop_nothing():
    """Guard: "write zero: 0.18" was advised where a fault had moved the belt."""
    found = suspicions(offsets(roped_campaign(5), 2e-3, 0.0))
    assert {(s.kind, s.severity) for s in found} == {("zero", "look")}
    assert "write zero" not in found[0].sentence
    assert stops(offsets(roped_campaign(5), 2e-3, 2e-3)) == []
    assert stops(offsets(roped_campaign(5), 0.1 * WHITE, 0.0)) == []


def test_two_sensors_at_one_place_must_agree():
    campaign = roped_campaign(6)
    same = tuple(dataclasses.replace(s, at="point_1") if s.name == "y4" else s for s in campaign.signals)
    wrong = dataclasses.replace(campaign, signals=same)
    assert (None, "y1 and y4", "same_place") in stops(wrong)
    rng = np.random.default_rng(7)
    twice = damaged(wrong, lambda y: {"y4": y["y1"] + rng.normal(0, WHITE, len(y["y1"])) + 1e-4})
    assert stops(twice) == []


def test_two_places_must_not_read_one_thing():
    campaign, rng = roped_campaign(8), np.random.default_rng(9)
    copied = damaged(campaign, lambda y: {"y4": y["y1"]})
    assert (None, "y1 and y4", "same_place") in stops(copied)
    beside = damaged(campaign, lambda y: {"y4": y["y1"] + rng.normal(0, WHITE, len(y["y1"]))})
    assert (None, "y1 and y4", "same_place") in stops(beside)


def guided(travel, yaw, gain, swing):
    """y of a rope whose tail yaw is steered against y1: in proportion to it and its sum, or to and fro."""
    lag, drive, total = round(math.pi * RADIUS / SPACING), 0.0, 0.0
    y1, y3 = np.zeros(len(travel) + lag), np.zeros(len(travel) + lag)
    for k in range(lag, len(y1) - 1):
        total += SPACING * y1[k]
        drive = -gain * (y1[k] + 0.2 * total) if swing == 0.0 else drive
        if swing and abs(y1[k]) > swing:
            drive = -4.0 * abs(YAW) * np.sign(y1[k])
        y1[k + 1] = y1[k] + SPACING * (yaw + drive - (y1[k] - y3[k - lag]) / LENGTH)
        y3[k + 1] = y3[k] - SPACING * (y3[k] - y1[k - lag]) / LENGTH
    n = len(travel)
    return {"y1": y1[-n:], "y2": y1[:n], "y3": y3[-n:], "y4": y3[:n]}


def edge(travel, length, size):
    """y of an edge that is not straight: 0.3 of its first wave is in the second."""
    turns = 2.0 * np.pi * travel / length
    return size * (np.sin(turns) + 0.3 * np.sin(2.0 * turns + 1.0))


@pytest.mark.parametrize(("gain", "swing"), [(0.3, 0.0), (0.0, 5e-3)])
@pytest.mark.parametrize("size", [0.0, 1e-3])
def test_a_guide_in_closed_loop_stops(gain, swing, size):
    """Whether or not the belt's edge is straight."""
    campaign, rng = roped_campaign(10, length=60.0), np.random.default_rng(11)
    length = 2.0 * LENGTH + 2.0 * math.pi * RADIUS
    runs = []
    for r in campaign.runs:
        seen = guided(r.travel, r.yaw, gain, swing).items()
        noisy = {n: y + edge(r.travel, length, size) + rng.normal(0, WHITE, len(y)) for n, y in seen}
        runs.append(dataclasses.replace(r, signals=noisy))
    found = stops(dataclasses.replace(campaign, runs=tuple(runs)))
    assert "guided" in {kind for _, _, kind in found}


def test_an_edge_that_is_not_straight_is_no_guide():
    """It swings for ever as well, where the belt hardly drifts; but once a turn, and alike in all runs."""
    campaign, rng, length = roped_campaign(12, length=60.0), np.random.default_rng(13), 7.0
    around = 2.0 * math.pi * RADIUS
    machine = dataclasses.replace(campaign.machine, centre_distance=Quantity(value=(length - around) / 2.0))
    runs = []
    for r in campaign.runs:
        rest = {n: 0.02 * y + rng.normal(0, WHITE, len(y)) for n, y in r.signals.items()}
        seen = {n: y + edge(r.travel - k, length, 1e-3) for k, (n, y) in enumerate(rest.items())}
        runs.append(dataclasses.replace(r, signals=seen))
    edged = dataclasses.replace(campaign, machine=machine, runs=tuple(runs))
    assert check_guide(edged, records_of(edged)) == []


def drifting(seed, rate, rows=40):
    """Runs of which ``rows`` stand before the yaw, on a belt that runs off by ``rate`` [m/m] at both pulleys."""
    campaign = roped_campaign(seed)
    runs = []
    for run in campaign.runs:
        way = SPACING * np.arange(len(run.travel) + rows)
        still = {n: np.concatenate([np.full(rows, y[0]), y]) + rate * way for n, y in run.signals.items()}
        noise = np.random.default_rng(seed)
        before = {n: y + np.where(way < SPACING * rows, noise.normal(0, WHITE, len(way)), 0) for n, y in still.items()}
        runs.append(dataclasses.replace(run, travel=way, yaw_at=SPACING * rows, signals=before))
    return dataclasses.replace(campaign, runs=tuple(runs))


def test_a_record_that_begins_on_a_running_belt_names_run_in():
    (told,) = [s for s in suspicions(drifting(10, 1e-4)) if s.kind == "running_start"]
    assert told.severity == "look"
    assert "+0.1 mm/m" in told.sentence
    assert "run_in_m" in told.sentence
    assert not [s for s in suspicions(drifting(10, 0.0)) if s.kind == "running_start"]
    stated = drifting(10, 1e-4)
    stated = dataclasses.replace(stated, runs=tuple(dataclasses.replace(r, run_in=80.0) for r in stated.runs))
    assert not [s for s in suspicions(stated) if s.kind == "running_start"]


@pytest.mark.parametrize("scale", [1.03, 0.97])
def test_a_wheel_that_counts_too_little_or_too_much_is_told(scale):
    campaign = roped_campaign(11)
    runs = tuple(dataclasses.replace(r, time=r.travel * scale / r.speed) for r in campaign.runs)
    (told,) = suspicions(dataclasses.replace(campaign, runs=runs))
    assert (told.kind, told.severity, told.run) == ("travel", "look", None)
    assert f"true travel {scale:.3g} times" in told.sentence
    true = tuple(dataclasses.replace(r, time=r.travel / r.speed) for r in campaign.runs)
    assert suspicions(dataclasses.replace(campaign, runs=true)) == ()


def test_repeats_that_disagree_are_told_with_hours_and_what_would_do_it():
    """r2 repeats r0 seven hours later and moves as at 20 N/mm2, half way to the tension of r3."""
    campaign = roped_campaign(12, tension=(10e6, 40e6))
    assert check_repeats(campaign) == []
    clock = ("2025-05-12T07:00:00", "2025-05-12T07:30:00", "2025-05-12T14:00:00", "2025-05-12T15:00:00")
    runs = [dataclasses.replace(r, started=c) for r, c in zip(campaign.runs[:4], clock, strict=True)]
    later = runs[3].travel / runs[3].travel[-1]
    stiff = {n: y * (1.0 + later) for n, y in runs[3].signals.items()}
    half = {n: 0.5 * (y + stiff[n]) for n, y in runs[0].signals.items()}
    runs[2], runs[3] = (dataclasses.replace(r, signals=s) for r, s in zip(runs[2:], (half, stiff), strict=True))
    (told,) = check_repeats(dataclasses.replace(campaign, runs=tuple(runs)))
    assert str(told).startswith("run r2: differs from its first run r0")
    assert "7 h later" in told.sentence
    assert "as at 20 N/mm2 instead of 10" in told.sentence


@pytest.mark.parametrize(("share", "severity"), [(0.4, None), (0.7, "look"), (45.0, "stop")])
def test_a_belt_that_stands_beside_its_pulleys_is_told(share, severity):
    campaign = roped_campaign(14)
    y0 = -share * campaign.belt.width.value
    runs = (dataclasses.replace(campaign.runs[0], y0=y0), *campaign.runs[1:])
    found = suspicions(dataclasses.replace(campaign, runs=runs))
    assert [(s.run, s.severity) for s in found] == ([(campaign.runs[0].name, severity)] if severity else [])
    assert all(f"y0 = {1e3 * y0:.4g} mm" in s.sentence for s in found)


def test_a_yaw_that_was_on_before_a_running_record_is_told_before_exchanged_columns():
    """Records cut out after 20 m, their yaw stated where they begin and not 20 m before."""
    campaign = make_campaign(hidden=[{"id": "taper", "kappa_t": 2e-5}], seed=11, base="strip")[0]
    runs = []
    for run in campaign.runs:
        late = run.travel >= run.yaw_at + 20.0
        signals = {n: y[late] - y[late][0] for n, y in run.signals.items()}
        runs.append(
            dataclasses.replace(
                run, travel=run.travel[late], run_in=float(run.travel[late][0]), signals=signals, time=None
            )
        )
    true = dataclasses.replace(campaign, runs=tuple(runs))
    wrong = dataclasses.replace(true, runs=tuple(dataclasses.replace(r, yaw_at=r.run_in) for r in runs))
    found = [s for s in suspicions(wrong) if s.severity == "stop"]
    assert {s.kind for s in found} == {"running_start"}
    assert "it was on before (yaw_at_m below 0" in found[0].sentence
    assert "columns are exchanged" in found[0].sentence
    assert [s for s in suspicions(true) if s.severity == "stop"] == []
    unsaid = (dataclasses.replace(r, travel=r.travel - r.run_in, run_in=0.0, yaw_at=0.0) for r in runs)
    (told,) = [s for s in suspicions(dataclasses.replace(true, runs=tuple(unsaid))) if s.severity == "stop"]
    assert "columns are exchanged, or the yaw was on before the record (run_in_m)" in told.sentence
