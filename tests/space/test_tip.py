"""Tip tests of membrane and grid: bending in the plane, shear, stretch, torsion under tension; grids without bonds."""

import numpy as np
import pytest
from strip_bench import DX, strip

from belt_sim.space.scene import stiffness_ratio

STIFFNESS = 0.01  # the calibrations hold to 0.5 % for 2 to 5 nodes across
SHORT = 0.03  # of a strip 12 stations long, whose clamped end is a station
SHEAR_FACTOR = 1.2  # rectangle
BELTS = [("grid", 2, DX), ("grid", 5, 0.05), ("flex", 2, 0.05), ("flex", 3, DX), ("flex", 5, 0.05)]
#: EI of the membrane over the strip's at a width that fits at 25 mm alone, in couple tests of the belt itself
COUPLES = {0.05: 0.947, 0.025: 0.997, 0.0125: 1.023, 0.05 / 6: 1.029}
SQUARE = ("longitudinal", "transverse")

pytestmark = pytest.mark.filterwarnings("ignore:flex")


def tip_force(bench, force):
    """Spread a tip force [N], shape (3,), over the last station."""
    share = bench.mesh.line_stiffness / bench.mesh.line_stiffness.sum()
    bench.pulls[-1] = share[:, None] * np.asarray(force)


def bending(belt, length):
    return length**3 / (3.0 * belt.bending_stiffness)


def shear(belt, length):
    return SHEAR_FACTOR * length / (belt.shear_modulus * belt.area)


@pytest.mark.parametrize(("belt", "across", "dx"), BELTS)
def test_bends_in_its_plane_like_the_strip(belt, across, dx):
    bench = strip(belt, 2.0, across=across, dx=dx, drag=0.05 * dx / DX)
    tip_force(bench, (0.0, 1.0, 0.0))
    deflection = bench.settle(1500)[-1, :, 1].mean()
    assert deflection == pytest.approx(bending(bench.belt, 2.0) + shear(bench.belt, 2.0), rel=STIFFNESS)


@pytest.mark.parametrize("dx", COUPLES)
def test_two_cells_tell_what_couples_on_the_whole_belt_told(dx):
    at_25_mm = 0.112  # [m], of a strip of 0.2 m
    assert (at_25_mm / 0.2) ** 2 * stiffness_ratio(dx / at_25_mm, 2, 0.3) == pytest.approx(COUPLES[dx], abs=6e-4)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3])
def test_many_lines_bend_like_the_strip(poisson_ratio):
    """Constant strains over n elements: 1 + 2/n^2 at nu = 0 on slender cells, and the strip in the limit."""
    errors = [stiffness_ratio(0.02, across, poisson_ratio) - 1.0 for across in (11, 21)]
    assert errors[1] < 0.006
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)  # second order


@pytest.mark.parametrize("across", [2, 3])
def test_grid_shears_like_the_strip(across):
    bench = strip("grid", 0.3, across=across)
    tip_force(bench, (0.0, 1.0, 0.0))
    deflection = bench.settle(1500)[-1, :, 1].mean()
    assert shear(bench.belt, 0.3) > 0.2 * bending(bench.belt, 0.3)
    assert deflection == pytest.approx(bending(bench.belt, 0.3) + shear(bench.belt, 0.3), rel=SHORT)


@pytest.mark.parametrize(("belt", "across"), [("flex", 2), ("grid", 2), ("grid", 3)])
def test_stretches_like_the_strip(belt, across):
    bench = strip(belt, 1.0, across=across)
    tip_force(bench, (100.0, 0.0, 0.0))
    stretch = bench.settle(1500)[-1, :, 0].mean()
    assert stretch == pytest.approx(100.0 / (bench.belt.youngs_modulus * bench.belt.area), rel=STIFFNESS)


@pytest.mark.parametrize(("belt", "across", "tension"), [("flex", 2, 7.0), ("grid", 2, 40.0), ("grid", 3, 7.0)])
def test_twists_under_tension_like_the_strip(belt, across, tension):
    length, couple = 2.0, 0.05
    slowness = (40.0 / tension) ** 0.5
    bench = strip(
        belt, length, across=across, tension=tension, dt=1e-4 * slowness, drag=2.6 / across / slowness, both_ends=True
    )
    middle = bench.mesh.stations // 2
    apart = bench.mesh.line_y[0] - bench.mesh.line_y[-1]
    bench.pulls[middle, 0, 2], bench.pulls[middle, -1, 2] = couple / apart, -couple / apart
    place = bench.settle(3000, torsion=True)[middle]
    belt_ = bench.belt
    stiffness = tension * 1e6 * belt_.area * belt_.width**2 / 12.0
    stiffness += belt_.shear_modulus * belt_.width * belt_.thickness**3 / 3.0
    assert (place[0, 2] - place[-1, 2]) / apart == pytest.approx(couple * length / (4.0 * stiffness), rel=SHORT)


def middle_deflection(bonds, tension=60.0, length=2.0):
    """Lateral deflection [m] of a held span under 1 N in its middle."""
    bench = strip("grid", length, tension=tension, dt=1e-4, drag=1.3, both_ends=True, bonds=bonds)
    middle = bench.mesh.stations // 2
    bench.pulls[middle, :, 1] = 0.5
    return bench, bench.settle(4000)[middle, :, 1].mean()


@pytest.mark.parametrize("bonds", [("longitudinal",), SQUARE])
def test_without_diagonals_a_span_deflects_like_a_string(bonds):
    bench, deflection = middle_deflection(bonds)
    assert deflection == pytest.approx(2.0 / (4.0 * bench.case.tension_force), rel=SHORT)


def test_diagonals_make_a_span_stiff():
    assert middle_deflection((*SQUARE, "diagonal"))[1] < 0.02 * middle_deflection(SQUARE)[1]
