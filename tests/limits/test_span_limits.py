"""Each span law is the limit of a richer one, at the expected rate; and the strip against a solver of its own."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case, response
from scipy.integrate import solve_bvp

from belt_sim.effects.yaw import cos_sin
from belt_sim.jax_setup import in_float64
from belt_sim.line import span as law
from belt_sim.line.spans import runup_weights
from belt_sim.model import analytic_model
from studies.closed_forms import shelton_factor, sievers_coefficients

ROUNDING = 1e-9  # of the condensed transfer matrices
ORDER = 0.05  # how near a measured order must come to the whole number
BVP = 1e-6  # what solve_bvp leaves at its tolerance


def span_of(kl: float, sag: float = 0.0) -> law.Span:
    """A span of the paper's belt whose tension gives K L = kl."""
    base = law.strip(paper_case(10))
    force = kl**2 * base.bending / base.length**2
    return replace(base, force=force, sag_curvature=sag * base.sag_curvature)


@pytest.mark.parametrize("kl", [0.1, 0.5, 1.128, 2.0, 5.0, 10.0, 30.0])
def test_beam_response_has_the_open_web_coefficients(kl):
    span = span_of(kl)
    f1, f2, f3 = sievers_coefficients(kl)
    wanted = np.array([-f1 / span.length, f3, f2]) / span.length
    found = response(span)
    loss = 1e-16 / min(kl, 1.0) ** 4  # the closed forms cancel like (K L)^4
    np.testing.assert_allclose(found.runup[:3], wanted, rtol=ROUNDING + loss)
    mirrored = np.array([f1 / span.length, -f2, -f3]) / span.length
    np.testing.assert_allclose(found.runoff[:3], mirrored, rtol=ROUNDING + loss)


@pytest.mark.parametrize("kl", [0.5, 1.128, 3.0, 12.0])
def test_run_up_weight_is_the_shelton_factor(kl):
    base = paper_case(10)
    tension = 10e6 * (kl / 1.3483) ** 2
    case = replace(base, settings=replace(base.settings, tension=tension))
    kl = float(np.sqrt(case.tension_force * case.rig.span_length**2 / case.belt.bending_stiffness))
    assert runup_weights(case, analytic_model("beam_th2")) == pytest.approx(
        (float(shelton_factor(kl)),) * 2, rel=ROUNDING
    )


def order(errors, ratio: float) -> float:
    """Order at which the errors of two neighbouring limits fall."""
    return float(np.log(errors[0] / errors[1]) / np.log(ratio))


def test_second_order_beam_tends_to_first_order_as_tension_goes():
    plain = np.array([-6.0 / span_of(1.0).length, 2.0, 4.0])
    errors = [np.abs(response(span_of(kl)).runup[:3] * span_of(kl).length - plain).max() for kl in (0.2, 0.1)]
    assert order(errors, 2.0) == pytest.approx(2.0, abs=ORDER)


def test_second_order_beam_tends_to_the_rope_as_stiffness_goes():
    model, rope = analytic_model("beam_th2"), analytic_model("rope")
    errors = []
    for stiffness in (1e-4, 0.25e-4):  # K L ~ 1/sqrt(stiffness): the weight falls short of 1 by 1/(K L)
        case = paper_case(40)
        case = replace(case, belt=replace(case.belt, youngs_modulus=case.belt.youngs_modulus * stiffness))
        errors.append(abs(model.steady_rate(case) / rope.steady_rate(case) - 1))
    assert errors[1] < 5e-3
    assert order(errors, 2.0) == pytest.approx(1.0, abs=ORDER)


def test_strip_tends_to_the_second_order_beam_as_gravity_goes():
    model, beam = analytic_model("strip"), analytic_model("beam_th2")
    errors = []
    for gravity in (0.2, 0.1):
        case = paper_case(20)
        case = replace(case, rig=replace(case.rig, gravity=gravity))
        errors.append(abs(model.steady_rate(case) - beam.steady_rate(case)))
    assert order(errors, 2.0) == pytest.approx(2.0, abs=ORDER)  # even in Z: sagging up or down is the same
    assert model.steady_rate(replace(case, rig=replace(case.rig, gravity=0.0))) == beam.steady_rate(case)


def test_ernst_beam_tends_to_the_second_order_beam_as_the_sag_goes():
    model, beam = analytic_model("ernst_beam"), analytic_model("beam_th2")
    for tension in (7, 20):  # sag gives way like sag stretch: E/(1 + Lambda), Lambda = (rho g L)^2 E/(12 sigma^3)
        case = paper_case(tension)
        soft = 1.0 + (7850 * 9.81 * 11.28) ** 2 * 210e9 / (12 * (tension * 1e6) ** 3)
        as_beam = replace(case, belt=replace(case.belt, youngs_modulus=210e9 / soft))
        assert model.steady_rate(case) == pytest.approx(beam.steady_rate(as_beam), rel=ROUNDING)
    assert model.steady_rate(paper_case(400)) == pytest.approx(beam.steady_rate(paper_case(400)), rel=1e-3)


def test_softening_has_the_sizes_of_the_sheet():
    found = [float(law.sag_softening(paper_case(t))) for t in (7, 10, 20, 40)]
    np.testing.assert_allclose(found, [38, 13, 1.65, 0.21], rtol=0.03)  # printed to two digits


@pytest.mark.evidence("sag_roll", route="elements", what="response of a span, boundary-value solver, {BVP}")
@pytest.mark.parametrize("tension", [5, 10, 40])
def test_strip_response_agrees_with_a_boundary_value_solver(tension):
    span = law.strip(paper_case(tension))
    found = response(span)
    ends = np.eye(5)  # y_u - y_o, theta_o, theta_u, phi_o, phi_u one at a time
    kappa_u, kappa_o, tilt = (np.array(x) for x in zip(*(_by_collocation(span, e) for e in ends), strict=True))
    for mine, theirs in ((found.runup, kappa_u), (found.runoff, kappa_o), (found.mid_tilt, tilt)):
        np.testing.assert_allclose(mine, theirs, rtol=BVP, atol=BVP * np.abs(theirs).max())


def _by_collocation(span: law.Span, ends):
    """Curvature at run-up and run-off, tilt at mid-span, straight from the three differential equations."""
    y_u, theta_o, theta_u, phi_o, phi_u = ends
    z, k2, twist = span.sag_curvature, span.force / span.bending, span.bending * span.sag_curvature / span.torsion

    def slope(x, u):
        _, theta, kappa, bent, phi, turned = u
        bow = kappa - z * phi
        return np.stack([theta, bow, bent, k2 * bow, turned, twist * kappa])

    def mismatch(a, b):
        return np.array([a[0], a[1] - theta_o, a[4] - phi_o, b[0] - y_u, b[1] - theta_u, b[4] - phi_u])

    x = np.linspace(0, span.length, 41)
    solved = solve_bvp(slope, mismatch, x, np.zeros((6, len(x))), tol=1e-8, max_nodes=20000)
    assert solved.success
    return solved.sol(span.length)[2], solved.sol(0.0)[2], solved.sol(span.length / 2)[4]


def test_cosine_and_sine_are_right_to_the_last_digits():
    angle = np.concatenate([np.linspace(-1e4, 1e4, 20001), np.arange(-40, 41) * np.pi / 4])
    cos, sin = (np.asarray(x) for x in in_float64(cos_sin)(angle))
    assert np.abs(cos - np.cos(angle)).max() < 5e-16
    assert np.abs(sin - np.sin(angle)).max() < 5e-16
