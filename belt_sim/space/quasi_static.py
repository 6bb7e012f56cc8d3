"""engine=quasi_static: the 3D belt as static equilibria, without inertia, which does not matter at a 35th of the string
speed. A step is a length of travel; what a run filters over time is filtered over the travel made in that time."""

import math
from collections.abc import Hashable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.case import Numbers as Array
from belt_sim.curves import Curves
from belt_sim.errors import SimulationError
from belt_sim.jax_setup import StoredProgram
from belt_sim.scene_parts import SceneParts
from belt_sim.space import chain, run, wrap
from belt_sim.space.belt import ActiveFeatures, BeltArrays, belt_arrays, guide_forces, load_forces
from belt_sim.space.elastic import Level, solve_chain
from belt_sim.space.options import COMPLIANCE_TIME, LAYER_TIME, SPAN_TIME, Options, fit_options, refuse_sliding_limp
from belt_sim.space.scene import lay_out
from belt_sim.space.wrap import TAIL


class TravelState(NamedTuple):
    """nodes [m], (m, 3, n); pulleys: head and tail; tension [N]: mean of the spans; travel [m]; correction [m]: by how
    much the step's last Newton iteration moved a node at most; slip: None if it sticks; kinks: of a limp belt;
    compliance_yaw [rad], (2,): yaw by which the pulleys give way, None if they do not."""

    nodes: Array
    pulleys: wrap.BeltOnPulley
    tension: Array
    travel: Array
    correction: Array
    slip: wrap.SlipState | None = None
    kinks: chain.RopeKinks | None = None
    compliance_yaw: Array | None = None


def newton_step(
    belt: BeltArrays, levels: list[Level], cell: Array, on_nodes: Array, at_ends: Array, places: chain.ChainLayout,
    tail: tuple[wrap.WrapArrays, wrap.PoseArrays], moment: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Moves of the free nodes (3 m, n) [m] and of the tail pulley (2,) [m, rad] towards equilibrium, and the belt's
    pull on the tail pulley's slide [N]. By static condensation the free nodes are solved for their own forces and for
    those of a unit of slide and of spin, and two equations are left for the tail pulley.

    levels: the factorised chain; cell [N/m], (6 m, 6 m, n): stiffness of the cells' stretch; on_nodes [N], (3 m, n);
    at_ends [N], (2, 3 m): of ``chain_forces``; tail: its wrap and pose; moment [N m]: of the belt's weight on it.
    """
    on, at = tail
    along, both = jnp.tile(jnp.array([1.0, 0.0, 0.0]), len(on.r)), []  # its outermost stations, by slide and spin
    for outer in (on.first, on.last):
        k = outer % on.r.shape[-1]
        turned, r = on.angle[:, k] + at.spin, on.r[:, k]
        local = jnp.stack([r * jnp.cos(turned), jnp.zeros_like(r), -r * jnp.sin(turned)], axis=1)
        both.append(jnp.stack([along, (local @ at.axes.T).ravel()], axis=1))
    moves = jnp.stack(both)
    pull = jnp.einsum("eip,ei->p", moves, at_ends).at[1].add(moment)
    lacking = pull.at[0].add(belt.load)

    size, (first, last) = len(on_nodes), places.ends[TAIL]
    entry, leave = cell[:, :, first - 1], cell[:, :, last]
    pulls = jnp.zeros((size, 2, on_nodes.shape[-1]))  # forces on the free nodes by slide and spin
    pulls = pulls.at[:, :, first - 1].add(-entry[:size, size:] @ moves[0])
    pulls = pulls.at[:, :, last + 1].add(-leave[size:, :size] @ moves[1])
    wanted = jnp.where(places.free, on_nodes, 0.0)[:, None]
    found = solve_chain(levels, jnp.concatenate([wanted, pulls], axis=1))
    at_ends = [entry[size:, :size] @ found[..., first - 1], leave[:size, size:] @ found[..., last + 1]]
    felt = -jnp.stack(at_ends)  # by the tail's outermost stations: alone, with its slide, with its spin
    own = -jnp.stack([entry[size:, size:] @ moves[0], leave[:size, :size] @ moves[1]])
    lacking = lacking + jnp.einsum("eip,ei->p", moves, felt[..., 0])
    (a, b), (c, d) = jnp.einsum("eip,eiq->pq", moves, felt[..., 1:] + own)
    fixed = belt.slide_fixed
    a, b, force = jnp.where(fixed > 0, 1.0, a), jnp.where(fixed > 0, 0.0, b), jnp.where(fixed > 0, 0.0, lacking[0])
    slid = -jnp.stack([d * force - b * lacking[1], a * lacking[1] - c * force]) / (a * d - b * c)
    return found[:, 0] + jnp.einsum("ipn,p->in", found[:, 1:], slid), slid, pull[0]


def compliance_step(belt: BeltArrays, before: Array, turned: Array, moment: Array, moved: Array) -> Array:
    """Yaw by compliance [rad], (2,), after a step of ``moved`` [m] which began with ``before``; moment [N m]: on
    pulleys that have given way by ``turned`` so far. Implicit, with what both spans take from it, taken rather too
    large."""
    compliance = belt.surfaces.yaw_compliance
    slowly = jnp.where(moved > 0.0, belt.run_speed * COMPLIANCE_TIME / jnp.where(moved > 0.0, moved, 1.0), 0.0)
    lacking = compliance * moment - turned - slowly * (turned - before)
    return turned + lacking / (1.0 + slowly + compliance * belt.yaw_stiffness)


#: After the first a node is where it should be to a tenth of a mm at most; but the entry moment of a slack belt hangs
#: on parts of a nm between its edges, which links that turn by that much have not kept.
NEWTON_ITERATIONS = 2
_YIELDING = 2  # more of them, in which pulleys that give way come to rest with the belt


def find_equilibrium(
    belt: BeltArrays, pulleys: wrap.BeltOnPulley, nodes: Array, places: chain.ChainLayout, state: TravelState,
    command: run.Command, aside: Array | float,
) -> tuple[Array, Array, Array, Array, Array | None]:  # fmt: skip
    """Newton iterations from where the step has led the pulleys and the chain, ``nodes`` [m], (m, 3, n), to nodes; x
    [m] and spin [rad] of the tail pulley; tension [N]; by how much the last one moved a node at most [m]; and the yaw
    [rad], (2,), by which the pulleys give way. aside [m]: by how much held stations stand aside of their anchors."""
    taut, moved = state.nodes[..., places.stations], command.travel - state.travel
    weight = belt.mass[:, None] * belt.gravity

    def iteration(found: tuple[Any, ...], more: Array) -> tuple[tuple[Any, ...], None]:
        nodes, tail, *_, turned = found
        pose = chain.pose_of(belt, command, tail, turned)
        twist = chain.twist_of_cells(belt, pulleys._replace(pose=pose), places, state.tension)
        on_nodes, at_ends = chain.chain_forces(belt, nodes, places, twist, command.share)
        on_nodes = on_nodes.reshape(nodes.shape).at[:, 2].add(-weight)
        on_diagonal = None
        if belt.guides is not None:
            force, stiffness = guide_forces(belt, nodes, places.free)
            on_nodes = on_nodes.at[:, 1].add(force)
            on_diagonal = jnp.zeros_like(nodes).at[:, 1].set(stiffness).reshape(-1, nodes.shape[-1])
        if belt.loads is not None:
            on_nodes = on_nodes + command.share * load_forces(belt, nodes)
        levels, cell = chain.factorise_chain(belt, nodes, taut, places, twist, command.share, on_diagonal)
        arms = jnp.where(places.on_tail, nodes[:, 0] - pose.centre[TAIL, 0], 0.0)
        on_nodes, held = on_nodes.reshape(-1, nodes.shape[-1]), jax.tree.map(lambda v: v[TAIL], (pulleys.wrap, pose))
        tied = at_ends[TAIL], places, held, (weight * arms).sum()
        change, slid, pull = newton_step(belt, levels, cell, on_nodes, *tied)
        nodes, tail = nodes + change.reshape(nodes.shape), tail + slid
        if turned is not None:
            there = jnp.zeros_like(nodes).at[..., places.stations].set(nodes)
            pull_there = chain.pull_on_nodes(belt, there, command.share)
            moment = chain.belt_loads(pulleys._replace(pose=pose), there, pull_there)[:, 2]
            turned = jnp.where(more, compliance_step(belt, state.compliance_yaw, turned, moment, moved), turned)
        pose = chain.pose_of(belt, command, tail, turned)
        anchors = chain.anchor_positions(belt, pulleys._replace(pose=pose), places) + aside
        nodes, tension = jnp.where(places.free, nodes, anchors), -0.5 * pull
        return (nodes, tail, tension, jnp.abs(change).max(), turned), None

    tail = jnp.stack([pulleys.pose.centre[TAIL, 0], pulleys.pose.spin[TAIL]])
    begin = nodes, tail, state.tension, state.correction, state.compliance_yaw
    count = NEWTON_ITERATIONS if state.compliance_yaw is None else NEWTON_ITERATIONS + _YIELDING
    return jax.lax.scan(iteration, begin, jnp.arange(count) < count - 1)[0]


def predict(belt: BeltArrays, nodes: Array, held: Array, places: chain.ChainLayout, chords: Array) -> Array:
    """The chain led on by so many chords: free stations go along their links, held ones where the pulleys take them. A
    span's ends are taken further, which is shared out along the span, linearly, and unless it is limp, as a beam bends
    when they turn in its plane: a link that took it all would be slack or twice as tight."""
    at, link = jnp.arange(nodes.shape[-1]), jnp.roll(nodes, -1, axis=-1) - nodes
    shape, line_y = belt.shape, belt.line_y
    along = nodes + chords * (link if shape.sign > 0 else jnp.roll(link, 1, axis=-1) * -1.0)
    (before_head, after_head), (entry, leaves) = places.ends
    found = held
    for start, end in ((after_head, entry), (leaves, before_head)):
        first, last = (
            held[..., k] - nodes[..., k] - shape.sign * chords * link[..., j]
            for k, j in ((start, start), (end, end - 1))
        )
        s = (at - start) / (end - start)
        if not shape.limp:
            length = (held[..., end] - held[..., start])[:, 0].mean()
            turns = [(v[-1, 0] - v[0, 0]) / (line_y[0] - line_y[-1]) for v in (first, last)]
            turn = turns[0] * (1.0 - 4.0 * s + 3.0 * s**2) + turns[1] * (3.0 * s**2 - 2.0 * s)
            aside = length * (turns[0] * (s - 2.0 * s**2 + s**3) + turns[1] * (s**3 - s**2))
            first, last = (v.at[:, 0].set(v[:, 0].mean()) for v in (first, last))
        moved = along + (1.0 - s) * first[..., None] + s * last[..., None]
        if not shape.limp:
            moved = moved.at[:, 1].add(aside).at[:, 0].add(-line_y[:, None] * turn)
        found = jnp.where((at > start) & (at < end), moved, found)
    return found


def travel_step(belt: BeltArrays, state: TravelState, command: run.Command) -> TravelState:
    """The state after a step."""
    moved, sign = command.travel - state.travel, belt.shape.sign
    shaped = jnp.where(state.travel >= 0.0, 1.0, 0.0)
    spin = state.pulleys.pose.spin[TAIL] + sign * moved / belt.surfaces.radius[TAIL]
    tail = jnp.stack([state.pulleys.pose.centre[TAIL, 0], spin])
    pose = chain.pose_of(belt, command, tail, state.compliance_yaw)
    pulleys = state.pulleys._replace(surface=belt.surfaces, pose=pose)
    pulleys, kinks = chain.hold_run_up_ends(pulleys, state.kinks, sign)
    before = state.pulleys.pose
    rests = (moved == 0.0) & (state.travel >= 0.0)
    pulleys = wrap.sink_wraps(belt, pulleys, before, moved, shaped, rests)
    places = chain.cut_chain(pulleys.wrap)
    taut, chords = state.nodes[..., places.stations], moved / belt.chord
    anchors = chain.anchor_positions(belt, pulleys, places)
    nodes = predict(belt, taut, jnp.where(places.free, taut, anchors), places, chords)
    pulleys = wrap.release_stations(belt, pulleys)
    places = chain.cut_chain(pulleys.wrap, places.stations)
    if pulleys.layer is not None:
        anchors = chain.anchor_positions(belt, pulleys, places)
    aside = 0.0 if kinks is None else chain.end_offsets(belt, pulleys, places, taut, chords, kinks)[0]
    nodes = jnp.where(places.free, nodes, anchors + aside)
    found, tail, tension, correction, turned = find_equilibrium(belt, pulleys, nodes, places, state, command, aside)
    nodes = jnp.zeros_like(nodes).at[..., places.stations].set(found)
    pulleys, slip = pulleys._replace(pose=chain.pose_of(belt, command, tail, turned)), state.slip
    if slip is not None:
        pull = chain.pull_on_nodes(belt, nodes, command.share)
        wraps, slip = jax.vmap(partial(wrap.slide_wrap, belt, pull, belt.friction, 0.0, shaped))(pulleys, slip)
        pulleys = pulleys._replace(wrap=wraps)

    of_span, of_layer = (  # shares by which averages follow
        jnp.where(moved > 0.0, jnp.minimum(moved / (belt.run_speed * time), 1.0), 1.0)
        for time in (SPAN_TIME, LAYER_TIME)
    )
    turn = jax.vmap(partial(wrap.update_tangents, nodes=nodes, share=of_span))
    pulleys = pulleys._replace(wrap=turn(pulleys.wrap, pulleys.pose))
    pulleys = wrap.land_stations(belt, pulleys, (before, state.nodes), nodes, moved, shaped)
    pulleys = wrap.relax_layers(belt, pulleys, nodes, command.share, of_layer)
    return TravelState(nodes, pulleys, tension, command.travel, correction, slip, kinks, turned)


#: columns of a run with friction
FRICTION_COLUMNS = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "friction_residual")
FRICTION_TOLERANCE = 0.01  # of the largest limit: what friction may contradict Coulomb's law by in any step


class TravelCase(NamedTuple):
    """A case ready to be traced, its belt laid; commands, recorded: of ``plan_in_travel``; those of one kind can be run
    at once."""

    case: Case
    belt: BeltArrays
    state: TravelState
    commands: run.Command
    recorded: np.ndarray
    stations: int
    kind: Hashable


def lay_travel_case(
    case: Case, belt: str, travel: float, options: Options, parts: SceneParts, features: ActiveFeatures
) -> TravelCase:
    """The belt of a case laid round its pulleys, to be run over ``travel`` [m]; see BatchEngine."""
    refuse_sliding_limp(belt, options, parts)
    options = fit_options(options, case, belt, "quasi_static")
    scene = lay_out(case, belt, options, parts)
    arrays = belt_arrays(scene, features)
    shape = arrays.shape
    pulleys = chain.lay_pulleys(scene, arrays)
    run_up = pulleys.wrap.outer(chain.run_up_end(shape.sign))
    tension, travelled, correction = (np.array(v) for v in (float(case.tension_force), -scene.early, 0.0))
    state = TravelState(
        np.moveaxis(scene.mesh.laid, 0, -1), pulleys, tension, travelled, correction,
        slip=wrap.SlipState.none(shape.lines, shape.stations) if features.slips else None,
        kinks=chain.RopeKinks(run_up, *np.zeros((2, 2))) if shape.limp else None,
        compliance_yaw=np.zeros(2) if features.gives_way else None,
    )  # fmt: skip
    commands, recorded = run.plan_in_travel(case.settings, options, travel, parts.sets_in)
    sizes = tuple(np.shape(leaf) for leaf in jax.tree.leaves((arrays, state)))
    kind = shape, commands.travel.shape[1], sizes
    return TravelCase(case, arrays, state, commands, recorded, shape.stations, kind)


def run_travel_cases(
    ready: Sequence[TravelCase], chunk: int | None, observers: Sequence[object] = ()
) -> Iterator[list[Curves | SimulationError]]:
    """Curves of cases of one kind, chunk by chunk, which nobody can observe; see BatchEngine."""
    rows = SEGMENT_ROWS * math.ceil(max(len(r.recorded) for r in ready) / SEGMENT_ROWS)
    size = min(chunk or run.cases_per_chunk(ready[0].stations, ready[0].belt.shape.lines), len(ready))
    for begin in range(0, len(ready), size):
        some = ready[begin : begin + size]
        filled = [*some, *[some[-1]] * (size - len(some))]
        trees = []
        for r in filled:  # they stand still up to so many rows as the longest run has
            leaves, structure = jax.tree.flatten(r.commands)
            last = [np.broadcast_to(c[-1:, -1:], (rows - len(c), *c.shape[1:])) for c in leaves]
            padded = [np.concatenate(both) for both in zip(leaves, last, strict=True)]
            trees.append((r.belt, r.state, jax.tree.unflatten(structure, padded)))
        belts, states, commands = jax.tree.map(lambda *v: np.stack(v), *trees)
        structure, segments, found = jax.tree.structure(states), [], list[Curves | SimulationError]()
        for at in range(0, rows, SEGMENT_ROWS):
            now = jax.tree.map(lambda c, at=at: c[:, at : at + SEGMENT_ROWS], commands)
            leaves, table = run_batch(belts, states, now)
            states = jax.tree.unflatten(structure, leaves)
            segments.append(table)
        tables = np.concatenate(segments, axis=1)
        for made, table in zip(some, tables, strict=False):
            recorded, first = made.recorded, int(np.argmax(made.recorded))
            mean = table[: len(recorded)][recorded]
            worst = table[first : len(recorded), 24:].max(axis=1, initial=0.0)  # yaw steps included
            residual = np.maximum.accumulate(worst)[recorded[first:]]
            good = run.is_on_pulleys(mean, float(made.case.belt.width)) & ~(residual > FRICTION_TOLERANCE)
            end = len(mean) if good.all() else int(np.argmin(good))
            extra = {name: 20 + k for k, name in enumerate(FRICTION_COLUMNS[: mean.shape[1] - 20])}
            curves = run.curves_of(mean[:end].T, {"tail_x": run.TAIL_X, "correction": 19} | extra)
            found.append(curves)
            if end == len(mean):
                continue
            why = "the belt ran off its pulleys or its equilibrium was lost {where}: turn the yaw back earlier, "
            why += "shorten travel"
            if residual[end] > FRICTION_TOLERANCE:
                why = f"friction = {float(made.belt.friction):g}: how far nodes slide was not found {{where}}, to "
                most = f"{FRICTION_TOLERANCE:g} is allowed"
                why += f"{residual[end]:.2g} of the largest limit ({most}): raise model.steps"
            found[-1] = run.failure_with(curves, f"{why}, or use engine=native")
        yield found


def run_case(belt: BeltArrays, state: TravelState, commands: run.Command) -> tuple[TravelState, Array]:
    """The state after some rows of one case, and their mean readings, (rows, 20): of ``reading``, travel [m], and by
    how much a node was corrected at most [m]; with friction FRICTION_COLUMNS too, the last at its largest; commands:
    (rows, steps, ...)."""

    def one(state: TravelState, command: run.Command) -> tuple[TravelState, Array]:
        state = travel_step(belt, state, command)
        wraps, tail_x = state.pulleys.wrap, state.pulleys.pose.centre[TAIL, 0]
        read = run.reading(belt, state.nodes, wraps.first, wraps.last, tail_x, command.share)
        columns = [read, jnp.stack([state.travel, state.correction])]
        if (slip := state.slip) is not None:
            columns += [slip.total, slip.sliding, slip.residual.max(keepdims=True)]
        return state, jnp.concatenate(columns)

    def row(state: TravelState, commands: run.Command) -> tuple[TravelState, Array]:
        state, reads = jax.lax.scan(one, state, commands)
        mean, most = reads.mean(axis=0), reads.max(axis=0)
        return state, mean.at[19].set(most[19]).at[24:].set(most[24:])

    return jax.lax.scan(row, state, commands)


SEGMENT_ROWS = 16  # rows of one compiled call, which serves runs of any travel


def _run_cases(belts: BeltArrays, states: TravelState, commands: run.Command) -> tuple[list[Array], Array]:
    """``run_case`` of a batch, every array with a leading axis of cases; the states as their leaves."""
    after, rows = jax.vmap(run_case)(belts, states, commands)
    return jax.tree.leaves(after), rows


run_batch = StoredProgram(_run_cases, "rows of quasi-static cases")
QUASI_STATIC = run.BatchEngine(lay_travel_case, run_travel_cases)
prepare_case, simulate, simulate_batch = QUASI_STATIC.prepare_case, QUASI_STATIC.simulate, QUASI_STATIC.simulate_batch
