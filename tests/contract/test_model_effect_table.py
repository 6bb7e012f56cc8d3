"""Which model can represent which effect: computed and never dropped in silence."""

import pytest
from paper_cases import paper_case

from belt_sim.api.simulate import model_named
from belt_sim.effects.base import library
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.line.march import march_case
from belt_sim.model import MODELS, analytic_model
from studies.site.effect_pages import CAN, cell, table


def test_every_refusal_is_raised_with_a_remedy():
    refused = [(m, e) for m in MODELS.values() for e in library().values() if cell(m, e) != CAN]
    assert refused
    for model, effect in refused:
        with pytest.raises(CannotRepresent, match=effect.id):
            model.admit((effect.null(),))


def test_a_march_refuses_what_its_model_cannot_represent():
    with pytest.raises(CannotRepresent, match="rope has no runup law for taper"):
        march_case(paper_case(10), analytic_model("rope"), (library()["taper"](kappa_t=1e-5),), travel=10.0)


def test_a_rope_without_width_refuses_what_acts_through_the_width():
    effects = library()
    with pytest.raises(CannotRepresent, match="rope bear no moment for yaw_compliance"):
        march_case(paper_case(10), analytic_model("rope"), (effects["yaw_compliance"](c_m=1e-6),), travel=10.0)
    for name in ("taper", "yaw_compliance"):
        with pytest.raises(CannotRepresent, match=f"{name}: .* a rope has neither"):
            model_named("mujoco_rope").admit((effects[name].null(),))
        assert model_named("mujoco_flex").refusal(effects[name]) is None


def test_expected_cells():
    models, effects = MODELS, library()
    assert cell(models["strip"], effects["sag_roll"]) == "built in"
    assert cell(models["beam_th2"], effects["sag_roll"]) == CAN
    assert all(cell(model_named("mujoco_flex"), effects[name]) == "built in" for name in ("sag_roll", "shear"))
    assert all(cell(model_named("ritzinger"), e) != CAN for e in effects.values())
    assert len(table().splitlines()) == len(effects) + 2 + 2


def test_unknown_model_names_the_known_ones():
    with pytest.raises(InputError, match="use one of rope, beam_th1"):
        analytic_model("membrane")
