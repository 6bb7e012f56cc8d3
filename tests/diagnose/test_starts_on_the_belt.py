"""Runs may start anywhere on the belt: what comes round is the same in all of them, but for where it begins."""

from dataclasses import replace

import numpy as np
import pytest
from small_campaign import CLASSES, MODEL, SPREAD

from belt_sim.campaign import read_campaign, write_campaign
from belt_sim.diagnosis.examine import examine
from belt_sim.diagnosis.linearisation import PeriodicWaves, find_starts, linearise_effects
from belt_sim.diagnosis.workbench import workbench
from belt_sim.results.diagnosis import Verdict
from belt_sim.virtual_rig.make import make_campaign

LENGTH = 23.6  # [m], about that of the belt
STARTS = (0.0, 14.5, 3.25, 20.0, 8.125, 17.0)
EDGE = [{"id": "edge_profile", "cos1": 3e-4, "sin2": 2e-4, "cos5": 1e-4}]
ANYWHERE = replace(SPREAD, runs=tuple(replace(r, start=s) for r, s in zip(SPREAD.runs, STARTS, strict=True)))
FOUND = 0.5  # [m]: three sigmas of a start by an edge of so little


def test_runs_of_one_shape_are_turned_until_they_fit():
    """Readings without noise of three pairs of waves, by runs that start elsewhere."""
    rates = 2.0 * np.pi * np.array([[1.0, 2.0, 5.0]] * 3) / LENGTH
    gram = 1e8 * np.repeat(np.eye(6)[None], 3, axis=0)
    turning = PeriodicWaves(gram, np.zeros((3, 6)), rates)
    numbers, starts = np.array([1.0, 0.5, -0.3, 0.8, 0.2, 0.4]), np.array([0.0, 7.0, 19.5])
    moments = [1e8 * turning.rotations(r, starts[r : r + 1])[0] @ numbers for r in range(3)]
    found, _ = replace(turning, moments=np.array(moments)).align(LENGTH * np.arange(400) / 400)
    first = int(np.argmin(found[:, 1]))
    assert found[first].tolist() == [0.0, 0.0]
    apart = (found[:, 0] - (starts - starts[first]) + LENGTH / 2) % LENGTH - LENGTH / 2
    assert np.abs(apart).max() < 0.5 * LENGTH / 400


@pytest.fixture(scope="module")
def anywhere():
    """What is found where every run starts at a place of its own."""
    return examine(make_campaign(hidden=EDGE, seed=4, plan=ANYWHERE)[0], MODEL, CLASSES)


def test_a_crooked_edge_is_named_wherever_runs_start(anywhere):
    """Guard: it ended as none_known."""
    assert (anywhere.decision.verdict, list(anywhere.decision.named)) == (Verdict.EXPLAINED, ["edge_profile"])


def test_starts_are_found_and_paid_for(anywhere):
    runs = anywhere.bench.campaign.runs
    first = next(k for k, run in enumerate(runs) if run.start_u == 0.0)
    length = float(np.max(anywhere.bench.samples.cases.rig.belt_length))
    apart = np.array([run.start - s for run, s in zip(runs, STARTS, strict=True)]) + STARTS[first]
    assert np.abs((apart + length / 2) % length - length / 2).max() < FOUND
    row = next(r for r in anywhere.table.rows if r.ids == {"edge_profile"})
    assert len(row.scanned) == len(runs) - 1


def test_runs_that_start_at_one_place_are_left_there():
    made = make_campaign(hidden=EDGE, seed=4, plan=SPREAD)[0]
    bench = workbench(made, MODEL, CLASSES)
    near = linearise_effects(bench, bench.fit([bench.start((), bench.forward.null())])[0], [c.id for c in CLASSES])
    assert find_starts(bench, near) is None


def test_a_start_that_is_stated_is_taken(tmp_path):
    made = make_campaign(hidden=EDGE, seed=4, plan=ANYWHERE)[0]
    stated = replace(made, runs=tuple(replace(r, start=s) for r, s in zip(made.runs, STARTS, strict=True)))
    write_campaign(stated, tmp_path / "stated")
    read = read_campaign(tmp_path / "stated")
    assert [run.start for run in read.runs] == list(STARTS)
    bench = workbench(read, MODEL, CLASSES)
    fit = bench.fit([bench.start(("edge_profile",), bench.forward.null())])[0]
    count = int(np.isfinite(bench.samples.y).sum())
    assert fit.chi2 < count + 5.0 * np.sqrt(2.0 * count)
