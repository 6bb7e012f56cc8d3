"""Records cut out of a running machine, and one spoilt repeat: neither becomes a law, a wrong number or damage."""

from dataclasses import replace

import numpy as np
import pytest

import belt_sim as bs
from belt_sim.campaign.kinematics import check_repeats, suspicions
from belt_sim.campaign.types import rig_of
from belt_sim.diagnosis.foresight import free_starts, sheet_evidence
from belt_sim.discovery.selection import LawSearch
from belt_sim.model import MODELS
from belt_sim.virtual_rig import Plan, RunSetting, make_campaign

TAPER = 2e-5  # 1/m
STRIP = MODELS["strip"]


@pytest.fixture(scope="module")
def whole():
    """Ten runs that begin at rest, over a conical tail pulley."""
    return make_campaign(hidden=[{"id": "taper", "kappa_t": TAPER}], seed=3, base="strip")[0]


def cut(campaign, metres):
    """The campaign without the first metres of every record, which counts from there."""

    def later(run):
        rows = run.travel >= metres
        signals = {n: y[rows] - y[rows][0] for n, y in run.signals.items()}
        return replace(run, travel=run.travel[rows] - metres, signals=signals)

    return replace(campaign, runs=tuple(map(later, campaign.runs)))


def test_records_that_begin_at_rest_stay_as_they_are(whole):
    assert free_starts(whole, STRIP) == (whole, ())


def test_a_record_cut_on_a_running_machine_is_told_and_its_state_left_free(whole):
    campaign, (told,) = free_starts(cut(whole, 3.0), STRIP)
    assert (told.kind, told.severity) == ("running_start", "look")
    assert "the machine ran before" in told.sentence
    assert "run_in_m" in told.sentence
    assert all(np.isnan(run.run_in) for run in campaign.runs)
    assert [s for s in suspicions(campaign) if s.severity == "stop"] == []


def test_a_crown_in_cut_records_is_told_beside_its_running_start():
    """A free start explains four fifths of it: too little to leave the state free, enough to ask whether it ran."""
    made = make_campaign(hidden=[{"id": "crown", "c": 0.02}], seed=4, base="strip")[0]
    assert free_starts(made, STRIP) == (made, ())
    campaign, (told,) = free_starts(cut(made, 9.0), STRIP)
    assert campaign == cut(made, 9.0)
    assert "may lean already where the record begins" in told.sentence


def test_a_cut_record_without_a_yaw_begins_on_the_running_machine_too():
    """Its conical pulley turned the belt before the record: begun straight, it would need a law of its own."""
    plan = Plan(runs=tuple(RunSetting(tension=t, yaw=yaw) for t in (1e7, 3e7) for yaw in (-7e-4, 0.0, 7e-4)))
    made = make_campaign(hidden=[{"id": "taper", "kappa_t": 6.0 * TAPER}], seed=5, base="strip", plan=plan)[0]
    assert free_starts(made, STRIP) == (made, ())
    campaign, (told,) = free_starts(cut(made, 9.0), STRIP)
    assert all(np.isnan(run.run_in) for run in campaign.runs)
    assert "r02" in told.sentence


@pytest.mark.parametrize("ran", [False, True])
def test_where_a_law_of_few_numbers_says_as_much_the_start_is_asked_for(ran):
    """A belt that is slow to set itself to a yaw leans as if it had run before; one sensor cannot tell the two."""
    runs = tuple(RunSetting(tension=t, yaw=yaw) for t in (1e7, 1.5e7, 2e7, 3e7) for yaw in (-7e-4, 7e-4))
    plan = Plan(runs=runs, length=20.0, signals={"y1": "point_1"})
    slow = [] if ran else [{"id": "lagging_set", "kappa": 3.3e-5, "time": 17.5}]
    made = make_campaign(hidden=slow, seed=6, base="strip", plan=plan)[0]
    made = cut(made, 2.0) if ran else made
    assert free_starts(made, STRIP)[0] is not made
    campaign, (told,) = free_starts(made, STRIP, LawSearch().evidence_of_unknown)
    assert campaign is made
    assert told.severity == "stop"
    assert "or an unknown law acts" in told.sentence
    unknown = replace(made, runs=tuple(replace(run, run_in=np.nan) for run in made.runs))
    assert free_starts(unknown, STRIP, LawSearch().evidence_of_unknown) == (unknown, ())


def test_many_readings_tell_a_running_start_from_a_law(whole):
    ran = replace(cut(whole, 3.0), runs=cut(whole, 3.0).runs[:4])
    assert free_starts(ran, STRIP, LawSearch().evidence_of_unknown)[0] is not ran


def test_a_number_fitted_to_cut_records_is_the_true_one_and_says_what_it_costs(whole):
    found = bs.fit(cut(whole, 20.0), ["taper"], model="strip")
    both = np.array([1.0, 1.0])  # of tail and head, which these records tell from the sum only
    u = float(np.sqrt(both @ found.covariance @ both))
    assert abs(sum(found.values.values()) - TAPER) < 3.0 * u
    assert u < 0.05 * TAPER
    assert found.chi2[1] < 1.2 * found.degrees
    assert any("the machine ran before" in note for note in found.notes)


def test_a_yaw_that_was_on_before_the_record_may_be_stated(whole):
    """Without any freedom of the start: the numbers are as sure as those of the whole records."""
    runs = tuple(replace(r, run_in=20.0, travel=r.travel + 20.0, yaw_at=0.0) for r in cut(whole, 20.0).runs)
    stated = replace(whole, runs=runs)
    assert free_starts(stated, STRIP) == (stated, ())
    assert [s for s in suspicions(stated) if s.severity == "stop"] == []
    found = bs.fit(stated, ["taper"], model="strip")
    assert abs(found.values["taper.kappa_t"] - TAPER) < 3.0 * found.u["taper.kappa_t"]
    assert found.u["taper.kappa_t"] < 0.2 * TAPER


def spoil(campaign, name):
    """The campaign with one run whose readings grow by half over its travel."""
    grown = {r.name: 1.0 + 0.5 * r.travel / r.travel[-1] for r in campaign.runs if r.name == name}
    runs = (replace(r, signals={n: y * grown.get(r.name, 1.0) for n, y in r.signals.items()}) for r in campaign.runs)
    return replace(campaign, runs=tuple(runs))


def test_one_spoilt_repeat_comes_before_any_effect_and_makes_no_law(whole):
    assert check_repeats(whole) == []
    found = bs.diagnose(spoil(whole, "r09"), model="strip", effects=["taper"], advise=False)
    assert found.verdict == "cannot_say"
    assert "run r09: differs from its first run r03" in found.sentence
    assert found.discovery is None


def test_of_several_repeats_the_spoilt_one_is_named(whole):
    """r03 and its three repeats, of which the second is spoilt; the noise of each is its own."""
    first, rng = whole.runs[2], np.random.default_rng(5)
    more = [
        replace(
            first,
            name=n,
            repeat_of="r03",
            signals={k: y + rng.normal(0, 3e-5, len(y)) for k, y in first.signals.items()},
        )
        for n in ("a", "b", "c")
    ]
    (told,) = check_repeats(spoil(replace(whole, runs=(first, *more)), "b"))
    assert told.run == "b"
    assert told.severity == "stop"
    assert "differs from the 3 other runs of its setting" in told.sentence
    (told,) = check_repeats(spoil(replace(whole, runs=(first, *more)), "r03"))
    assert told.run == "r03"


@pytest.mark.parametrize("odd", [0, 4])
def test_a_step_in_one_of_many_repeats_does_not_hide_behind_its_own_size(whole, odd):
    """0.8 mm at a third of the way, which the settings could do (yaw), but which none of the others does."""
    first, rng, runs = whole.runs[2], np.random.default_rng(6), []
    for k in range(7):
        step = 8e-4 * (first.travel > first.travel[-1] / 3.0) * (k == odd)
        signals = {n: y + step + rng.normal(0.0, 3e-5, len(y)) for n, y in first.signals.items()}
        runs.append(replace(first, name=f"q{k}", repeat_of="q0" if k else None, signals=signals))
    (told,) = check_repeats(replace(whole, runs=tuple(runs)))
    assert told.run == f"q{odd}"
    assert "times as far as they do" in told.sentence
    good = [r for k, r in enumerate(runs) if k != odd]
    good = [replace(r, repeat_of=good[0].name if r is not good[0] else None) for r in good]
    assert check_repeats(replace(whole, runs=tuple(good))) == []


def test_a_curved_edge_that_every_run_meets_elsewhere_is_no_spoilt_repeat(whole):
    length, rng = float(rig_of(whole).belt_length), np.random.default_rng(2)
    runs = []
    for run in whole.runs:
        start = rng.uniform(0.0, length)
        edge = 1.0e-3 * np.cos(2.0 * np.pi * (run.travel + start) / length)
        runs.append(replace(run, start=start, signals={n: y + edge - edge[0] for n, y in run.signals.items()}))
    edged = replace(whole, runs=tuple(runs))
    assert check_repeats(edged) == []
    assert [s.run for s in check_repeats(spoil(edged, "r10"))] == ["r10"]


def test_a_wrong_direction_of_all_runs_is_asked_about_beside_a_real_effect():
    """It explains less than the effect does, and hardly anything else than the direction would."""
    runs = tuple(RunSetting(tension=t, yaw=yaw) for t in (7e6, 14e6, 4e7) for yaw in (-7e-4, 7e-4))
    plan = Plan(runs=runs, length=30.0, spacing=0.5)
    right = make_campaign(hidden=[{"id": "soft_cover", "d": 60}], seed=11, base="strip", plan=plan)[0]
    wrong = replace(right, runs=tuple(replace(r, direction=-1.0) for r in right.runs))
    (told,) = [e for e in sheet_evidence(wrong, STRIP) if e.mistake.kind == "direction"]
    assert told.suspicion.severity == "look"
    assert "the direction of travel" in told.suspicion.sentence
    assert [e for e in sheet_evidence(right, STRIP) if e.mistake.kind == "direction"] == []
