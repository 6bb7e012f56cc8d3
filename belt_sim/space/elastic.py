"""Elastic energy of the belt between two neighbouring stations: membrane or bonds, and the couple of torsion; how
stiffly the stations on a pulley are tied; and the solve of a chain of them.

A cell is stations i and i + 1; between two lines it is a quadrilateral a, b (station i, lines j, j + 1), c, d, whose
energy is a function of its six squared distances: of MuJoCo's flex triangles, or of springs.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Belt
from belt_sim.case import Numbers as Array
from belt_sim.space.options import RESIDUAL_TORSION
from belt_sim.space.scene import EDGES, SIGNS, LaidLoop, Mesh


class Ties(NamedTuple):
    """What ties the nodes of a belt; q = m - 1 strips, k = n stations, or 1 where all are alike.

    law, shape (q, 2, 6, 6): of the membrane, energy = 1/2 e law e [N/m3] with e the change of the squared lengths, for
    i + j even and odd; zero for a grid. spring, shape (q, 6): stiffness of the bonds [N/m]; zero for a membrane.
    length, natural, shape (q, 6, k): stress-free lengths [m] of the straight belt, and what its camber adds to them.
    Of a rope, whose links are all it has, spring and length are of shape (1, 1) and (1, 1, 1).
    """

    law: Array
    spring: Array
    length: Array
    natural: Array


class CellEnergy(NamedTuple):
    """Of cells of m lines: slope (6 m, n) [N] and curvature (6 m, 6 m, n) [N/m] of the energy, by the places of
    station i, then of station i + 1, each node by node x, y, z."""

    slope: Array
    curvature: Array | None

    @property
    def forces(self) -> Array:
        """Forces on the nodes [N], (3 m, n), station by station."""
        size = len(self.slope) // 2
        return -(self.slope[:size] + jnp.roll(self.slope[size:], 1, axis=-1))


def stretch_energy(
    ties: Ties, bonds: bool, places: Array, stations: Array, share: Array, *, taut: Array | None = None
) -> CellEnergy:
    """Of membrane or bonds. places [m], shape (m, 3, n); stations, shape (n,): their numbers; share: of the camber;
    taut [m], like places, if the curvature is wanted: places in equilibrium, whose tension stiffens the belt across.
    """
    lines, _, n = places.shape
    if lines == 1:  # the links of a rope
        apart = jnp.roll(places[0], -1, axis=-1) - places[0]
        stiffness, free, square = ties.spring[0, 0], ties.length[0, 0, 0], (apart * apart).sum(axis=0)
        pull = stiffness * (1.0 - free / jnp.sqrt(square)) * apart
        slope = jnp.concatenate([-pull, pull])
        if taut is None:
            return CellEnergy(slope, None)
        length = jnp.sqrt(((jnp.roll(taut[0], -1, axis=-1) - taut[0]) ** 2).sum(axis=0))
        along = stiffness * free / (square * jnp.sqrt(square)) * apart[:, None] * apart
        bent = along + stiffness * (1.0 - free / length) * np.eye(3)[..., None]
        bent = jnp.concatenate([jnp.concatenate([bent, -bent], 1), jnp.concatenate([-bent, bent], 1)])
        return CellEnergy(slope, bent)

    slope, curvature = jnp.zeros((6 * lines, n)), jnp.zeros((6 * lines, 6 * lines, n)) if taut is not None else None
    for j in range(lines - 1):
        apart = _edge_vectors(places, j)
        free = ties.length[j] + share * ties.natural[j]
        free = free if free.shape[-1] == 1 else free[:, stations]
        odd = (stations + j) % 2 == 1
        by_square, law = _law(ties, j, bonds, (apart * apart).sum(axis=1), free, odd)
        by_corner = SIGNS[:, :, None, None] * (2.0 * apart)[:, None]  # squared lengths by the corners' places
        by_corner = by_corner.reshape(6, 12, n)
        rows = np.concatenate([3 * v + np.arange(3) for v in (j, j + 1, lines + j, lines + j + 1)])
        pull = (by_square[:, None] * by_corner).sum(axis=0)
        slope = slope.at[rows].add(pull) if lines > 2 else pull  # a GPU is slow at scattering
        if curvature is not None and taut is not None:
            tension = _law(ties, j, bonds, (_edge_vectors(taut, j) ** 2).sum(axis=1), free, odd)[0]
            # sums written out: XLA's loops over a leading axis are ten times slower on a CPU
            weighted = sum(law[:, k, None] * by_corner[None, k] for k in range(6))
            material = sum(by_corner[k][:, None] * weighted[k][None] for k in range(6))
            pairs = np.einsum("kp,kq->kpq", SIGNS, SIGNS)
            turning = sum(2.0 * tension[k] * pairs[k][..., None] for k in range(6))  # (4, 4, n)
            bent = material + (turning[:, None, :, None] * np.eye(3)[None, :, None, :, None]).reshape(12, 12, -1)
            curvature = curvature.at[rows[:, None], rows].add(bent) if lines > 2 else bent
    return CellEnergy(slope, curvature)


def strains(ties: Ties, nodes: Array, k: Array, share: Array) -> Array:
    """Mean strain (m,) of the lines over the links between stations k; nodes [m], (m, 3, n); share: of the camber."""
    places = nodes[:, :, k]
    links = places[:, :, 1:] - places[:, :, :-1]
    if len(nodes) == 1:
        free = ties.length[0]
    else:
        natural = ties.length + share * ties.natural
        natural = natural if natural.shape[-1] == 1 else natural[..., k[:-1]]
        free = jnp.concatenate([natural[:, 5], natural[-1:, 1]])
    return (jnp.sqrt((links * links).sum(axis=1)) / free - 1.0).mean(axis=1)


def _edge_vectors(places: Array, j: int) -> Array:
    """The six edges of the quadrilaterals between lines j and j + 1 [m], shape (6, 3, n)."""
    after = jnp.roll(places, -1, axis=-1)
    corners = (places[j], places[j + 1], after[j], after[j + 1])
    return jnp.stack([corners[to] - corners[start] for start, to in EDGES])


def _law(ties: Ties, j: int, bonds: bool, square: Array, free: Array, odd: Array) -> tuple[Array, Array]:
    """First and second derivatives of the energy by the squared lengths, shapes (6, n) and (6, 6, n)."""
    if bonds:
        length = jnp.sqrt(square)
        first = 0.5 * ties.spring[j][:, None] * (1.0 - free / length)
        second = 0.25 * ties.spring[j][:, None] * free / (square * length)
        return first, jnp.eye(6)[:, :, None] * second[:, None]
    law = jnp.where(odd, ties.law[j, 1][:, :, None], ties.law[j, 0][:, :, None])
    return (law * (square - free * free)[None]).sum(axis=1), law


class TwistStiffness(NamedTuple):
    """Couples on the sections of the free spans that lines lack: C phi'', phi the roll of a section.

    The strip has F b^2 / 12 + G b h^3 / 3; lines at y_j with shares w_j of the section have F sum(w_j y_j^2), and C is
    the rest: 8 % (40 N/mm2) to 16 % (7 N/mm2) for two lines. A twist also stretches the edges, by (y phi')^2 / 2. Of
    the strip that is a couple E h b^5 phi'^3 / 360, of lines EA phi'^3 (sum(w_j y_j^4) - sum(w_j y_j^2)^2) / 2, nothing
    for two. strip_tension, line_tension [1/m], strip_torsion [N/m]: b^2 / 12, sum(w_j y_j^2) and G b h^3 / 3, all over
    chord b'^2, b' the outer lines' distance; line_residual [N/m]: of the residual stress, what the lines have by
    themselves, as ``strip_torsion`` has the strip's; cubic [N/m3]: what the lines lack of the couple, as a force on
    them over the cube of what a link of the one rises more than the other.

    A strip does not roll where it meets the pulley. The last landed station is up to half a chord before or behind that
    place, so that the next station rolls too little or too much, and the entry moment of a belt that tilts swings with
    every landing. The couples on that station are those of a link as long as its distance from the right place.
    """

    strip_tension: Array
    line_tension: Array
    strip_torsion: Array
    cubic: Array
    line_residual: Array

    @staticmethod
    def from_belt(belt: Belt, mesh: Mesh) -> "TwistStiffness":
        """Of a belt; zero for a rope."""
        if mesh.lines == 1:
            return TwistStiffness(0.0, 0.0, 0.0, 0.0, 0.0)
        width, thickness = float(belt.width), float(belt.thickness)
        share = mesh.line_stiffness / mesh.line_stiffness.sum()
        apart = float(mesh.line_y[0] - mesh.line_y[-1])
        per = 1.0 / (mesh.chord * apart**2)
        lacking = width**4 / 180.0 - float(share @ mesh.line_y**4) + float(share @ mesh.line_y**2) ** 2
        stiffness = float(belt.youngs_modulus) * float(belt.area)
        stress_free = RESIDUAL_TORSION * stiffness * mesh.residual * width**2 / 12.0
        return TwistStiffness(
            strip_tension=per * width**2 / 12.0,
            line_tension=per * float(share @ mesh.line_y**2),
            strip_torsion=per * (float(belt.shear_modulus) * width * thickness**3 / 3.0 - stress_free),
            cubic=0.5 * stiffness * lacking / (apart * (mesh.chord * apart) ** 3),
            line_residual=per * stiffness * float((share * mesh.line_y**2) @ mesh.residual_strain),
        )


def twist_energy(places: Array, stiffness: Array, cubic: Array) -> CellEnergy:
    """Couples on the sections: energy stiffness d^2 / 2 + cubic d^4 / 4, d by how much more the first line rises
    above the last at station i + 1 than at i [m]. stiffness [N/m], shape (n,); cubic [N/m3]."""
    lines, roll = places.shape[0], places[0, 2] - places[-1, 2]
    by_height = np.zeros(6 * lines)
    by_height[[2, 3 * lines - 1, 3 * lines + 2, 6 * lines - 1]] = -1.0, 1.0, 1.0, -1.0
    more = jnp.roll(roll, -1) - roll
    square = np.outer(by_height, by_height)[..., None]
    slope = by_height[:, None] * (stiffness * more + cubic * more**3)
    return CellEnergy(slope, square * (stiffness + 3.0 * cubic * more**2))


class SlidingStiffness(NamedTuple):
    """Blocks [N/m] of stations of even and odd number, each (2, 2 m, 2 m): own, of the next station when this one
    moves after; relief_first, relief_last: what the span beyond an outermost station takes off its own block."""

    own: Array
    after: Array
    relief_first: Array
    relief_last: Array


def read_sliding_stiffness(
    ties: Ties, bonds: bool, mesh: Mesh, loop: LaidLoop, inertia: np.ndarray | float = 0.0
) -> SlidingStiffness:
    """Read off in the middle of the upper span, laid and under tension.

    inertia [N/m], shape (m,): mass / dt^2 of a node, which a step of an implicit integrator adds to the stiffness of
    the free spans; 0 = they give way as they do at rest.
    """
    upper = np.flatnonzero(loop.z > 0.0)
    middle = int(upper[np.argmin(np.abs(loop.x[upper] - loop.x.mean()))])
    tail_x = loop.x.max() - loop.radius_tail
    free = int(np.count_nonzero(np.abs(loop.x[upper] - 0.5 * tail_x) < 0.5 * tail_x))
    numbers = np.arange(middle - 1, middle + 4)
    laid, curvature = np.moveaxis(mesh.laid[numbers], 0, -1), jax.jit(stretch_energy, static_argnums=1)
    cell = np.asarray(curvature(ties, bonds, laid, numbers, jnp.array(0.0), taut=laid).curvature)
    size = 3 * mesh.lines
    plane = np.arange(size).reshape(-1, 3)[:, [1, 0]].ravel()  # along the axis and along the turn on a pulley
    here, there = np.ix_(plane, plane), np.ix_(plane + size, plane + size)
    down, up = np.ix_(plane + size, plane), np.ix_(plane, plane + size)
    block = np.empty((2, 3, 2 * mesh.lines, 2 * mesh.lines))
    for k in (1, 2):
        before, behind = cell[..., k - 1], cell[..., k]
        block[numbers[k] % 2] = before[up], before[there] + behind[here], behind[down]
    still = np.diag(np.repeat(np.broadcast_to(inertia, (mesh.lines,)), 2))
    relief = np.zeros((2, 2, 2 * mesh.lines, 2 * mesh.lines))
    for (end, side), parity in itertools.product(enumerate((-1, 1)), (0, 1)):
        taken = relief[end, parity]  # static condensation of the free span, from its far end on
        for k in reversed(range(free)):
            own_parity = (parity + side + k) % 2
            own = block[own_parity, 1] + still - taken
            inwards = block[own_parity, 1 - side]  # felt by the station nearer to the pulley
            outwards = block[1 - own_parity, 1 + side]  # felt here when that one moves
            taken[:] = inwards @ np.linalg.solve(own, outwards)
    return SlidingStiffness(block[:, 1], block[:, 2], *relief)


# Block-tridiagonal systems, symmetric and positive definite, by cyclic reduction: log2(n) levels of every other row.
#
# Blocks stand first in every array. The chain is folded into lanes, stretches of it side by side, which stand last:
# every other row of all lanes lies together in memory, and all arithmetic runs along the lanes.

_LANES = 128


class Level(NamedTuple):
    """One level of a factorised chain: of the k rows a lane that it eliminates, inverse (b, b, k, lanes) of the
    diagonal block, and that times the block on the row before and after."""

    inverse: Array
    before: Array
    after: Array


def block_product(one: Array, other: Array) -> Array:
    """Products of blocks (a, b, ...) and (b, c, ...)."""
    found = one[:, 0, None] * other[None, 0]
    for k in range(1, one.shape[1]):  # written out, it is faster than a sum over an axis
        found = found + one[:, k, None] * other[None, k]
    return found


def block_inverse(block: Array) -> Array:
    """Inverses of symmetric positive definite blocks (b, b, ...), halved down to single numbers: by elimination, not
    cofactors, which would lose what is soft beside a stiff link."""
    size = block.shape[0]
    if size == 1:
        return 1.0 / block
    half = size // 2
    one, across, other = block[:half, :half], block[:half, half:], block[half:, half:]
    alone = block_inverse(one)
    carried = block_product(alone, across)
    last = block_inverse(other - block_product(across.swapaxes(0, 1), carried))
    beside = -block_product(carried, last)
    first = alone - block_product(beside, carried.swapaxes(0, 1))
    above, below = jnp.concatenate([first, beside], axis=1), jnp.concatenate([beside.swapaxes(0, 1), last], axis=1)
    return jnp.concatenate([above, below])


def sweep_inverse(block: Array) -> Array:
    """Inverses of positive definite blocks (b, b, k, lanes), by sweeping one row after another: five times slower than
    ``block_inverse``, and exact where entries of a block differ by many powers of ten."""
    for i in range(block.shape[0]):
        here = (np.arange(block.shape[0]) == i)[:, None]
        cross, corner = (v[..., None, None] for v in (here | here.T, here & here.T))
        pivot = 1.0 / block[i, i]
        others = block - block[:, i, None] * (block[None, i] * pivot)
        block = jnp.where(corner, -pivot, jnp.where(cross, block * pivot, others))
    return -block


def _fold(chain: Array, filling: Array | float) -> Array:
    """A chain (b, c, n) in lanes (b, c, length, lanes), one behind the other, filled up at its end; their length is the
    power of 2 that leaves some _LANES lanes."""
    rows = chain.shape[-1]
    length = 2 ** max(round(math.log2(rows / _LANES)), 0) if rows > _LANES else rows
    lanes = math.ceil(rows / length)
    if lanes * length > rows:
        more = jnp.broadcast_to(filling, (*chain.shape[:-1], lanes * length - rows))
        chain = jnp.concatenate([chain, more], axis=-1)
    return chain.reshape(*chain.shape[:-1], lanes, length).swapaxes(-1, -2)


def _shift(values: Array, by: int) -> Array:
    """What stands before each even row, of values at odd ones (b, c, k, lanes): by = 1; behind each odd row, of values
    at even ones: by = -1."""
    if by > 0:
        last = values[..., -1:, :]
        across = jnp.concatenate([jnp.zeros_like(last[..., :1]), last[..., :-1]], axis=-1)
        return jnp.concatenate([across, values[..., :-1, :]], axis=-2)
    first = values[..., :1, :]
    across = jnp.concatenate([first[..., 1:], jnp.zeros_like(first[..., :1])], axis=-1)
    return jnp.concatenate([values[..., 1:, :], across], axis=-2)


def factorise(diagonal: Array, beside: Array, inverse: Callable[[Array], Array] = block_inverse) -> list[Level]:
    """Of a chain with blocks diagonal (b, b, n) and ``beside`` (b, b, n): of row i on unknown i + 1; its last is 0."""
    size = diagonal.shape[0]
    alone = jnp.eye(size)[:, :, None, None]
    diagonal, beside = _fold(diagonal, alone[..., 0]), _fold(beside, 0.0)
    levels: list[Level] = []
    while diagonal.shape[-2:] != (1, 1):
        if diagonal.shape[-2] == 1:  # one row a lane is left: from here on one lane of them all
            diagonal, beside = (v.swapaxes(-1, -2) for v in (diagonal, beside))
        if diagonal.shape[-2] % 2:
            diagonal = jnp.concatenate([diagonal, jnp.broadcast_to(alone, (size, size, 1, 1))], axis=-2)
            beside = jnp.concatenate([beside, jnp.zeros_like(alone)], axis=-2)
        inner, right, left = inverse(diagonal[..., 0::2, :]), beside[..., 0::2, :], _shift(beside[..., 1::2, :], 1)
        after, before = block_product(inner, right), block_product(inner, left.swapaxes(0, 1))
        levels.append(Level(inner, before, after))
        diagonal = diagonal[..., 1::2, :] - block_product(right.swapaxes(0, 1), after)
        diagonal = diagonal - _shift(block_product(left, before), -1)
        beside = -_shift(block_product(left, after), -1)
    inner = inverse(diagonal)
    return [*levels, Level(inner, jnp.zeros_like(inner), jnp.zeros_like(inner))]


def solve_chain(levels: list[Level], wanted: Array) -> Array:
    """Unknowns (b, c, n) for right-hand sides (b, c, n)."""
    rows, kept = wanted.shape[-1], []
    wanted = _fold(wanted, 0.0)
    for level in levels[:-1]:
        if wanted.shape[-2] == 1:
            wanted = wanted.swapaxes(-1, -2)
        if wanted.shape[-2] % 2:
            wanted = jnp.concatenate([wanted, jnp.zeros_like(wanted[..., :1, :])], axis=-2)
        outer = wanted[..., 0::2, :]
        kept.append(block_product(level.inverse, outer))
        back, on = block_product(level.before.swapaxes(0, 1), outer), block_product(level.after.swapaxes(0, 1), outer)
        wanted = wanted[..., 1::2, :] - on - _shift(back, -1)
    found = block_product(levels[-1].inverse, wanted)
    for level, alone in zip(reversed(levels[:-1]), reversed(kept), strict=True):
        count, lanes = alone.shape[-2:]
        if found.shape[-1] != lanes:
            found = found.swapaxes(-1, -2)[..., :lanes]
        found = found[..., :count, :]
        outer = alone - block_product(level.before, _shift(found, 1)) - block_product(level.after, found)
        found = jnp.stack([outer, found], axis=-2).reshape(*outer.shape[:-2], 2 * count, lanes)
    return found.swapaxes(-1, -2).reshape(*found.shape[:2], -1)[..., :rows]
