"""How stiffly the belt on a pulley resists sliding: its in-plane stiffness, by unit displacements."""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.mujoco_4 import Solver

_PROBE = 1e-6  # [m], a strain of 4e-5 of a link
_IN_PLANE = (1, 0)  # y and x of the upper span: along the axis and along the turn on a pulley
_AROUND = (-1, 0, 1)


@dataclass
class Tangent:
    """Stiffness of a strip of stations [N/m], each with 2 m degrees of freedom: node by node along the axis, the turn.

    block, shape (2, 3, 2 m, 2 m): for a station of even or odd number, what holds the station before it, itself and
    the one after it when it moves; inertia [N/m], shape (2 m,): mass / dt^2 of a free station, which a step of the
    implicit integrator adds to its stiffness; free: stations of a free span, whose far end is held.
    """

    block: np.ndarray
    inertia: np.ndarray
    free: int
    known: dict[tuple[int, int], np.ndarray] = field(default_factory=dict)

    @staticmethod
    def of(mesh: Mesh, loop: Loop, solver: Solver, dt: float) -> "Tangent":
        """Read off in the middle of the upper span, laid and under tension."""
        slides = mesh.laid - mesh.rest
        upper = np.flatnonzero(loop.z > 0.0)
        middle = int(upper[np.argmin(np.abs(loop.x[upper] - loop.x.mean()))])
        size = 2 * mesh.across
        block = np.empty((2, len(_AROUND), size, size))
        for station in (middle, middle + 1):
            seen = [(station + d) % mesh.stations for d in _AROUND]
            for column in range(size):
                place = (station, column // 2, _IN_PLANE[column % 2])
                forces = []
                for shift in (_PROBE, -_PROBE):
                    slides[place] += shift
                    forces.append(solver.elastic_forces(slides)[seen][:, :, list(_IN_PLANE)])
                    slides[place] -= shift
                block[station % 2, :, :, column] = (forces[1] - forces[0]).reshape(len(_AROUND), size) / (2.0 * _PROBE)
        inertia = np.repeat(mesh.mass, 2) / dt**2
        tail_x = loop.x.max() - loop.radius_tail
        inside = np.abs(loop.x[upper] - 0.5 * tail_x) < 0.5 * tail_x
        return Tangent(block=block, inertia=inertia, free=int(np.count_nonzero(inside)))

    def wrap(self, first: int, count: int) -> np.ndarray:
        """Stiffness of stations first..first + count - 1 between two free spans, shape (2 m count, 2 m count)."""
        key = (first % 2, count)
        if key not in self.known:
            self.known[key] = self._assembled(*key)
        return self.known[key]

    def _assembled(self, parity: int, count: int) -> np.ndarray:
        size = self.block.shape[-1]
        whole = np.zeros((count, size, count, size))
        for column in range(count):
            for k, d in enumerate(_AROUND):
                if 0 <= column + d < count:
                    whole[column + d, :, column] += self.block[(parity + column) % 2, k]
        whole[0, :, 0] -= self._relief((parity - 1) % 2, -1)
        whole[-1, :, -1] -= self._relief((parity + count) % 2, 1)
        return whole.reshape(count * size, count * size)

    def _relief(self, parity: int, side: int) -> np.ndarray:
        """What the free span beyond a station takes off its stiffness in a step: condensation of ``free`` stations.

        parity: of the span's station beside it; side: +1 or -1, the span goes on along or against station numbers.
        """
        size = self.block.shape[-1]
        relief = np.zeros((size, size))
        for k in reversed(range(self.free)):
            here = (parity + k) % 2
            own = self.block[here, 1] + np.diag(self.inertia) - relief
            inwards = self.block[here, 1 - side]  # felt by the station nearer to the pulley
            outwards = self.block[1 - here, 1 + side]  # felt here when that one moves
            relief = inwards @ np.linalg.solve(own, outwards)
        return relief
