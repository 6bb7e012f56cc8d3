"""Options stand in the configurations, every one of them; the belt runs at the speed that was asked for."""

from dataclasses import fields, replace

import numpy as np
import pytest
import yaml
from paper_cases import paper_case

from belt_sim.errors import InputError
from belt_sim.files import CONF
from belt_sim.model import model_named
from belt_sim.space import BELTS, Options
from belt_sim.space.native import simulate
from belt_sim.space.options import SLOWNESS, fit_options, string_speed


def written(belt):
    return yaml.safe_load((CONF / "model" / f"mujoco_{belt}.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("belt", BELTS)
def test_every_option_stands_in_the_configuration_and_nothing_else(belt):
    group = written(belt)
    assert list(group) == ["name", *(f.name for f in fields(Options)), "contact", "scene", "control"]
    model = model_named(group.pop("name"), group)
    assert (model.belt, model.options, model.control) == (belt, Options(), False)


def at_speed(speed, tension=60.0):
    case = paper_case(tension)
    return replace(case, settings=replace(case.settings, speed=speed))


def test_the_belt_runs_as_fast_as_is_accurate_unless_told_otherwise():
    case = at_speed(0.3)
    assert fit_options(Options(), case, "flex").run_speed == pytest.approx(min(2.0, string_speed(case) / SLOWNESS))
    assert fit_options(Options(belt_speed=0.7), case, "flex").run_speed == 0.7
    assert fit_options(Options(belt_speed="case"), case, "flex").run_speed == 0.3
    assert model_named("mujoco_flex", {"belt_speed": "case"}).options.belt_speed == "case"


@pytest.mark.parametrize(("speed", "name"), [(3.0, "options.belt_speed"), ("case", "settings.speed")])
def test_a_speed_that_shakes_the_belt_is_refused_with_a_remedy(speed, name):
    with pytest.raises(InputError, match=rf"{name} = 3 m/s: .* leave options.belt_speed out for 0\.85 m/s"):
        fit_options(Options(belt_speed=speed), at_speed(3.0, tension=7.0), "flex")


@pytest.mark.parametrize("speed", ["fast", 0.0, -1.0, -1, float("nan")])
def test_what_is_no_speed_is_refused(speed):
    with pytest.raises(InputError, match=r"options\.belt_speed"):
        fit_options(Options(belt_speed=speed), at_speed(1.0), "flex")


def test_the_pace_that_was_run_is_told():
    options = Options(dx=0.04, dt=2e-3, run_in=0.2, settle=0.1, acceleration=3.0, belt_speed="case")
    curves = simulate(at_speed(0.4), belt="flex", travel=0.1, options=options)
    assert np.max(curves.extra["belt_speed"]) == pytest.approx(0.4)
