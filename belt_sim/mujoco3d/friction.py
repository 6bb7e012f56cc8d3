"""Coulomb friction of landed nodes: how far they slide until no node pulls harder than friction allows.

Slip with given limits is Tresca's problem: the increments u that make 1/2 u K u + f u + sum of limit |u_i| least. Its
minimum says what Coulomb's law says at given pressures: a node that slides is held with its limit against its
increment, one that does not slide is held with less. The function is convex; Newton's method on the nodes that slide,
with a line search, and a set of sliding nodes that grows and shrinks as the minimum asks.
"""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.loop import LaidLoop
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.mujoco_interface import Solver

_PROBE = 1e-6  # [m], a strain of 4e-5 of a link
_IN_PLANE = (1, 0)  # y and x of the upper span: along the axis and along the turn on a pulley
_AROUND = (-1, 0, 1)


@dataclass
class WrapStiffness:
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
    def of(mesh: Mesh, loop: LaidLoop, solver: Solver, dt: float) -> "WrapStiffness":
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
        return WrapStiffness(block=block, inertia=inertia, free=int(np.count_nonzero(inside)))

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


_SWEEPS = 40
_ROOT_STEPS = 30
_SETTLED = 1e-3  # of the limits: what is left over slides in the next step
_SHORTEST = 1e-3  # of a Newton step


def slip_increments(force: np.ndarray, limit: np.ndarray, stiffness: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Slip increments [m] of the nodes, shape (nodes, 2).

    force [N], shape (nodes, 2): holding forces if none slid; limit [N], shape (nodes,); stiffness [N/m], shape
    (2 nodes, 2 nodes), positive definite: sliding by u changes the holding forces to force + stiffness @ u; guess [m],
    shape (nodes, 2): where to start.
    """
    nodes = np.arange(len(force))
    blocks = stiffness.reshape(len(nodes), 2, len(nodes), 2)[nodes, :, nodes]
    slip, share = guess.copy(), 1.0
    for _ in range(_SWEEPS):
        held = force + (stiffness @ slip.ravel()).reshape(-1, 2)
        size, pull = np.hypot(slip[:, 0], slip[:, 1]), np.hypot(held[:, 0], held[:, 1])
        moving = size > 0.0
        residual = held[moving] + slip[moving] * (limit[moving] / size[moving])[:, None]
        wrong = max(np.abs(residual).max(initial=0.0), (pull - limit)[~moving].max(initial=0.0))
        if wrong <= _SETTLED * limit.max():
            break
        alone = held - np.einsum("nij,nj->ni", blocks, slip)
        rests = np.hypot(alone[:, 0], alone[:, 1]) <= limit
        changes = np.where(moving, rests | (share < 1.0), pull > limit)
        for k in np.flatnonzero(changes):
            rows = slice(2 * k, 2 * k + 2)
            rest = force[k] + stiffness[rows] @ slip.ravel() - blocks[k] @ slip[k]
            slip[k] = _one_node(rest, float(limit[k]), blocks[k])
        slip, share = _newton(force, limit, stiffness, slip)
    return slip


def _one_node(force: np.ndarray, limit: float, block: np.ndarray) -> np.ndarray:
    """The increment of one node, shape (2,), while the others rest: |force + block u| = limit against u, or 0.

    With block = sum of a_k v_k v_k it has the length r at which sum of (force v_k / (a_k r + limit))^2 = 1.
    """
    if np.hypot(*force) <= limit:
        return np.zeros(2)
    if limit == 0.0:
        return -np.linalg.solve(block, force)
    a, v = np.linalg.eigh(block)
    h, r = v.T @ force, 0.0
    for _ in range(_ROOT_STEPS):
        part = h / (a * r + limit)
        more = (part @ part - 1.0) / (2.0 * part @ (part * a / (a * r + limit)))
        r += more
        if more <= 1e-12 * r:
            break
    return -v @ (h * r / (a * r + limit))


def _newton(force, limit, stiffness, slip) -> tuple[np.ndarray, float]:
    """One step on the nodes that slide, as far as the function falls, and the share of it that was made."""
    size = np.hypot(slip[:, 0], slip[:, 1])
    moving = np.flatnonzero(size > 0.0)
    rows = (2 * moving[:, None] + np.arange(2)).ravel()
    along = slip[moving] / size[moving, None]
    gradient = (force.ravel() + stiffness @ slip.ravel())[rows] + (limit[moving, None] * along).ravel()
    hessian = stiffness[np.ix_(rows, rows)].copy()
    turn = (np.eye(2) - along[:, :, None] * along[:, None, :]) * (limit[moving] / size[moving])[:, None, None]
    k = 2 * np.arange(len(moving))
    for i in range(2):
        for j in range(2):
            hessian[k + i, k + j] += turn[:, i, j]
    step = np.zeros(force.size)
    step[rows] = np.linalg.solve(hessian, -gradient)
    change, slope, share = step.reshape(-1, 2), float(gradient @ step[rows]), 1.0
    curve, linear = float(step @ stiffness @ step), float((force.ravel() + stiffness @ slip.ravel()) @ step)
    while True:
        rubbed = limit @ (np.hypot(*(slip + share * change).T) - size)
        if share * linear + 0.5 * share**2 * curve + rubbed <= 0.1 * share * slope:
            break
        share *= 0.5
        if share <= _SHORTEST:
            return slip, 0.0
    return slip + share * change, share
