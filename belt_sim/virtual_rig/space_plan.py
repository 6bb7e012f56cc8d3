"""The short rig that is measured in three dimensions, and what its campaign file states of the errors."""

import math

from belt_sim.campaign import BeltSheet, Machine, Quantity
from belt_sim.mujoco3d.machine.pace import accurate
from belt_sim.si import N_PER_MM2
from belt_sim.virtual_rig.plan import Noise, Plan, Setting, grid

#: A narrow belt, so that the bending stress of its edges, 2 E b beta/L = 5.3 N/mm2 at the yaw below, stays under its
#: tension, and K L = 0.48 ... 1.17 makes the tension felt; Lambda = 0.41 at 10 N/mm2, 0.002 at 60.
SHORT_RIG = Machine(
    centre_distance=Quantity(value=2.0, u=5e-4),
    head_radius=Quantity(value=0.170, u=1e-4),
    tail_radius=Quantity(value=0.170, u=1e-4),
)
NARROW_BELT = BeltSheet(
    width=Quantity(value=0.1, u=5e-5),
    thickness=Quantity(value=3e-4, u=1e-6),
    youngs_modulus=Quantity(value=210e9, u=2e9),
    density=Quantity(value=7850.0),
    poisson_ratio=Quantity(value=0.3),
)
TENSIONS = (10.0 * N_PER_MM2, 20.0 * N_PER_MM2, 40.0 * N_PER_MM2, 60.0 * N_PER_MM2)
YAW = 2.5e-4  # [rad]
TRAVEL, SPACING = 12.0, 0.1  # [m]

#: What the sensors do. They are no better than this on purpose: noise much below what the simulator itself is off by
#: (stated_error.py) would let a diagnosis see the mesh. The signals are tenths of a millimetre.
SENSORS = Noise(
    white=5e-6, zero=1e-5, wander_sd=1e-5, wander_length=2.0, tilt_white=2e-5, tension_rel=0.005, yaw_u=1e-6
)


def space_plan() -> Plan:
    """Ten runs: four tensions, yaw to either side, two runs made again."""
    runs = tuple(paced(run) for run in grid(TENSIONS, (-YAW, YAW)))
    return Plan(runs=runs, length=TRAVEL, spacing=SPACING, machine=SHORT_RIG, belt=NARROW_BELT)


def paced(run: Setting) -> Setting:
    """The run at the speed at which the belt really runs in the scene."""
    string_speed = math.sqrt(run.tension / NARROW_BELT.density.value)
    return Setting(**{**vars(run), "speed": round(accurate(string_speed), 2)})
