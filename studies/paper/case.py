"""The belt and the two rigs of the paper, and what they are set to, in SI.

Lengths, radii and yaw are stated there. The material is assumed: steel (E, density, Poisson's ratio), which the paper
does not give. ``conf/rig`` and ``conf/belt`` say the same for the command line.
"""

from typing import Any

from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.units import DEGREE

TEST_RIG = Rig(centre_distance=11.28, head_radius=0.17, tail_radius=0.17)
ROPE_EXAMPLE = Rig(centre_distance=2.0, head_radius=0.17, tail_radius=0.17)
PAPER_BELT = Belt(width=0.2, thickness=3e-4, youngs_modulus=210e9, density=7850.0)
YAW = -0.042 * DEGREE  # [rad], of the tail pulley


def paper_case(tension: float, yaw: float = YAW, rig: Rig = TEST_RIG, **settings: Any) -> Case:
    """The paper's belt at ``tension`` [Pa], its tail pulley yawed by ``yaw`` [rad] at travel 0; further Settings."""
    return Case(rig=rig, belt=PAPER_BELT, settings=Settings(tension=tension, yaw=Schedule.step(yaw), **settings))
