"""The contenders of the 3D bench stand for the same belt, and their largest steps are what they are said to be."""

import numpy as np
import pytest

from studies.bench.space import explicit
from studies.bench.space.lammps import BEYOND, SAFE, lammps_run, program
from studies.bench.space.particles import Particles
from studies.bench.space.task import SHORT

SMALL_ANGLES = 2e-3  # of the tension: the laid spans sag and the section is cut square
STEPS = 2000


@pytest.mark.parametrize("across", [2, 3])
def test_the_particles_carry_the_tension_and_the_mass_of_the_belt(across):
    case = SHORT.case()
    belt = Particles.from_case(case, across)
    assert belt.mass.sum() == pytest.approx(float(case.belt.mass_per_length * case.rig.belt_length), rel=1e-3)
    kind, one, other = belt.bonds.T
    apart = belt.place[other] - belt.place[one]
    length = np.linalg.norm(apart, axis=1)
    pull = belt.stiffness[kind] * (length - belt.length[kind]) * apart[:, 0] / length
    middle = 0.5 * belt.centre_distance
    cut = (belt.place[one, 0] - middle) * (belt.place[other, 0] - middle) < 0.0
    upper = cut & (belt.place[one, 2] > 0.0)
    assert pull[upper].sum() == pytest.approx(float(case.tension_force), rel=SMALL_ANGLES)


@pytest.mark.skipif(program() is None, reason="LAMMPS is not installed")
def test_lammps_is_stable_up_to_the_step_of_the_fastest_mode():
    belt = Particles.from_case(SHORT.case(), 2)
    limit = belt.largest_step()
    assert lammps_run(belt, dt=SAFE * limit, speed=1.0, steps=STEPS).stable
    assert not lammps_run(belt, dt=BEYOND * limit, speed=0.0, steps=STEPS, contact=False).stable


def test_explicit_steps_fail_above_five_microseconds():
    model, free = explicit.explicit_model(SHORT.begin()[0])
    assert explicit.stable(model, free, 4e-6)
    assert not explicit.stable(model, free, 6e-6)
