"""The pulleys, where they are and how the belt loads them, and the belt as a chain of stations, cut open in the middle
of the head's wrap: what is free, what pulls, how stiffly."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.jax_setup import LEAST_EFFORT, jit_float64
from belt_sim.space import wrap as on_pulley
from belt_sim.space.belt import BeltArrays
from belt_sim.space.elastic import Level, factorise, stretch_energy, twist_energy
from belt_sim.space.options import COMPLIANCE_TIME, FURTHEST_KINK, KINK_STATIONS, TAIL_DAMPING_RATIO
from belt_sim.space.run import Command, reading
from belt_sim.space.scene import HEAD_SPIN, HEAD_YAW, STATION_JOINTS, TAIL_SLIDE, TAIL_SPIN, TAIL_YAW, SceneLayout
from belt_sim.space.wrap import FIRST, HEAD, LAST, OUTWARDS, TAIL, BeltOnPulley, PoseArrays, WrapArrays


def lay_pulleys(scene: SceneLayout, belt: BeltArrays) -> BeltOnPulley:
    """The belt laid round head and tail at rest: on plain cylinders so far, aligned, turned back by what comes before
    travel 0; stations are anchored where their nodes are, at their mean height, then landed or released."""
    mesh, ends = scene.mesh, []
    for laid in (scene.loop.on_head, scene.loop.on_tail):
        on = np.flatnonzero(laid)
        jump = np.flatnonzero(np.diff(on) > 1)  # where the numbers begin anew on the pulley
        ends.append((on[jump[0] + 1] - mesh.stations, on[jump[0]]) if len(jump) else (on[0], on[-1]))
    (first, last), (r, y, angle) = np.array(ends).T, np.zeros((3, 2, mesh.lines, mesh.stations))
    wraps = WrapArrays(first, last, r, y, angle, np.zeros((2, mesh.stations)), np.zeros((2, 2)))
    layer = None if belt.fibres is None else np.zeros((2, 2, mesh.lines, 2))
    turned = -float(np.sign(float(scene.case.settings.direction))) * scene.early / belt.surfaces.radius
    centre = np.array([[0.0, 0.0, 0.0], [float(scene.case.rig.centre_distance), 0.0, 0.0]])
    pose = PoseArrays(centre, np.stack([np.eye(3)] * 2), turned, np.zeros(2))
    pulleys = BeltOnPulley(wraps, belt.surfaces, pose, layer)
    return jax.tree.map(np.asarray, _anchor_laid(belt, pulleys, np.moveaxis(mesh.laid, 0, -1)))


@partial(jit_float64, effort=LEAST_EFFORT)  # runs once a case
def _anchor_laid(belt: BeltArrays, pulleys: BeltOnPulley, nodes: Array) -> BeltOnPulley:
    r, y, angle = jax.vmap(on_pulley.cylinder_coordinates, (None, 0))(nodes, pulleys.pose)
    circle = jax.vmap(on_pulley.radius_at, (0, None, 0))(pulleys.surface, 0.0, y)
    wraps = pulleys.wrap._replace(r=circle + (r - circle).mean(axis=1, keepdims=True), y=y, angle=angle)
    meet = jax.vmap(partial(on_pulley.update_tangents, nodes=nodes, share=1.0))
    pulleys = pulleys._replace(wrap=meet(wraps, pulleys.pose))
    pulleys = on_pulley.land_stations(belt, pulleys, (pulleys.pose, nodes), nodes, 0.0, 0.0)
    return on_pulley.release_stations(belt, pulleys)


def pose_of(
    belt: BeltArrays, command: Command, tail: Array, turned: Array | None = None, askew: Array | float = 1.0
) -> PoseArrays:
    """Where the pulleys are, the tail pulley at x [m] and spin [rad] ``tail``; turned [rad], (2,): yaw by which they
    give way; askew [1]: share of the wobble."""
    rolled = belt.shape.sign * command.travel / belt.surfaces.radius
    yaw = command.yaw if turned is None else command.yaw + turned
    axes = jax.vmap(on_pulley.axes_of, in_axes=(0, 0, None, 0, None))(belt.surfaces, yaw, command.share, rolled, askew)
    centre, spin = jnp.zeros((2, 3)).at[TAIL, 0].set(tail[0]), jnp.stack([rolled[HEAD], tail[1]])
    return PoseArrays(centre, axes, spin, command.share * belt.surfaces.bow)


def belt_loads(pulleys: BeltOnPulley, nodes: Array, pull: Array) -> Array:
    """Force along x [N], moment about the axis and about z [N m] on head and tail, (2, 3), of the pull of belt and
    weight on the nodes."""
    n, found = nodes.shape[-1], []
    for which in (HEAD, TAIL):
        first, last = pulleys.wrap.first[which], pulleys.wrap.last[which]
        held = (np.arange(n) - first) % n <= (last - first) % n
        arms, forces = nodes - pulleys.pose.centre[which, :, None], jnp.where(held, pull, 0.0)
        t = jnp.einsum("mik,mjk->ij", arms, forces)
        moment = jnp.stack([t[1, 2] - t[2, 1], t[2, 0] - t[0, 2], t[0, 1] - t[1, 0]])
        found.append(jnp.stack([forces[:, 0].sum(), moment @ pulleys.pose.axes[which, :, 1], moment[2]]))
    return jnp.stack(found)


def finish_step(
    belt: BeltArrays, pulleys: BeltOnPulley, slips: tuple[Any, Any], before: tuple[PoseArrays, Array], nodes: Array,
    pull: Array, moved: Array, shaped: Array, command: Command, dt: Array,
) -> tuple[BeltOnPulley, Any, Any, Array, Array]:  # fmt: skip
    """After a step in time of ``dt`` [s]: the pulleys, what slid, landed and left; slips; loads of ``belt_loads``; and
    what the instruments read, (20,); slips: of the stations, and the pulley that waited (NEITHER), None if nothing
    slips in a batch; pull: of belt and weight; the others as of ``land_stations``."""
    loads, (slip, waiting) = belt_loads(pulleys, nodes, pull), slips
    if belt.sliding_stiffness is not None:
        # when both belts slide as a whole they take turns, since each reckons with the other standing still
        other = jnp.where(waiting == HEAD, TAIL, HEAD)
        waiting = jnp.where((slip.sliding > 0.5).all(), other, on_pulley.NEITHER)

        def slide(of: tuple[Array, BeltOnPulley, Any]) -> tuple[WrapArrays, Any]:
            which, pulley, own = of
            acting = pull, command.friction, command.speed, shaped
            moves = partial(on_pulley.slide_wrap, belt, *acting, pulley, own)
            return jax.lax.cond(which == waiting, lambda: (pulley.wrap, own), moves)

        wraps, slip = jax.lax.map(slide, (jnp.arange(2), pulleys, slip))
        pulleys = pulleys._replace(wrap=wraps)
    pulleys = on_pulley.carry_wraps(belt, pulleys, before, nodes, moved, shaped, command.share, dt)
    wraps, tail_x = pulleys.wrap, pulleys.pose.centre[TAIL, 0]
    read = reading(belt, nodes, wraps.first, wraps.last, tail_x, command.share)
    return pulleys, slip, waiting, loads, jnp.concatenate([read, jnp.stack([command.travel, command.speed])])


class TailPulley(NamedTuple):
    """The tail pulley: mass [kg] on its slide, inertia [kg m2] about its axis, drags [N s/m], [N m s] on deviations
    from steady motion, radius [m], x [m] of its slide's zero."""

    mass: Array
    inertia: Array
    slide_drag: Array
    spin_drag: Array
    radius: Array
    x: Array

    @staticmethod
    def from_scene(scene: SceneLayout, model: mujoco.MjModel, masses: np.ndarray, armature: np.ndarray) -> "TailPulley":
        """With the inertia that the compiled pulleys have; masses [kg]: of the bodies; armature: of the joints."""
        bodies = [model.body(f"tail-{name}").id for name in ("carriage", "fork", "pulley")]
        mass, radius = float(masses[bodies].sum()), scene.parts.tail.radius
        stiffness = 2.0 * scene.mesh.line_stiffness.sum() / float(scene.case.rig.span_length)
        drag = 2.0 * TAIL_DAMPING_RATIO * (stiffness * mass) ** 0.5
        inertia = float(armature[TAIL_SPIN] + model.body_inertia[bodies[-1], 1])
        return TailPulley(mass, inertia, drag, drag * radius**2, radius, float(scene.case.rig.centre_distance))

    def advance(
        self, belt: BeltArrays, joints: Array, loads: Array, turned: Array | None, command: Command, dt: Array,
        actuators: Array | float = 0.0,
    ) -> tuple[Array, Array, Array | None]:  # fmt: skip
        """Joints [rad, m] of both pulleys, their rates and forces on them [N m, N] in the coming step, (3, 5); x [m]
        and spin [rad] of the tail pulley at its end; yaw [rad] by which the pulleys then give way, None = they do not.

        joints, (2, 5): and rates, before; loads: of ``belt_loads``; turned: yaw by which they have given way;
        actuators: forces that act besides, (5,). Slide and spin of the tail are integrated; the rest is commanded, and
        the rate of a commanded joint is set instead.
        """
        q, v = joints
        if turned is not None:  # it follows the belt's moment on a pulley
            turned += (belt.surfaces.yaw_compliance * loads[:, 2] - turned) * jnp.minimum(dt / COMPLIANCE_TIME, 1.0)
        yaw = command.yaw if turned is None else command.yaw + turned
        loose, sign = 1.0 - belt.slide_fixed, belt.shape.sign
        rim = sign * (command.speed - command.acceleration * dt)  # it is to go steadily with the belt
        slide = loose * (belt.load + loads[TAIL, 0] - self.slide_drag * v[TAIL_SLIDE])
        moment = loads[TAIL, 1] + self.inertia * sign * command.acceleration / self.radius
        moment = moment - self.spin_drag * (v[TAIL_SPIN] - rim / self.radius)
        on_joints = actuators + jnp.zeros(STATION_JOINTS).at[TAIL_SLIDE].set(slide).at[TAIL_SPIN].set(moment)
        sliding = loose * v[TAIL_SLIDE]
        spin = sign * command.travel / belt.surfaces.radius[HEAD]
        rates = jnp.zeros(STATION_JOINTS).at[HEAD_SPIN].set((spin - q[HEAD_SPIN]) / dt)
        rates = rates.at[TAIL_SLIDE].set(sliding).at[TAIL_SPIN].set(v[TAIL_SPIN])
        x = self.x + q[TAIL_SLIDE] + dt * (sliding + loose * dt * on_joints[TAIL_SLIDE] / self.mass)
        turns = q[TAIL_SPIN] + dt * (v[TAIL_SPIN] + dt * on_joints[TAIL_SPIN] / self.inertia)
        q = q.at[HEAD_YAW].set(yaw[HEAD]).at[TAIL_YAW].set(yaw[TAIL])
        return jnp.stack([q, rates, on_joints]), jnp.stack([x, turns]), turned


class ChainLayout(NamedTuple):
    """Of the chain: numbers of its stations (n,), which of them are free and which lie on the tail pulley (n,), and
    the places of the outermost stations held, by pulley and end (2, 2)."""

    stations: Array
    free: Array
    on_tail: Array
    ends: Array


def cut_chain(wraps: WrapArrays, stations: Array | None = None) -> ChainLayout:
    """The loop, cut in the middle of the head's wrap, or there where ``stations`` begin, as the wraps part it."""
    at = jnp.arange(wraps.r.shape[-1])
    if stations is None:
        stations = ((wraps.first[HEAD] + wraps.last[HEAD]) // 2 + at) % len(at)
    ends = jnp.stack([wraps.first - stations[0], wraps.last - stations[0]], axis=1) % len(at)
    (before_head, after_head), (entry, leaves) = ends
    free = ((at > after_head) & (at < entry)) | ((at > leaves) & (at < before_head))
    return ChainLayout(stations, free, (at >= entry) & (at <= leaves), ends)


def anchor_positions(belt: BeltArrays, pulleys: BeltOnPulley, places: ChainLayout) -> Array:
    """Where the chain's stations are held by the pulley that holds them [m], (m, 3, n); of free ones it says nothing.
    Reckoned once a station and not for both pulleys: sines are what a step is slow at."""

    def by_pulley(values: Array) -> Array:
        return jnp.where(places.on_tail, values[TAIL], values[HEAD])

    wraps, pose = pulleys.wrap, pulleys.pose
    r, y, angle = (by_pulley(v[..., places.stations]) for v in (wraps.r, wraps.y, wraps.angle))
    turned, axes = angle + by_pulley(pose.spin[:, None]), by_pulley(pose.axes[..., None])
    found = on_pulley.anchor_places(r, y, turned, axes, by_pulley(pose.centre[..., None]), by_pulley(pose.bow[:, None]))
    if pulleys.layer is not None:  # it displaces the stations at the ends of a wrap
        middle = wraps.angle[..., places.stations].mean(axis=1)
        for end in (FIRST, LAST):
            inside = jax.vmap(partial(on_pulley.depth, end=end))(pulleys, middle)
            move = partial(on_pulley.station_displacement, belt, end=end)
            found = found + by_pulley(jax.vmap(move)(pulleys, inside))
    return found


def chain_forces(
    belt: BeltArrays, nodes: Array, places: ChainLayout, twist: Array, share: Array
) -> tuple[Array, Array]:
    """Elastic forces on all nodes of the chain [N], (3 m, n), and those of the spans' stretch on the outermost stations
    held, by pulley and end (2, 2, 3 m); twist: of ``twist_of_cells``."""
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, places.stations, share)
    on_nodes, size = cell.forces, 3 * len(nodes)
    if len(nodes) > 1:
        on_nodes += twist_energy(nodes, twist, belt.twist.cubic).forces
    first, last = cell.slope[size:, places.ends[:, FIRST] - 1], cell.slope[:size, places.ends[:, LAST]]
    return on_nodes, -jnp.stack([first, last]).transpose(2, 0, 1)


def factorise_chain(
    belt: BeltArrays, nodes: Array, taut: Array, places: ChainLayout, twist: Array, share: Array, more: Array | None
) -> tuple[list[Level], Array]:
    """The chain's stiffness at ``nodes`` [m], factorised, held stations as unit blocks; and the curvature of the cells'
    energy of stretch [N/m], (6 m, 6 m, n); taut [m]: places whose tension stiffens the belt across its direction; more
    [N/m], (3 m, n): what is added on the diagonal."""
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, places.stations, share, taut=taut).curvature
    assert cell is not None
    whole = cell if len(nodes) == 1 else cell + twist_energy(nodes, twist, belt.twist.cubic).curvature
    size, free = len(cell) // 2, places.free
    diagonal, unit = whole[:size, :size] + jnp.roll(whole[size:, size:], 1, axis=-1), np.eye(size)[:, :, None]
    if more is not None:
        diagonal = diagonal + unit * more[:, None]
    beside = jnp.where(free & jnp.roll(free, -1), whole[:size, size:], 0.0)
    return factorise(jnp.where(free, diagonal, unit), beside), cell


def pull_on_nodes(belt: BeltArrays, nodes: Array, share: Array) -> Array:
    """Forces of belt and weight [N] on nodes at ``nodes`` [m], both (m, 3, n) by stations' numbers."""
    cell = stretch_energy(belt.ties, belt.shape.bonds, nodes, jnp.arange(nodes.shape[-1]), share)
    weight = (belt.mass * belt.gravity)[:, None, None] * np.array([[0.0], [0.0], [1.0]])
    return cell.forces.reshape(nodes.shape) - weight


def twist_of_cells(belt: BeltArrays, pulleys: BeltOnPulley, places: ChainLayout, tension: Array) -> Array:
    """Stiffness of the couples on the sections of the chain [N/m], (n,), a cell being a station and the next, at a
    tension [N]; see TwistStiffness."""
    twist, chord, cells = belt.twist, belt.chord, len(places.stations)
    whole = tension * twist.strip_tension + twist.strip_torsion
    stiffness = jnp.full(cells, whole - tension * twist.line_tension - twist.line_residual)
    for end in (FIRST, LAST):  # a link as long as its distance from the place where the belt meets the pulley
        behind = jnp.clip(jax.vmap(partial(on_pulley.outer_depth, end=end))(pulleys), -0.5 * chord, 0.5 * chord)
        seems = whole * (chord / (chord - behind) - 1.0)
        stiffness = stiffness.at[(places.ends[:, end] - 1 + end) % cells].add(seems)
    return stiffness


# How a belt without bending stiffness meets and leaves a pulley between two stations, and what damps its sway.
#
# Where such a belt runs off it has a kink, from the direction of the stations that lie on the pulley to that of the
# span. If the span simply began at the last station held, each release would let its beginning jump by kink x chord
# (10-18 um at 25 mm and a yaw of 0.042 deg). The spans of a limp belt ring with these jumps, and as the stations land
# in step with them, each landing catches the same phase: the rate of drift comes out wrong by as much as a fifth. So
# the span of a limp belt begins at the tangent point: the last station held stands on the straight line through the
# tangent point and the first free station.
#
# At the run-up a yaw step makes such a kink. The belt on the pulley turns with it, and the span goes on from the
# tangent point, which does not move. The outermost station held is up to half a chord before or behind that point and
# the pulley would take it aside by yaw x this distance, and the span with it (15 um at 40 mm), for a span length of
# travel. Before the tangent point a station belongs to the span and is not taken along; behind it, it is, but the
# span's line goes through the tangent point until the next station lands.
#
# Belts with bending stiffness have no kink and need none of this.


def run_up_end(sign: int) -> int:
    """The end of a wrap at which a belt comes that travels along (+1) or against (-1) station numbers; of -sign: the
    one at which it leaves."""
    return FIRST if sign > 0 else LAST


class RopeKinks(NamedTuple):
    """At the run-up of a pulley: station, the number of the one that met the pulley last; yaw [rad]; offset [m]: how
    far the pulley would have taken the span's line since that station landed."""

    station: Array
    yaw: Array
    offset: Array


def hold_run_up_ends(
    pulleys: BeltOnPulley, kinks: RopeKinks | None, sign: int
) -> tuple[BeltOnPulley, RopeKinks | None]:
    """Before a step: a limp span's end stays at the tangent point while the pulley at its run-up is yawed."""
    if kinks is None:
        return pulleys, None
    end = run_up_end(sign)

    def hold(pulley: BeltOnPulley, kink: RopeKinks) -> tuple[WrapArrays, RopeKinks]:
        wrap, pose = pulley.wrap, pulley.pose
        outer, yaw = wrap.outer(end), jnp.arctan2(-pose.axes[0, 1], pose.axes[1, 1])
        inside = on_pulley.outer_depth(pulley, end)
        ahead = -OUTWARDS[end] * inside * jnp.cos(wrap.tangent[end])  # along x
        taken = (yaw - kink.yaw) * ahead
        offset = jnp.where(outer == kink.station, kink.offset, 0.0) + jnp.where(inside < 0.0, 0.0, taken)
        k = outer % wrap.y.shape[-1]
        wrap = wrap._replace(y=wrap.y.at[:, k].add(jnp.where(inside < 0.0, -taken, 0.0)))
        return wrap, RopeKinks(outer, yaw, offset)

    wraps, kinks = jax.vmap(hold)(pulleys, kinks)
    return pulleys._replace(wrap=wraps), kinks


def run_off_line(
    wrap: WrapArrays, pose: PoseArrays, sign: int, free: Array, far: Array, chord: Array
) -> tuple[Array, Array]:
    """How far the last nodes held stand aside of their anchors [m], and the slope of y there against the travel, (m,).

    free [m], (m, 3): first free nodes; far [m], (m, 3): nodes further along the span, to which it runs straight.
    """
    n = wrap.y.shape[-1]
    last = wrap.outer(run_up_end(-sign))
    k, landed = last % n, (last - sign) % n
    r, y, angle = wrap.r[:, k], wrap.y[:, k], wrap.angle[:, k]
    slope = (wrap.y[:, landed] - y) / chord
    r_far, _, angle_far = on_pulley.cylinder_coordinates(far, pose)
    ahead = r_far * jnp.sin(sign * (angle_far - angle))
    beyond = r * jnp.arctan2(r_far * jnp.cos(angle_far - angle) - r, ahead)
    beyond = jnp.clip(beyond, -FURTHEST_KINK * chord, FURTHEST_KINK * chord)  # of the tangent point
    tangent, y_free = y + slope * beyond, on_pulley.cylinder_coordinates(free, pose)[1]
    return tangent + (y_free - tangent) * beyond / (beyond + chord) - y, slope


def end_offsets(
    belt: BeltArrays, pulleys: BeltOnPulley, places: ChainLayout, taut: Array, moved: Array | float, kinks: RopeKinks
) -> tuple[Array, Array]:
    """By how much held stations of the chain of a limp belt stand aside of their anchors [m], shape (m, 3, n), and the
    slopes of y against the travel at the run-offs of head and tail, (2, m).

    taut [m], (m, 3, n): the chain in its last equilibrium; moved [1]: chords that it has been led on since.
    """
    sign, found, slopes = belt.shape.sign, jnp.zeros_like(taut), []
    for which in (HEAD, TAIL):
        pulley, kink = jax.tree.map(lambda values, which=which: values[which], (pulleys, kinks))
        wrap, pose = pulley.wrap, pulley.pose
        last, first = places.ends[which, run_up_end(-sign)], places.ends[which, run_up_end(sign)]
        free, next_free, far = (taut[..., last + i * sign] for i in (1, 2, KINK_STATIONS))
        move, slope = run_off_line(wrap, pose, sign, free + moved * (next_free - free), far, belt.chord)
        found = found.at[..., last].add(move[:, None] * pose.axes[:, 1])
        found = found.at[..., first].add(-kink.offset * pose.axes[:, 1])
        slopes.append(slope)
    return found, jnp.stack(slopes)


def sway_drag(
    belt: BeltArrays, places: ChainLayout, y: Array, slopes: Array, landed: Array, speed: Array, damping: Array
) -> Array:
    """What is added to the drag of a limp belt's slides across the travel, (m, n) [N], so that it acts on waves only:
    drag times the sideways speed of a straight span, which is linear between its ends: at the tangent point (theta its
    direction) v (theta + slope), at the run-up the pulley's.

    y [m], landed [m/s], (m, n): of the chain, of its held stations; slopes: of ``end_offsets``; damping [1/s].
    """
    sign, n, forces = belt.shape.sign, y.shape[-1], jnp.zeros_like(y)
    for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
        first, last = places.ends[begins, run_up_end(-sign)], places.ends[ends, run_up_end(sign)]
        links, link = sign * (last - first) % n, sign * (jnp.arange(n) - first) % n
        theta = (y[:, last] - y[:, (first + sign) % n]) / (belt.chord * (links - 1))
        at_run_off = speed * (theta + slopes[begins])
        speeds = at_run_off[:, None] + (landed[:, last] - at_run_off)[:, None] * link / links
        forces += jnp.where((link > 0) & (link < links), damping * belt.mass[:, None] * speeds, 0.0)
    return jnp.where(speed == 0.0, 0.0, forces)
