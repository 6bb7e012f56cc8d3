"""Which model runs where none is stated, and how little that changes where the belt is tight."""

from dataclasses import replace

import numpy as np
import pytest

import belt_sim as bs
from belt_sim.api.simulate import campaign_model
from belt_sim.errors import InputError

#: largest difference of y on the test rig, in percent of the largest y (docs/simulate.md)
TOLD = {7: 3.1, 22: 0.8, 45: 0.1}


@pytest.mark.parametrize(("tension", "model"), [(7, "strip_lift_off"), (22.3, "strip_lift_off"), (22.4, "strip")])
def test_a_run_chooses_by_its_tension(tension, model):
    """The choice, and so a plant and a row of a table, is none that is then warned of."""
    found = bs.simulate(tension=tension, travel=2.0)
    assert (found.model, found.beyond) == (model, ())
    assert bs.simulate(model="beam_th2", tension=tension, travel=2.0).model == "beam_th2"
    plant = bs.linearise(tension=tension)
    assert (plant.model, plant.beyond) == (model, ())
    table = bs.sweep(tension=[tension, 60], travel=2.0)
    assert (*table["model"], *table.attrs["beyond"]) == (model, "strip")


def test_another_belt_lifts_off_at_another_tension():
    thick = {"width": 0.2, "thickness": 0.5e-3, "youngs_modulus": 210e9, "density": 7850.0, "poisson_ratio": 0.3}
    found = bs.simulate(tension=30, belt=thick, travel=2.0)
    assert (found.model, found.beyond) == ("strip_lift_off", ())
    table = bs.sweep(tension=[30, 60], belt=thick | {"thickness": [0.3e-3, 0.5e-3]}, travel=2.0)
    assert list(table["model"]) == ["strip", "strip_lift_off", "strip", "strip"]
    assert repr(table).splitlines()[2].split()[3:4] == ["strip_lift_off"]  # which row is which
    with pytest.raises(InputError, match="a sweep has one model"):
        bs.sweep(tension=[30, 60], model=["strip", "beam_th2"])
    assert bs.simulate(tension=7, effects=["lift_off"], travel=2.0).model == "strip"


def test_a_campaign_has_one_model_by_its_slackest_run():
    synthetic = bs.load_campaign("machine_fault")
    assert campaign_model(None, synthetic).name == "strip"
    campaign = replace(synthetic, source=replace(synthetic.source, kind="measured"))
    tensions = [run.tension / 1e6 for run in campaign.runs]
    assert min(tensions) < 22 < max(tensions)
    assert campaign_model(None, campaign).name == "strip_lift_off"
    tight = replace(campaign, runs=tuple(r for r in campaign.runs if r.tension >= 23e6))
    assert campaign_model("by_tension", tight).name == "strip"
    assert campaign_model("strip", campaign).name == "strip"


@pytest.mark.parametrize("tension", TOLD)
def test_both_models_agree_where_the_belt_is_tight(tension):
    strip, layer = (
        np.asarray(bs.simulate(model=m, tension=tension, yaw=-0.042, travel=40).curves.y)
        for m in ("strip", "strip_lift_off")
    )
    assert 100 * np.abs(layer - strip).max() / np.abs(strip).max() == pytest.approx(TOLD[tension], abs=0.05)
