"""What a load is."""

from typing import Protocol

import numpy as np

from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import State


class Load(Protocol):
    """Something that acts on the nodes during a step."""

    def forces(self, state: State, springs: Springs) -> np.ndarray:
        """[N], shape (n, m, 3); springs: those that hold the nodes during the step."""
