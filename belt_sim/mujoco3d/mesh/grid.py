"""The grid: particles tied by bonds along the belt, across it and diagonally (paper Fig. 19)."""

from dataclasses import replace

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.mujoco3d.mesh.belt import Mesh, add_nodes, lay, lines, rest_chord
from belt_sim.mujoco3d.mesh.chain import bond
from belt_sim.mujoco3d.mesh.lattice import calibrate
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.options import Options


class Grid:
    """Every bond is a spatial tendon, a spring along the line between two nodes."""

    def mesh(self, case: Case, loop: Loop, options: Options) -> Mesh:
        m = options.across
        if m < 2:
            raise InputError("options.across", m, "nodes", "a grid needs 2 or more")
        chord = rest_chord(case, loop)
        lattice = calibrate(case.belt, chord, m, options.bonds)
        mesh = lay(case, loop, lattice.width, m)
        y, share = lines(lattice.width, m)
        strain = float(case.settings.tension) / float(case.belt.youngs_modulus)
        laid = mesh.laid.copy()
        laid[:, :, 1] = y * (1.0 - lattice.poisson_ratio * strain)
        return replace(mesh, laid=laid, line_stiffness=lattice.lines * share)

    def tie(self, spec: mujoco.MjSpec, mesh: Mesh, case: Case, options: Options) -> None:
        add_nodes(spec, mesh, sites=True)
        lattice = calibrate(case.belt, mesh.chord, mesh.across, options.bonds)
        w = lattice.width / (mesh.across - 1)
        diagonal = lattice.diagonal / float(np.hypot(mesh.chord, w))
        n, m = mesh.stations, mesh.across
        for i in range(n):
            on, last = (i + 1) % n, i >= mesh.links
            for j in range(m):
                if not last:
                    bond(spec, mesh, (i, j), (on, j), float(mesh.line_stiffness[j]) / mesh.chord)
                if j + 1 == m:
                    continue
                if lattice.transverse:
                    bond(spec, mesh, (i, j), (i, j + 1), lattice.transverse / w)
                if lattice.diagonal and not last:
                    bond(spec, mesh, (i, j), (on, j + 1), diagonal)
                    bond(spec, mesh, (i, j + 1), (on, j), diagonal)
