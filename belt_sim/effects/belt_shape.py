"""Shape of the belt: camber, an edge that is not straight, a weld."""

from dataclasses import replace
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.effects.base import METRES, TURN_OVER, Cause, Effect, effect, parameter, with_parameters
from belt_sim.line.runup import add
from belt_sim.line.span import integral, interpolate_rows, natural_curvature_rows, span_fields

EDGE_HARMONICS = 40
FALLS = 1.27  # measured edges: amplitudes fall as harmonic^-1.27


_HARMONICS = {
    f"{short}{k}": parameter(
        "m", f"harmonic {k} of the belt length, {words}", plausible=(-1e-2 / k, 1e-2 / k), scale=2e-4 / k**FALLS
    )
    for k in range(1, EDGE_HARMONICS + 1)
    for short, words in (("cos", "in phase"), ("sin", "in quadrature"))
}


@effect
class EdgeProfile(with_parameters("_Harmonics", _HARMONICS)):  # type: ignore[misc]
    """Sensors see y + e(material point): e repeats every belt length and passes points 4, 1, 2, 3 in turn.

    e is free up to a wavelength of a fortieth of the belt; on a laboratory conveyor three harmonics left half of it,
    twenty a fifth. It is linear in the reading: a fit needs no march for it, and takes as many harmonics as show.
    """

    title = "Edge profile: the belt's own edge is not straight"
    law = "sensor"
    reference = "docs/theory.md; spectrum as measured on a laboratory conveyor, 1.9 mm peak to peak"
    parity = "even"
    tension_exponent = 0.0
    on_belt = True
    comes_round = True
    min_revolutions = 1.0  # seen once, but alike in all runs
    cause = Cause(
        "the belt's edge is not straight",
        ("upper", "lower"),
        "Look whether the reading repeats with every turn of the belt; average over whole turns.",
    )

    def sensor(self, reading, case):
        phase = _phase(reading.sensor_travel, case)
        cos, first, second = jnp.cos(phase), jnp.zeros(()), jnp.zeros(())
        for k in range(EDGE_HARMONICS, 0, -1):  # Clenshaw's sums, of the cosines and of the sines
            size = jnp.stack([getattr(self, f"cos{k}"), getattr(self, f"sin{k}")])[:, None, None]
            first, second = size + 2.0 * cos * first - second, first
        return replace(reading, y=reading.y + first[0] * cos - second[0] + first[1] * jnp.sin(phase))

    @classmethod
    def columns(cls, sensor_travel, case):
        phase = jnp.arange(1, EDGE_HARMONICS + 1)[:, None, None] * _phase(sensor_travel, case)
        return jnp.stack([jnp.cos(phase), jnp.sin(phase)], axis=1).reshape(-1, *phase.shape[1:])


def _phase(seen, case):
    """2 pi times the place on the belt over its length, of what passes points 1-4, shape (4, n).

    What lies at point 4 at travel 0 has none, whichever way the belt goes, in a run that starts at the marked place.
    """
    rig, direction, seen = case.rig, case.settings.direction, seen + case.settings.start
    at_1, at_2 = rig.span_length, rig.span_length + rig.wrap_tail
    along = jnp.stack([at_1, at_2, at_2 + rig.span_length, 0.0 * at_1])  # points 1-4 along the belt from 4
    return 2 * jnp.pi * (direction * seen[None] - along[:, None]) / rig.belt_length


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
