"""What the bending layer beside a pulley is made of, as arrays."""

from typing import NamedTuple

import numpy as np

from belt_sim.case import Case
from belt_sim.pytree import Numbers as Array


class Fibres(NamedTuple):
    """plate [N m], thickness [m], modulus [Pa], own [1]: as in mujoco3d.wrap.layer.Layer; own 0 = like a thread."""

    plate: Array
    thickness: Array
    modulus: Array
    own: Array

    @staticmethod
    def of(case: Case, strength: float) -> "Fibres":
        """Of a belt; strength [1] multiplies l^2 and l^3."""
        belt = case.belt
        tense = float(case.tension_force) * float(belt.width) ** 2 / 12.0
        still = float(belt.shear_modulus) * float(belt.width) * float(belt.thickness) ** 3 / 3.0
        own = strength * tense / (tense + still)
        return Fibres(*map(np.array, (belt.plate_stiffness, belt.thickness, belt.youngs_modulus, own)))
