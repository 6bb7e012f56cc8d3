"""A straight piece of a belt model with its ends held, pulled at its nodes until it rests."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from paper_cases import paper_case

from belt_sim.case import Case
from belt_sim.space.elastic import TwistStiffness
from belt_sim.space.mujoco_interface import Motion, Solver, compile_model, set_solver
from belt_sim.space.options import Options
from belt_sim.space.scene import LaidLoop, Mesh, add_belt, lay_mesh, tie_lengths
from studies.paper.case import ROPE_EXAMPLE

DX = 0.025  # [m]
SLACK = 1e-6  # [N/mm2]
HELD = 1e10  # [N/m]


@dataclass
class Strip:
    """motion: of the nodes from the stress-free places; rest [m], stiffness [N/m]: of springs on their slides;
    pulls [N]: forces on the nodes; all (n, across, 3)."""

    case: Case
    mesh: Mesh
    solver: Solver
    motion: Motion
    rest: np.ndarray
    stiffness: np.ndarray
    pulls: np.ndarray

    @property
    def belt(self):
        return self.case.belt

    def settle(self, steps: int, *, torsion: bool = False) -> np.ndarray:
        """Displacements [m] from the laid places after ``steps``; torsion: with the couples that lines lack."""
        twist, tension = TwistStiffness.from_belt(self.belt, self.mesh), float(self.case.tension_force)
        stiffness = np.full(
            self.mesh.stations,
            tension * (twist.strip_tension - twist.line_tension) + twist.strip_torsion - twist.line_residual,
        )
        for _ in range(steps):
            forces, height = self.pulls.copy(), (self.mesh.rest + self.motion.slides)[..., 2]
            if torsion:
                roll = height[:, 0] - height[:, -1]
                more = np.roll(roll, -1) - roll
                couple = stiffness * more + twist.cubic * more**3
                forces[:, 0, 2] += couple - np.roll(couple, 1)
                forces[:, -1, 2] -= couple - np.roll(couple, 1)
            self.solver.step(self.motion, self.rest, self.stiffness, forces, np.zeros(1))
        return self.motion.slides - (self.mesh.laid - self.mesh.rest)


def strip(
    belt: str,
    length: float,
    *,
    across=2,
    tension=SLACK,
    dt=1e-2,
    drag=0.05,
    both_ends=False,
    dx=DX,
    camber=0.0,
    **options,
) -> Strip:
    """A strip [m] laid straight at ``tension`` [N/mm2], its first (and last) station held; drag [N s/m] of a node;
    camber [1/m]: natural curvature in its plane."""
    case, n = paper_case(tension, 0.0, ROPE_EXAMPLE), round(length / dx) + 1
    nowhere = np.zeros(n, bool)
    loop = LaidLoop(np.arange(n) * dx, np.zeros(n), nowhere, nowhere, dx, radius_head=0.17, radius_tail=0.17)
    settings = Options(dx=dx, across=across, dt=dt, **options)
    mesh = replace(lay_mesh(belt, case, loop, settings), closed=False, curvature=np.full(n - 1, camber))
    spec = mujoco.MjSpec()
    post = spec.worldbody.add_body(name="post", mass=1.0, inertia=[1.0, 1.0, 1.0], explicitinertial=True)
    post.add_joint(name="post", type=mujoco.mjtJoint.mjJNT_HINGE)
    set_solver(spec, dt, 0.0, still="post")
    add_belt(spec, belt, mesh, case, settings)
    solver, shape = Solver(compile_model(spec), mesh.rest.shape), mesh.rest.shape
    solver.model.dof_damping[solver.base :] = drag
    solver.set_rest_lengths(tie_lengths(mesh, solver.tied_nodes(), 1.0))
    slides = mesh.laid - mesh.rest
    stiffness = np.zeros(shape)
    stiffness[[0, -1] if both_ends else [0]] = HELD
    return Strip(
        case,
        mesh,
        solver,
        Motion(*np.zeros((2, 1)), slides.copy(), np.zeros(shape)),
        slides,
        stiffness,
        np.zeros(shape),
    )
