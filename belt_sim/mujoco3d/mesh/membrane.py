"""The shell belt: a two-dimensional flex membrane of real E, h and rho with a calibrated width."""

import math

import mujoco

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.mujoco3d.mesh.belt import Mesh, add_nodes, lay, node_name
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.mujoco_4 import STRETCH_ONLY
from belt_sim.mujoco3d.options import Options


def model_width(width: float, across: int, poisson_ratio: float) -> float:
    """Width [m] at which the linear triangles bend in their plane like the strip.

    With n = across - 1 elements in zigzag they bend as EI (1 + 2 / n^2) (1 + 0.7 nu^2 / n^2): constant strain, and a
    lateral strain that triangles of unlike tension share. Tip tests: tests/mujoco3d/test_tip.py, 0.5 %.
    """
    n2 = (across - 1) ** 2
    return width / math.sqrt((1.0 + 2.0 / n2) * (1.0 + 0.7 * poisson_ratio**2 / n2))


class Membrane:
    """Flex triangles between the stations, diagonals alternating so that the mesh has no preferred side."""

    def mesh(self, case: Case, loop: Loop, options: Options) -> Mesh:
        if options.across < 2:
            raise InputError("options.across", options.across, "nodes", "a membrane needs 2 or more")
        width = model_width(float(case.belt.width), options.across, float(case.belt.poisson_ratio))
        return lay(case, loop, width, options.across)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=False)
        flex = spec.add_flex(name="belt", dim=2)
        n, m = mesh.stations, mesh.across
        flex.vertbody = [node_name(i, j) for i in range(n) for j in range(m)]
        flex.vert = [0.0] * (3 * n * m)
        flex.elem = [v for i in range(mesh.links) for j in range(m - 1) for v in _triangles(i, j, n, m)]
        width = float(mesh.line_y[0] - mesh.line_y[-1])
        flex.young = float(case.belt.youngs_modulus)
        flex.poisson = float(case.belt.poisson_ratio)
        flex.thickness = float(case.belt.area) / width
        flex.elastic2d = STRETCH_ONLY
        flex.contype = flex.conaffinity = 0
        flex.radius = 1e-3
        flex.rgba = [0.75, 0.78, 0.82, 1.0]


def _triangles(i: int, j: int, n: int, m: int) -> list[int]:
    a, b = i * m + j, i * m + j + 1
    c, d = (i + 1) % n * m + j, (i + 1) % n * m + j + 1
    return [a, b, c, b, d, c] if (i + j) % 2 else [a, b, d, a, d, c]
