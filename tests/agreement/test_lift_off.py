"""The bending layer: against shell elements, against a solution of its own, and its symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import BELT, RIG, YAW, paper_case
from scipy.integrate import simpson
from scipy.linalg import expm

from belt_sim.curves import late_rates
from belt_sim.effects.pulley import LiftOff
from belt_sim.line.span import strip
from belt_sim.line.spans import span_responses
from belt_sim.model import MODELS
from studies.closed_forms import steady_offsets

STRIP, LIFTING = MODELS["strip"], MODELS["strip_lift_off"]
SETTLED = 2e-3  # of rates and offsets: what is left of the transient after 150 m
SHELL = 0.0105  # of the entry moment: S8R shells on cylinders, 2512 elements; of the change 6 to 26 % at 7 and 10 N/mm2
ROUNDING = 1e-7  # a transfer matrix of the whole span loses digits at 40 N/mm2
#: change of (entry moment, carry-over) by the layer, upper and lower span, in shell elements held on cylinders
SHELL_ELEMENTS = {
    7: ((0.023, 0.030), (-0.069, -0.113)),
    10: ((0.014, 0.015), (-0.061, -0.091)),
    20: ((0.001, -0.004), (-0.026, -0.038)),
    40: ((0.000, -0.004), (-0.005, -0.010)),
}


def answers(tension, direction=1.0, *effects):
    case = paper_case(tension, direction=direction)
    return span_responses(case, effects, strip(case))


def by_transfer_matrix(tension: float, side: float) -> tuple[float, float]:
    """Curvatures at run-up and run-off per unit of angle at the run-up, the layer being an end condition."""
    case = paper_case(tension)
    stress, length, radius = tension * 1e6, RIG.span_length, RIG.tail_radius
    plate = BELT.youngs_modulus * BELT.thickness**3 / 12 / (1 - BELT.poisson_ratio**2)
    layer = np.sqrt(plate / stress / BELT.thickness)
    force, sag, bending = case.tension_force, case.sag_curvature, BELT.bending_stiffness
    torsion = strip(case).torsion
    far = np.linspace(0.0, 40 * layer, 20001)  # the twist beside the pulley, by quadrature of its two exponentials
    other = np.sqrt(plate * BELT.width**3 / 12 / torsion)
    slope = layer / radius * np.exp(-far / layer)
    rate = slope[0] / (1 - (other / layer) ** 2) * (np.exp(-far / layer) - np.exp(-far / other))
    lift = side * simpson(rate, x=far)
    lean = simpson(slope * rate, x=far) * bending / torsion
    tilt = lift * bending / torsion
    along = np.zeros((6, 6))  # y, theta, phi, kappa, kappa', phi'
    along[0, 1] = along[1, 3] = along[2, 5] = along[3, 4] = 1
    along[1, 2], along[4, 3], along[4, 2] = -sag, force / bending, -sag * force / bending
    along[5, 3] = bending * sag / torsion
    start = np.zeros((6, 3))  # per unit of kappa, kappa', phi' at the run-off
    start[3:] = np.eye(3)
    start[2, 0], start[1] = tilt, (lean, 0, lift)
    end = expm(along * length) @ start
    ends = np.stack([end[0], end[2] - tilt * end[3], end[1] + lean * end[3] - lift * end[5]])
    unknown = np.linalg.solve(ends, [0, 0, 1])
    return float(end[3] @ unknown), float(unknown[0])


@pytest.mark.evidence(
    "lift_off",
    route="shell",
    what="change of both moments at 7 to 40 N/mm2, {SHELL} of the entry moment",
)
@pytest.mark.parametrize("tension", SHELL_ELEMENTS)
def test_moments_change_as_in_shell_elements(tension):
    plain, lifted = answers(tension), answers(tension, 1.0, LiftOff())
    for span, (entry, carried) in enumerate(SHELL_ELEMENTS[tension]):
        assert lifted.runup[span, 2] / plain.runup[span, 2] - 1 == pytest.approx(entry, abs=SHELL)
        assert lifted.runoff[span, 2] / plain.runoff[span, 2] - 1 == pytest.approx(carried, abs=SHELL)


@pytest.mark.evidence("lift_off", route="elements", what="moments by a transfer matrix of its own, {ROUNDING}")
@pytest.mark.parametrize("tension", [7, 20, 40])
def test_a_transfer_matrix_with_the_layer_as_end_condition_says_the_same(tension):
    lifted = answers(tension, 1.0, LiftOff())
    for span, side in enumerate((1.0, -1.0)):
        found = lifted.runup[span, 2], lifted.runoff[span, 2]
        np.testing.assert_allclose(found, by_transfer_matrix(tension, side), rtol=ROUNDING)


def test_on_reversed_travel_the_spans_change_places():
    forward, back = answers(10, 1.0, LiftOff()), answers(10, -1.0, LiftOff())
    for name in ("runup", "runoff", "mid_tilt"):
        np.testing.assert_allclose(getattr(back, name), getattr(forward, name)[::-1], rtol=1e-12)


def test_a_thin_belt_has_no_layer():
    """l^2 ~ h^2 at a given stress: the effect of a fiftieth of the thickness is at most some 1/2500."""
    case = paper_case(10)
    foil = replace(case, belt=replace(case.belt, thickness=case.belt.thickness / 50))
    plain, lifted = (span_responses(foil, e, strip(foil)) for e in ((), (LiftOff(),)))
    change = np.asarray(lifted.runup[:, 2] / plain.runup[:, 2]) - 1
    whole = np.asarray(answers(10, 1.0, LiftOff()).runup[:, 2] / answers(10).runup[:, 2]) - 1
    assert np.abs(change).max() < 1.5 / 2500 * np.abs(whole).max()


def test_the_march_ends_in_the_closed_form():
    case = paper_case(20)
    curves = LIFTING.run(case, travel=150.0)
    np.testing.assert_allclose(late_rates(curves), LIFTING.steady_rate(case), rtol=SETTLED)
    upper, lower = steady_offsets(case, LIFTING)
    y = np.asarray(curves.y)[:, -1]
    np.testing.assert_allclose((y[0] - y[3], y[2] - y[1]), (upper, lower), rtol=SETTLED)
    assert LIFTING.steady_rate(case) / STRIP.steady_rate(case) == pytest.approx(1.011, abs=2e-3)


def test_the_model_is_the_strip_with_the_effect():
    case = paper_case(7, -YAW)
    whole, added = LIFTING.run(case, travel=150.0), STRIP.run(case, (LiftOff(),), travel=150.0)
    np.testing.assert_array_equal(whole.y, added.y)
