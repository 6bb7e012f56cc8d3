"""A case as arrays, of which the mechanics is written: read off the same scene that is compiled for MuJoCo; and the
forces on the nodes beside the belt's own: edge guides, loads at a place or all along."""

import math
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, pytree
from belt_sim.case import Numbers as Array
from belt_sim.scene_parts import SceneParts
from belt_sim.space.elastic import SlidingStiffness, Ties, TwistStiffness, read_sliding_stiffness
from belt_sim.space.options import is_limp
from belt_sim.space.scene import Mesh, SceneLayout, calibrate, membrane_law, sink_chords


class ActiveFeatures(NamedTuple):
    """In some case of a batch: slips, it may slide on its pulleys; guides, number of rollers; gives_way, a pulley does
    so to the belt's moment; layered, it leaves its pulleys along a bending layer; cambered, it is curved by nature;
    pushes, number of places at which its spans are pushed; leans, its weight or a couple all along pulls it aside;
    canted, an axis is not level."""

    slips: bool = False
    guides: int = 0
    gives_way: bool = False
    layered: bool = False
    cambered: bool = False
    pushes: int = 0
    leans: bool = False
    canted: bool = False


def active_features(parts: Sequence[SceneParts]) -> ActiveFeatures:
    """What acts in any of these scenes."""
    return ActiveFeatures(
        slips=any(math.isfinite(p.friction) for p in parts),
        guides=max(len(p.edge_guides) for p in parts),
        gives_way=any(s.yaw_compliance for p in parts for s in (p.head, p.tail)),
        layered=any(p.lift_off for p in parts),
        cambered=any(p.camber is not None for p in parts),
        pushes=max(len(p.pushes) for p in parts),
        leans=any(p.lean or p.roll or p.roll_lower for p in parts),
        canted=any(s.cant for p in parts for s in (p.head, p.tail)),
    )


class LayerFibres(NamedTuple):
    """plate [N m]: D of a fibre, per width; thickness [m]; modulus [Pa]; tension_share [1]: share of the torsional
    stiffness that is the fibres' tension, the rest resists that they lift off apart, 0 = like a thread; residual [1],
    shape (m,): strain of the lines by residual stress, which the layer does not count."""

    plate: Array
    thickness: Array
    modulus: Array
    tension_share: Array
    residual: Array

    @staticmethod
    def from_mesh(case: Case, mesh: Mesh, twist: TwistStiffness, strength: float) -> "LayerFibres":
        """Of a belt; strength [1] multiplies l^2 and l^3."""
        belt, tense = case.belt, float(case.tension_force) * twist.strip_tension
        share = strength * tense / (tense + twist.strip_torsion)
        return LayerFibres(belt.plate_stiffness, belt.thickness, belt.youngs_modulus, share, mesh.residual_strain)


_SPARE = 6  # stations by which a wrap may be longer than half a turn


class BatchShape(NamedTuple):
    """What the cases of a batch share: stations, lines, kind of ties, direction of travel, stations that may be off
    the circle at an end of a wrap, stations that a pulley holds at most (0 if no belt of the batch slips), whether the
    spans resist no bending, whether an axis is not level."""

    stations: int
    lines: int
    bonds: bool
    sign: int
    zone: int
    longest_wrap: int = 0
    limp: bool = False
    canted: bool = False


class SurfaceArrays(NamedTuple):
    """Both pulleys, every field of shape (2,): head, tail. radius [m]; extra [m]: how much wider the stations' circle
    is; sink_chords: chords along which a station sinks; the others as in belt_sim.scene_parts.PulleySurface."""

    radius: Array
    extra: Array
    sink_chords: Array
    taper: Array
    crown: Array
    wobble: Array
    wobble_phase: Array
    bow: Array
    cant: Array
    yaw_offset: Array
    yaw_compliance: Array


#: Rollers, every field of shape (g,): height, +1 beside the upper span, -1 beside the lower; the others as in
#: belt_sim.scene_parts.GuideRoller. One that pushes nothing is all 0.
GuideArrays = namedtuple("GuideArrays", "height x gap side stiffness")
#: At places of the spans, every field of shape (p,): height as above; x [m], along, across [N], couple [N m] as in
#: belt_sim.scene_parts.Push. All along: lean [m/s2], pull of the weight towards +y; roll, roll_lower [N], couple per
#: metre about +x on what is above and below the axes.
LoadArrays = namedtuple("LoadArrays", "height x along across couple lean roll roll_lower")


@pytree
@dataclass(frozen=True, kw_only=True)
class BeltArrays:
    """The numbers of one case, and the shape that it shares with others of a batch.

    chord [m]: of the straight belt at rest; mass [kg], stiffness [N] (EA), line_y [m], shape (m,): of the lines;
    gravity [m/s2]; load [N]: on the tail pulley's slide; slide_fixed [1]: 1 where the slide is fixed instead, else 0;
    run_speed [m/s]; level [m]: of the spans' ends above the axes; friction [1], inf = it sticks;
    area [m2], width [m], bending [N m2]; yaw_stiffness [N m/rad]: how stiffly both spans hold a pulley against turning,
    rather too large; sliding_stiffness, guides, fibres, loads: None where none of them acts in a batch.
    """

    ties: Ties
    twist: TwistStiffness
    surfaces: SurfaceArrays
    chord: Array
    mass: Array
    stiffness: Array
    line_y: Array
    gravity: Array
    load: Array
    slide_fixed: Array
    run_speed: Array
    level: Array
    friction: Array
    area: Array
    width: Array
    bending: Array
    yaw_stiffness: Array
    sliding_stiffness: SlidingStiffness | None = None
    guides: GuideArrays | None = None
    fibres: LayerFibres | None = None
    loads: LoadArrays | None = None
    shape: BatchShape = field(metadata={"static": True})


def belt_arrays(scene: SceneLayout, features: ActiveFeatures, inertia: np.ndarray | float = 0.0) -> BeltArrays:
    """The arrays of a scene; its options are fitted to its case; inertia: as of ``read_sliding_stiffness``."""
    case, mesh, options, parts = scene.case, scene.mesh, scene.options, scene.parts
    twist = TwistStiffness.from_belt(case.belt, mesh)
    both = parts.head, parts.tail
    radius, *same = (np.array([getattr(s, f) for s in both], float) for f in ("radius", *SurfaceArrays._fields[3:]))
    wider = np.array([scene.loop.radius_head, scene.loop.radius_tail]) - radius
    surfaces = SurfaceArrays(radius, wider, np.array([float(sink_chords(mesh.chord, r)) for r in radius]), *same)
    longest = math.ceil(math.pi * float(surfaces.radius.max()) / mesh.chord) + _SPARE if features.slips else 0
    shape = BatchShape(
        mesh.stations, mesh.lines, bonds=scene.kind != "flex", sign=int(np.sign(float(case.settings.direction))),
        zone=int(surfaces.sink_chords.max()) + 2, longest_wrap=longest, limp=is_limp(scene.kind, options),
        canted=features.canted,
    )  # fmt: skip
    ties, belt, guides, loads = _ties(scene), case.belt, None, None
    if features.cambered:
        ties = ties._replace(natural=np.broadcast_to(ties.natural, (*ties.natural.shape[:2], mesh.stations)))
    on_spans = []  # height and fields of what acts on spans, (fields + 1, count); what there is less of is all 0
    for acting, fields, count in (
        (parts.edge_guides, GuideArrays._fields[1:], features.guides),
        (parts.pushes, LoadArrays._fields[1:5], features.pushes),
    ):
        rows = [(1.0 if a.span == "upper" else -1.0, *(getattr(a, f) for f in fields)) for a in acting[:count]]
        rows += [(0.0,) * (len(fields) + 1)] * (count - len(rows))
        on_spans.append(np.array(rows).reshape(count, len(fields) + 1).T)
    if features.guides:
        guides = GuideArrays(*on_spans[0])
    if features.pushes or features.leans:
        loads = LoadArrays(*(*on_spans[1], parts.lean * parts.gravity, parts.roll, parts.roll_lower))
    slides = read_sliding_stiffness(ties, shape.bonds, mesh, scene.loop, inertia) if features.slips else None
    arrays = BeltArrays(
        ties=ties, twist=twist, surfaces=surfaces, chord=mesh.chord, mass=mesh.mass, stiffness=mesh.line_stiffness,
        line_y=mesh.line_y, gravity=parts.gravity, load=2.0 * float(case.tension_force),
        slide_fixed=float(options.tensioning == "length"), run_speed=options.run_speed, level=scene.loop.radius_head,
        friction=parts.friction, area=belt.area, width=belt.width, bending=belt.bending_stiffness,
        yaw_stiffness=8.0 * float(belt.bending_stiffness / case.rig.span_length), sliding_stiffness=slides,
        guides=guides, loads=loads, shape=shape,
        fibres=LayerFibres.from_mesh(case, mesh, twist, parts.lift_off) if features.layered else None,
    )  # fmt: skip
    return jax.tree.map(lambda v: np.asarray(v, float), arrays)


def _ties(scene: SceneLayout) -> Ties:
    """Six edges a quadrilateral, in the order of EDGES; a bond is counted once. A rope has its links alone."""
    case, mesh = scene.case, scene.mesh
    strips, chord = mesh.lines - 1, mesh.chord
    if scene.kind == "rope":
        link = np.full((1, 1, 1), chord)
        return Ties(np.zeros((1, 1)), mesh.line_stiffness[:, None] / chord, link, np.zeros_like(link))
    w = -np.diff(mesh.line_y)

    def edge_lengths(strain: np.ndarray) -> np.ndarray:
        """Stress-free lengths [m], (m - 1, 6, k), of trapezoids whose lines are shorter by ``strain``, (m, k)."""
        along = chord * (1.0 - strain)
        across = np.broadcast_to(w[:, None], along[1:].shape)
        diagonal = np.sqrt(across**2 + along[1:] * along[:-1])
        return np.stack([across, along[1:], diagonal, diagonal, across, along[:-1]], axis=1)

    straight = edge_lengths(mesh.residual_strain[:, None])
    natural = np.zeros_like(straight)
    if mesh.curvature is not None:
        natural = edge_lengths(np.outer(mesh.line_y, mesh.curvature)) - edge_lengths(0.0 * mesh.line_y[:, None])
    law, spring = np.zeros((strips, 2, 6, 6)), np.zeros((strips, 6))
    if scene.kind == "flex":
        thick, belt = float(case.belt.area) / float(mesh.line_y[0] - mesh.line_y[-1]), case.belt
        elastic = thick, float(belt.youngs_modulus), float(belt.poisson_ratio)
        law[:] = [membrane_law(chord, width, *elastic) for width in w]
    else:
        lattice, along = calibrate(case.belt, chord, mesh.lines, scene.options.bonds), mesh.line_stiffness / chord
        spring[:, 0], spring[:, 5], spring[-1, 1] = lattice.transverse / w, along[:-1], along[-1]
        spring[:, 2:4] = (lattice.diagonal / np.hypot(chord, w))[:, None]
    return Ties(law, spring, straight, natural)


def guide_forces(belt: BeltArrays, nodes: Array, free: Array) -> tuple[Array, Array]:
    """Force [N] and stiffness [N/m] along y of the rollers on the nodes, both (m, n): on free stations within one chord
    of them, by a share that falls linearly with the distance, so that stations come and go without a jolt."""
    guides, shares = belt.guides, belt.stiffness / belt.stiffness.sum()
    assert guides is not None
    x, y, z = nodes.mean(axis=0)
    near = jnp.clip(1.0 - jnp.abs(x - guides.x[:, None]) / belt.chord, 0.0, 1.0)
    near = jnp.where(free & (z * guides.height[:, None] > 0.0), near, 0.0)
    beyond = guides.side[:, None] * y - guides.gap[:, None]
    stiff = guides.stiffness[:, None] * near * (beyond > 0.0)
    push = -(stiff * guides.side[:, None] * beyond).sum(axis=0)
    return shares[:, None] * push, shares[:, None] * stiff.sum(axis=0)


def load_forces(belt: BeltArrays, nodes: Array) -> Array:
    """Forces [N] on ``nodes`` [m], both (m, 3, n): stations within one chord of a place take its load, by a share that
    falls linearly with the distance. The lines take a push as they are stiff, a couple as forces along the belt that
    grow with y, a rolling couple as vertical forces on the outer two."""
    loads, chord, line_y = belt.loads, belt.chord, belt.line_y
    assert loads is not None
    middle, line = nodes.mean(axis=0), belt.stiffness / belt.stiffness.sum()
    upper = middle[2] > 0.0
    near = jnp.clip(1.0 - jnp.abs(middle[0] - loads.x[:, None]) / chord, 0.0, 1.0)
    near = jnp.where(upper == (loads.height[:, None] > 0.0), near, 0.0)
    whole = near.sum(axis=1, keepdims=True)
    near = near / jnp.where(whole > 0.0, whole, 1.0)
    ahead = jnp.roll(middle, -1, axis=1) - jnp.roll(middle, 1, axis=1)
    ahead = ahead * jnp.sign(ahead[0]) / jnp.sqrt((ahead * ahead).sum(axis=0))
    across, along, couple = (v @ near for v in (loads.across, loads.along, loads.couple))
    arm = line * line_y / jnp.maximum(line @ line_y**2, 1e-12)
    forces = (along * line[:, None] - couple * arm[:, None])[:, None] * ahead
    aside = across * line[:, None] + (loads.lean * belt.mass)[:, None]
    lift: Array = jnp.zeros_like(aside)
    if len(line_y) > 1:
        outer = np.zeros((len(line_y), 1))
        outer[[0, -1], 0] = 1.0, -1.0
        lift = outer * jnp.where(upper, loads.roll, loads.roll_lower) * chord / (line_y[0] - line_y[-1])
    return forces + jnp.stack([jnp.zeros_like(aside), aside, lift], axis=1)
