"""Residual stress of the strip: its torsional stiffness, and what it does to the rates of a slack belt."""

from functools import partial

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.curves import late_rates
from belt_sim.effects.span import Flatness
from belt_sim.jax_setup import LEAST_EFFORT, jit_float64
from belt_sim.line.span import response_by_change, strip, thin_strip_torsion, with_change
from belt_sim.model import analytic_model

FIBRES = 4001
INTEGRATION = 1e-5  # relative: trapezoids over 4,000 fibres
TIGHT = 0.01  # of the rate at 40 N/mm2, which 5 N/mm2 of residual stress change by 0.6 %
SHELL = {(7, 5): (1748.6, 660.0, -7.190), (10, 5): (3799.0, 1961.9, -12.953), (20, 10): (10580.7, 5777.5, -21.736)}
NEAR_SHELL = 0.035  # the crossbow of a hanging strip with long edges stiffens it by up to 3.2 % at 7 N/mm2


@pytest.mark.evidence(
    "flatness", route="formula", what="torsional stiffness from the work of the stress at rest, {INTEGRATION}"
)
@pytest.mark.parametrize("tension", [10, 40])
@pytest.mark.parametrize("amplitude", [-8e6, 2e6, 1e7])
def test_stress_at_rest_works_on_the_twist_as_tension_does(tension, amplitude):
    case = paper_case(tension)
    belt = case.belt
    y = np.linspace(-0.5, 0.5, FIBRES) * belt.width
    stress = float(case.settings.tension) + amplitude * (1.0 - 12.0 * (y / belt.width) ** 2)
    assert np.trapezoid(stress, y) == pytest.approx(float(case.settings.tension) * belt.width, rel=INTEGRATION)
    wanted = belt.thickness * np.trapezoid(stress * y**2, y)
    wanted += belt.shear_modulus * belt.width * belt.thickness**3 / 3
    assert float(Flatness(amplitude=amplitude).span(strip(case), case).torsion) == pytest.approx(
        wanted, rel=INTEGRATION
    )


@pytest.mark.evidence(
    "flatness",
    route="shell",
    what="entry moment, carry-over and tilt of a span with residual stress at 7 to 20 N/mm2, {NEAR_SHELL}",
)
@pytest.mark.parametrize(("tension", "residual"), SHELL)
def test_a_span_is_as_stiff_as_the_shell_with_residual_stress(tension, residual):
    """Figures of ``python -m studies.shell.span residual=[5,10] ends=[hinged]`` (studies/notes/shell.md)."""
    from studies.shell.span import by_law

    found = by_law(paper_case(tension), "hinged", residual * 1e6)
    np.testing.assert_allclose(found, SHELL[tension, residual], rtol=NEAR_SHELL)


def test_long_edges_make_a_slack_belt_run_faster_and_leave_a_tight_one_alone():
    model, flat = analytic_model("strip"), (Flatness(amplitude=5e6),)

    def rate(tension, *effects):
        return abs(late_rates(model.run(paper_case(tension), effects, travel=300.0), share=0.1)[0])

    assert rate(7, *flat) > 1.25 * rate(7)
    assert rate(40, *flat) == pytest.approx(rate(40), rel=TIGHT)


def test_a_strip_that_is_not_flat_may_lose_most_of_its_tension():
    """Long edges have taken what the tension adds to the torsion: a law that takes the tension too leaves the rest."""
    case = paper_case(10)
    flat = Flatness(amplitude=1.2e7).span(strip(case), case)
    assert float(with_change(flat, case, "tension", -0.9).torsion) == pytest.approx(float(thin_strip_torsion(case)))
    by_tension = jit_float64(partial(response_by_change, kind="tension"), effort=LEAST_EFFORT)(flat, case)
    assert np.isfinite(np.asarray(by_tension)).all()
