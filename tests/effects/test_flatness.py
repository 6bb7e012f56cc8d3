"""Residual stress of the strip: its section by numerical integration, and what it does to the rates of a slack belt."""

import numpy as np
import pytest
from paper_cases import paper_case
from scipy.optimize import brentq

from belt_sim.analytic.model import analytic_model
from belt_sim.curves import late_rates
from belt_sim.effects.flatness import Flatness
from belt_sim.laws.span import strip

FIBRES = 40001
INTEGRATION = 2e-4  # of the section's stiffness: trapezoids over 40,000 fibres, one of which holds the kink


def integrated(case, amplitude):
    """(EI, T) of fibres that carry no pressure, by trapezoids."""
    belt, tension = case.belt, float(case.settings.tension)
    y = np.linspace(-0.5, 0.5, FIBRES) * belt.width
    residual = amplitude * (1.0 - 12.0 * (y / belt.width) ** 2)

    def carried(mean):
        return np.trapezoid(np.maximum(mean + residual, 0.0), y) / belt.width - tension

    stress = brentq(carried, -4 * abs(amplitude) - tension, 4 * abs(amplitude) + 4 * tension) + residual
    bending = belt.youngs_modulus * belt.thickness * np.trapezoid(np.where(stress > 0, y**2, 0.0), y)
    st_venant = belt.shear_modulus * belt.width * belt.thickness**3 / 3
    return bending, belt.thickness * np.trapezoid(np.maximum(stress, 0.0) * y**2, y) + st_venant


@pytest.mark.parametrize("tension", [5, 10, 20, 40])
@pytest.mark.parametrize("amplitude", [-3e7, -8e6, 2e6, 5e6, 1e7, 3e7])
def test_the_section_is_that_of_fibres_which_carry_no_pressure(tension, amplitude):
    case = paper_case(tension)
    span = Flatness(amplitude=amplitude).span(strip(case), case)
    bending, torsion = integrated(case, amplitude)
    assert float(span.bending) == pytest.approx(bending, rel=INTEGRATION)
    assert float(span.torsion) == pytest.approx(torsion, rel=INTEGRATION)


def test_long_edges_make_a_slack_belt_run_faster_and_leave_a_tight_one_alone():
    """The late rate at 7 N/mm2 rises above that at 40 with 20 N/mm2 of residual stress."""
    model, flat = analytic_model("strip"), (Flatness(amplitude=2e7),)
    slack, tight = (abs(late_rates(model.run(paper_case(s), flat, travel=300.0), share=0.1)[0]) for s in (7, 40))
    assert slack > 1.2 * tight
    bare = abs(late_rates(model.run(paper_case(40), travel=300.0), share=0.1)[0])
    assert tight == pytest.approx(bare, rel=0.03)  # 2 % less by its smaller torsional stiffness
