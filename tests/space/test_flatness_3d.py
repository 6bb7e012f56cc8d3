"""Residual stress of the strip in 3D: stress-free lengths of its lines, and what a twist meets of them."""

from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.effects.span import Flatness
from belt_sim.errors import CannotRepresent
from belt_sim.jax_setup import in_float64
from belt_sim.space import Options
from belt_sim.space.belt import ActiveFeatures, belt_arrays
from belt_sim.space.elastic import stretch_energy
from belt_sim.space.model import SpaceModel
from belt_sim.space.options import fit_options
from belt_sim.space.scene import lay_out
from studies.paper.case import ROPE_EXAMPLE

TENSION, RESIDUAL = 20.0, 10.0  # N/mm2
TWIST = 1e-4  # [rad] between two stations: the edges' stretch by it is a millionth of their strain
EXACT = 0.03  # of T and of its change: the lines are as far apart as those of a belt under tension
DIAGONALS = 0.06  # of both: in five lines the diagonals carry a part of the tension that twists less (5 %)
CASE = paper_case(TENSION, rig=ROPE_EXAMPLE)


def scene_of(amplitude, across, belt="flex", case=CASE, **options):
    settings = Options(dx=0.04, across=across, **options)
    parts = SpaceModel(belt=belt, options=settings).parts(case, [Flatness(amplitude=amplitude * 1e6)])
    return lay_out(case, belt, fit_options(settings, case, belt), parts)


@pytest.mark.parametrize("across", [2, 3, 5, 7])
def test_the_lines_share_a_parabola_without_resultant(across):
    """Its second moment over the width is -1/15 b^2 of many lines; three overdo it, two have none of it."""
    mesh = scene_of(RESIDUAL / 2.0, across, "grid").mesh
    share, u = mesh.line_stiffness / mesh.line_stiffness.sum(), mesh.line_y / np.ptp(mesh.line_y)
    strain = mesh.residual_strain / mesh.residual
    assert share @ strain == pytest.approx(0.0, abs=1e-12)
    assert share @ (u**2 * strain) == pytest.approx({2: 0.0, 3: -3 / 32, 5: -0.0762, 7: -0.0711}[across], abs=1e-4)


@in_float64
def torsional_stiffness(amplitude, across, belt):
    """Couple over twist per metre [N m2] of all that acts between two stations under tension, mean of even and odd."""
    scene = scene_of(amplitude, across, belt)
    arrays = belt_arrays(scene, ActiveFeatures())
    strain = float(CASE.settings.tension / CASE.belt.youngs_modulus)
    numbers, m = np.arange(4), across
    nodes = np.zeros((m, 3, 4))
    nodes[:, 0] = arrays.chord * (1.0 + strain) * numbers
    y = scene.mesh.laid[0, :, 1]
    nodes[:, 1] = y[:, None]
    couples = []
    for k in (1, 2):  # of the cell between k and k + 1, at its further end
        roll = TWIST * (numbers - k - 0.5)
        nodes[:, 2] = y[:, None] * roll
        slope = np.asarray(stretch_energy(arrays.ties, arrays.shape.bonds, nodes, numbers, 0.0).slope)[:, k]
        couples.append(float(y @ slope[3 * m + 2 :: 3] - (y * roll[k + 1]) @ slope[3 * m + 1 :: 3]))
    own, apart = np.mean(couples) / TWIST, float(np.ptp(scene.mesh.line_y))
    tension, twist = float(CASE.tension_force), arrays.twist
    more = (tension * (twist.strip_tension - twist.line_tension) + twist.strip_torsion - twist.line_residual) * apart**2
    return (own + float(more)) * float(arrays.chord)


@pytest.mark.parametrize(("belt", "across", "near"), [("flex", 2, EXACT), ("grid", 2, EXACT), ("grid", 3, EXACT),
                                                      ("grid", 5, DIAGONALS)])  # fmt: skip
def test_a_belt_twists_as_easily_as_the_law_says(belt, across, near):
    """T = b^3 h (sigma - 0.8 amplitude)/12 + G b h^3/3, by stress-free lengths, and couples for what lines lack."""
    b, h = float(CASE.belt.width), float(CASE.belt.thickness)
    found = [torsional_stiffness(a, across, belt) for a in (0.0, RESIDUAL)]
    assert found[1] - found[0] == pytest.approx(-0.8 * RESIDUAL * 1e6 * b**3 * h / 12.0, rel=near)
    still = float(CASE.belt.shear_modulus) * b * h**3 / 3.0
    assert found[0] == pytest.approx(float(CASE.tension_force) * b**2 / 12.0 + still, rel=near)


def test_none_of_it_is_the_belt_without_it_to_the_last_digit():
    """Every array of the engines on JAX, and the mesh of the native one."""
    plain = lay_out(CASE, "flex", fit_options(Options(dx=0.04, across=3), CASE, "flex"),
                    SpaceModel(options=Options(dx=0.04, across=3)).parts(CASE, []))  # fmt: skip
    null = scene_of(0.0, 3)
    for one, other in zip(belt_arrays(plain, ActiveFeatures()).ties,
                          belt_arrays(null, ActiveFeatures()).ties, strict=True):  # fmt: skip
        np.testing.assert_array_equal(one, other)
    assert belt_arrays(null, ActiveFeatures()).twist.line_residual == 0.0
    assert null.mesh.residual == 0.0


@pytest.mark.parametrize(
    ("residual", "across", "options", "reason"),
    [
        (5.0, 3, {"belt": "flex"}, "across = 2 in a membrane"),
        (16.0, 5, {}, "a line of 5 slack"),
        (-21.0, 3, {}, None),
        (-28.0, 3, {}, "a line of 3 slack"),
        (26.0, 2, {}, "twist by themselves"),
    ],
)
def test_lines_that_would_fold_are_refused_by_name(residual, across, options, reason):
    options = {"belt": "grid", **options}
    if reason is None:
        assert scene_of(residual, across, **options).mesh.residual < 0.0
        return
    with pytest.raises(CannotRepresent, match=f"effects = flatness.*{reason}"):
        scene_of(residual, across, **options)


def test_a_rope_and_the_scene_with_contacts_say_no():
    effects = [Flatness(amplitude=5e6)]
    with pytest.raises(CannotRepresent, match="a rope has neither"):
        SpaceModel(belt="rope").admit(effects)
    with pytest.raises(CannotRepresent, match=r"model\.contact = mujoco"):
        replace(SpaceModel(), contact="mujoco").run(CASE, effects, travel=0.1)
