"""What goes wrong when a campaign is set up is said before anything is fitted: units, zeros, places, guides."""

import dataclasses
import math

import numpy as np
import pytest
from roped_campaign import LENGTH, RADIUS, SPACING, WHITE, YAW, damaged, roped_campaign

from belt_sim.campaign import Quantity, suspicions
from belt_sim.campaign.quality import check_guide, records_of


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
