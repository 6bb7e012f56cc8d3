"""Tension by the belt's length, against the belt laid under a force."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from paper_cases import paper_case
from pulley_bench import carrying

from belt_sim.api.simulate import model_named
from belt_sim.case import Rig
from belt_sim.errors import InputError
from belt_sim.space import Options
from belt_sim.space.native import SpaceRun, instants_of
from belt_sim.space.options import fit_options
from belt_sim.space.scene import HangingBelt, lay_loop, lift
from belt_sim.space.wrap import TAIL
from studies.paper.case import ROPE_EXAMPLE

ROUNDING = 1e-9
LINK = 5e-3  # [m]: the last of 400 points of a span of 2 m lies so far from where it touches
PHASE = 1e-4  # [m] of 2.2 mm: four ends of wraps, where links of 25 mm are chords of a path that bends unevenly
AT_REST = 2e-3  # of the tension; the weight of a wrap alone makes upper and lower span differ by 2 q R / F
SLACK_AT_REST = 5e-3  # at 1 N/mm2 the sway of the sags, two seconds old, is not yet over

pytestmark = pytest.mark.filterwarnings("ignore:flex")


@pytest.mark.parametrize("radii", [(0.17, 0.17), (-0.2, -0.1)])  # below 0: of the lower span
@pytest.mark.parametrize("gravity", [0.0, 32.0])  # a curvature of 0.25 1/m
def test_a_span_touches_both_circles(radii, gravity):
    machine = Rig(centre_distance=2.0, head_radius=abs(radii[0]), tail_radius=abs(radii[1]), gravity=gravity)
    belt = HangingBelt.from_case(paper_case(1.0, 0.0, machine))
    span = belt.upper if radii[0] > 0.0 else belt.lower
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


@pytest.mark.parametrize(
    ("belt", "tension", "near"),
    [pytest.param("rope", 1.0, SLACK_AT_REST, marks=pytest.mark.long), ("flex", 7.0, AT_REST)],
)
def test_a_belt_of_the_right_length_has_the_tension(belt, tension, near):
    case = paper_case(tension, 0.0, ROPE_EXAMPLE)
    options = fit_options(Options(tensioning="length", settle=2.0 if tension < 7.0 else 1.0), case, belt)
    run = SpaceRun(case, belt, options)
    rows, resting = instants_of(run.scene, 1.0)
    state = run.lay(rows[0])
    for row, following in pairwise(rows[: resting + 1]):
        run.step(state, row, following)
    assert state.readings[17] == pytest.approx(2.0, abs=ROUNDING)
    assert -carrying(state).loads[TAIL, 0] == pytest.approx(2.0 * case.tension_force, rel=near)


def test_a_longer_belt_is_slacker():
    case = paper_case(60, 0.0, ROPE_EXAMPLE)
    slack = replace(case, settings=replace(case.settings, tension=1e6))

    def free_length(case):
        return HangingBelt.from_case(case).length / (1.0 + case.settings.tension / case.belt.youngs_modulus)

    assert free_length(slack) > free_length(case) + 4e-3


def test_an_unknown_tensioning_is_refused_in_one_line():
    assert model_named("mujoco_rope", {"tensioning": "length"}).options.tensioning == "length"
    assert model_named("mujoco_rope", {"tensioning": None}).options.tensioning == "force"
    with pytest.raises(InputError, match=r"model\.tensioning = glue: choose one of force, length"):
        model_named("mujoco_rope", {"tensioning": "glue"})
