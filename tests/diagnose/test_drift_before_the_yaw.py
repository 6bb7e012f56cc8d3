"""What a machine does before the yaw is data: no error of zero, wherever the sensors were set to zero."""

from dataclasses import replace

import pytest
from small_campaign import CLASSES, MODEL, SPREAD

from belt_sim.api.compare import compare
from belt_sim.campaign import suspicions
from belt_sim.diagnosis.describe import describe
from belt_sim.diagnosis.examine import examine, find_faults
from belt_sim.results.diagnosis import Verdict
from belt_sim.units import MM
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise

LATE = replace(SPREAD, runs=tuple(replace(run, yaw_at=10.0) for run in SPREAD.runs))
OFFSET = 3.0 * MM  # of every sensor
EQUAL = 0.02  # settings and noise levels are found anew
#: A sheet that states how well a sensor reads zero, not how far the belt moved before the yaw.
SURE_OF_ZERO = Noise(white=0.01 * MM, wander_sd=0.02 * MM, zero=0.03 * MM)
TAPER = [{"id": "taper", "kappa_t": 1e-4}]


def test_a_fault_that_acts_before_the_yaw_is_named_and_zero_is_not_doubted():
    made = make_campaign(hidden=TAPER, seed=3, plan=replace(LATE, zero_at_start=False), noise=SURE_OF_ZERO)[0]
    drift = max(abs(y[20] - y[0]) for run in made.runs for y in run.signals.values())
    assert drift > 3.0 * SURE_OF_ZERO.zero
    assert {(s.kind, s.severity) for s in suspicions(made)} == {("running_start", "look")}  # which it may also be
    found = examine(made, MODEL, CLASSES)
    assert find_faults(found.bench, found.nothing.values, ()) == ()
    assert (found.decision.verdict, list(found.decision.named)) == (Verdict.EXPLAINED, ["taper"])
    assert found.suspicions == suspicions(made)
    assert describe(found, seed=0).suspicions == ()  # the taper is what acts before the yaw
    nothing = replace(found, named=found.nothing, decision=replace(found.decision, named={}))
    assert describe(nothing, seed=0).suspicions == found.suspicions


def test_what_is_shown_counts_from_the_yaw_and_its_uncertainty_holds_no_free_zero():
    """A constant on a record that shows its own zero changes neither the error nor the noise floor."""
    made = make_campaign(hidden=TAPER, seed=3, plan=LATE, noise=SURE_OF_ZERO)[0]
    moved = tuple(replace(run, signals={k: y + OFFSET for k, y in run.signals.items()}) for run in made.runs)
    plain, raised = (compare(c, "beam_th2", drawn=False).error for c in (made, replace(made, runs=moved)))
    assert plain.noise_floor < 0.3 * MM  # settings leave half of it; a free zero would be 20 mm
    assert raised.fit.before == pytest.approx(plain.fit.before, rel=EQUAL)
    assert raised.noise_floor == pytest.approx(plain.noise_floor, rel=EQUAL)
