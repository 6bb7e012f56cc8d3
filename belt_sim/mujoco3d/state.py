"""What a step of a run in time reads and writes: where the pulleys are, what is held on them, the whole.

Landed stations are held on the pulleys by stiff springs in the solver's metric, instead of contacts. Every node rides
on three slides. While its station lies on a pulley, springs on the slides hold it at an anchor that turns with the
pulley. Under MuJoCo's discrete integrator a joint spring is implicit, so it may be as stiff as 1e13 N/m: no
penetration, no creep, no chatter, no cone.
"""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.mujoco_interface import Motion
from belt_sim.mujoco3d.rope import RopeKinks
from belt_sim.mujoco3d.wrap import PoseArrays, WrapArrays


@dataclass
class RunState(Motion):
    """The belt and the machine at one instant; of lists and arrays of two the first is the head pulley's.

    joints, joint_rates: of the pulleys, in the order of machine.HEAD_YAW ..., as MuJoCo integrates them;
    poses: where the pulleys carry the belt; wraps: the stations on them; layers [m], shape (2, m, 2) each: what the
    bending layer displaces (wrap.py); slip_increments [m], shape (m, 2, n) each: how far the nodes slid in the last
    step, along the axis, along the turn; rolled [m], shape (2,): what the pulleys turned in the step; shaped: 1 from
    travel 0 on, where stations land on the pulleys as they are, 0 before, on plain cylinders;
    loads, shape (2, 3): force along x [N], moment about the axis and about z [N m] that the belt does to a pulley;
    yaw [rad], shape (2,): commanded; compliance_yaw [rad], shape (2,); share: how much of yaw offsets, cants and camber
    acts; slip [m], shape (2,): how far the belt has slid sideways, mean over the wrap;
    waiting_pulley: the pulley on which the belt did not slide in the last step, because both take turns (-1 = neither);
    kinks: of a limp belt (rope.py); run_off_stations, kink_slope: its stations at the run-offs when they were last put
    on their lines, and the slope of y there counted against the travel, shape (2, m);
    time [s]; travel [m], speed [m/s]: of the belt.
    """

    poses: list[PoseArrays]
    wraps: list[WrapArrays]
    layers: list[np.ndarray]
    slip_increments: list[np.ndarray]
    travel: float
    kinks: list[RopeKinks] = field(default_factory=list)
    run_off_stations: list[int] = field(default_factory=list)
    kink_slope: np.ndarray = field(default_factory=lambda: np.zeros((2, 1)))
    loads: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    compliance_yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    slip: np.ndarray = field(default_factory=lambda: np.zeros(2))
    rolled: np.ndarray = field(default_factory=lambda: np.zeros(2))
    shaped: float = 0.0
    share: float = 0.0
    waiting_pulley: int = -1
    speed: float = 0.0
    time: float = 0.0

    def held_stations(self, pulley: int) -> np.ndarray:
        """Numbers of the stations on a pulley."""
        wrap = self.wraps[pulley]
        return np.arange(wrap.first, wrap.last + 1) % len(self.slides)

    def sliding_share(self, pulley: int) -> float:
        """Share of the nodes on a pulley that slid in the last step."""
        increments = self.slip_increments[pulley][..., self.held_stations(pulley)]
        return float(increments.any(axis=1).mean()) if increments.size else 0.0
