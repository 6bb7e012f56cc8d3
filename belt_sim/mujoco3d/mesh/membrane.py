"""The shell belt: a two-dimensional flex membrane of real E, h and rho, as wide as bends like the strip."""

import mujoco

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.mujoco3d.mesh.belt import Mesh, add_nodes, lay, node_name, rest_chord
from belt_sim.mujoco3d.mesh.couple_test import matching_width, zigzag
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.mujoco_4 import STRETCH_ONLY
from belt_sim.mujoco3d.options import Options


class Membrane:
    """Flex triangles between the stations, diagonals alternating so that the mesh has no preferred side."""

    def mesh(self, case: Case, loop: Loop, options: Options) -> Mesh:
        if options.across < 2:
            raise InputError("options.across", options.across, "nodes", "a membrane needs 2 or more")
        belt = case.belt
        width = matching_width(float(belt.width), rest_chord(case, loop), options.across, float(belt.poisson_ratio))
        return lay(case, loop, width, options.across)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=False)
        flex = spec.add_flex(name="belt", dim=2)
        n, m = mesh.stations, mesh.across
        flex.vertbody = [node_name(i, j) for i in range(n) for j in range(m)]
        flex.vert = [0.0] * (3 * n * m)
        corners = (v for i in range(mesh.links) for j in range(m - 1) for t in zigzag(i, j) for v in t)
        flex.elem = [station % n * m + line for station, line in corners]
        width = float(mesh.line_y[0] - mesh.line_y[-1])
        flex.young = float(case.belt.youngs_modulus)
        flex.poisson = float(case.belt.poisson_ratio)
        flex.thickness = float(case.belt.area) / width
        flex.elastic2d = STRETCH_ONLY
        flex.contype = flex.conaffinity = 0
        flex.radius = 1e-3
        flex.rgba = [0.75, 0.78, 0.82, 1.0]
