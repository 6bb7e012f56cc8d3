"""In-plane stiffness of a wrap between its two spans, as a chain: mujoco3d/wrap/tangent.py, at rest and on arrays."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.belt_mechanics.elastic import Ties, stretched
from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mesh.loop import Loop
from belt_sim.mujoco3d.wrap.tangent import Tangent
from belt_sim.pytree import Numbers as Array


class Grip(NamedTuple):
    """Blocks [N/m] of stations of even and odd number, each (2, 2 m, 2 m): own, of the next station when this one
    moves after; relief_first, relief_last: what the span beyond an outermost station takes off its own block."""

    own: Array
    after: Array
    relief_first: Array
    relief_last: Array


def grip_of(ties: Ties, bonds: bool, mesh: Mesh, loop: Loop) -> Grip:
    """Read off in the middle of the upper span, laid and under tension; spans give way as they do at rest."""
    upper = np.flatnonzero(loop.z > 0.0)
    middle = int(upper[np.argmin(np.abs(loop.x[upper] - loop.x.mean()))])
    tail_x = loop.x.max() - loop.radius_tail
    free = int(np.count_nonzero(np.abs(loop.x[upper] - 0.5 * tail_x) < 0.5 * tail_x))
    numbers = np.arange(middle - 1, middle + 4)
    cell = np.asarray(_curvature(ties, bonds, np.moveaxis(mesh.laid[numbers], 0, -1), numbers))
    size = 3 * mesh.across
    plane = np.arange(size).reshape(-1, 3)[:, [1, 0]].ravel()  # along the axis and along the turn on a pulley
    here, there = np.ix_(plane, plane), np.ix_(plane + size, plane + size)
    down, up = np.ix_(plane + size, plane), np.ix_(plane, plane + size)
    block = np.empty((2, 3, 2 * mesh.across, 2 * mesh.across))
    for k in (1, 2):
        before, behind = cell[..., k - 1], cell[..., k]
        block[numbers[k] % 2] = before[up], before[there] + behind[here], behind[down]
    tangent = Tangent(block=block, inertia=np.zeros(2 * mesh.across), free=free)
    relief = [[tangent._relief((parity + side) % 2, side) for parity in (0, 1)] for side in (-1, 1)]
    return Grip(block[:, 1], block[:, 2], np.array(relief[0]), np.array(relief[1]))


@partial(jax.jit, static_argnums=1)
def _curvature(ties: Ties, bonds: bool, places: Array, numbers: Array) -> Array:
    curvature = stretched(ties, bonds, places, numbers, jnp.array(0.0), taut=places).curvature
    assert curvature is not None
    return curvature


def wrapped(grip: Grip, first: Array, count: Array, longest: int) -> tuple[Array, Array]:
    """The chain of ``count`` stations from number ``first`` on, (2 m, 2 m, longest) twice: diagonal, on the next."""
    at = jnp.arange(longest)
    parity = (first + at) % 2
    own = jnp.asarray(grip.own)[parity]
    own = own.at[0].add(-jnp.asarray(grip.relief_first)[parity[0]])
    own = own.at[count - 1].add(-jnp.asarray(grip.relief_last)[parity[count - 1]])
    beside = jnp.swapaxes(jnp.asarray(grip.after)[parity], 1, 2)
    return jnp.moveaxis(own, 0, -1), jnp.moveaxis(jnp.where((at < count - 1)[:, None, None], beside, 0.0), 0, -1)
