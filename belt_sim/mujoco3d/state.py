"""What a step of a run reads and writes."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mujoco_4 import Motion
from belt_sim.mujoco3d.wrap.hold import Pose, Wrap


@dataclass
class State(Motion):
    """The belt and the machine at one instant; of arrays of two the first is the head pulley's.

    joints, joint_rates: of the pulleys, in the order of scene.HEAD_YAW ..., as MuJoCo integrates them;
    poses: where the pulleys carry the belt; wraps: the stations on them;
    loads, shape (2, 3): force along x [N], moment about the axis and about z [N m] that the belt does to a pulley;
    yaw [rad], shape (2,): commanded; given_way [rad], shape (2,): yaw by compliance; share: how much of yaw offsets,
    cants and camber acts; slip [m], shape (2,): how far the belt has slid sideways, mean over the wrap;
    waits: the pulley on which the belt did not slide in the last step, because both take turns (-1 = neither);
    led, kink_slope: of a limp belt (wrap/release.py), stations at the run-offs when they were last put on their lines,
    and dy/ds of those beside them on the pulleys, shape (2, m);
    time [s]; travel [m], speed [m/s]: of the belt.
    """

    poses: tuple[Pose, Pose]
    wraps: tuple[Wrap, Wrap]
    loads: np.ndarray
    yaw: np.ndarray
    given_way: np.ndarray
    slip: np.ndarray
    led: list[int]
    kink_slope: np.ndarray
    travel: float
    share: float = 0.0
    waits: int = -1
    speed: float = 0.0
    time: float = 0.0
