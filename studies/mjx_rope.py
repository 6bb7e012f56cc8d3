"""A rope on two pulleys as one traceable step: MJX integrates, JAX makes the forces and holds the landed stations.

MJX on JAX has no flex, no discrete integrator and slow tendons, so the links' forces are written here and the steps
are explicit. Two properties of a limp rope make them affordable. Its law does not know EA: the rope is softened until
its tension stretches it by STRAIN. Nor does it know inertia: all forces are divided by the tension, and the mass is
chosen for STRING_SPEED, so that every tension takes the same step; the tension is left in the weight alone.

Landed stations are put where the pulley carries them after every step. They land half a chord before the tangent
points and leave half a chord beyond; the last one stands on the line through the tangent point and the first free
station (a rope has a kink there), and the dashpots of the links do not feel a straight span that turns.
"""

import contextlib
import io
import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax.numpy as jnp
import mujoco
import numpy as np

with contextlib.redirect_stdout(io.StringIO()):  # it says which of its optional parts are not installed
    from mujoco import mjx

from belt_sim.case import Case
from belt_sim.errors import CannotRepresent
from belt_sim.mujoco3d.machine.pace import SLOWNESS
from belt_sim.mujoco3d.mesh.loop import laid_loop

STRAIN = 0.04  # [1] of the softened rope; y_1 after 2 m is within 0.2 % of that at 0.01
STRING_SPEED = 25.0  # spans a second
COURANT = 0.6  # of sqrt(m / k); 1 is the limit of stability
LINK_DAMPING = 0.2  # of a link, over sqrt(k m)
REST_DRAG = 20.0  # [1/s] while the belt stands
SETTLE, YAW_TIME, PAUSE, SPEED_UP = 0.6, 0.3, 0.1, 0.5  # [s]
HEAD, TAIL = 0, 1


@dataclass(frozen=True)
class Rope:
    """The scene: n stations; lengths [m], times [s], forces per unit of tension.

    rest, shape (n, 3): places laid; chord, free_length; stiffness [1/m], mass [s2/m], radius of the stations' circle;
    centres, shape (2, 3): of head and tail pulley; speed [m/s] of the belt; dt.
    """

    model: mjx.Model
    rest: np.ndarray
    chord: float
    free_length: float
    stiffness: float
    mass: float
    radius: float
    centres: np.ndarray
    speed: float
    dt: float

    @staticmethod
    def of(case: Case, dx: float) -> "Rope":
        """The rope of a case, without its sag; raises CannotRepresent for pulleys of unlike radii."""
        rig = case.rig
        if float(rig.head_radius) != float(rig.tail_radius):
            raise CannotRepresent("the MJX rope needs pulleys of one radius: use model=mujoco_rope")
        loop = laid_loop(_weightless(case), dx, path=_on_the_circle)
        rest = np.stack([loop.x, np.zeros_like(loop.x), loop.z], axis=1)
        string_speed = STRING_SPEED * float(rig.span_length)
        free = loop.chord / (1.0 + STRAIN)
        stiffness, mass = 1.0 / (STRAIN * free), loop.chord / string_speed**2
        dt = COURANT * math.sqrt(mass / stiffness)
        centres = np.array([[0.0, 0.0, 0.0], [float(rig.centre_distance), 0.0, 0.0]])
        model = mjx.put_model(_particles(rest, mass, dt))
        return Rope(
            model, rest, loop.chord, free, stiffness, mass, loop.radius_head, centres, string_speed / SLOWNESS, dt
        )


class State(NamedTuple):
    """held, shape (n,): 0 free, 1 head, 2 tail; y [m], angle [rad]: anchors in the spinning pulley; time, travel."""

    data: mjx.Data
    held: jnp.ndarray
    y: jnp.ndarray
    angle: jnp.ndarray
    time: jnp.ndarray
    travel: jnp.ndarray


def _weightless(case: Case) -> Case:
    return replace(case, rig=replace(case.rig, gravity=0.0))


def _on_the_circle(depth: np.ndarray, chord: float, radius: float) -> np.ndarray:
    """No path of touchdown.py: here stations land on the circle."""
    return np.zeros_like(depth)


def _particles(rest: np.ndarray, mass: float, dt: float) -> mujoco.MjModel:
    """Bodies on three slides each, Euler steps, nothing else."""
    spec, off = mujoco.MjSpec(), mujoco.mjtDisableBit
    spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_EULER, dt
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.disableflags = int(off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT | off.mjDSBL_EULERDAMP)
    for place in rest:
        body = spec.worldbody.add_body(pos=place)
        body.mass, body.inertia, body.explicitinertial = mass, [1e-6] * 3, True
        for axis in np.eye(3):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    return spec.compile()


def begin(rope: Rope) -> State:
    """Everything at rest, the stations beyond the axes held."""
    x, z = jnp.array(rope.rest[:, 0]), jnp.array(rope.rest[:, 2])
    held = jnp.where(x >= rope.centres[TAIL, 0], TAIL + 1, jnp.where(x <= 0.0, HEAD + 1, 0))
    angle = jnp.where(held == TAIL + 1, jnp.arctan2(x - rope.centres[TAIL, 0], z), jnp.arctan2(x, z))
    zero = jnp.zeros(())
    return State(mjx.make_data(rope.model), held, jnp.zeros_like(x), angle, zero, zero)


def step(rope: Rope, state: State, weight, yaw) -> State:
    """One step; weight [1/m]: of a metre of belt per unit of tension, yaw [rad] of the tail pulley."""
    n = len(rope.rest)
    time = state.time + rope.dt
    speed = rope.speed * jnp.clip((time - SETTLE - YAW_TIME - PAUSE) / SPEED_UP, 0.0, 1.0)
    travel = state.travel + speed * rope.dt
    turned = yaw * jnp.clip((time - SETTLE) / YAW_TIME, 0.0, 1.0)
    data = state.data.replace(qfrc_applied=_forces(rope, state, weight, speed).ravel())
    data = mjx.step(rope.model, data)
    state = state._replace(time=time, travel=travel)
    place = rope.rest + data.qpos.reshape(n, 3)
    velocity = data.qvel.reshape(n, 3)
    for which, angle in ((HEAD, 0.0), (TAIL, turned)):
        state, place, velocity = _carry(rope, state, place, velocity, which, angle, speed)
    return state._replace(data=data.replace(qpos=(place - rope.rest).ravel(), qvel=velocity.ravel()))


def _forces(rope: Rope, state: State, weight, speed) -> jnp.ndarray:
    """Links (spring and dashpot), weight, and a drag while the belt stands; per unit of tension, shape (n, 3)."""
    n = len(rope.rest)
    place, velocity = rope.rest + state.data.qpos.reshape(n, 3), state.data.qvel.reshape(n, 3)
    link = jnp.roll(place, -1, axis=0) - place
    length = jnp.sqrt((link * link).sum(axis=1, keepdims=True))
    pull = rope.stiffness * (length - rope.free_length) / length * link
    pull += LINK_DAMPING * math.sqrt(rope.stiffness * rope.mass) * (jnp.roll(velocity, -1, axis=0) - velocity)
    drag = jnp.where(speed > 0.0, 0.0, REST_DRAG * rope.mass)
    down = jnp.array([0.0, 0.0, -1.0]) * weight * rope.chord
    return pull - jnp.roll(pull, 1, axis=0) - drag * velocity + down


def _carry(rope: Rope, state: State, place, velocity, which: int, yaw, speed):
    """Let stations land on and leave one pulley, and put the held ones where it carries them."""
    side, centre = (1.0 if which == TAIL else -1.0), rope.centres[which]
    c, s = jnp.cos(yaw), jnp.sin(yaw)
    axes = jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    spin, half = state.travel / rope.radius, 0.5 * rope.chord
    local = (place - centre) @ axes
    # the run-up is at the top of the tail pulley and at the bottom of the head pulley
    before, runs_up = side * (centre[0] - place[:, 0]), side * place[:, 2] > 0.0
    lands = (state.held == 0) & (speed > 0.0) & runs_up & (before < half)
    angle = jnp.where(lands, jnp.arctan2(local[:, 0], local[:, 2]) - spin, state.angle)
    y = jnp.where(lands, local[:, 1], state.y)
    held = jnp.where(lands, which + 1, state.held)
    turned = angle + spin
    carried = _on_circle(rope, turned, y) @ axes.T + centre
    along = jnp.stack([jnp.cos(turned), jnp.zeros_like(turned), -jnp.sin(turned)], axis=1) @ axes.T * speed
    mine = held == which + 1
    place = jnp.where(mine[:, None], carried, place)
    velocity = jnp.where(mine[:, None], along, velocity)
    past = side * (centre[0] - place[:, 0])
    held = jnp.where(mine & ~(side * place[:, 2] > 0.0) & (past > half) & (speed > 0.0), 0, held)
    place = _lead_off(place, held == which + 1, past, carried, turned, which, centre[0], speed)
    return state._replace(held=held, y=y, angle=angle), place, velocity


def _on_circle(rope: Rope, turned, y) -> jnp.ndarray:
    return jnp.stack([rope.radius * jnp.sin(turned), y, rope.radius * jnp.cos(turned)], axis=1)


def _lead_off(place, mine, past, carried, turned, which: int, x, speed) -> jnp.ndarray:
    """Put the last held station on the line through the tangent point and the first free one; shape (n, 3).

    carried: where the pulley would carry every station; y at the tangent point lies between the two around it.
    """
    n = len(mine)
    last = jnp.argmax(mine & ~jnp.roll(mine, -1))
    inner = jnp.where(past[last] > 0.0, (last - 1) % n, last)
    outer, free = (inner + 1) % n, (last + 1) % n
    run_off = math.pi if which == TAIL else 2.0 * math.pi
    here, there = (jnp.mod(turned[k] - run_off + math.pi, 2.0 * math.pi) - math.pi for k in (inner, outer))
    y = carried[inner, 1] - here / (there - here) * (carried[outer, 1] - carried[inner, 1])
    led = y + (place[free, 1] - y) / (place[free, 0] - x) * (place[last, 0] - x)
    return place.at[last, 1].set(jnp.where(speed > 0.0, led, place[last, 1]))


def points(rope: Rope, state: State) -> jnp.ndarray:
    """y of points 1-4 [m], where the belt passes the pulleys' axes; shape (4,)."""
    place = rope.rest + state.data.qpos.reshape(len(rope.rest), 3)
    after, a = jnp.roll(place, -1, axis=0), rope.centres[TAIL, 0]
    found = []
    for x, up in ((a, 1.0), (a, -1.0), (0.0, -1.0), (0.0, 1.0)):
        ahead, beyond = place[:, 0] - x, after[:, 0] - x
        crossing = (ahead * beyond <= 0.0) & (place[:, 2] * up > 0.0) & (ahead != beyond)
        share = ahead / jnp.where(ahead == beyond, 1.0, ahead - beyond)
        y = place[:, 1] + share * (after[:, 1] - place[:, 1])
        found.append(jnp.sum(jnp.where(crossing, y, 0.0)) / jnp.maximum(crossing.sum(), 1))
    return jnp.stack(found)
