"""Natural curvature and side loads within a span, against textbook beams, a boundary-value solver and each other."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import RIG, affected, paper_case
from scipy.integrate import simpson, solve_bvp
from scipy.linalg import expm

from belt_sim.effects.pulley import Taper
from belt_sim.effects.span import Camber, EdgeGuide, Weld, raised_cosine
from belt_sim.jax_setup import in_float64
from belt_sim.line.march import march_case
from belt_sim.line.span import beam_first_order, beam_second_order, natural_curvature_rows, span_fields, strip, supports
from belt_sim.model import analytic_model

TEXTBOOK = 1e-8  # rounding of beams condensed piece by piece
FIELDS = 1e-4  # Simpson's rule on 65 places, and scipy's solver at its tolerance
LOADED = 1e-6  # rounding of matrix exponentials of the whole span
TILTED = 2e-3  # read between 65 places, and the load makes a kink
STILL = 1e-9  # [m]: rounding of a march in which nothing moves
DOUBLED = 1e-10  # rounding of pieces that were doubled from one to the next; each condensed by itself is off by 3e-9
PIECES = 5e-3  # a weld's pieces, and straight lines between the places of its middle
SETTLED = 0.01  # of a weld's movement after 14 rounds of the belt
STEPS = 0.01  # of y: a stop met within a step of 50 mm
BELT_LENGTH = float(RIG.belt_length)
KAPPA = 1e-4  # [1/m]


@pytest.mark.evidence("edge_guide", route="elements", what="side load on a clamped beam, textbook, {TEXTBOOK}")
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
def test_a_side_load_bends_a_clamped_beam_like_the_textbook(share):
    span = beam_first_order(paper_case(40))
    found, length, bending = supports(span, share, span_fields(span))[0], span.length, span.bending
    near, far = share, 1.0 - share
    assert found.give == pytest.approx((near * far * length) ** 3 / (3.0 * bending), rel=TEXTBOOK)
    assert found.runup == pytest.approx(near**2 * far * length / bending, rel=TEXTBOOK)
    assert found.runoff == pytest.approx(near * far**2 * length / bending, rel=TEXTBOOK)
    cubic = [3 * near**2 - 2 * near**3, near * far**2 * length, -far * near**2 * length, 0.0, 0.0]
    np.testing.assert_allclose(found.place, cubic, atol=TEXTBOOK * length)


def test_inside_a_beam_whose_end_is_turned_curvature_is_the_textbooks():
    """Linear along a beam of first order, 4/L where it is turned and -2/L at the other end."""
    span = beam_first_order(paper_case(40))
    fields, length = span_fields(span), span.length
    curvature = (6.0 * np.asarray(fields.x) / length - 2.0) / length
    np.testing.assert_allclose(fields.per_runup, curvature, atol=4.0 * DOUBLED / length)
    np.testing.assert_allclose(fields.per_runoff, curvature[::-1] * -1.0, atol=4.0 * DOUBLED / length)


@pytest.mark.parametrize("law", [beam_first_order, beam_second_order])
def test_a_turned_end_turns_a_flat_span_by_as_much(law):
    """So that uniform camber changes no curvature at the ends."""
    fields = span_fields(law(paper_case(10)))
    assert simpson(fields.per_runup, x=fields.x) == pytest.approx(1.0, rel=FIELDS)
    assert simpson(fields.per_runoff, x=fields.x) == pytest.approx(-1.0, rel=FIELDS)


@pytest.mark.evidence("camber", route="elements", what="end curvatures and tilt, boundary-value solver, {FIELDS}")
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
    (curves,) = affected([(case, {"camber": {"kappa_c": KAPPA}})], 60.0)
    np.testing.assert_allclose(curves.y, 0.0, atol=STILL)
    np.testing.assert_allclose(curves.moment, -case.belt.bending_stiffness * KAPPA, rtol=FIELDS)


def test_uniform_camber_moves_a_hanging_belt_like_two_tapered_pulleys():
    case = paper_case(10, 0.0)
    like = float(KAPPA * (1.0 + Camber().influence(strip(case), case)[0]))
    assert 0.5 * KAPPA < like < KAPPA
    cambered, tapered = (
        march_case(case, analytic_model("strip"), effects, travel=60.0)
        for effects in ((Camber(kappa_c=KAPPA), Taper()), (Camber(), Taper(kappa_t=like, kappa_t_head=like)))
    )
    assert np.abs(tapered.y).max() > 1e-3
    np.testing.assert_allclose(cambered.y, tapered.y, rtol=FIELDS, atol=STILL)


def test_a_weld_comes_round_once_a_belt_length_and_leaves_no_drift():
    weld = (Weld(angle=1e-3, at=5.0),)
    curves = march_case(paper_case(40, 0.0), analytic_model("beam_th2"), weld, travel=16 * BELT_LENGTH)
    at = BELT_LENGTH * np.linspace(0.0, 1.0, 40, endpoint=False)
    last, before = (np.interp(start + at, curves.travel, curves.y[0]) for start in (14 * BELT_LENGTH, 13 * BELT_LENGTH))
    size = np.ptp(last)
    assert size > 1e-4
    assert np.abs(last - before).max() < SETTLED * size


def test_a_stiff_guide_stops_the_belt_at_its_gap():
    hard = {"stiffness": 1e9, "stiffness_lower": 1e9, "gap": 1e-3, "at": 2.0}
    guides = [{"edge_guide": hard}, {}, {"edge_guide": hard | {"gap": 1.0}}]
    cases = [paper_case(40, direction=direction) for direction in (1.0, -1.0)]
    found = affected([(case, guide) for case in cases for guide in guides], 200.0)
    for stopped, free, far in (found[:3], found[3:]):
        late = np.abs(stopped.y[:, -1] - stopped.y[:, -4])  # of records every 2 m
        assert np.abs(free.y[:, -1]).min() > 20e-3
        assert late.max() < 1e-6
        assert 1e-3 < np.abs(stopped.y[:, -1]).max() < 4e-3
        np.testing.assert_allclose(far.y, free.y, atol=STILL)


def test_a_guide_is_right_in_the_usual_steps():
    guide = (EdgeGuide(stiffness=1e6, gap=3e-4, at=0.5),)
    case = replace(paper_case(60), rig=replace(RIG, centre_distance=2.0))
    coarse, fine = (march_case(case, analytic_model("strip"), guide, travel=12.0, step=s).y for s in (0.05, 0.00625))
    np.testing.assert_allclose(coarse, fine, atol=STEPS * np.abs(fine).max())


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("law", [beam_second_order, strip])
def test_a_side_load_on_a_hanging_span_is_what_its_equations_say(law, share):
    """Two pieces of the strip's equations by matrix exponentials; EI kappa' jumps by the load, all else is smooth."""
    span = law(paper_case(10))
    z, length, at = float(span.sag_curvature), float(span.length), share * float(span.length)
    k2, twist = float(span.force / span.bending), float(span.bending * z / span.torsion)
    m = np.zeros((6, 6))  # y, theta, kappa, kappa', phi, phi'
    m[0, 1] = m[1, 2] = m[2, 3] = m[4, 5] = 1.0
    m[1, 4], m[3, 2], m[3, 4], m[5, 2] = -z, k2, -k2 * z, twist
    held, here = [0, 1, 4], np.array([0.0, 0.0, 0.0, 1.0 / float(span.bending), 0.0, 0.0])

    def solved(start, end, load):
        """State at the run-off, the load and the run-up: start, end = y, theta, phi there."""
        u = np.zeros(6)
        u[held] = start
        free = expm(m * length)
        right = np.asarray(end) - (free @ u + expm(m * (length - at)) @ here * load)[held]
        u[[2, 3, 5]] = np.linalg.solve(free[np.ix_(held, [2, 3, 5])], right)
        middle = expm(m * at) @ u
        return u, middle, expm(m * (length - at)) @ (middle + here * load)

    found = supports(span, share, span_fields(span))[0]
    still = (0.0, 0.0, 0.0)
    off, there, up = solved(still, still, 1.0)
    mid = expm(m * length / 2) @ off
    if share < 0.5:
        mid = mid + expm(m * (length / 2 - at)) @ here
    ends = [(still, (1, 0, 0)), ((0, 1, 0), still), (still, (0, 1, 0)), ((0, 0, 1), still), (still, (0, 0, 1))]
    np.testing.assert_allclose(found.place, [solved(*e, 0.0)[1][0] for e in ends], rtol=LOADED, atol=LOADED)
    for mine, theirs in ((found.give, there[0]), (found.runup, up[2]), (found.runoff, off[2])):
        assert mine == pytest.approx(theirs, rel=LOADED)
    assert found.tilt == pytest.approx(mid[4], rel=TILTED, abs=1e-12)


def test_a_guide_stops_the_span_that_it_stands_beside_where_it_stands():
    """Near the tail pulley: on the upper span point 1 meets it at once, on the lower one what has left the pulley."""
    near, case = {"gap": 1e-4, "at": 0.3}, paper_case(40)
    guides = [{}, {"edge_guide": near | {"stiffness": 1e8}}, {"edge_guide": near | {"stiffness_lower": 1e8}}]
    free, upper, lower = (c.y for c in affected([(case, g) for g in guides], 20.0))
    early = free[0] < 3e-4
    assert upper[0].max() < 4e-4 < 0.1 * free[0].max()  # the span bends between the pulley and the roller
    np.testing.assert_allclose(lower[0, early], free[0, early], rtol=0.01)
    assert np.abs(lower[2] - free[2]).max() > 1e-4


def test_a_weld_that_is_half_on_a_pulley_bends_by_what_is_in_the_span():
    """Against the integral over the part of it that is there, of what each place adds."""
    case, weld = paper_case(10, 0.0), Weld(length=0.6)
    span = strip(case)
    fields, (middles, added) = in_float64(span_fields)(span), in_float64(weld.influence)(span, case)
    rows, x = np.asarray(in_float64(natural_curvature_rows)(fields, span)), np.asarray(fields.x)
    ends = np.array([-0.2, 0.0, 0.13, 0.5 * x[-1], x[-1] - 0.07, x[-1] + 0.25])
    for middle, found in zip(ends, [[np.interp(m, middles, row) for row in added] for m in ends], strict=True):
        at = np.linspace(max(middle - 0.3, 0.0), min(middle + 0.3, x[-1]), 20001)
        shape = raised_cosine((at - middle) / weld.length, np) / weld.length
        right = [np.trapezoid(shape * np.interp(at, x, row), at) for row in rows]
        assert np.all(np.abs(np.subtract(found, right)) < PIECES * np.abs(added).max(axis=1)), middle
