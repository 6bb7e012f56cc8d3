"""The rope: a chain of particles tied by springs, limp in every direction."""

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.mesh.belt import Mesh, add_nodes, lay, node_name
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.options import Options


class Chain:
    """One line of particles; every link is a spatial tendon of stiffness EA / length."""

    def mesh(self, case: Case, loop: Loop, options: Options) -> Mesh:
        return lay(case, loop, float(case.belt.width), 1)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=True)
        n = mesh.stations
        for i in range(mesh.links):
            bond(spec, mesh, (i, 0), ((i + 1) % n, 0), float(mesh.line_stiffness[0]) / mesh.chord)


def bond(spec: mujoco.MjSpec, mesh: Mesh, one: tuple[int, int], other: tuple[int, int], stiffness: float) -> None:
    """Tie two nodes by a spring [N/m] that is slack at their stress-free distance."""
    tendon = spec.add_tendon(name=f"bond-{one[0]}-{one[1]}-{other[0]}-{other[1]}")
    tendon.wrap_site(node_name(*one))
    tendon.wrap_site(node_name(*other))
    tendon.stiffness[0] = stiffness
    length = float(np.linalg.norm(mesh.rest[one] - mesh.rest[other]))
    tendon.springlength = [length, length]
    tendon.width, tendon.rgba = 1e-3, [0.75, 0.78, 0.82, 1.0]
