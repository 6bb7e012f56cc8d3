"""What a step of a run in time reads and writes: where the pulleys are, what is held on them, the whole.

Landed stations are held on the pulleys by stiff springs in the solver's metric, instead of contacts. Every node rides
on three slides. While its station lies on a pulley, springs on the slides hold it at an anchor that turns with the
pulley. Under MuJoCo's discrete integrator a joint spring is implicit, so it may be as stiff as 1e13 N/m: no
penetration, no creep, no chatter, no cone.
"""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.space.mujoco_interface import Motion
from belt_sim.space.rope import RopeKinks
from belt_sim.space.wrap import TAIL, BeltOnPulley, SlipState


@dataclass
class RunState(Motion):
    """The belt and the machine at one instant; of lists and arrays of two the first is the head pulley's.

    joints, joint_rates: of the pulleys, in the order of machine.HEAD_YAW ..., as MuJoCo integrates them;
    pulleys: where they carry the belt, the stations on them, their bending layers (wrap.py); slip: of these stations;
    kinks, run_off_stations: of a limp belt (rope.py), its stations at the run-offs when they were last put on their
    lines, shape (2,); shaped: 1 from travel 0 on, where stations land on the pulleys as they are, 0 before, on plain
    cylinders; loads, shape (2, 3): force along x [N], moment about the axis and about z [N m] that the belt does to a
    pulley; yaw [rad], shape (2,): commanded; compliance_yaw [rad], shape (2,); share: how much of yaw offsets, cants
    and camber acts; waiting_pulley: the pulley on which the belt did not slide in the last step, because both take
    turns (-1 = neither); time [s]; travel [m], speed [m/s]: of the belt.
    """

    pulleys: BeltOnPulley
    slip: SlipState
    travel: float
    kinks: RopeKinks | None = None
    run_off_stations: np.ndarray | None = None
    loads: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    compliance_yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    shaped: float = 0.0
    share: float = 0.0
    waiting_pulley: int = -1
    speed: float = 0.0
    time: float = 0.0

    @property
    def tail_x(self) -> float:
        """Place of the tail pulley along the machine [m]."""
        return float(self.pulleys.pose.centre[TAIL, 0])

    def held_stations(self, pulley: int) -> np.ndarray:
        """Numbers of the stations on a pulley."""
        first, last = (int(v[pulley]) for v in (self.pulleys.wrap.first, self.pulleys.wrap.last))
        return np.arange(first, last + 1) % len(self.slides)
