"""Natural curvature and side loads within a span, against textbook beams, a boundary-value solver and each other."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import RIG, paper_case
from scipy.integrate import simpson, solve_bvp

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.effects.camber import Camber
from belt_sim.effects.edge_guide import EdgeGuide
from belt_sim.effects.taper import Taper
from belt_sim.effects.weld import Weld
from belt_sim.laws.inside import along, support
from belt_sim.laws.span import beam_first_order, beam_second_order, strip

TEXTBOOK = 1e-8  # rounding of beams condensed piece by piece
FIELDS = 1e-4  # Simpson's rule on 65 places, and scipy's solver at its tolerance
STILL = 1e-9  # [m]: rounding of a march in which nothing moves
SETTLED = 0.01  # of a weld's movement after 14 rounds of the belt
STEPS = 0.01  # of y: a stop met within a step of 50 mm
BELT_LENGTH = float(RIG.belt_length)
KAPPA = 1e-4  # [1/m]


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
def test_a_side_load_bends_a_clamped_beam_like_the_textbook(share):
    span = beam_first_order(paper_case(40))
    found, length, bending = support(span, share, along(span)), span.length, span.bending
    near, far = share, 1.0 - share
    assert found.give == pytest.approx((near * far * length) ** 3 / (3.0 * bending), rel=TEXTBOOK)
    assert found.runup == pytest.approx(near**2 * far * length / bending, rel=TEXTBOOK)
    assert found.runoff == pytest.approx(near * far**2 * length / bending, rel=TEXTBOOK)
    cubic = [3 * near**2 - 2 * near**3, near * far**2 * length, -far * near**2 * length, 0.0, 0.0]
    np.testing.assert_allclose(found.place, cubic, atol=TEXTBOOK * length)


@pytest.mark.parametrize("law", [beam_first_order, beam_second_order])
def test_a_turned_end_turns_a_flat_span_by_as_much(law):
    """So that uniform camber changes no curvature at the ends."""
    fields = along(law(paper_case(10)))
    assert simpson(fields.per_runup, x=fields.x) == pytest.approx(1.0, rel=FIELDS)
    assert simpson(fields.per_runoff, x=fields.x) == pytest.approx(-1.0, rel=FIELDS)


@pytest.mark.parametrize("tension", [7.0, 40.0])
def test_uniform_camber_of_a_hanging_strip_is_what_its_equations_say(tension):
    """kappa and tilt of a strip with straight clamped ends: EI (kappa - kc)'' = F y'', T phi'' = EI Z (kappa - kc)."""
    span = strip(paper_case(tension))
    force, bending, torsion, z, length = (
        float(v) for v in (span.force, span.bending, span.torsion, span.sag_curvature, span.length)
    )

    def slopes(x, u):  # y, y', kappa - kc, its slope, phi, phi'
        bent = u[2] + KAPPA - z * u[4]
        return np.stack([u[1], bent, u[3], force / bending * bent, u[5], bending * z * u[2] / torsion])

    x = np.linspace(0.0, length, 201)
    solved = solve_bvp(slopes, lambda a, b: [a[0], a[1], a[4], b[0], b[1], b[4]], x, np.zeros((6, 201)), tol=1e-8)
    effect = Camber(kappa_c=KAPPA)
    added = effect.influence(span, paper_case(tension))
    assert solved.success
    assert KAPPA * added[0] == pytest.approx(solved.sol(length)[2], rel=FIELDS)
    assert KAPPA * added[1] == pytest.approx(solved.sol(0.0)[2], rel=FIELDS)
    assert KAPPA * added[2] == pytest.approx(solved.sol(length / 2)[4], rel=FIELDS)


def test_uniform_camber_leaves_a_flat_belt_where_it_is():
    case = paper_case(10, 0.0)
    curves = march(case, analytic_model("beam_th2"), (Camber(kappa_c=KAPPA),), travel=60.0)
    np.testing.assert_allclose(curves.y, 0.0, atol=STILL)
    np.testing.assert_allclose(curves.moment, -case.belt.bending_stiffness * KAPPA, rtol=FIELDS)


def test_uniform_camber_moves_a_hanging_belt_like_two_tapered_pulleys():
    case = paper_case(10, 0.0)
    like = float(KAPPA * (1.0 + Camber().influence(strip(case), case)[0]))
    assert 0.5 * KAPPA < like < KAPPA
    cambered, tapered = (
        march(case, analytic_model("strip"), effects, travel=60.0)
        for effects in ((Camber(kappa_c=KAPPA),), (Taper(kappa_t=like, kappa_t_head=like),))
    )
    assert np.abs(tapered.y).max() > 1e-3
    np.testing.assert_allclose(cambered.y, tapered.y, rtol=FIELDS, atol=STILL)


def test_a_weld_comes_round_once_a_belt_length_and_leaves_no_drift():
    weld = (Weld(angle=1e-3, at=5.0),)
    curves = march(paper_case(40, 0.0), analytic_model("beam_th2"), weld, travel=16 * BELT_LENGTH)
    at = BELT_LENGTH * np.linspace(0.0, 1.0, 40, endpoint=False)
    last, before = (np.interp(start + at, curves.travel, curves.y[0]) for start in (14 * BELT_LENGTH, 13 * BELT_LENGTH))
    size = np.ptp(last)
    assert size > 1e-4
    assert np.abs(last - before).max() < SETTLED * size


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_stiff_guide_stops_the_belt_at_its_gap(direction):
    case = paper_case(40, direction=direction)
    hard = EdgeGuide(stiffness=1e9, stiffness_lower=1e9, gap=1e-3, at=2.0)
    curves = march(case, analytic_model("beam_th2"), (hard,), travel=200.0)
    free = march(case, analytic_model("beam_th2"), travel=200.0)
    far = march(case, analytic_model("beam_th2"), (replace(hard, gap=1.0),), travel=200.0)
    late = np.abs(curves.y[:, -1] - curves.y[:, -50])
    assert np.abs(free.y[:, -1]).min() > 20e-3
    assert late.max() < 1e-6
    assert 1e-3 < np.abs(curves.y[:, -1]).max() < 4e-3
    np.testing.assert_allclose(far.y, free.y, atol=STILL)


def test_a_guide_is_right_in_the_usual_steps():
    guide = (EdgeGuide(stiffness=1e6, gap=3e-4, at=0.5),)
    case = replace(paper_case(60), rig=replace(RIG, centre_distance=2.0))
    coarse, fine = (march(case, analytic_model("strip"), guide, travel=12.0, step=s).y for s in (0.05, 0.00625))
    np.testing.assert_allclose(coarse, fine, atol=STEPS * np.abs(fine).max())
