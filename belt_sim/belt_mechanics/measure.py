"""What a belt of arrays shows at one instant: the readings of belt_sim.mujoco3d.run.measure."""

import jax.numpy as jnp

from belt_sim.belt_mechanics.belt import Belt, Shape
from belt_sim.belt_mechanics.elastic import strains
from belt_sim.belt_mechanics.wrap import HEAD, TAIL, Wrap
from belt_sim.mujoco3d.constants import AXIS_STATIONS, RUNUP_LINKS
from belt_sim.pytree import Numbers as Array


def reading(shape: Shape, belt: Belt, places: Array, wraps: Wrap, tail_x: Array, share: Array) -> Array:
    """y of points 1-4 [m], angles [rad], entry moments [N m], slack-edge stresses [Pa], tilts [rad], sags [m], tension
    [N]; shape (17,), in the order of run/measure.py. places [m], shape (m, 3, n)."""
    first, last, n = wraps.first, wraps.last, shape.stations
    zero = jnp.zeros_like(tail_x)
    points = ((first[TAIL], tail_x), (last[TAIL], tail_x), (first[HEAD], zero), (last[HEAD], zero))
    found = [_at_axis(shape, belt, places, station, x) for station, x in points]
    runups = (first[TAIL], first[HEAD]) if shape.sign > 0 else (last[HEAD], last[TAIL])
    begins = [s - RUNUP_LINKS - 1 if shape.sign > 0 else s + 1 for s in runups]
    forces = [_section_forces(shape, belt, places, s, share) for s in begins]
    edges = [t / belt.area - 6.0 * jnp.abs(m) / (belt.area * belt.width) for t, m in forces]
    # before the belt has gone round the numbers of the head's wrap lie below the tail's
    lower_head = first[HEAD] + n * jnp.rint((last[TAIL] - first[HEAD]) / n + 0.5).astype(int)
    middles = [((last[HEAD] + first[TAIL]) // 2) % n, ((last[TAIL] + lower_head) // 2) % n]
    across = [places[0, :, k] - places[-1, :, k] for k in middles]
    heights = [places[:, 2, k].mean() for k in middles]
    return jnp.stack(
        [
            *(y for y, _ in found),
            *(shape.sign * slope for _, slope in found),
            *(moment for _, moment in forces),
            *edges,
            *(jnp.arctan2(a[2], a[1]) for a in across),
            belt.level - heights[0],
            -belt.level - heights[1],
            forces[0][0],
        ]
    )


def _at_axis(shape: Shape, belt: Belt, places: Array, station: Array, x: Array) -> tuple[Array, Array]:
    k = (station - AXIS_STATIONS + jnp.arange(2 * AXIS_STATIONS + 1)) % shape.stations
    centre = places[:, :, k].mean(axis=0)
    ahead = centre[0] - x
    crosses = ahead[1:-2] * ahead[2:-1] <= 0.0
    i = 1 + jnp.where(crosses.any(), jnp.argmax(crosses), AXIS_STATIONS - 1)
    share = ahead[i] / (ahead[i] - ahead[i + 1])
    y = centre[1, i] + share * (centre[1, i + 1] - centre[1, i])
    return y, (centre[1, i + 2] - centre[1, i - 1]) / (3.0 * belt.chord)


def _section_forces(shape: Shape, belt: Belt, places: Array, first: Array, share: Array) -> tuple[Array, Array]:
    k = (first + jnp.arange(RUNUP_LINKS + 1)) % shape.stations
    strain = strains(belt.ties, places, k, share)
    if shape.lines == 1:
        return belt.stiffness[0] * strain[0], jnp.zeros(())
    weight = belt.stiffness * belt.line_y
    return belt.stiffness @ strain, -belt.bending * (weight @ strain) / (weight @ belt.line_y)
