"""A straight piece of a belt model with its ends held, pulled at its nodes until it rests."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import mujoco
import numpy as np
from paper_cases import paper_case

from belt_sim.case import Case
from belt_sim.mujoco3d import scene
from belt_sim.mujoco3d.belt import Mesh
from belt_sim.mujoco3d.loop import Loop
from belt_sim.mujoco3d.natural import curved
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.torsion import Torsion
from belt_sim.paper import ROPE_EXAMPLE

DX = 0.025  # [m]
SLACK = 1e-6  # [N/mm2]
HELD = 1e10  # [N/m]
_FIRST_NODE = 1  # dof; 0 is the post, whose equality makes MuJoCo factorise the metric


@dataclass
class Strip:
    """slides [m], pulls [N], shape (n, across, 3): displacements from the stress-free places, forces on the nodes."""

    case: Case
    mesh: Mesh
    model: mujoco.MjModel
    data: mujoco.MjData
    slides: np.ndarray
    pulls: np.ndarray

    @property
    def belt(self):
        return self.case.belt

    def settle(self, steps: int, *, torsion: bool = False) -> np.ndarray:
        """Displacements [m] from the laid places after ``steps``; torsion: with the couples of torsion.py."""
        view = SimpleNamespace(scene=SimpleNamespace(mesh=self.mesh, base=_FIRST_NODE), slides=self.slides, wraps=())
        couples, given = Torsion.of(self.case, view, self.data), self.pulls.copy()
        quiet = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda message: None)
        for _ in range(steps):
            if torsion and couples.tense:
                couples.apply(view, (), float(self.case.tension_force))
                self.pulls[:, [0, -1], 2] += given[:, [0, -1], 2]
            mujoco.mj_step(self.model, self.data)
        mujoco.set_mju_user_warning(quiet)
        return self.slides - (self.mesh.laid - self.mesh.rest)


def strip(
    belt, length: float, *, across=2, tension=SLACK, dt=1e-2, drag=0.05, both_ends=False, dx=DX, camber=0.0, **options
) -> Strip:
    """A strip [m] laid straight at ``tension`` [N/mm2], its first (and last) station held; drag [N s/m] of a node;
    camber [1/m]: natural curvature in its plane."""
    case, n = paper_case(tension, 0.0, ROPE_EXAMPLE), round(length / dx) + 1
    nowhere = np.zeros(n, bool)
    loop = Loop(
        x=np.arange(n) * dx, z=np.zeros(n), on_head=nowhere, on_tail=nowhere, chord=dx, radius_head=0.17,
        radius_tail=0.17, centre_distance=2.0,
    )  # fmt: skip
    settings = Options(dx=dx, across=across, dt=dt, **options)
    mesh = curved(replace(belt.mesh(case, loop, settings), closed=False), np.full(n - 1, camber))
    spec = scene._empty(settings, 0.0)
    body = spec.worldbody.add_body(name="post", mass=1.0, inertia=[1.0, 1.0, 1.0], explicitinertial=True)
    body.add_joint(name="post", type=mujoco.mjtJoint.mjJNT_HINGE)
    spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1="post")
    belt.tie(spec, mesh, case, settings)
    model = spec.compile()
    data, shape = mujoco.MjData(model), mesh.rest.shape
    slides, pulls, spring, stiffness = (
        a[_FIRST_NODE:].reshape(shape) for a in (data.qpos, data.qfrc_applied, model.qpos_spring, model.jnt_stiffness)
    )
    slides[:] = spring[:] = mesh.laid - mesh.rest
    stiffness[[0, -1] if both_ends else [0]] = HELD
    model.dof_damping[_FIRST_NODE:] = drag
    return Strip(case, mesh, model, data, slides, pulls)
