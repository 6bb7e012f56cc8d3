"""The 3D campaigns of models/campaigns: they open, and the independent line of this package measures the same.

They take minutes to make, so they are read here, not made anew (`python -m studies.samples`).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from belt_sim.campaign import read_campaign
from belt_sim.io import CAMPAIGNS
from belt_sim.virtual_rig import reveal
from belt_sim.virtual_rig.hidden import fault_from_spec
from belt_sim.virtual_rig.make import check_base
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.space import IN_SCENE, OWN_ERROR, SENSORS, space_plan, with_simulator_error
from studies.challenge.space_campaigns import SETTINGS, space_setting
from studies.samples import SPACE_SAMPLES

GAIN, WANDER = OWN_ERROR["native"]
LARGEST = 300_000  # bytes
SENSED = np.sqrt(SENSORS.white**2 + SENSORS.zero**2 + SENSORS.wander_sd**2)
#: In one-sigma errors of a reading: 20 signals with a zero and 6 wander lengths each have an rms of 1 +- 0.1.
RMS, WORST = 1.25, 4.0


def folder(name: str) -> Path:
    return CAMPAIGNS / name


def errors_in_sigmas(name: str, *, with_faults: bool = True) -> np.ndarray:
    """Readings minus the 1D line with the true settings, machine and faults, over their stated error."""
    campaign, truth, plan = read_campaign(folder(name)), reveal(folder(name)), space_plan()
    errors = TrueErrors(
        machine=truth.machine,
        tension_rel=np.array(truth.settings["tension_rel"]),
        yaw=np.array(truth.settings["yaw"]),
    )
    faults = [fault_from_spec({"id": e["id"], **e["parameters"]}) for e in truth.effects] if with_faults else []
    line = observe(plan, true_line(plan, truth.base, errors), faults)
    seen = np.array([[run.signals[s] for run in campaign.runs] for s in plan.signals]).transpose(0, 2, 1)
    return (seen - line) / np.sqrt(SENSED**2 + WANDER**2 + (GAIN * line) ** 2)


@pytest.mark.parametrize("name", SPACE_SAMPLES)
def test_it_is_small_reads_and_its_truth_opens(name):
    assert sum(path.stat().st_size for path in folder(name).iterdir()) < LARGEST
    truth, campaign = reveal(folder(name)), read_campaign(folder(name))
    assert (truth.seed, truth.base) == (SPACE_SAMPLES[name]["seed"], SPACE_SAMPLES[name]["base"])
    assert [{"id": e["id"], **e["parameters"]} for e in truth.effects] == SPACE_SAMPLES[name]["hidden"]
    assert len(campaign.runs) == len(space_plan().runs)
    assert campaign.signals[0].gain == pytest.approx(with_simulator_error(SENSORS)[0].gain)


@pytest.mark.evidence(
    "taper",
    route="3d",
    what="a conical tail pulley in 3D, 10 to 60 N/mm2: readings as this law says within their "
    "stated error (rms {RMS} sigma)",
)
@pytest.mark.parametrize("name", SPACE_SAMPLES)
def test_space_and_line_measure_alike_within_the_stated_error(name):
    off = errors_in_sigmas(name)
    assert np.sqrt(np.mean(off**2)) < RMS
    assert np.abs(off).max() < WORST


@pytest.mark.parametrize("name", [n for n, s in SPACE_SAMPLES.items() if s["hidden"]])
def test_without_what_is_hidden_they_do_not(name):
    assert np.abs(errors_in_sigmas(name, with_faults=False)).max() > 1.5 * WORST


def test_the_simulators_error_adds_to_the_sensors_in_squares():
    stated = with_simulator_error(replace(SENSORS, gain=0.03))[0]
    assert stated.gain == pytest.approx(np.hypot(0.03, GAIN))
    assert stated.wander_sd == pytest.approx(np.hypot(SENSORS.wander_sd, WANDER))
    assert (stated.white, stated.zero) == (SENSORS.white, SENSORS.zero)


def test_settings_by_lot_meet_every_fault_once_and_come_again():
    """In as many seeds as there are settings; none is part of its base law, and all have a scene."""
    drawn = [space_setting(seed) for seed in range(len(SETTINGS))]
    assert [vars(h) for _, h in drawn[:5]] == [vars(space_setting(seed)[1]) for seed in range(5)]
    assert sorted(f.id for _, h in drawn for f in h.faults) == sorted(filter(None, SETTINGS))
    for base, hidden in drawn:
        check_base(base, hidden.faults)
        assert all(f.id in IN_SCENE for f in hidden.faults)
        assert all(d > 3 for d in hidden.sizes)
