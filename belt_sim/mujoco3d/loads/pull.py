"""What belt and weight pull at the nodes, and what comes of it on the pulleys."""

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Solver
from belt_sim.mujoco3d.state import Pose, Wrap


def pull_on_nodes(mesh: Mesh, solver: Solver, slides: np.ndarray, gravity: float) -> np.ndarray:
    """Forces of belt and weight [N] on nodes at ``slides``, shape (n, m, 3); gravity [m/s2]."""
    pull = solver.elastic_forces(slides)
    pull[..., 2] -= mesh.mass * gravity
    return pull


def loads_on_pulleys(
    mesh: Mesh, slides: np.ndarray, pull: np.ndarray, wraps: tuple[Wrap, Wrap], poses: tuple[Pose, Pose]
) -> np.ndarray:
    """Force along x [N], moment about the axis and about z [N m] that the belt does to either pulley, shape (2, 3)."""
    loads = np.empty((2, 3))
    for which, (wrap, pose) in enumerate(zip(wraps, poses, strict=True)):
        k = wrap.stations
        arms, forces = (mesh.at(slides, k) - pose.centre).reshape(-1, 3), pull[k].reshape(-1, 3)
        t = arms.T @ forces  # arm x force by hand: numpy.cross takes 50 us
        moment = np.array((t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]))
        loads[which] = forces[:, 0].sum(), moment @ pose.axes[:, 1], moment[2]
    return loads
