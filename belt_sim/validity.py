"""Where the models stop being right: what a case does, over what its model still bears.

Each limit has a load, 1 at the boundary. Most boundaries stand where the moments of a span, and so the movement of the
belt, are wrong by some 3 %; the derivations and what they were checked against are in docs/validity.md.
"""

from collections.abc import Collection, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.generic_law import GenericLaw
from belt_sim.effects.law import RELATIVE
from belt_sim.effects.pulley import LiftOff, Slip, with_side_force
from belt_sim.effects.span import EdgeGuide
from belt_sim.errors import Limit
from belt_sim.jax_setup import StoredProgram, in_float64
from belt_sim.line.runup import FRICTION
from belt_sim.line.span import CHANGE_LIMITS, beam_second_order, sag_softening, span_fields, strip
from belt_sim.line.spans import span_responses

WRONG_SHARE = 0.03  # share by which moments or movement may be wrong at a boundary
SLIP_WAY = 0.1  # share of a quarter span on which slip may act
POWERS = float(np.log(2.0))  # log of 1 + a change of the tension of a span: beyond, y1 is more than 3 % wrong
NEXT_ORDER = 0.25  # share of either second-order term that is kept where both cancel
STRENGTH = 450e6  # [Pa], bending fatigue of usual belt steels
NARROWEST = 20.0  # thicknesses that a strip is wide at least: below it is a bar, whose section the laws do not have
SHORTEST_SPAN = 1.0  # widths that a span is long at least: below it is a plate
SMALL_ANGLE = (2.0 * WRONG_SHARE) ** 0.5  # [rad]: laws take cosines of rolls and of directions for 1
LIFTS = (
    "the belt is too slack for this model, its own stiffness lifts it off the pulleys: use model=strip_lift_off, or "
    "effects=[lift_off] with a 3D belt"
)
LIMIT_GIVEN = {"slip": f"if friction is {FRICTION:g} or less"}  # limits that hang on what no campaign states
PULLEYS_FILL = 0.8  # share of the centre distance that both pulleys may fill


def _spans(case: Case):
    """Return moments at the run-up of the strip and of a flat beam, per radian of yaw; those that the strip, and one
    that lifts off, carry over; places in the strip and its moments there; bending, twisting and sag of it, and force:
    one program, as every run of a model asks for all."""
    span = strip(case)
    strips = [span_responses(case, effects, span) for effects in ((), (LiftOff(strength=1.0),))]
    entry = [answer.runup[0, 2] for answer in (strips[0], span_responses(case, (), beam_second_order(case)))]
    fields = span_fields(span)
    numbers = [jnp.asarray(x, float) for x in (span.bending, span.torsion, span.sag_curvature, span.force)]
    return *entry, *(answer.runoff[:, 2] for answer in strips), fields.x, fields.per_runup, *numbers


_SPANS = StoredProgram(_spans, "spans of limits", brief=True)


def limits(case: Case, contains: Collection[str] = ("sag_roll",)) -> tuple[Limit, ...]:
    """All limits of a model for one case; ``contains``: the effects, or the limits themselves, that it has in it.

    M is the strip's entry moment after the largest step or angle of a yaw.
    """
    rig, belt, force = case.rig, case.belt, case.tension_force
    yaw = _largest_yaw(case)
    runup, flat, carried, lifted, *fields = (np.asarray(x) for x in _SPANS(case))
    moment = abs(float(fields[2] * runup)) * yaw
    # the belt slips on z = 4 R M/(mu F b) of its pulley and turns by M z/2 EI, so that y gains z/s; at s = L/4
    zone = 4.0 * max(rig.head_radius, rig.tail_radius) * moment / (FRICTION * force * belt.width)
    # entry stiffness (4 + P)/(1 + P) EI/L, P = 12 EI n/(G A L^2): lower by 3 P/4; the strip has no shear
    ratio = 12.0 * 1.2 * belt.bending_stiffness / (belt.shear_modulus * belt.area * rig.span_length**2)
    # F - rho A v^2 is the tension that counts, and low-tension movement goes with its third power
    fast = 3.0 * belt.density * case.settings.speed**2 / case.settings.tension
    # the linear span is wrong by 4 (stretch - relief)/(M yaw), energies of fourth order with the linear fields put in:
    # twist stretches the edges, E h b^5/1440 int phi'^4; and in F w'' = q + (M phi)'' the moment lets the tilted span
    # sag on, int (M phi)'^2 / 2F. Where both are alike, the next order is left: a quarter of the larger is kept
    x, per_runup, bending, torsion, sag_curvature, pull = fields
    along = bending * per_runup
    integrals = [along * (sag_curvature / torsion)]
    for _ in range(2):  # up to every place; SciPy's would take simulate its import
        sums = np.cumsum((integrals[-1][1:] + integrals[-1][:-1]) / 2.0 * np.diff(x))
        integrals.append(np.concatenate([[0.0], sums]))
    _, twist, tilt = integrals
    twist, tilt = twist - tilt[-1] / x[-1], tilt - tilt[-1] * x / x[-1]
    stretch = belt.youngs_modulus * belt.thickness * belt.width**5 / 1440.0 * np.trapezoid(twist**4, x)
    relief = np.trapezoid(np.gradient(along * tilt, x) ** 2, x) / (2.0 * pull)
    beyond = float(4.0 * max(abs(stretch - relief), NEXT_ORDER * max(stretch, relief)) / along[-1])  # [1/rad^2]
    layer = float(np.abs(lifted / carried - 1.0).max())  # of both spans: the lower one's, whichever way it runs
    deep, thick = _deep_and_thick(case)
    hanging = "strip_lift_off" if layer > WRONG_SHARE else "strip"
    found = (  # name, load, the effect that moves it out of the way, and words
        ("flat_belt", abs(flat / runup - 1.0) / WRONG_SHARE, "sag_roll", f"the spans sag and tilt: use {hanging}"),
        ("slack_edge", 6.0 * moment / (force * belt.width), "",  # an edge has the stress sigma -+ 6 M/(b^2 h)
         "after the yaw an edge is slack, as a linear span has it: it overrates its moment"),
        ("second_order", abs(beyond) * yaw**2 / WRONG_SHARE, "",
         "the turn is so large that the linear span is wrong: the slack edge sags more, twist stretches both"),
        ("bending_layer", layer / WRONG_SHARE, "lift_off", LIFTS),
        ("slip", zone / (SLIP_WAY * rig.span_length / 4.0), "slip",
         "the belt slips on the pulley after the yaw"),
        ("shear", 0.75 * ratio / WRONG_SHARE, "shear",
         "the spans are short and wide: shear bends them as well; add effects=[shear]"),
        (deep.id, deep.load, "", deep.words),
        ("fast_belt", fast / WRONG_SHARE, "speed_tension",
         "the belt runs at a share of its string speed: inertia counts"),
        (thick.id, thick.load, "", thick.words),
    )  # fmt: skip
    kept = (row for row in found if not {row[0], row[2]} & {*contains})
    return tuple(Limit(name, float(load), words, LIMIT_GIVEN.get(name, "")) for name, load, _, words in kept)


def exceeded_limits(case: Case, contains: Collection[str] = ("sag_roll",)) -> tuple[Limit, ...]:
    """The limits that the case is beyond, the worst first."""
    return tuple(sorted((x for x in limits(case, contains) if x.load > 1.0), key=lambda x: -x.load))


def lifts_off(case: Case) -> bool:
    """Whether the belt is so slack that a strip is beyond the limit bending_layer: its stiffness lifts it off."""
    return any(x.id == "bending_layer" for x in exceeded_limits(case))


def geometric(case: Case) -> tuple[Limit, ...]:
    """The limits that machine and belt are beyond whatever the model, the worst first: no strip, a plate, pulleys that
    nearly touch or are narrower than the belt, steel that yields over them, spans that are no parabolas, an edge that
    the yaw alone slackens."""
    rig, belt, tension = case.rig, case.belt, float(case.settings.tension)
    span, filled = float(rig.span_length), float(rig.head_radius + rig.tail_radius) / float(rig.centre_distance)
    softened = float(belt.youngs_modulus) / (1.0 + float(sag_softening(case)))  # sag takes up what an edge lacks
    stretch = softened * float(belt.width) * _largest_yaw(case) / (2.0 * span)
    narrow, wide = NARROWEST * belt.thickness / belt.width, SHORTEST_SPAN * belt.width / span
    found = (
        Limit("no_strip", narrow, f"the belt is less than {NARROWEST:g} thicknesses wide"),
        Limit("short_span", wide, "the spans are shorter than the belt is wide: it is a plate"),
        Limit("large_pulleys", filled / PULLEYS_FILL, "the pulleys nearly touch"),
        *_deep_and_thick(case),
        Limit("edge_stretch", stretch / tension, "the yaw stretches one edge so far that the other goes slack"),
        Limit("off_pulley", belt.width / (rig.face_width or np.inf), "the belt is wider than the pulleys' faces"),
    )
    return tuple(sorted((Limit(x.id, float(x.load), x.words) for x in found if x.load > 1.0), key=lambda x: -x.load))


def run_limits(
    case: Case, curves: Curves, linear: bool = True, effects: Sequence[Any] = (), contains: Collection[str] = ()
) -> tuple[Limit, ...]:
    """Return the limits that a run left, all effects included, the worst first, with the place and the travel.

    linear: whether rolls, directions and guides are those of a linear law (a belt in three dimensions has no limit
    there); contains: limits that its model has in it. Without ``rig.face_width`` a face is taken to be as wide as the
    belt, which may leave it by half its width.
    """
    belt, face, travel = case.belt, case.rig.face_width, np.asarray(curves.travel)
    room = float(belt.width) / 2.0 if face is None else max(float(face - belt.width) / 2.0, 1e-3)
    edge = "the belt lies half beside a face of its own width" if face is None else "an edge leaves the pulley's face"
    spans, points = ("upper span", "lower span"), tuple(f"point {k}" for k in (1, 2, 3, 4))
    way = SLIP_WAY * float(case.rig.span_length) / 4.0
    kinds, left = list[tuple[str, np.ndarray, tuple[str, ...], str]](), list[Limit]()
    if face is None or face > belt.width:  # else it was beside them before it ran (``geometric``)
        kinds.append(("off_pulley", np.abs(np.asarray(curves.y) + float(case.settings.y0)) / room, points, edge))
    if curves.edge_stress is not None:
        words = "an edge is slack" + ", which a linear span does not know" * linear
        kinds.append(("slack_edge", 1.0 - np.asarray(curves.edge_stress) / float(case.settings.tension), spans, words))
    if curves.moment is not None and "slip" not in contains:
        kinds.append(("slip", slip_zones(case, curves) / way, points, "the belt slips on the pulley"))
    wraps = np.array([case.rig.wrap_tail, case.rig.wrap_tail, case.rig.wrap_head, case.rig.wrap_head])[:, None]
    for slip in (e for e in effects if linear and isinstance(e, Slip) and curves.moment is not None):
        own = 1.0 / max(float(slip.inverse_friction), 1e-9)
        words = "the belt slides on more than its wrap, which effects=[slip] does not know"
        zones = slip_zones(case, curves, own)
        whole = zones * with_side_force(zones / float(belt.width)) / wraps
        kinds.append(("whole_wrap", np.asarray(whole), points, words))
        ups = (np.arange(4) % 2 == (0 if float(case.settings.direction) > 0.0 else 1))[:, None]
        words = "the belt keeps sliding where it runs up, which effects=[slip] knows at changes of the yaw only"
        lasting = slip_zones(case, curves, own, by_yaw=False) * ups
        kinds.append(("lasting_slip", lasting / way, points, words))
    if linear and curves.tilt is not None:
        words = "the cross-section rolls beyond small angles"
        kinds.append(("large_tilt", np.abs(np.asarray(curves.tilt)) / SMALL_ANGLE, spans, words))
    if linear and curves.angle is not None:
        words = "the belt runs aslant beyond small angles"
        kinds.append(("large_angle", np.abs(np.asarray(curves.angle)) / SMALL_ANGLE, points, words))
    for law in (e for e in effects if linear and isinstance(e, GenericLaw)):
        for kind in dict.fromkeys(t.place.relative for _, t in law.terms(*RELATIVE)):
            low, high = (-POWERS, POWERS) if kind == "tension" else CHANGE_LIMITS
            words = f"a law changes the {kind} of a span by more than powers of the change stand for"
            change = np.asarray(np.log1p(np.maximum(in_float64(law.shares)(kind, curves, case), -0.999)))
            kinds.append(("large_change", np.maximum(change / low, change / high), spans, words))
    for guide in (e for e in effects if linear and isinstance(e, EdgeGuide)):
        push, grip = (np.asarray(x) for x in in_float64(guide.pushed)(strip(case), curves, case))
        there = (np.array([guide.stiffness, guide.stiffness_lower]) > 0.0)[:, None]  # spans with rollers
        turned = (slip_zones(case, curves) / wraps)[[0, 1, 3, 2]].reshape(2, 2, -1).max(axis=0)
        slides = np.where(there, np.maximum(np.abs(push) / grip[:, None], turned), 0.0)
        bears = grip[slides.max(axis=1).argmax()]
        words = f"beside an edge guide the belt slides on its pulley, friction ({FRICTION:g}) bears {bears:.0f} N"
        kinds.append(("guide_slips", slides, spans, words))
        late = push[:, push.shape[1] // 2 :] != 0.0
        meets = (late[:, 1:] & ~late[:, :-1]).sum(axis=1)
        if meets.max() > 1 and not any(e.comes_round for e in effects):
            words = "the belt swings on and off its edge guides: behind a run-off they push too late; "
            words += f"put them (at) near a run-up, most in the {spans[meets.argmax()]}"
            left.append(Limit("guide_hunts", float(meets.max()), words))
    for name, load, places, words in kinds:
        if name not in contains and load.max() > 1.0:
            where, _ = np.unravel_index(np.argmax(load), load.shape)
            first = float(travel[np.argmax((load > 1.0).any(axis=0))])
            words = f"from {first:.3g} m of travel on, {words}, most at {places[where]}"
            left.append(Limit(name, float(load.max()), words, LIMIT_GIVEN.get(name, "")))
    return tuple(sorted(left, key=lambda x: -x.load))


def slip_zones(case: Case, curves: Curves, friction: float = FRICTION, by_yaw: bool = True) -> np.ndarray:
    """Effective zones [m] of the wraps on which the belt slides at points 1-4 along a run, (4, n).

    Friction turns a wrapped belt by a couple of at most c = mu F b/4R per metre. A belt that runs up lands as bent as
    its span: friction holds only what the moment there, 0 before the start, has changed by faster than c a metre. A
    belt that leaves comes as bent as it landed one wrap ago: friction holds the rest, for good. After a step of the yaw
    both are the same. The first record after such a step counts from the moment right before it; by_yaw: whether
    changes of the yaw, and the start, count at run-ups. Without ``curves.moment_runoff`` (3D) run-offs count for none.
    """
    yaws = (case.settings.yaw, case.settings.yaw_head)
    steps = np.concatenate([np.ravel(x.at)[(np.ravel(x.over) <= 0.0) & (np.ravel(x.change) != 0.0)] for x in yaws])
    rig, s, forward = case.rig, np.asarray(curves.travel), float(case.settings.direction) > 0.0
    couple = friction * float(case.tension_force * case.belt.width) / 4.0
    pulleys = ((float(rig.tail_radius), float(rig.wrap_tail)), (float(rig.head_radius), float(rig.wrap_head)))
    up, zones = np.asarray(curves.moment), np.zeros((4, len(s)))
    jumps = np.isin(np.arange(len(s)), [0, *np.searchsorted(s, steps)])
    turning = jumps | np.any([(s > a) & (s <= a + o) for x in yaws for a, o in zip(x.at, x.over, strict=True)], 0)
    for span, ends in enumerate(((0, 3), (1, 2))):  # points at the tail and the head pulley
        to_head = (span == 0) != forward
        radius, _ = pulleys[to_head]
        felt = up[span] if by_yaw else up[span] - np.cumsum(np.where(turning, np.diff(up[span], prepend=0.0), 0.0))
        for moment in (felt, -felt):
            ahead, before = (m * radius / couple - s for m in (moment, np.concatenate([[0.0], moment[:-1]])))
            least = np.minimum.accumulate(np.where(jumps, np.minimum(ahead, before), ahead))
            zones[ends[to_head]] = np.maximum(zones[ends[to_head]], ahead - least)
        if curves.moment_runoff is not None:
            radius, wrap = pulleys[not to_head]
            landed = np.interp(s - wrap, s, up[1 - span], left=0.0)
            zones[ends[not to_head]] = np.abs(np.asarray(curves.moment_runoff)[span] - landed) * radius / couple
    return zones


def _largest_yaw(case: Case) -> float:
    """The largest angle or change of angle of either pulley [rad]."""
    changes = [np.atleast_1d(np.asarray(x.change, float)) for x in (case.settings.yaw, case.settings.yaw_head)]
    return float(max(np.abs([*x, *np.cumsum(x)]).max(initial=0.0) for x in changes))


def _deep_and_thick(case: Case) -> tuple[Limit, Limit]:
    """The limits deep_sag, slope of the hanging span at its ends psi = Z L/2 (laws take cos psi = 1), and thick_belt,
    bending stress E h/2R over the pulley and the tension."""
    slope = case.sag_curvature * case.rig.span_length / 2.0
    radius = min(case.rig.head_radius, case.rig.tail_radius)
    stress = case.belt.youngs_modulus * case.belt.thickness / (2.0 * radius) + case.settings.tension
    return (
        Limit("deep_sag", float(slope**2 / 2.0 / WRONG_SHARE), "the spans hang so low that they are no parabolas"),
        Limit("thick_belt", float(stress / STRENGTH), "belt steel tires or yields when bent over such a pulley"),
    )
