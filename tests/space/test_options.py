"""Options stand in the configurations, every one of them; the belt runs at the speed that was asked for."""

from dataclasses import fields, replace

import numpy as np
import pytest
import yaml
from paper_cases import paper_case

import belt_sim as bs
from belt_sim.api.simulate import model_named
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.io import CONF
from belt_sim.space import BELTS, Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.options import OBEYED, OF_BELT, SLOWNESS, fit_options, string_speed
from studies.paper.case import ROPE_EXAMPLE


def written(belt):
    return yaml.safe_load((CONF / "model" / f"mujoco_{belt}.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("belt", BELTS)
def test_every_option_stands_in_the_configuration_and_nothing_else(belt):
    group = written(belt)
    assert list(group) == ["name", *(f.name for f in fields(Options)), "contact", "scene"]
    model = model_named(group.pop("name"), group)
    assert (model.belt, model.options) == (belt, Options())


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"across": 2.5}, "model.across = 2.5 nodes: .* whole"),
        ({"steps": 1.5}, "model.steps = 1.5: .* whole"),
        ({"steps": float("inf")}, "model.steps = inf: .* whole"),
        ({"dx": 0.0}, "model.dx = 0.0 m: give a positive"),
        ({"friction": -1}, "model.friction = -1.0: give 0 or a positive"),
        ({"dt": "short"}, "model.dt = short s: give a positive number"),
        ({"tail_mass": 3}, "use one of dx, .*, steps, contact, scene"),
    ],
)
def test_an_option_that_cannot_be_is_refused_with_its_unit(given, says):
    with pytest.raises(InputError, match=says):
        Options.from_settings(given)
    assert type(Options.from_settings({"steps": 3.0}).steps) is int


def at_speed(speed, tension=60.0):
    case = paper_case(tension)
    return replace(case, settings=replace(case.settings, speed=speed))


def test_the_belt_runs_as_fast_as_is_accurate_unless_told_otherwise():
    case = at_speed(0.3)
    assert fit_options(Options(), case, "flex").run_speed == pytest.approx(min(2.0, string_speed(case) / SLOWNESS))
    assert fit_options(Options(belt_speed=0.7), case, "flex").run_speed == 0.7
    assert fit_options(Options(belt_speed="case"), case, "flex").run_speed == 0.3
    assert model_named("mujoco_flex", {"belt_speed": "case"}).options.belt_speed == "case"


def test_a_result_says_at_which_step_and_speed_it_was_run():
    """In time: a slow belt on MJX takes longer steps, a yaw step that folds the belt shorter ones."""
    slow, folds = paper_case(7.0), paper_case(7.0, 0.005, ROPE_EXAMPLE)
    pace = string_speed(slow) / SLOWNESS
    for engine, step in (("native", 1e-3), ("mjx", 2e-3 / pace), ("quasi_static", None)):
        used = SpaceModel(engine=engine).options_for(slow)
        assert (used.dt, used.belt_speed) == (pytest.approx(step), pytest.approx(pace))
    assert SpaceModel().options_for(folds).step < 1e-3
    brief = {"name": "mujoco_flex", "dx": 0.04, "run_in": 0.02, "settle": 0.05, "belt_speed": 0.2, "acceleration": 3.0}
    found = bs.simulate(paper_case(60.0, rig=ROPE_EXAMPLE), model=brief, travel=0.1)
    assert found.details["options"]["dt"] == 1e-3
    assert np.max(found.curves.extra["belt_speed"]) == pytest.approx(0.2)


@pytest.mark.parametrize(("speed", "name"), [(3.0, "model.belt_speed"), ("case", "speed")])
def test_a_speed_that_shakes_the_belt_is_refused_with_a_remedy(speed, name):
    with pytest.raises(InputError, match=rf"{name} = 3 m/s: .* without a speed asked for it is 0\.85 m/s"):
        fit_options(Options(belt_speed=speed), at_speed(3.0, tension=7.0), "flex")


@pytest.mark.parametrize("speed", ["fast", 0.0, -1.0, -1, float("nan")])
def test_what_is_no_speed_is_refused(speed):
    with pytest.raises(InputError, match=r"model\.belt_speed"):
        fit_options(Options(belt_speed=speed), at_speed(1.0), "flex")


#: a changed value of every option, within its bounds
CHANGED = {
    "dx": 0.05, "across": 3, "dt": 1.5e-3, "belt_speed": 0.3, "friction": 0.05, "bonds": ("longitudinal", "transverse"),
    "tensioning": "length", "run_in": 0.1, "acceleration": 2.0, "settle": 0.1, "yaw_time": 0.1, "damping": 200.0,
    "sample": 0.02, "frame": 0.01, "steps": 3,
}  # fmt: skip
#: what makes a run short; an engine takes of these what it obeys
BRIEF = {"dx": 0.04, "dt": 2e-3, "run_in": 0.04, "settle": 0.03, "acceleration": 3.0, "yaw_time": 0.05, "sample": 0.01}
TRAVEL = 0.04  # [m]


class Frames:
    """Counts the frames of a run."""

    count = 0

    def start(self, case, travel):
        self.count = 0

    def frame(self, frame):
        self.count += 1

    def finish(self, curves):
        pass


def ran(engine, contact, belt, options, case):
    model = SpaceModel(belt=belt, options=options, engine=engine, contact=contact)
    frames = Frames()
    watchers = () if engine == "quasi_static" else (frames,)
    curves = model.run(case, travel=TRAVEL, observers=watchers)
    return np.concatenate([[frames.count, len(curves.travel)], curves.y.ravel(), curves.extra["tension"]])


@pytest.mark.parametrize(
    ("engine", "contact", "belt"),
    [
        ("native", "held", "flex"),
        pytest.param("quasi_static", "held", "flex", marks=pytest.mark.long),
        pytest.param("native", "held", "grid", marks=pytest.mark.long),
        pytest.param("quasi_static", "held", "grid", marks=pytest.mark.long),
        pytest.param("native", "held", "rope", marks=pytest.mark.long),
        pytest.param("quasi_static", "held", "rope", marks=pytest.mark.long),
        pytest.param("mjx", "held", "flex", marks=pytest.mark.long),
        pytest.param("native", "mujoco", "flex", marks=pytest.mark.long),
    ],
)
def test_a_changed_option_changes_the_result_or_is_refused(engine, contact, belt, short_rig):
    """Whatever differs in the last digit counts; what an engine cannot do is refused by its name."""
    by = engine if contact == "held" else contact
    known = OBEYED[by] | OF_BELT[belt]
    brief = Options(**{name: value for name, value in BRIEF.items() if name in known})
    usual = ran(engine, contact, belt, brief, short_rig)
    for name, value in (CHANGED | ({} if belt == "flex" else {"dt": 1e-4})).items():  # tendons bound the step
        options = replace(brief, **{name: value})
        if name not in known:
            with pytest.raises(InputError, match=rf"model\.{name} = .* does not obey it"):
                ran(engine, contact, belt, options, short_rig)
        else:
            try:
                found, said = ran(engine, contact, belt, options, short_rig), ""
            except (CannotRepresent, InputError) as refusal:
                found, said = np.empty(0), str(refusal)
            assert name in said or not np.array_equal(found, usual), name


@pytest.mark.parametrize(("engine", "contact"), [("quasi_static", "held"), ("mjx", "held"), ("native", "mujoco")])
def test_what_an_engine_does_not_obey_is_refused_by_its_name(engine, contact, short_rig):
    known = OBEYED[engine if contact == "held" else contact] | OF_BELT["flex"]
    for name in CHANGED.keys() - known:
        options = Options(**{n: v for n, v in BRIEF.items() if n in known} | {name: CHANGED[name]})
        with pytest.raises(InputError, match=rf"model\.{name} = .* does not obey it"):
            ran(engine, contact, "flex", options, short_rig)


def test_every_option_is_in_the_table():
    names = {f.name for f in fields(Options)}
    assert set(CHANGED) == names
    assert set.union(*OBEYED.values(), *OF_BELT.values()) == names


def test_a_drag_below_what_a_scene_needs_is_refused():
    """It would change nothing: the contacts' landings ask for more."""
    case = at_speed(0.4)
    least = fit_options(Options(), case, "flex", "mujoco").damping
    assert fit_options(Options(damping=1.01 * least), case, "flex", "mujoco").damping == 1.01 * least
    with pytest.raises(InputError, match=r"model\.damping = 2.* give at least"):
        fit_options(Options(damping=2.0), case, "flex", "mujoco")
    assert fit_options(Options(damping=2.0), case, "flex").damping == 2.0
