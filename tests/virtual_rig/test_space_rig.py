"""A campaign measured in three dimensions: what is asked for gets into the scene, and a campaign comes out."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from belt_sim.campaign import read_campaign
from belt_sim.case import GRAVITY
from belt_sim.effects.load import load_effects
from belt_sim.errors import BeltError, InputError
from belt_sim.scene_parts import PulleySurface, Push
from belt_sim.space.options import Options
from belt_sim.virtual_rig import reveal, space, write_blind
from belt_sim.virtual_rig.hidden import fault_from_spec
from belt_sim.virtual_rig.march import TrueErrors
from belt_sim.virtual_rig.plan import RunSetting
from belt_sim.virtual_rig.space import (
    NARROW_BELT,
    OWN_ERROR,
    SENSORS,
    TENSIONS,
    YAW,
    make_space_campaign,
    measure,
    run_scene,
    scene_effects,
    scene_parts,
    space_plan,
    take_readings,
    true_cases,
)

COARSE = Options(dx=0.04, run_in=0.0, settle=0.2)
TINY = replace(space_plan(), runs=(RunSetting(tension=40e6, yaw=YAW, speed=1.0),), length=0.5, spacing=0.1)
FINE = Options(dx=0.025, run_in=0.0, settle=0.4)
RUN = partial(run_scene, effects=(), options=COARSE, travel=0.2)
MIRRORED = (
    5e-6  # [m]: the membrane's triangles lean to one side; a belt without yaw drifts by 2 um over the first metre
)


def edited(name: str, direction: float = 1.0, **parameters):
    """Scene parts after one fault."""
    plan = replace(TINY, runs=(replace(TINY.runs[0], direction=direction),))
    fault = fault_from_spec({"id": name, **parameters})
    case = true_cases(plan, "beam_th2", TrueErrors(), [fault])[0]
    return scene_parts(case, scene_effects(load_effects, [fault]), Options())


@pytest.mark.parametrize(
    ("name", "parameters", "there"),
    [
        ("taper", {"kappa_t": 2e-5}, {"taper": 2e-5}),
        ("crown", {"c": 5e-3}, {"crown": 5e-3}),
        ("cant", {"gamma": -1e-3}, {"cant": -1e-3}),
        ("yaw_compliance", {"c_m": 5e-6}, {"yaw_compliance": 5e-6}),
        ("wobble", {"beta_1": 1e-3, "phase": 0.3}, {"wobble": 1e-3, "wobble_phase": 0.3}),
    ],
)
def test_a_fault_of_the_pulley_shapes_the_tail_pulley_only(name, parameters, there):
    parts = edited(name, **parameters)
    assert {k: getattr(parts.tail, k) for k in there} == pytest.approx(there, rel=1e-12)
    assert parts.head == PulleySurface(radius=0.17)


def test_wobble_runs_the_other_way_when_the_travel_is_reversed():
    parts = edited("wobble", direction=-1.0, beta_1=1e-3, phase=0.3)
    assert parts.tail.wobble_phase == pytest.approx(-0.3, rel=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_loads_on_the_spans_are_forces_in_the_scene(direction):
    """On a rig of 2 m and a belt of 0.1 m: an idler pushes the other way on reversed travel, a drag goes against it."""
    idler = edited("idler_skew", direction, force=2.0, place=0.25)
    assert idler.pushes == (Push(span="upper", x=0.5, across=2.0 * direction),)
    drag = edited("side_drag", direction, moment=-0.5, place=0.25)
    assert drag.pushes == (Push(span="upper", x=0.5, along=-10.0 * direction, couple=-0.5 * direction),)
    assert (edited("machine_tilt", angle=0.01).lean, edited("off_centre_load", moment=0.01).roll) == (0.01, -0.01)


def test_slip_is_friction():
    assert edited("slip", inverse_friction=10.0).friction == pytest.approx(0.1)


def test_sag_roll_is_gravity():
    assert true_cases(TINY, "beam_th2", TrueErrors())[0].rig.gravity == 0.0
    assert true_cases(TINY, "strip", TrueErrors())[0].rig.gravity == GRAVITY
    assert edited("sag_roll", strength=1.0).gravity == GRAVITY


def test_yaw_offsets_turn_their_own_pulley():
    tail, head = edited("yaw_offset_tail", beta_0=1e-4), edited("yaw_offset_head", beta_0=-1e-4)
    assert (tail.tail.yaw_offset, tail.head.yaw_offset) == (1e-4, 0.0)
    assert (head.tail.yaw_offset, head.head.yaw_offset) == (0.0, -1e-4)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_weld_is_a_bend_of_the_belt_at_its_place_whichever_way_it_runs(direction):
    parts = edited("weld", direction=direction, angle=1e-3, at=1.2)
    s = np.linspace(0.0, float(true_cases(TINY, "strip", TrueErrors())[0].rig.belt_length), 20001)
    camber = parts.camber(s)
    assert np.trapezoid(camber, s) == pytest.approx(1e-3, rel=1e-6)
    assert s[np.argmax(camber)] == pytest.approx(1.2, abs=1e-3)


def test_camber_bends_the_belt_all_round():
    np.testing.assert_array_equal(edited("camber", kappa_c=1e-4).camber(np.linspace(0.0, 5.0, 7)), np.full(7, 1e-4))


@pytest.mark.parametrize("hidden", [["sensor_gain"], ["nonsense"], [3], [{"id": "taper", "d": 6}], "random"])
def test_what_has_no_scene_is_refused_in_one_line(hidden):
    with pytest.raises(InputError) as caught:
        make_space_campaign(load_effects, hidden=hidden, plan=TINY)
    assert "\n" not in str(caught.value)


def test_gravity_cannot_be_hidden_from_the_strip():
    with pytest.raises(InputError, match="part of base strip"):
        make_space_campaign(load_effects, hidden=["sag_roll"], base="strip", plan=TINY)


def test_the_rig_is_one_where_beam_theory_holds():
    """Edge stress of the entry moment 4 EI beta / L below the lowest tension."""
    plan = space_plan()
    edge = 2 * NARROW_BELT.youngs_modulus.value * NARROW_BELT.width.value * YAW / plan.machine.centre_distance.value
    assert edge < 0.6 * min(TENSIONS)


def test_a_tiny_campaign_is_written_and_its_truth_opens(tmp_path):
    made = make_space_campaign(
        load_effects,
        hidden=[{"id": "taper", "kappa_t": 1e-4}],
        seed=5,
        plan=replace(TINY, length=0.2),
        options=replace(COARSE, dt=2e-3, settle=0.05, acceleration=3.0, yaw_time=0.05),
        workers=1,
        engine="native",
    )
    sha256 = write_blind(tmp_path / "c", *made)
    truth, campaign = reveal(tmp_path / "c"), read_campaign(tmp_path / "c")
    assert truth.sha256() == sha256
    assert truth.effects == [{"id": "taper", "parameters": {"kappa_t": 1e-4}, "d": None}]
    assert (truth.base, len(campaign.runs)) == ("strip", 1)
    assert campaign.signals[0].gain > SENSORS.gain  # the simulator's own error is stated
    assert all(b"taper" not in path.read_bytes() for path in (tmp_path / "c").iterdir())
    with pytest.raises(InputError, match="exists"):
        write_blind(tmp_path / "c", *made)


@pytest.mark.long
def test_opposite_yaw_is_the_mirror_image():
    plan = replace(TINY, runs=(TINY.runs[0], replace(TINY.runs[0], yaw=-YAW)))
    left, right = (run_scene(c, (), FINE, 0.5) for c in true_cases(plan, "strip", TrueErrors()))
    assert left.y[0, -1] > 5 * MIRRORED  # towards where the pulley points
    np.testing.assert_allclose(left.y, -right.y, atol=MIRRORED)


@pytest.mark.long
def test_processes_measure_what_one_measures_and_in_order():
    plan = replace(TINY, runs=(TINY.runs[0], replace(TINY.runs[0], yaw=-YAW), replace(TINY.runs[0], yaw=2 * YAW)))
    cases = true_cases(plan, "strip", TrueErrors())
    one, two = (measure(cases, RUN, workers) for workers in (1, 2))
    for alone, together in zip(one, two, strict=True):
        np.testing.assert_array_equal(alone.y, together.y)


@pytest.mark.long
def test_a_run_that_fails_ends_the_campaign():
    """A belt of 2 kPa cannot carry its weight."""
    good, bad = (
        true_cases(replace(TINY, runs=(replace(TINY.runs[0], tension=t),)), "strip", TrueErrors())[0]
        for t in (40e6, 2e3)
    )
    with pytest.raises(BeltError) as caught:
        measure([bad, good, good], RUN, 2)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "options", "engine"),
    [
        ("slip", COARSE, "quasi_static"),
        ("idler_skew", COARSE, "quasi_static"),
    ],
)
def test_the_quick_engine_measures_what_it_can(monkeypatch, name, options, engine):
    asked = []
    monkeypatch.setattr(space, "measure", lambda cases, run, workers, tell: asked.append(run) or [])
    with pytest.raises(ValueError, match="zip"):  # nothing is measured here
        make_space_campaign(load_effects, hidden=[name], seed=0, plan=TINY, options=options)
    assert [run.keywords["engine"] for run in asked] == [engine]


@pytest.mark.long
def test_both_engines_measure_alike():
    """Points 1 and 4 after half a metre, within what the file states of the engines' own errors and sensors."""
    case = true_cases(TINY, "strip", TrueErrors())[0]
    taper = load_effects([{"id": "taper", "kappa_t": 1e-4}])
    native, quasi_static = (
        take_readings(TINY, [run_scene(case, taper, FINE, 0.5, e)]) for e in ("native", "quasi_static")
    )
    np.testing.assert_allclose(quasi_static, native, atol=5e-6, rtol=OWN_ERROR["native"][0])
