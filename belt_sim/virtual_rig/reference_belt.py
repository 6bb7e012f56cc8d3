"""Twins of the library's effects on the belt and its spans: natural curvature, weld, edge, sag, flatness, loads."""

from dataclasses import replace

import numpy as np

from belt_sim.case import GRAVITY
from belt_sim.virtual_rig.fault import Fault, any_place_on_belt, belt_length, largest_yaw, shape, size
from belt_sim.virtual_rig.load import couple_at, force_at, tilt_sensitivity, uniform_force, uniform_roll_couple

# The belt itself: natural curvature, weld, edge, sag.


class CamberFault(Fault):
    """The belt is curved in its plane by nature; by Betti a run-up feels what its span's shape does not take up."""

    draw_order = 27
    kappa_c: float = size("1/m", 2e-5, 1e-3)

    def turn(self, s, line, y, kappa):
        left = 1 - line.runup_sensitivity.mean(axis=1) * line.span_length
        return np.broadcast_to(self.kappa_c * left, kappa.shape)

    def read(self, value, place, s, line):
        if not place.endswith("mid_span"):
            return value
        per_curvature = line.bending * line.span_length * tilt_sensitivity(line, place == "upper_mid_span").mean(axis=1)
        return value + self.kappa_c * per_curvature

    def scene(self, parts, case):
        return parts.with_camber(lambda s: np.full(np.shape(s), self.kappa_c)) if self.kappa_c else parts


class TemperatureDifferenceFault(Fault):
    """The edge at +y is warmer, and longer by 12 ppm a kelvin: the belt is curved towards the colder edge."""

    difference: float = size("K", 0.3, 15.0)

    def _curved(self, width):
        longer = 12e-6 * self.difference
        return CamberFault(kappa_c=-longer / width)

    def turn(self, s, line, y, kappa):
        return self._curved(line.width).turn(s, line, y, kappa)

    def read(self, value, place, s, line):
        return self._curved(line.width).read(value, place, s, line)

    def scene(self, parts, case):
        return self._curved(float(case.belt.width)).scene(parts, case)


class FlatnessFault(Fault):
    """Residual stress of the strip, amplitude (1 - 12 y^2/b^2) across its width; positive: long edges."""

    amplitude: float = size("Pa", 4e6, 2e7)

    def set(self, line):
        return replace(line, residual=line.residual + self.amplitude)


_POINTS = (np.arange(16) + 0.5) / 16 - 0.5  # quadrature over the bend
_SHAPE = 1 + np.cos(2 * np.pi * _POINTS)


class WeldFault(Fault):
    """A weld: a kink of the belt over a raised cosine; at travel 0 it lies ``at`` along the belt from point 4 over 1,
    2, 3.

    Elastic part by Betti: a kink at x bends the run-up by minus the curvature at x per unit run-up angle; the kink
    itself counts while it runs up, so that one passage, once a belt length, turns the belt by -angle in all.
    """

    draw_order = 28
    LENGTH = 0.6  # [m], wide against a step of the march
    angle: float = size("rad", 2e-4, 2e-3)
    at: float = shape(5.64, any_place_on_belt, lambda plan: [share * belt_length(plan) for share in np.arange(8) / 8])

    def turn(self, s, line, y, kappa):
        return self.angle * np.stack([self._at_runup(place, line) for place in self._places(s, line)])

    def read(self, value, place, s, line):
        if not place.endswith("mid_span"):
            return value
        upper = place == "upper_mid_span"
        behind = np.where((line.direction > 0) == upper, *self._places(s, line))
        tilt = self._mean_curvature(self._on_last_turn(behind, line), tilt_sensitivity(line, upper), line)
        return value + self.angle * line.bending * tilt

    def _places(self, s, line):
        """How far the kink lies behind the run-off of the span to the tail, and of that to the head, not wrapped."""
        behind_point_3 = 2 * line.span_length + line.wrap_tail - self.at
        place = np.where(line.direction > 0, self.at, behind_point_3) + s
        place = place + line.start
        return place, place - line.span_length - line.wrap_tail

    def _on_last_turn(self, place, line):
        """The same on the last way round the belt."""
        half = self.LENGTH / 2
        return np.mod(place + half, line.belt_length) - half

    def _at_runup(self, place, line):
        """Curvature at a span's run-up from a unit kink at ``place`` behind its run-off, shape (batch,)."""
        place = self._on_last_turn(place, line)
        passing = (line.span_length - place) / self.LENGTH
        bump = np.where(np.abs(passing) < 0.5, (1 + np.cos(2 * np.pi * passing)) / self.LENGTH, 0.0)
        return bump - self._mean_curvature(place, line.runup_sensitivity, line)

    def _mean_curvature(self, place, bent, line):
        """Mean over a unit kink at ``place`` (..., batch) of the curvature ``bent`` (batch, n) along a span."""
        length = line.span_length[:, None]
        local = place[..., None] + _POINTS * self.LENGTH
        inside = (local > 0) & (local < length)
        cell = np.clip((local / length) * bent.shape[1] - 0.5, 0, bent.shape[1] - 1.001)
        k, t = cell.astype(int), cell % 1
        rows = np.arange(len(bent))[:, None]
        felt = (1 - t) * bent[rows, k] + t * bent[rows, k + 1]
        return (felt * inside) @ _SHAPE / len(_SHAPE)

    def scene(self, parts, case):
        """Curved by nature over the weld's length."""
        length, around = self.LENGTH, float(case.rig.belt_length)

        def camber(s):
            off = (s - self.at + 0.5 * around) % around - 0.5 * around
            bent = self.angle / length * (1 + np.cos(2 * np.pi * off / length))
            return np.where(np.abs(off) < 0.5 * length, bent, 0.0)

        return parts.with_camber(camber) if self.angle else parts


HARMONICS, DECAY = 40, 1.27
FIRST = 4e-4  # [m]: of the cosine and of the sine, together 0.57 mm
STEEPEST = 1e-2  # [m]: amplitude times harmonic, that is 3 mm/m of slope on a belt of 20 m


_SIZES = {
    f"{kind}{k}": size("m", FIRST / k**DECAY, STEEPEST / k) for k in range(1, HARMONICS + 1) for kind in ("cos", "sin")
}
_Harmonics = type("_Harmonics", (Fault,), {**_SIZES, "__annotations__": dict.fromkeys(_SIZES, float)})


class EdgeProfileFault(_Harmonics):  # type: ignore[misc,valid-type]
    """The belt's edge is not straight: y + e(m) - e(m when the yaw was applied), m the part of the belt.

    e = sum over k of (cosk cos + sink sin)(2 pi k m / belt length), m counted backwards from what was at point 4 at
    travel 0. The last term: y = 0 is where the point was when the yaw was applied. Forty harmonics, drawn with the
    spectrum of a measured edge: amplitudes that fall like k^-1.27 about 0.57 mm for the first.
    """

    draw_order = 14
    mixed = True

    def edge(self, place, s, line):
        phase = -2 * np.pi * line.belt_coordinate(place, s) / line.belt_length
        edge = 0.0
        for k in range(1, HARMONICS + 1):
            cos, sin = getattr(self, f"cos{k}"), getattr(self, f"sin{k}")
            if np.any(cos) or np.any(sin):
                edge = edge + (cos * np.cos(k * phase) + sin * np.sin(k * phase))
        return edge


class SagRollFault(Fault):
    """The sagging belt tilts instead of bending in its plane: 1 makes a flat strip the strip.

    The base has none of it (beam_th2) or all (strip), and the fault adds ``strength`` to that share. In the scene,
    where a belt tilts because it hangs, the share is that of its weight: a belt of base beam_th2 has none until this
    fault.
    """

    draw_order = 15
    fixed = True
    part_of = ("strip",)
    strength: float = size("1", 1.0, 1.5)

    def set(self, line):
        return replace(line, sag_roll=line.sag_roll + self.strength)

    def scene(self, parts, case):
        return replace(parts, gravity=parts.gravity + self.strength * GRAVITY)


# Loads beside the pulleys: idlers, scrapers, guides, weight.


def _place_on_span():
    """A place as a share of the span's length."""
    return shape(0.5, lambda plan, rng: rng.uniform(0.1, 0.9), lambda plan: (0.15, 0.4, 0.6, 0.85))


def _on_spans(upper, lower, line, unit_load):
    """Unit loads on the spans that a fault of these sizes acts on; unit_load: of ``load``, without its span."""
    return tuple(unit_load(line, above) for above, size in ((True, upper), (False, lower)) if above or np.any(size))


class IdlerSkewFault(Fault):
    """A skewed idler pushes a span towards +y, and to the other side when the belt runs backwards."""

    draw_order = 23
    force: float = size("N", 0.2, 50.0)
    force_lower: float = size("N", 0.2, 50.0, drawn=False)
    place: float = _place_on_span()

    def loads(self, line):
        return _on_spans(self.force, self.force_lower, line, lambda line, above: force_at(line, above, self.place))

    def push(self, s, line, load, free, kept):
        return (self.force if load.upper else self.force_lower) * line.direction, kept

    def scene(self, parts, case):
        x, direction = self.place * float(case.rig.centre_distance), float(case.settings.direction)
        parts = parts.with_push(span="upper", x=x, across=self.force * direction)
        return parts.with_push(span="lower", x=x, across=self.force_lower * direction)


class SideDragFault(Fault):
    """A scraper drags on one edge of a span: a couple about the vertical, positive for the edge y > 0."""

    draw_order = 24
    moment: float = size("N m", 0.5, 50.0)
    moment_lower: float = size("N m", 0.5, 50.0, drawn=False)
    place: float = _place_on_span()

    def loads(self, line):
        """The drag -D t on the edge at b/2 turns y' upwards along the travel t, whichever way the belt runs."""
        return _on_spans(self.moment, self.moment_lower, line, lambda line, above: couple_at(line, above, self.place))

    def push(self, s, line, load, free, kept):
        return (self.moment if load.upper else self.moment_lower) + 0 * free, kept

    def scene(self, parts, case):
        """The drag itself, against the travel at one edge: on the middle of the belt, and the couple to the edge."""
        half, x = 0.5 * float(case.belt.width), self.place * float(case.rig.centre_distance)
        for span, moment, way in (("upper", self.moment, 1.0), ("lower", self.moment_lower, -1.0)):
            travel = way * float(case.settings.direction)  # of what runs there, along the machine
            parts = parts.with_push(span=span, x=x, along=-abs(moment) / half * travel, couple=moment * travel)
        return parts


def _excursion(plan) -> float:
    """How far the belt may come in the record [m]: a sixth of what a rope would make of its largest yaw."""
    return largest_yaw(plan) * plan.length / 6 + 1e-4


class EdgeGuideFault(Fault):
    """Rollers on both sides of a span, ``at`` from the tail pulley: elastic stops for a belt ``gap`` off the middle."""

    draw_order = 29
    stiffness: float = size("N/m", 1e5, 1e7, positive=True)
    stiffness_lower: float = size("N/m", 1e5, 1e7, positive=True)
    gap: float = shape(
        5e-4,
        lambda plan, rng: rng.uniform(0.1, 0.6) * _excursion(plan),
        lambda plan: [share * _excursion(plan) for share in (0.2, 0.5)],
    )
    at: float = shape(
        1.0,
        lambda plan, rng: rng.uniform(0.15, 0.85) * plan.machine.centre_distance.value,
        lambda plan: [share * plan.machine.centre_distance.value for share in (0.3, 0.7)],
    )

    def loads(self, line):
        share = 1 - self.at / line.span_length
        return force_at(line, True, share), force_at(line, False, share)

    def push(self, s, line, load, free, kept):
        """The roller and the span give way together: k (|y| - gap) back towards the middle, as far as friction of the
        half turn on a pulley bears it, 0.3 pi F."""
        k = np.broadcast_to(self.stiffness if load.upper else self.stiffness_lower, free.shape)
        beyond = np.maximum(np.abs(free) - self.gap, 0.0)
        return -np.sign(free) * np.minimum(k * beyond / (1 + k * load.give), 0.3 * np.pi * line.force), kept

    def scene(self, parts, case):
        """As lines beside the spans; equal pulleys are taken for the place along the machine."""
        x = float(case.rig.centre_distance) - self.at
        for span, stiffness in (("upper", self.stiffness), ("lower", self.stiffness_lower)):
            for side in (1.0, -1.0) if stiffness else ():
                parts = parts.with_guide(span=span, x=x, gap=self.gap, side=side, stiffness=stiffness)
        return parts


class MachineTiltFault(Fault):
    """The machine leans about its long axis: a share of the belt's weight, q angle, pulls both spans towards +y."""

    draw_order = 22
    angle: float = size("rad", 2e-3, 0.05)

    def loads(self, line):
        return uniform_force(line, True), uniform_force(line, False)

    def push(self, s, line, load, free, kept):
        weight = line.density * line.gravity * line.width * line.thickness
        return self.angle * weight, kept

    def scene(self, parts, case):
        return replace(parts, lean=parts.lean + self.angle)


class OffCentreLoadFault(Fault):
    """A load beside the middle of a span rolls it, its side y > 0 down; a belt that cannot roll stays."""

    draw_order = 25
    idle_on = ("beam_th2",)
    moment: float = size("N", 2e-3, 1.0)
    moment_lower: float = size("N", 2e-3, 1.0, drawn=False)

    def loads(self, line):
        return _on_spans(self.moment, self.moment_lower, line, uniform_roll_couple)

    def push(self, s, line, load, free, kept):
        return -(self.moment if load.upper else self.moment_lower) + 0 * free, kept

    def scene(self, parts, case):
        return replace(parts, roll=parts.roll - self.moment, roll_lower=parts.roll_lower - self.moment_lower)
