"""One step in time of a belt on MJX, implicit in the belt's stiffness.

From (qpos, qvel) to the next:
1. the pulleys' joints from the forces on them (slide and spin of the tail) and from the command (drive, yaw);
2. the anchors of landed stations for the pulleys' new places, as springs of the nodes' joints in MJX's model;
3. a predicted state, q + h v, landed nodes on their anchors, and what MJX computes there;
4. (M/h^2 + D/h + K) dq = f - M (q* - q - h v)/h^2 on the chain of stations, by block cyclic reduction;
5. qacc of that into MJX's data, and MJX's advance;
6. stations land and go.

One Newton iteration is enough; the tension that stiffens the belt across its direction is that of the step's beginning:
that of the predicted state may be slack, and the run then diverges.
"""

import jax.numpy as jnp
from mujoco import mjx

from belt_sim.case import Numbers as Array
from belt_sim.space.belt import guide_forces, load_forces
from belt_sim.space.block_tridiagonal import factorise, solve_chain
from belt_sim.space.chain import (
    ChainLayout,
    anchor_positions,
    chain_forces,
    chain_stiffness,
    cut_chain,
    pull_on_nodes,
    spans_blocks,
    twist_of_cells,
)
from belt_sim.space.loop import smoothstep
from belt_sim.space.machine import HEAD_SPIN, STATION_JOINTS, TAIL_SLIDE, TAIL_SPIN
from belt_sim.space.mjx_interface import advance, apply_actuators, compute_multibody, node_masses, read_sensors
from belt_sim.space.mjx_model import MjxData, MjxModel, flat_of, nodes_of
from belt_sim.space.pulleys import belt_loads, pose_of
from belt_sim.space.run import Command, reading
from belt_sim.space.wrap import HEAD, TAIL, carry_wraps, sink_wraps

_HOLD = 1e13  # [N/m], of the springs that stand for landed nodes in MJX's model: those of the native engine


def step(model: MjxModel, data: MjxData, command: Command) -> MjxData:
    """The data after a step. For jax.jit, jax.vmap (``stack_cases`` gives the axes), jax.lax.scan and jax.grad."""
    m, belt, shape, h = model.mjx, model.belt, model.belt.shape, model.dt
    d = apply_actuators(m, data.mjx)
    q, v = d.qpos, d.qvel
    rest = nodes_of(shape, m.body_pos[m.nbody - shape.stations * shape.lines :].reshape(-1))  # stress-free places
    before = rest + nodes_of(shape, q)
    moves = jnp.stack([q[:STATION_JOINTS], v[:STATION_JOINTS]])
    actuators = d.qfrc_actuator[:STATION_JOINTS]
    driven, tail, turned = model.tail.advance(belt, moves, data.loads, data.compliance_yaw, command, h, actuators)
    spin = shape.sign * command.travel / belt.surfaces.radius[HEAD]
    joints = driven[0].at[TAIL_SLIDE].set(tail[0] - model.tail.x).at[TAIL_SPIN].set(tail[1]).at[HEAD_SPIN].set(spin)
    applied = jnp.zeros_like(q).at[:STATION_JOINTS].set(driven[2])
    askew = smoothstep(d.time / (0.5 * model.settle))  # a wobble sets in while the belt comes to rest
    pose = pose_of(belt, command, tail, turned, askew)
    came_from = data.pulleys.pose
    moved = jnp.abs(pose.spin[HEAD] - came_from.spin[HEAD]) * belt.surfaces.radius[HEAD]
    shaped = jnp.where(data.travel >= 0.0, 1.0, 0.0)
    stands = (command.speed == 0.0) & (command.travel >= 0.0)
    pulleys = data.pulleys._replace(surface=belt.surfaces, pose=pose)
    pulleys = sink_wraps(belt, pulleys, came_from, moved, shaped, stands)
    places = cut_chain(pulleys.wrap)
    twist = twist_of_cells(belt, pulleys, places, jnp.maximum(-0.5 * data.loads[TAIL, 0], 0.0))
    rates = nodes_of(shape, v)
    back = (jnp.arange(shape.stations) - places.stations[0]) % shape.stations  # from the chain to stations' numbers
    anchors, free = anchor_positions(belt, pulleys, places)[..., back], places.free[back]
    predicted = jnp.where(free, before + h * rates, anchors)  # where the belt would go by itself
    drag = jnp.stack([command.drag[0], command.drag[1], command.drag[1]])[None, :, None]
    damping = belt.mass[:, None, None] * jnp.broadcast_to(drag, before.shape)
    nothing = jnp.zeros(STATION_JOINTS)
    m = m.replace(
        qpos_spring=flat_of(nothing, anchors - rest),
        jnt_stiffness=flat_of(nothing, jnp.broadcast_to(jnp.where(free, 0.0, _HOLD), before.shape)),
        dof_damping=flat_of(nothing, damping),
    )
    qvel = flat_of((joints - q[:STATION_JOINTS]) / h, (predicted - before) / h)
    there = d.replace(qpos=flat_of(joints, predicted - rest), qvel=qvel, qfrc_applied=applied)
    there = compute_multibody(m, there)
    after = _implicit(model, command, there, places, twist, (before, rates), damping)[..., back]
    goal = flat_of((joints - q[:STATION_JOINTS]) / h, (after - before) / h)
    d = read_sensors(m, advance(m, there.replace(qpos=q, qvel=v), (goal - v) / h))
    loads = belt_loads(pulleys, after, pull_on_nodes(belt, after, command.share))
    pulleys = carry_wraps(belt, pulleys, (came_from, before), after, moved, shaped, command.share, h)
    tail_x = pose.centre[TAIL, 0]
    read = reading(belt, after, pulleys.wrap.first, pulleys.wrap.last, tail_x, command.share)
    read = jnp.concatenate([read, jnp.stack([tail_x, command.travel, command.speed])])
    return MjxData(d, pulleys, loads, command.travel, turned, read)


def _implicit(
    model: MjxModel,
    command: Command,
    there: mjx.Data,
    places: ChainLayout,
    twist: Array,
    was: tuple[Array, Array],
    damping: Array,
) -> Array:
    """The chain after the step [m], (m, 3, n), from MJX's data at the predicted state.

    was: nodes [m] and their rates [m/s] before the step; damping [N s/m]; all (m, 3, n) by stations' numbers.
    """
    shape, belt, h = model.belt.shape, model.belt, model.dt
    size, m, d = 3 * shape.lines, model.mjx, there

    def on_chain(values: Array) -> Array:
        return values[..., places.stations]

    first = m.nbody - shape.stations * shape.lines
    nodes = on_chain(nodes_of(shape, d.xpos[first:].reshape(-1)))
    before, rates = on_chain(was[0]), on_chain(was[1])
    mass = on_chain(nodes_of(shape, node_masses(m, d)))
    others = on_chain(nodes_of(shape, d.qfrc_passive - d.qfrc_bias + d.qfrc_actuator))
    pull, _ = chain_forces(belt, nodes, places, twist, command.share)
    more = (mass / h**2 + on_chain(damping) / h).reshape(size, -1)
    lacking = pull + (others - mass * (nodes - before - h * rates) / h**2).reshape(size, -1)
    if belt.guides is not None:
        force, stiffness = guide_forces(belt, nodes, places.free)
        lacking, more = lacking.at[1::3].add(force), more.at[1::3].add(stiffness)
    if belt.loads is not None:
        lacking = lacking + command.share * load_forces(belt, before).reshape(lacking.shape)
    _, cell = chain_stiffness(belt, nodes, before, places, twist, command.share)
    levels = factorise(*spans_blocks(cell, places, more))
    change = solve_chain(levels, jnp.where(places.free, lacking, 0.0)[:, None])[:, 0]
    return nodes + change.reshape(nodes.shape)
