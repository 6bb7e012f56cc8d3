"""What a span is and bears: sag, shear, flatness; a leaning machine, idlers, scrapers, loads, edge guides; camber, a
warm edge, a weld."""

from dataclasses import replace
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.effects.base import CHECK_MODEL, METRES, TURN_OVER, Cause, Effect, effect, parameter
from belt_sim.line.runup import FRICTION, add
from belt_sim.line.span import (
    add_load,
    integral,
    interpolate_rows,
    load_response,
    natural_curvature_rows,
    span_fields,
    supports,
)  # fmt: skip


@effect
class SagRoll(Effect):
    """Adds kappa = y'' + phi Z to a beam of second order; strength multiplies Z = q/F (1 = the full strip law)."""

    title = "Sag-roll coupling: a hanging belt relieves its in-plane bending by tilting"
    law = "span"
    reference = "docs/theory.md (strip); edge ropes of Ritzinger 1997 and Ernst 1965 describe the same sag"
    parity = "odd"
    cause = Cause("a slack belt hangs, and tilts instead of bending", ("upper", "lower"), CHECK_MODEL, of_model=True)
    strength: float = parameter("1", "strength of the effect (theory: 1)", plausible=(0.5, 1.5), scale=1.0, default=1.0)

    def span(self, span, case):
        return add(span, sag_curvature=self.strength * case.sag_curvature)


@effect
class Shear(Effect):
    """A side force Q shears the belt by n Q/(G b h), and it lands along its sheared middle line.

    Timoshenko's beam, y' = theta - n EI kappa'/(G b h): bends decay with K^2 = (F/EI)/(1 + n F/(G b h)), and the moment
    4 EI/L per radian of a clamped end becomes (4 + P)/(1 + P) EI/L, P = 12 n EI/(G b h L^2). Where the belt runs up,
    dy/ds = -alpha + n M'/(G b h), M' [N] the slope of its moment there, loads on the span included; alpha stays the
    angle of the cross-sections, also on the pulley. Under an even side load the belt moves at first as if it had run
    6 n EI/(G b h L) further, and later at a higher rate. n = (12 + 11 nu)/(10 + 10 nu) for a rectangle; the membrane of
    the 3D belt has n = 1.
    """

    title = "Shear flexibility of short, wide spans"
    law = "span"
    reference = "paper eq. 8; Cowper 1966 for n; landing: shell elements that roll onto a pulley"
    parity = "odd"
    cause = Cause("a short, wide span gives way in shear", ("upper", "lower"), CHECK_MODEL, of_model=True)
    coefficient: float = parameter(
        "1", "shear coefficient n of the cross-section", plausible=(1.0, 1.3), scale=1.177, default=1.177
    )

    def span(self, span, case):
        return add(span, shear=self.coefficient / (case.belt.shear_modulus * case.belt.area))

    def runup(self, runup, state, case):
        return add(runup, drift=self.coefficient / (case.belt.shear_modulus * case.belt.area) * state.side_force)


@effect
class Flatness(Effect):
    """The strip has the residual stress amplitude (1 - 12 y^2/b^2) across its width: a parabola without resultant.

    amplitude > 0: long edges, which are pressed; amplitude < 0: a long middle. The stress at rest works on the twist
    like tension does, T = b^3 h (sigma - 0.8 amplitude)/12 + G b h^3/3 (the integral of s y^2 over the section).
    Narrow edges under pressure do not buckle, so EI stays as it is (studies/notes/shell.md compares both with a shell).
    From amplitude = 1.25 sigma on the spans twist by themselves and no linear law holds: the share of the tension in T
    is then taken as 0.
    """

    title = "Flatness: residual stress of the rolled strip changes how easily a span twists"
    law = "span"
    reference = "residual stress of rolled strip: Fischer et al. 2000 (Int. J. Mech. Sci. 42); T by virtual work"
    parity = "odd"
    needs = frozenset({"sag"})
    cause = Cause(
        "the strip is not flat (long edges or a long middle)",
        ("upper", "lower"),
        "Slacken the belt and look for wavy edges or a loose middle.",
    )
    amplitude: float = parameter("Pa", "residual stress in the middle of the width", plausible=(-2e7, 2e7), scale=3e6)

    def span(self, span, case):
        belt = case.belt
        change = -jnp.minimum(0.8 * self.amplitude, case.settings.tension)
        return add(span, torsion=belt.width**3 * belt.thickness / 12.0 * change)

    def scene(self, parts, case):
        return add(parts, residual=self.amplitude)


@effect
class MachineTilt(Effect):
    """The share ``angle`` of the belt's weight pulls both spans sideways: a side load q angle per metre towards +y.

    The spans bow towards the lower side and climb there on both pulleys alike: strongest when slack, at most as a rope
    by q angle L / (2 F (1 + pi R / L)). To those who stay upright the belt's weight is where it was and both pulleys
    are canted the other way (``Cant``); the wraps, which friction holds, feel nothing of it.
    """

    title = "Machine tilt: a machine that leans to one side about its long axis"
    law = "span"
    reference = "clamped span under an even side load, any textbook; docs/theory.md for the hanging strip"
    parity = "even"
    tension_exponent = -1.0
    cause = Cause(
        "the machine leans to one side",
        ("upper", "lower"),
        "Put a level across the frame, at the head and at the tail.",
    )
    angle: float = parameter("rad", "lean of the machine towards +y", plausible=(-0.05, 0.05), scale=1e-3)

    def influence(self, span, case):
        return load_response(span, "spread_force", span_fields(span))

    def bend(self, bend, boundary, known, case):
        return add_load(bend, known, jnp.full(2, self.angle * case.weight_per_length))

    def scene(self, parts, case):
        return add(parts, lean=self.angle)


_PLACE: Any = parameter(
    "1",
    "share of the span's length, counted from the head pulley",
    plausible=(0.1, 0.9),
    scale=0.5,
    null=0.5,
    modifier=True,
    grid=(0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9),
)


class _OnOneSpan(Effect):
    """A load on one span: the upper one, or with ``side`` -1 the lower one, along which the belt runs the other way.

    load: its kind, of ``load_response``; of: the name of its number; sign: of the load that this is.
    """

    side: ClassVar[float] = 1.0
    load: ClassVar[str]
    of: ClassVar[str]
    sign: ClassVar[float] = 1.0

    def influence(self, span, case):
        share = getattr(self, "place", None)  # counts from the head pulley
        if share is not None:
            share = jnp.where(self.side * case.settings.direction > 0, share, 1.0 - share)  # from the run-off
        return load_response(span, self.load, span_fields(span), share)

    def bend(self, bend, boundary, known, case):
        load = self.sign * getattr(self, self.of)
        load = load * case.settings.direction if self.load == "force" else load
        none, forward = jnp.zeros_like(load), self.side * case.settings.direction > 0
        # the upper span runs up the tail pulley, on reversed travel up the head pulley
        loads = jnp.where(forward, jnp.stack([load, none]), jnp.stack([none, load]))
        return add_load(bend, known, loads)

    def scene(self, parts, case):
        forward, load = float(case.settings.direction), self.sign * getattr(self, self.of)
        if self.load == "spread_roll":
            return add(parts, **{"roll" if self.side > 0 else "roll_lower": load})
        span, x = "upper" if self.side > 0 else "lower", getattr(self, "place", 0.0) * float(case.rig.centre_distance)
        if self.load == "force":
            return parts.with_push(span=span, x=x, across=load * forward)
        direction, drag = self.side * forward, 2.0 * abs(load) / float(case.belt.width)
        return parts.with_push(span=span, x=x, along=-direction * drag, couple=direction * load)


@effect
class IdlerSkew(_OnOneSpan):
    """A roller askew under the upper span exerts a constant side force, to +y on forward travel, to -y on reversed.

    A support with friction on one side only does the same.
    """

    title = "Idler skew: a roller under the upper span that does not stand square"
    law = "span"
    reference = "clamped span under a side force, any textbook; makers' guides: skewed and seized idlers"
    parity = "even"
    tension_exponent = -1.0
    cause = Cause(
        "a roller under the upper span is not square to the belt",
        ("upper",),
        "Measure the rollers' angles, or lower them away for one run.",
    )
    load, of = "force", "force"
    force: float = parameter("N", "side force on the span, forward travel", plausible=(-50.0, 50.0), scale=0.1)
    place: float = _PLACE


@effect
class SideDrag(_OnOneSpan):
    """A drag D against the travel at the edge y = b/2 turns the belt there by a couple about z, moment = D b/2.

    With x along the travel the couple turns x towards y, in either direction of travel. The change of tension by D is
    neglected.
    """

    title = "Side drag: a scraper or skirt that rubs on one edge of the upper span"
    law = "span"
    reference = "clamped span under a couple, any textbook; makers' guides: scrapers and skirts"
    parity = "even"
    needs = frozenset({"width"})
    cause = Cause(
        "a scraper or skirt rubs on one edge of the upper span",
        ("upper",),
        "Look for rub marks on one edge, and lift the scraper for one run.",
    )
    load, of = "couple", "moment"
    moment: float = parameter(
        "N m", "couple of a drag at the edge y > 0 of the span", plausible=(-50.0, 50.0), scale=0.2
    )
    place: float = _PLACE


@effect
class OffCentreLoad(_OnOneSpan):
    """A load of w newton per metre at the offset e rolls the span, its loaded side down: a couple w e a metre.

    A hanging span that rolls bends in its own plane, kappa = y'' + Z phi; a span without sag does not respond. The
    additional sag is neglected.
    """

    title = "Off-centre load: what the upper span carries lies on one side"
    law = "span"
    reference = "hanging strip with a rolling couple: docs/theory.md; makers' guides: off-centre loading"
    parity = "even"
    needs = frozenset({"sag"})
    cause = Cause("the load on the upper span lies off centre", ("upper",), "Centre the load, or run the belt empty.")
    load, of, sign = "spread_roll", "moment", -1.0
    moment: float = parameter(
        "N",
        "couple per metre of the span, side y > 0 loaded",
        plausible=(-2.0, 2.0),
        scale=5e-3,
        shop=(1.0, "N m per m"),
    )


def _below(above: type[_OnOneSpan]) -> type[_OnOneSpan]:
    """Return the effect that does the same on the lower span."""
    cause = above.cause
    assert cause is not None
    content = {
        "__doc__": "The same on the lower span.",
        "__module__": __name__,
        "title": above.title.replace(":", " below:", 1).replace("upper", "lower"),
        "cause": replace(cause, phrase=cause.phrase.replace("upper", "lower"), parts=("lower",)),
        "side": -1.0,
    }
    return effect(type(f"{above.__name__}Lower", (above,), content))


IdlerSkewLower, SideDragLower, OffCentreLoadLower = map(_below, (IdlerSkew, SideDrag, OffCentreLoad))

_NEAREST = 0.25  # [m] to a pulley: nearer, a step of the march no longer follows the span's stiffness


@effect
class EdgeGuide(Effect):
    """Two rollers, one at each edge, ``gap`` away from the belt in the middle: P = k max(0, |y| - gap), inwards.

    The belt beside the roller is where its ends and P put it, y = y_ends - P give, so that P = k (|y_ends| - gap) /
    (1 + k give). P bends the span's run-up back until the belt no longer runs sideways: y saturates. ``at`` counts
    from the tail pulley's axis; a sticking belt does not move on the pulleys themselves. Friction of the half turn
    (mu = FRICTION) bears a push of pi mu F, and where the belt leaves a pulley a moment of pi mu F b/4 (``Slip``: its
    zone is then the whole wrap); P stays at the less. A guide behind a run-off reaches it and slides the belt on its
    pulley.
    """

    title = "Edge guides: rollers beside the spans that push the belt's edge back"
    law = "span"
    reference = "docs/theory.md; clamped beam with an elastic stop, any textbook"
    parity = "odd"
    cause = Cause(
        "a guide roller pushes the belt back at its edge",
        ("upper", "lower"),
        "Look for contact and wear at the guide rollers, and swing them away for one run.",
    )
    stiffness: float = parameter("N/m", "rollers of the upper span", plausible=(10.0, 1e8), scale=1e5)
    stiffness_lower: float = parameter("N/m", "rollers of the lower span", plausible=(10.0, 1e8), scale=1e5)
    gap: float = parameter(
        "m",
        "play between edge and roller",
        plausible=(0.0, 0.02),
        scale=1e-3,
        modifier=True,
        # so close that a search does not end where only the next reading touches
        grid=(0.0, 1.5e-4, 3e-4, 4.5e-4, 6.5e-4, 1e-3, 1.5e-3, 2.2e-3, 4e-3, 8e-3),
    )
    at: float = parameter(
        "m",
        "distance from the tail pulley's axis",
        plausible=(0.25, 50.0),
        scale=1.0,
        modifier=True,
        grid=(0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
        shop=METRES,
    )

    def influence(self, span, case):
        fields = span_fields(span)
        share = jnp.clip(self.at, _NEAREST, span.length - _NEAREST) / span.length
        near_runoff, near_runup = supports(span, share, fields)
        known = jax.tree.map(lambda *of_spans: jnp.stack(of_spans), near_runup, near_runoff)
        whole = jnp.pi * FRICTION * jnp.maximum(case.tension_force, 0.0)  # without tension friction bears nothing
        return known, jnp.minimum(whole, 0.25 * whole * case.belt.width / (span.bending * jnp.abs(known.runoff)))

    def bend(self, bend, boundary, known, case):
        unit, grip = known
        place = boundary.start + jnp.sum(unit.place * boundary.ends.T, axis=1) + case.settings.y0
        return add_load(bend, unit, jnp.clip(self._push(place, unit, boundary.direction), -grip, grip))

    def _push(self, place, unit, direction):
        """Return the push on the spans up the tail and the head pulley [N], for y where it acts (2, ...)."""
        stiff = jnp.stack([self.stiffness, self.stiffness_lower])
        stiff = jnp.where(direction > 0, stiff, stiff[::-1])  # the first span runs up the tail pulley
        stiff, give = (row.reshape(-1, *[1] * (place.ndim - 1)) for row in (stiff, unit.give))
        return -stiff * (place - jnp.clip(place, -self.gap, self.gap)) / (1.0 + stiff * give)

    def pushed(self, span, curves, case):
        """Return the push that the rollers of the upper and the lower span would need along a run [N], (2, records),
        and what friction bears of it (2,)."""
        (unit, grip), forward = self.influence(span, case), case.settings.direction > 0
        y, angle = jnp.asarray(curves.y), jnp.asarray(curves.angle)
        off, up = (jnp.array([3, 1]), jnp.array([0, 2])) if forward else (jnp.array([2, 0]), jnp.array([1, 3]))
        ends = jnp.stack([y[up] - y[off], angle[off], angle[up]])  # rolls of the ends count for nothing here
        place = y[off] + jnp.einsum("sk,ksn->sn", unit.place[:, :3], ends) + case.settings.y0
        push = self._push(place, unit, case.settings.direction)
        return (push, grip) if forward else (push[::-1], grip[::-1])

    def scene(self, parts, case):
        x = float(case.rig.centre_distance) - min(max(self.at, _NEAREST), float(case.rig.span_length) - _NEAREST)
        for span, stiffness in (("upper", self.stiffness), ("lower", self.stiffness_lower)):
            if stiffness > 0.0:
                for side in (1.0, -1.0):
                    gap = self.gap - side * float(case.settings.y0)
                    parts = parts.with_guide(span=span, x=x, gap=gap, side=side, stiffness=stiffness)
        return parts


# Shape of the belt: camber, an edge that is warmer, a weld.


def add_natural(bend, added, natural):
    """Return ``bend`` with a natural curvature: what it adds at the run-up, the run-off and to the tilt, and itself at
    the run-up and the run-off."""
    own = {"natural_runup": natural[0], "natural_runoff": natural[1]}
    return add(bend, runup=added[0], runoff=added[1], tilt=added[2], **own)


class _EvenlyCurved(Effect):
    """A belt of the same natural curvature all along, which is its number ``of``, or as that makes one edge longer.

    stretch: of the edge y > 0 against the other per unit of the number.
    """

    of: ClassVar[str]
    stretch: ClassVar[float] = 0.0

    def curvature(self, case):
        """Return kappa_c [1/m]."""
        number = getattr(self, self.of)
        return -self.stretch * number / case.belt.width if self.stretch else number

    def influence(self, span, case):
        """Added at the run-up, the run-off [1/m] and to the tilt [rad], shape (3,), by a natural curvature of 1 1/m."""
        return integral(natural_curvature_rows(span_fields(span), span), span)

    def bend(self, bend, boundary, known, case):
        kappa_c = self.curvature(case)
        return add_natural(bend, kappa_c * known, (kappa_c, kappa_c))

    def scene(self, parts, case):
        kappa_c = self.curvature(case)
        return parts.with_camber(lambda s: np.full(np.shape(s), kappa_c)) if kappa_c else parts


@effect
class Camber(_EvenlyCurved):
    """The bending moment is EI (kappa - kappa_c) all round the belt; kappa_c > 0: the edge at +y is the shorter one.

    It leaves a flat belt where it is. A hanging one it tilts, T phi'' = EI Z (kappa - kappa_c), and so the belt drifts
    as on two pulleys tapered by kappa_c (1 - integral of the curvature per unit of run-up angle), which is about
    kappa_c Lambda / (1 + Lambda), Lambda of ``belt_sim.line.span.sag_softening``.
    """

    title = "Camber: a belt that is evenly curved in its own plane when nothing holds it"
    law = "span"
    reference = "docs/theory.md; Benson 2002 (JDSMC 124(1) 25)"
    parity = "even"
    on_belt = True
    cause = Cause(
        "the belt is curved in its own plane (camber)",
        ("upper", "lower"),
        "Stretch a string along one edge of a free length of belt and measure the bow. A belt that is warmer at one "
        f"edge does the same: feel both edges. {TURN_OVER}",
    )
    of = "kappa_c"
    kappa_c: float = parameter(
        "1/m", "natural curvature", plausible=(-1e-3, 1e-3), scale=2e-5, shop=(12.5e3, "mm of bow over 10 m")
    )


@effect
class TemperatureDifference(_EvenlyCurved):
    """A belt that is warmer at +y by ``difference`` is longer there: a camber kappa_c = -alpha difference/b.

    alpha = 1.2e-5 1/K of steel. A heater or a draught stays where it is when the belt is turned over; a camber turns.
    """

    title = "Temperature difference: a belt that is warmer at one edge"
    law = "span"
    reference = "thermal curvature alpha dT/b, any textbook; acts as camber"
    parity = "even"
    cause = Cause(
        "the belt is warmer at one edge than at the other",
        ("upper", "lower"),
        f"Measure the temperature at both edges while the belt runs. {TURN_OVER}",
    )
    of, stretch = "difference", 1.2e-5  # [1/K] of steel
    difference: float = parameter("K", "temperature at +y less that at -y", plausible=(-15.0, 15.0), scale=0.3)


_PLACES = 512  # of the weld's middle, from where it enters a span to where it has left it
_POINTS = (np.arange(16) + 0.5) / 16 - 0.5  # middles of pieces of a weld, which run up one after the other


def raised_cosine(u, xp=jnp):
    """1 + cos(2 pi u) for |u| < 1/2, else 0: a bend of mean 1 over its own length; xp: jax.numpy or numpy."""
    return xp.where(xp.abs(u) < 0.5, 1.0 + xp.cos(2.0 * xp.pi * u), 0.0)


@effect
class Weld(Effect):
    """Natural curvature angle / length (1 + cos) over ``length``: each passage of a run-up turns the belt.

    ``at``: the middle of the weld at travel 0, from point 4 on by the points 1, 2 and 3. A flat belt it leaves where it
    is; a hanging one drifts as by a camber of angle over the belt's length.
    """

    title = "A weld: the belt is curved in its own plane over a short length, which passes once every belt length"
    law = "span"
    reference = "docs/theory.md; Benson 2002 (JDSMC 124(1) 25) for splices"
    parity = "even"
    on_belt = True
    comes_round = True
    min_revolutions = 1.0  # it runs up both pulleys
    cause = Cause(
        "a weld puts a kink into the belt", ("upper", "lower"), "Lay a straightedge along the edge across the weld."
    )
    angle: float = parameter("rad", "kink of the belt", plausible=(-2e-3, 2e-3), scale=2e-4)
    at: float = parameter(
        "m",
        "place at travel 0",
        plausible=(-300.0, 300.0),  # it comes back every belt length
        scale=2.0,
        modifier=True,
        grid=tuple(k / 12 for k in range(12)),
        of_belt=True,
        shop=METRES,
    )
    length: float = parameter(
        "m", "length of the bend", plausible=(0.2, 2.0), scale=0.6, null=0.6, modifier=True, shop=METRES
    )

    def influence(self, span, case):
        """Places x (n,) of a weld's middle from the run-off [m], and what a weld of 1 rad there adds at the run-up, the
        run-off [1/m] and to the tilt [rad], shape (3, n)."""
        fields, piece = span_fields(span), self.length / len(_POINTS)
        rows = natural_curvature_rows(fields, span)
        shape = raised_cosine(_POINTS) / len(_POINTS)

        def passage(middle):
            place = middle + self.length * _POINTS
            inside = jnp.clip(0.5 + jnp.minimum(place, span.length - place) / piece, 0.0, 1.0)  # share of each piece
            return interpolate_rows(fields.x, rows, jnp.clip(place, 0.0, span.length)) @ (shape * inside)

        x = jnp.linspace(-0.5 * self.length, span.length + 0.5 * self.length, _PLACES)
        return x, jax.vmap(passage, out_axes=1)(x)

    def bend(self, bend, boundary, known, case):
        rig, (middles, unit) = case.rig, known
        to_point_3 = 2.0 * rig.span_length + rig.wrap_tail
        place = jnp.where(boundary.direction > 0, self.at, to_point_3 - self.at) + boundary.travel
        place = place + case.settings.start
        place = place - jnp.stack([0.0 * to_point_3, rig.span_length + rig.wrap_tail])  # from each span's run-off
        place = jnp.mod(place + 0.5 * self.length, rig.belt_length) - 0.5 * self.length
        there = (place >= middles[0]) & (place <= middles[-1])
        added = self.angle * jnp.where(there, interpolate_rows(middles, unit, place), 0.0)
        ends = [self.angle / self.length * raised_cosine((place - x) / self.length) for x in (rig.span_length, 0.0)]
        return add_natural(bend, added, ends)

    def scene(self, parts, case):
        around = float(case.rig.belt_length)
        at = self.at + float(case.settings.direction * case.settings.start)

        def camber(s):
            off = np.mod(s - at + 0.5 * around, around) - 0.5 * around
            return self.angle / self.length * raised_cosine(off / self.length, np)

        return parts.with_camber(camber) if self.angle else parts
