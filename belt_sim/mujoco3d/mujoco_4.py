"""What the belt itself pulls at its nodes, where they are, read from MuJoCo."""

import mujoco
import numpy as np


def elastic_forces(model: mujoco.MjModel, data: mujoco.MjData, base: int, shape: tuple[int, int, int]) -> np.ndarray:
    """Forces [N] of the belt's membrane or bonds on its nodes at the present positions, shape (n, m, 3).

    The force that MuJoCo's step leaves behind is that of the step's beginning, and the one it integrates is a tangent
    to it: a link that turns by an angle d within a step seems shorter by d^2 / 2, a third of its strain on a pulley.
    Here positions are taken as they are.
    """
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_flex(model, data)
    mujoco.mj_tendon(model, data)
    mujoco.mj_passive(model, data)
    springs = model.jnt_stiffness[base:] * (model.qpos_spring[base:] - data.qpos[base:])
    return (data.qfrc_spring[base:] - springs).reshape(shape)
