"""Slip at a change of yaw against the least energy of a belt that friction holds, and when it must not happen."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import BELT, RIG, YAW, affected, paper_case, steered
from scipy.optimize import lsq_linear

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.case import Schedule
from belt_sim.effects.slip import Slip
from belt_sim.laws.span import beam_second_order, response

STRIPS = 0.01  # of the turn: three hundred pieces of the wrap
EXACT = 1e-9
MU = 0.15
SHORT = replace(RIG, centre_distance=2.0)
BEAM = analytic_model("beam_th2")


def turn_of_least_energy(case, friction: float) -> float:
    """Turn of the run-up on the tail pulley [rad] at which bending of wrap and span, and friction work, are least.

    1/2 EI int theta'^2 ds + int (mu F b/4R) theta ds + 1/2 EI k (beta - theta(0))^2 over theta >= 0 along the wrap; the
    friction's work is completed to a square, so that it is one bounded least-squares problem.
    """
    force, bending = float(case.tension_force), float(case.belt.bending_stiffness)
    k = float(response(beam_second_order(case)).runup[2])
    pieces = 300
    ds = float(case.rig.wrap_tail) / pieces
    bend = (np.eye(pieces, k=1) - np.eye(pieces)) * np.sqrt(bending / ds)  # the last piece is held at 0
    entry = np.zeros((1, pieces))
    entry[0, 0] = np.sqrt(bending * k)
    rows = np.concatenate([bend, entry])
    work = np.full(pieces, friction * force * BELT.width / (4 * float(case.rig.tail_radius)) * ds)
    work[0] *= 0.5
    right = np.concatenate([np.zeros(pieces), [np.sqrt(bending * k) * YAW]])
    right = right - np.linalg.lstsq(rows.T, work, rcond=None)[0]
    return float(lsq_linear(rows, right, bounds=(0.0, np.inf), method="bvls", tol=1e-14).x[0])


@pytest.mark.parametrize(
    ("rig", "tension", "friction"), [(RIG, 40, MU), (RIG, 10, 0.3), (SHORT, 40, MU), (SHORT, 100, 0.1)]
)
def test_the_belt_turns_as_far_as_bending_and_friction_work_say(rig, tension, friction):
    case = paper_case(tension, rig=rig)
    wanted = turn_of_least_energy(case, friction)
    start = march(case, BEAM, (Slip(inverse_friction=1 / friction),), travel=0.1)
    turned = YAW - float(start.angle[0, 0])
    assert turned == pytest.approx(wanted, rel=STRIPS)
    zone = wanted * 2 * float(case.belt.bending_stiffness) / float(start.moment[0, 0])
    assert 0.0 < abs(zone) < float(rig.wrap_tail)


def test_the_zone_ends_with_the_wrap():
    loose, looser = (
        march(paper_case(7, 4 * YAW, rig=SHORT), BEAM, (Slip(inverse_friction=i),), travel=0.1) for i in (100.0, 1000.0)
    )
    np.testing.assert_allclose(loose.y, looser.y, atol=EXACT * np.abs(loose.y).max())


def test_it_happens_at_changes_of_yaw_and_at_no_other_time():
    """Later by a step, later by a change of nothing, and never while the yaw moves slowly against the zone."""
    slip = {"slip": {"inverse_friction": 1 / MU}}
    still = Schedule.step(0.0)
    early, late, idle, slow, slow_sticks, quick, quick_sticks = affected(
        [
            (steered(paper_case(20), Schedule.step(YAW).then(still)), slip),
            (steered(paper_case(20), Schedule.step(YAW, at=2.0)), slip),
            (steered(paper_case(20), Schedule.step(YAW).then(Schedule.step(0.0, at=3.0))), slip),
            (steered(paper_case(20), Schedule.ramp(YAW, at=0.0, over=1.0)), slip),
            (steered(paper_case(20), Schedule.ramp(YAW, at=0.0, over=1.0)), {}),
            (steered(paper_case(20), Schedule.ramp(YAW, at=0.0, over=0.1)), slip),
            (steered(paper_case(20), Schedule.ramp(YAW, at=0.0, over=0.1)), {}),
        ],
        20.0,
    )
    np.testing.assert_allclose(late.y[:, 10:], early.y[:, :-10], atol=EXACT * np.abs(early.y).max())
    np.testing.assert_array_equal(idle.y, early.y)
    np.testing.assert_array_equal(slow.y, slow_sticks.y)
    sticks = affected([(paper_case(20), {})], 20.0)[0]
    assert 0.1 < np.abs(quick.y - quick_sticks.y).max() / np.abs(early.y - sticks.y).max() < 0.9


def test_a_belt_that_turned_starts_faster():
    slips, sticks = affected([(paper_case(7), {"slip": {"inverse_friction": 1 / MU}}), (paper_case(7), {})], 20.0)
    assert np.abs(slips.moment[0, 0]) < np.abs(sticks.moment[0, 0])
    assert slips.y[0, 5] / sticks.y[0, 5] > 1.02
