"""The bending layer, hidden by finite elements whose ends give way, is found by the closed form under the strip."""

from small_campaign import SEED, SPREAD

from belt_sim.api.simulate import candidates_of
from belt_sim.diagnosis.describe import describe
from belt_sim.diagnosis.examine import examine
from belt_sim.model import analytic_model
from belt_sim.results.diagnosis import Verdict
from belt_sim.virtual_rig.make import make_campaign

WITHIN = 3.0  # u
NAMED = ["lift_off", "soft_cover", "tension_bias", "crown"]  # those most like it


def test_lift_off_is_found_with_its_size():
    strip = analytic_model("strip")
    campaign = make_campaign(
        hidden=[{"id": "lift_off", "strength": 1.0}], base="strip", seed=5, plan=SPREAD, title="layer"
    )[0]
    found = describe(
        examine(campaign, strip, candidates_of(NAMED, strip), seed=SEED),
        seed=SEED,
    )
    assert found.verdict is Verdict.EXPLAINED
    assert [e.id for e in found.effects] == ["lift_off"]
    strength = found.effects[0].parameters["strength"]
    assert abs(strength.value - 1.0) < WITHIN * strength.u
    noise = found.noise.wander_factor  # u is of the wander as it is in these runs, not as the file states it
    assert 0.7 < noise < 1.3
    assert strength.u < 0.2 * noise
