"""The batch of ropes on MJX: its forces, and its drift against the rope law."""

import math
from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.paper import ROPE_EXAMPLE
from studies.mjx_batch import DX, simulate_ropes
from studies.mjx_rope import Rope, _forces, begin

NEAR = 0.02  # of y: a span is longer by up to dx; halved with dx (docs/three_dimensions.md)
START = 0.8  # of dx times the yaw: the station that the yaw moves lies up to dx beyond the tangent point
ALIKE = 2e-3  # of y between 7 and 60 N/mm2: the weight turns the run-up by up to 11 mrad
YAWS = np.radians([-0.042, -0.042, 0.021])


def test_the_laid_rope_pulls_by_one_along_and_presses_by_the_chord_over_the_radius():
    rope = Rope.of(paper_case(60, 0.0, ROPE_EXAMPLE), DX)
    state = begin(rope)
    forces = np.asarray(_forces(rope, state, 0.0, 0.0))
    free = np.asarray(state.held) == 0
    inner = free & np.roll(free, 1) & np.roll(free, -1)
    np.testing.assert_allclose(forces[inner], 0.0, atol=1e-4)  # the laid curve is interpolated
    held = ~free & ~np.roll(free, 1) & ~np.roll(free, -1)
    pressure = np.linalg.norm(forces[held], axis=1)
    np.testing.assert_allclose(pressure, 2.0 * math.sin(0.5 * rope.chord / 0.17), rtol=1e-3)


def test_arrays_that_do_not_match_and_unlike_pulleys_are_refused():
    case = paper_case(60, 0.0, ROPE_EXAMPLE)
    with pytest.raises(InputError, match="one positive tension a yaw"):
        simulate_ropes(case, [1e7, 2e7], [0.0], travel=1.0)
    unlike = replace(case, rig=replace(case.rig, head_radius=0.2))
    with pytest.raises(CannotRepresent, match="mujoco_rope"):
        simulate_ropes(unlike, [1e7], [0.0], travel=1.0)


@pytest.mark.long
def test_ropes_of_a_batch_drift_like_the_law():
    tensions = np.array([7e6, 60e6, 60e6])
    curves = simulate_ropes(paper_case(60, 0.0, ROPE_EXAMPLE), tensions, YAWS, travel=2.0)
    for yaw, y in zip(YAWS, curves.y, strict=True):
        law = march(paper_case(60, yaw, ROPE_EXAMPLE), analytic_model("rope"), travel=2.0)
        exact = np.array([np.interp(curves.travel, law.travel, p) for p in law.y])
        off = np.abs(y - exact)[:, 1:]
        allowed = START * DX * abs(yaw) + NEAR * np.abs(exact).max(axis=0)[1:]
        assert np.all(off[[0, 2]] < allowed)  # the run-ups: run-offs are read off a line that still has its kink
    np.testing.assert_allclose(curves.y[0][0, -1], curves.y[1][0, -1], rtol=ALIKE)
    np.testing.assert_allclose(curves.y[2][0, -1], -0.5 * curves.y[1][0, -1], rtol=ALIKE)
