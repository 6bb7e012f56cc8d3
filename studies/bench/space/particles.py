"""The bonded-particle belt as input for LAMMPS: particles, harmonic bonds, two rotating cylinders with friction.

Stations, bonds and stiffnesses are those of belt_sim.space.mesh. The cylinders are granular walls
(fix wall/gran/region); the particles do not roll.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigsh

from belt_sim.case import Case
from belt_sim.space.loop import lay_loop
from belt_sim.space.mesh import Grid, Mesh, calibrate
from belt_sim.space.options import Options

DIAMETER = 0.01  # [m] of a particle; its density is chosen to give the node's mass
WALL = 1e7  # [N/m]: 13 um deep under a node's pressure at 60 N/mm2, and 1 % off the largest stable step
WALL_DAMPING = 10.0  # [1/s]
FRICTION = 0.3
DRAG = 1.0  # [1/s]


@dataclass(frozen=True)
class Particles:
    """A lattice belt laid round its pulleys.

    place [m], shape (n, 3); mass [kg], shape (n,); bonds, shape (b, 3): kind, one, other (from 0); stiffness [N/m],
    length [m] at rest, of each kind; radius [m] of the cylinders under the particles; centre_distance [m].
    """

    place: np.ndarray
    mass: np.ndarray
    bonds: np.ndarray
    stiffness: np.ndarray
    length: np.ndarray
    radius: float
    centre_distance: float

    @staticmethod
    def from_case(case: Case, across: int) -> "Particles":
        """The belt of a case with ``across`` particles over its width, 25 mm apart."""
        options = Options(across=across)
        loop = lay_loop(case, options.dx)
        mesh = Grid().mesh(case, loop, options)
        lattice = calibrate(case.belt, mesh.chord, across, options.bonds)
        w = lattice.width / (across - 1)
        slant = float(np.hypot(mesh.chord, w))
        along = list(mesh.line_stiffness / mesh.chord)
        return Particles(
            place=mesh.laid.reshape(-1, 3),
            mass=np.tile(mesh.mass, mesh.stations),
            bonds=_bonds(mesh),
            stiffness=np.array([*along, lattice.transverse / w, lattice.diagonal / slant]),
            length=np.array([*[mesh.chord] * across, w, slant]),
            radius=0.5 * (loop.radius_head + loop.radius_tail) - 0.5 * DIAMETER,
            centre_distance=float(case.rig.centre_distance),
        )

    def largest_step(self) -> float:
        """2 / omega [s] of the lattice's fastest mode, from its stiffness and mass matrices."""
        kind, one, other = self.bonds.T
        apart = self.place[other] - self.place[one]
        direction = apart / np.linalg.norm(apart, axis=1, keepdims=True)
        rows = np.repeat(np.arange(len(kind)), 6)
        columns = np.concatenate([3 * one[:, None] + np.arange(3), 3 * other[:, None] + np.arange(3)], axis=1).ravel()
        stretch = sparse.csr_matrix((np.concatenate([-direction, direction], axis=1).ravel(), (rows, columns)))
        scaled = stretch @ sparse.diags(1.0 / np.sqrt(np.repeat(self.mass, 3)))
        fastest = eigsh(scaled.T @ sparse.diags(self.stiffness[kind]) @ scaled, k=1, which="LM")[0][0]
        return 2.0 / float(np.sqrt(fastest))


def _bonds(mesh: Mesh) -> np.ndarray:
    n, m = mesh.stations, mesh.lines
    found = []
    for i in range(n):
        here, on = i * m, (i + 1) % n * m
        for j in range(m):
            found.append((j, here + j, on + j))
            if j + 1 < m:
                found += [(m, here + j, here + j + 1), (m + 1, here + j, on + j + 1), (m + 1, here + j + 1, on + j)]
    return np.array(found)


def write_particles(path: Path, belt: Particles) -> None:
    """A LAMMPS data file, atom style hybrid sphere bond."""
    volume, reach = np.pi / 6.0 * DIAMETER**3, belt.radius + 0.3
    lines = ["bonded-particle belt", "", f"{len(belt.place)} atoms", f"{len(belt.bonds)} bonds", "1 atom types"]
    lines += [f"{len(belt.stiffness)} bond types", "", f"{-reach} {belt.centre_distance + reach} xlo xhi"]
    lines += ["-0.3 0.3 ylo yhi", f"{-reach} {reach} zlo zhi", "", "Atoms", ""]
    for k, ((x, y, z), mass) in enumerate(zip(belt.place, belt.mass, strict=True), start=1):
        lines.append(f"{k} 1 {x:.12g} {y:.12g} {z:.12g} {DIAMETER} {mass / volume:.12g} 1")
    lines += ["", "Bonds", ""]
    lines += [f"{k} {kind + 1} {a + 1} {b + 1}" for k, (kind, a, b) in enumerate(belt.bonds, start=1)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def script(belt: Particles, *, dt: float, speed: float, steps: int, contact: bool = True) -> str:
    """LAMMPS commands for ``steps`` steps of ``dt`` [s] at a belt speed [m/s]; contact: with the pulleys."""
    kinds = zip(belt.stiffness, belt.length, strict=True)
    coefficients = [f"bond_coeff {k} {0.5 * s:.12g} {r:.12g}" for k, (s, r) in enumerate(kinds, start=1)]
    return "\n".join(
        [
            "units si\natom_style hybrid sphere bond\nboundary f f f\nnewton off on\ncomm_modify vel yes cutoff 0.3",
            "neighbor 0.01 bin\nneigh_modify delay 0 every 100 check yes\nspecial_bonds lj/coul 1 1 1",
            f"pair_style zero {2 * DIAMETER} nocoeff\nbond_style harmonic\nread_data belt.data\npair_coeff * *",
            *coefficients,
            "fix move all nve\nfix weight all gravity 9.81 vector 0 0 -1",
            f"fix drag all viscous {DRAG * belt.mass.mean():.6g}",
            *(_pulleys(belt, dt, speed) if contact else []),
            f"timestep {dt:.9g}\nthermo {steps}\nthermo_style custom step ke pe",
            f"run {steps}\n",
        ]
    )


def _pulleys(belt: Particles, dt: float, speed: float) -> list[str]:
    """Two open cylinders that turn so that the particles' centres move at ``speed`` on them."""
    rate = speed / (belt.radius + 0.5 * DIAMETER)
    lines = [f'variable turned equal "{-rate:.12g}*step*{dt:.9g}"']
    for name, x in (("head", 0.0), ("tail", belt.centre_distance)):
        place = f"cylinder y {x} 0 {belt.radius:.12g} -0.29 0.29 side out open 1 open 2"
        lines.append(f"region {name} {place} rotate v_turned {x} 0 0 0 1 0")
        law = f"hooke/history {WALL:g} NULL {WALL_DAMPING:g} NULL {FRICTION} 1"
        lines.append(f"fix {name} all wall/gran/region {law} region {name}")
    return lines
