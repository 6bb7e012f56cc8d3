"""In-plane bending and stretch of the membrane against Timoshenko's cantilever."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from belt_sim.mujoco3d import scene
from belt_sim.mujoco3d.loop import Loop
from belt_sim.mujoco3d.membrane import Membrane
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.study import paper_case

STIFFNESS = 0.01  # the calibration of the width holds to 0.5 % for 2 to 5 nodes across
SHEAR_FACTOR = 1.2  # rectangle


def cantilever(across: int, length: float, force: tuple[float, float]):
    """Deflection and stretch [m] of a straight strip clamped at x = 0 under a tip force [N] along x and y."""
    case, dx = paper_case(2.0, 1e-6, 0.0), 0.025
    n = round(length / dx) + 1
    loop = Loop(x=np.arange(n) * dx, z=np.zeros(n), chord=dx, radius_head=0.17, radius_tail=0.17)
    options = Options(dx=dx, across=across, dt=1e-2)
    belt = Membrane()
    mesh = replace(belt.mesh(case, loop, options), closed=False)
    spec = scene._empty(options, 0.0)
    body = spec.worldbody.add_body(name="post", mass=1.0, inertia=[1.0, 1.0, 1.0], explicitinertial=True)
    body.add_joint(name="post", type=mujoco.mjtJoint.mjJNT_HINGE)
    spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1="post")
    belt.tie(spec, mesh, case, options)
    model = spec.compile()
    model.jnt_stiffness[1 : 1 + 3 * across] = 1e10
    model.dof_damping[1:] = 0.05
    data = mujoco.MjData(model)
    slides, pull = (a[1:].reshape(n, across, 3) for a in (data.qpos, data.qfrc_applied))
    share = mesh.line_stiffness / mesh.line_stiffness.sum()
    pull[-1, :, 0], pull[-1, :, 1] = force[0] * share, force[1] * share
    quiet = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    for _ in range(1500):
        mujoco.mj_step(model, data)
    mujoco.set_mju_user_warning(quiet)
    return case.belt, slides[-1, :, 1].mean(), slides[-1, :, 0].mean()


@pytest.mark.filterwarnings("ignore:flex")
@pytest.mark.parametrize("across", [2, 3, 5])
def test_bends_in_its_plane_like_the_strip(across):
    length, force = 2.0, 1.0
    belt, deflection, _ = cantilever(across, length, (0.0, force))
    bending = force * length**3 / (3.0 * belt.bending_stiffness)
    shear = SHEAR_FACTOR * force * length / (belt.shear_modulus * belt.area)
    assert deflection == pytest.approx(bending + shear, rel=STIFFNESS)


@pytest.mark.filterwarnings("ignore:flex")
def test_stretches_like_the_strip():
    belt, _, stretch = cantilever(2, 1.0, (100.0, 0.0))
    assert stretch == pytest.approx(100.0 / (belt.youngs_modulus * belt.area), rel=STIFFNESS)
