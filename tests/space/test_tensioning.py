"""Tension by the belt's length and by pulleys that move apart, against the belt laid under a force."""

import math
from dataclasses import replace

import numpy as np
import pytest
from paper_cases import YAW, paper_case

from belt_sim.errors import InputError
from belt_sim.model import model_named
from belt_sim.space import Options
from belt_sim.space.loop import Catenary, HangingBelt, free_length, lay_loop, lift
from belt_sim.space.native import SpaceRun, simulate
from belt_sim.space.options import fit_options
from belt_sim.space.recording import Recorder
from belt_sim.space.tensioning import KollerPlan
from belt_sim.space.wrap import TAIL
from studies.paper.case import ROPE_EXAMPLE, TEST_RIG
from studies.tensionings import EarlyFrames

ROUNDING = 1e-9
LINK = 5e-3  # [m]: the last of 400 points of a span of 2 m lies so far from where it touches
PHASE = 1e-4  # [m] of 2.2 mm: four ends of wraps, where links of 25 mm are chords of a path that bends unevenly
AT_REST = 2e-3  # of the tension; the weight of a wrap alone makes upper and lower span differ by 2 q R / F
SLACK_AT_REST = 5e-3  # at 1 N/mm2 the sway of the sags, two seconds old, is not yet over
RUNNING = 0.03  # of the tension at stations 40 mm apart: wraps longer by up to 35 um at each of four ends
COARSE = {"dx": 0.04, "dt": 2e-3, "run_in": 0.6, "settle": 0.2, "acceleration": 3.0}
STILL = 5e-6  # [m], what y may wander by: shaking of landings

pytestmark = pytest.mark.filterwarnings("ignore:flex")


@pytest.mark.parametrize("radii", [(0.17, 0.17), (-0.2, -0.1)])
@pytest.mark.parametrize("curvature", [0.0, 0.25])
def test_a_span_touches_both_circles(radii, curvature):
    span = Catenary.from_circles(2.0, *radii, curvature)
    points = np.concatenate([[span.start], span.divide(400)])
    assert span.start @ [math.cos(span.slopes[0]), math.sin(span.slopes[0])] == pytest.approx(0.0, abs=ROUNDING)
    for place, radius in ((0.0, radii[0]), (2.0, radii[1])):
        distance = np.hypot(points[:, 0] - place, points[:, 1])
        assert abs(radius) - ROUNDING < distance.min() < abs(radius) + LINK**2 / abs(radius)
        assert np.all(np.sign(points[:, 1]) == np.sign(radius))
    links = np.hypot(*np.diff(points, axis=0).T)
    assert links == pytest.approx(span.length / 400, rel=1e-6)


def test_a_polygon_of_stations_is_as_long_as_the_smooth_belt_and_its_four_ways_onto_the_pulleys():
    depth = np.linspace(0.0, 0.125, 20001)  # the path is on the circle after 4.5 chords
    height, radius = lift(depth, 0.025, 0.17), 0.17
    way = np.hypot(1.0 + height / radius, np.gradient(height, depth))
    longer = 4.0 * float(np.mean(way) * depth[-1] - depth[-1])
    for centre_distance in (2.0, 2.008, 2.016):
        case = paper_case(7, 0.0, replace(ROPE_EXAMPLE, centre_distance=centre_distance))
        loop = lay_loop(case, 0.025)
        assert loop.chord * len(loop.x) == pytest.approx(HangingBelt.from_case(case).length + longer, abs=PHASE)


@pytest.mark.parametrize(("belt", "tension", "near"), [("rope", 1.0, SLACK_AT_REST), ("flex", 7.0, AT_REST)])
def test_a_belt_of_the_right_length_has_the_tension(belt, tension, near):
    case = paper_case(tension, 0.0, ROPE_EXAMPLE)
    options = fit_options(Options(tensioning="length", settle=2.0 if tension < 7.0 else 1.0), case, belt)
    run = SpaceRun.begin(case, belt, options)
    run.run_stage(run.stages(1.0)[0], Recorder(run.scene, ()))
    assert run.state.tail_x == pytest.approx(2.0, abs=ROUNDING)
    assert -run.state.loads[TAIL, 0] == pytest.approx(2.0 * case.tension_force, rel=near)


def test_a_longer_belt_is_slacker():
    case = paper_case(60, 0.0, ROPE_EXAMPLE)
    slack = replace(case, settings=replace(case.settings, tension=1e6))
    assert free_length(slack) > free_length(case) + 4e-3


def test_the_plan_ends_where_the_same_belt_has_the_wanted_tension():
    case = paper_case(7, 0.0, TEST_RIG)
    tight = lay_loop(case, 0.025)
    plan = KollerPlan.from_case(case, tight)
    slack = lay_loop(plan.slack, 0.025, len(tight.x))
    strains = [1.0 + float(c.settings.tension / c.belt.youngs_modulus) for c in (case, plan.slack)]
    assert slack.chord / strains[1] == pytest.approx(tight.chord / strains[0], abs=ROUNDING / len(tight.x))
    assert plan.places_at(plan.travel)[0] == pytest.approx(11.28, abs=ROUNDING)
    assert plan.places_at(0.0) == pytest.approx([slack.centre_distance, 0.0], abs=ROUNDING)
    assert np.all(np.diff(plan.places) > 0.0)
    assert plan.slack.settings.tension < 0.5 * case.settings.tension


@pytest.fixture(scope="module")
def both():
    """The short rig laid under a force, and tensioned by Koller's procedure, with what was seen on the way."""
    case, watcher = paper_case(60, -YAW, ROPE_EXAMPLE), EarlyFrames()
    options = Options(**COARSE)
    force = simulate(case, travel=0.5, options=options)
    koller = simulate(case, travel=0.5, options=replace(options, tensioning="koller"), observers=(watcher,))
    return force, koller, watcher.frames


def test_the_pulleys_move_apart_until_the_tension_is_there(both):
    frames = both[2]
    tension = np.array([f.scalars["tension"] for f in frames]) / 60e6
    sag = np.array([f.scalars["sag_lower"] for f in frames])
    x = np.array([f.tail_x for f in frames])
    assert len(frames) > 30
    assert tension[0] < 0.01
    assert sag[0] > 0.1
    assert np.all(np.diff(x[: len(x) // 2]) > 0.0)
    assert tension[-1] == pytest.approx(1.0, rel=RUNNING)
    assert np.abs([f.points[:, 1] for f in frames]).max() < STILL


def test_the_tail_pulley_is_let_go_when_its_load_is_there_and_not_before():
    case = paper_case(60, 0.0, ROPE_EXAMPLE)
    run = SpaceRun.begin(case, "flex", fit_options(Options(**COARSE, tensioning="koller"), case, "flex"))
    stage, load = run.stages(1.0)[1], 2.0 * case.tension_force
    for carried, led in ((0.0, True), (0.99, True), (1.01, False)):
        run.state.loads[TAIL, 0] = -carried * load
        command = next(stage.commands(run.state))
        assert (command.tail_motion is not None) is led


def test_however_it_was_tensioned_the_belt_runs_alike(both):
    """Stations lie differently on the pulleys at travel 0, so the curves may stand half a chord apart."""
    force, koller, _ = both
    stretch = 60.0 / 210e3 * 5.066 / 2.0  # [m], what the tension moves the tail pulley by
    assert koller.extra["tail_x"].mean() == pytest.approx(force.extra["tail_x"].mean(), abs=RUNNING * stretch)
    assert koller.extra["tension"].mean() == pytest.approx(force.extra["tension"].mean(), rel=RUNNING)
    assert koller.sag.mean() == pytest.approx(force.sag.mean(), rel=RUNNING)
    for point in (0, 2):
        early, late = (np.interp(0.45 + d, force.travel, np.abs(force.y[point])) for d in (-0.025, 0.025))
        assert early < np.interp(0.45, koller.travel, np.abs(koller.y[point])) < late


def test_an_unknown_tensioning_is_refused_in_one_line():
    assert model_named("mujoco_rope", {"tensioning": "length"}).options.tensioning == "length"
    assert model_named("mujoco_rope", {"tensioning": None}).options.tensioning == "force"
    with pytest.raises(InputError, match=r"options\.tensioning = glue: choose one of force, length, koller"):
        model_named("mujoco_rope", {"tensioning": "glue"})
