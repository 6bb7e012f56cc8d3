"""Ropes, and grids without diagonals, in time and on JAX: beside the rope law, and beside each other."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.errors import CannotRepresent
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options, quasi_static
from belt_sim.space.native import run_native
from belt_sim.space.options import BONDS
from belt_sim.space.quasi_static import simulate_batch
from studies.paper.case import ROPE_EXAMPLE

SHORT = Options(dx=0.04, run_in=0.3, settle=0.2, acceleration=3.0)
QUICK = replace(SHORT, steps=4)
LIMP = replace(QUICK, bonds=BONDS[:2])
TRAVEL = 1.5
#: of y_1 after 0.5 m, by direction: 13e-6 and 1e-3 off; a kink at the tangent point: 5e-4, a span that sways: 9e-3
START = {1.0: 2e-4, -1.0: 2e-3}
SAMPLED = 5e-6  # [m]: half a station x yaw is 15 um; a span that rings moves point 3 by 200 um, the wrong way
LATE = 0.005  # of the late rate; with stations 40 mm apart it is 0.2 % off
LAW = 7e-4  # of y_1 after 0.6 m, 4e-4 and 6e-4 off; a kink at the tangent point itself: 8e-4 and 1e-3
PARITY = 0.005  # of the largest y, where the belt meets a pulley
WHERE_IT_LEAVES = 0.01  # there its kink makes native's y jump by 0.5 % of the largest from row to row


def at(travel, curves):
    return np.array([np.interp(travel, curves.travel, y) for y in curves.y])


def assert_beside(found, native, direction=1.0):
    apart = np.abs(at(native.travel, found) - native.y).max(axis=1) / np.abs(native.y).max()
    meets = slice(0, None, 2) if direction > 0 else slice(1, None, 2)
    assert apart[meets].max() < PARITY
    assert apart.max() < WHERE_IT_LEAVES


def test_a_batch_of_ropes_is_beside_the_rope_law(monkeypatch):
    """A shorter run is traced by no program of its own, nor a sweep of such ropes (tests/cli)."""
    cases = [paper_case(t, yaw, ROPE_EXAMPLE) for t, yaw in ((60.0, -7.3e-4), (30.0, 3.7e-4))]
    found = simulate_batch(cases, belt="rope", travel=0.7, options=QUICK, chunk=2)
    for case, curves in zip(cases, found, strict=True):
        law = march_case(case, analytic_model("rope"), travel=0.7)
        assert at(0.6, curves)[0] == pytest.approx(at(0.6, law)[0], rel=LAW)
        assert not curves.moment.any()
        assert curves.extra["tension"] == pytest.approx(float(case.settings.tension), rel=1e-3)
    monkeypatch.setattr(quasi_static, "travel_step", None)
    shorter = simulate_batch(cases, belt="rope", travel=0.6, options=QUICK, chunk=2)
    for one, whole in zip(shorter, found, strict=True):
        assert at(0.6, one)[0] == pytest.approx(at(0.6, whole)[0], rel=LAW)


@pytest.mark.long
@pytest.mark.parametrize(("belt", "options"), [("rope", QUICK), ("grid", LIMP)])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_limp_belts_are_beside_mujoco(belt, options, direction):
    case = paper_case(60.0, rig=ROPE_EXAMPLE)
    case = replace(case, settings=replace(case.settings, direction=direction))
    native = run_native(case, belt=belt, travel=TRAVEL, options=options)
    found = simulate_batch([case], belt=belt, travel=TRAVEL, options=options)[0]
    assert_beside(found, native, direction)
    assert np.abs(found.tilt[:, -1] - native.tilt[:, -1]).max() < 1e-4


def test_limp_belts_stick():
    case = paper_case(60.0, rig=ROPE_EXAMPLE)
    for belt, options in (("rope", QUICK), ("grid", LIMP)):
        with pytest.raises(CannotRepresent, match=r"model\.friction = 0\.3: a limp belt sticks"):
            simulate_batch([case], belt=belt, travel=0.1, options=replace(options, friction=0.3))
        with pytest.raises(CannotRepresent, match=r"model\.friction = 0\.3: a limp belt sticks"):
            run_native(case, belt=belt, travel=0.1, options=replace(options, steps=2, friction=0.3))


@pytest.mark.parametrize(
    ("direction", "points"), [(1.0, (0, 1, 2, 3)), pytest.param(-1.0, (1, 0, 3, 2), marks=pytest.mark.long)]
)
def test_rope_starts_like_the_rope_law(short_rig, direction, points):
    case = replace(short_rig, settings=replace(short_rig.settings, direction=direction))
    curves = run_native(case, belt="rope", travel=0.55, options=SHORT)
    law = march_case(case, analytic_model("rope"), travel=0.55)
    y, exact = (np.array([np.interp(0.5, c.travel, c.y[p]) for p in points]) for c in (curves, law))
    assert y[0] == pytest.approx(exact[0], rel=START[direction])
    assert y[1:] == pytest.approx(exact[1:], abs=SAMPLED)


@pytest.mark.long
def test_late_rate_of_the_rope_law_at_all_four_points(short_rig):
    curves = run_native(short_rig, belt="rope", travel=16.0, options=replace(SHORT, acceleration=1.0))
    law = march_case(short_rig, analytic_model("rope"), travel=16.0)
    slopes = [[np.polyfit(c.travel[c.travel >= 5.0], y[c.travel >= 5.0], 1)[0] for y in c.y] for c in (curves, law)]
    assert slopes[0] == pytest.approx(slopes[1], rel=LATE)
