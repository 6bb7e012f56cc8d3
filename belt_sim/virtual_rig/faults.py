"""Twins of the library's effects: the belt, its spans and loads; then the machine: yaw, pulleys, drive, sensors."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from belt_sim.case import GRAVITY
from belt_sim.virtual_rig.fault import (
    TAIL,
    Fault,
    any_phase,
    any_place_on_belt,
    belt_length,
    largest_yaw,
    shape,
    size,
    time_constant,
    warm_up,
)
from belt_sim.virtual_rig.line import (
    couple_at,
    force_at,
    roll_at_tail,
    tilt_sensitivity,
    uniform_force,
    uniform_roll_couple,
)

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


class IdlerSkewFault(Fault):
    """A skewed idler pushes the upper span towards +y, and to the other side when the belt runs backwards."""

    draw_order = 23
    above: ClassVar[bool] = True
    force: float = size("N", 0.2, 50.0)
    place: float = _place_on_span()

    def loads(self, line):
        return (force_at(line, self.above, self.place),)

    def push(self, s, line, load, free, kept):
        return self.force * line.direction, kept

    def scene(self, parts, case):
        force, span = self.force * float(case.settings.direction), "upper" if self.above else "lower"
        return parts.with_push(span=span, x=self.place * float(case.rig.centre_distance), across=force)


class IdlerSkewLowerFault(IdlerSkewFault):
    """The same under the lower span."""

    draw_order = 0
    above = False


class SideDragFault(Fault):
    """A scraper drags on one edge of the upper span: a couple about the vertical, positive for the edge y > 0."""

    draw_order = 24
    above: ClassVar[bool] = True
    moment: float = size("N m", 0.5, 50.0)
    place: float = _place_on_span()

    def loads(self, line):
        """The drag -D t on the edge at b/2 turns y' upwards along the travel t, whichever way the belt runs."""
        return (couple_at(line, self.above, self.place),)

    def push(self, s, line, load, free, kept):
        return self.moment + 0 * free, kept

    def scene(self, parts, case):
        """The drag itself, against the travel at one edge: on the middle of the belt, and the couple to the edge."""
        half, travel = 0.5 * float(case.belt.width), float(case.settings.direction) * (1.0 if self.above else -1.0)
        drag, span = abs(self.moment) / half, "upper" if self.above else "lower"
        x = self.place * float(case.rig.centre_distance)
        return parts.with_push(span=span, x=x, along=-drag * travel, couple=self.moment * travel)


class SideDragLowerFault(SideDragFault):
    """The same on the lower span."""

    draw_order = 0
    above = False


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
    """A load beside the middle of the upper span rolls it, its side y > 0 down; a belt that cannot roll stays."""

    draw_order = 25
    above: ClassVar[bool] = True
    idle_on = ("beam_th2",)
    moment: float = size("N", 2e-3, 1.0)

    def loads(self, line):
        return (uniform_roll_couple(line, self.above),)

    def push(self, s, line, load, free, kept):
        return -self.moment + 0 * free, kept

    def scene(self, parts, case):
        if self.above:
            return replace(parts, roll=parts.roll - self.moment)
        return replace(parts, roll_lower=parts.roll_lower - self.moment)


class OffCentreLoadLowerFault(OffCentreLoadFault):
    """The same on the lower span."""

    draw_order = 0
    above = False


# Yaw of the pulleys: set, offset, drifting, yielding.


class YawOffsetTailFault(Fault):
    """The tail pulley stands at beta_0 when zero is commanded."""

    draw_order = 1
    beta_0: float = size("rad", 1e-4, 2e-3)

    def set(self, line):
        return replace(line, offset_tail=line.offset_tail + self.beta_0)

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", yaw_offset=self.beta_0)


class YawOffsetHeadFault(Fault):
    """The head pulley stands at beta_0 when zero is commanded."""

    draw_order = 2
    beta_0: float = size("rad", 1e-4, 2e-3)

    def set(self, line):
        return replace(line, offset_head=line.offset_head + self.beta_0)

    def scene(self, parts, case):
        return parts.add_to_pulley("head", yaw_offset=self.beta_0)


class YawBacklashFault(Fault):
    """The tail pulley follows its command through a play of +-half, from the middle of the play."""

    half: float = size("rad", 5e-5, 5e-4, positive=True)

    def set(self, line):
        return replace(line, yaw=np.sign(line.yaw) * np.maximum(np.abs(line.yaw) - self.half, 0.0))


class YawComplianceFault(Fault):
    """The tail pulley's bearings yield to the spans' moments and pull: yaw beta - c_m (M_1 + M_2 - F (y_1 + y_2))."""

    draw_order = 9
    c_m: float = size("rad/(N m)", 5e-6, 5e-5, positive=True)

    def set(self, line):
        return replace(line, compliance=line.compliance + self.c_m)

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", yaw_compliance=self.c_m)


class YawDriftFault(Fault):
    """The machine warms up: the tail pulley turns by rate tau (1 - exp(-t/tau)), t the time since travel 0."""

    draw_order = 16
    rate: float = size("rad/s", 1e-6, 1e-5)
    time_constant: float = time_constant()

    def yaw(self, s, line):
        return self.rate * warm_up(s, line, self.time_constant)


class UnequalTensionFault(Fault):
    """The tensioners pull unequally on both sides: the tail pulley turns in proportion to the belt's force."""

    draw_order = 21
    yaw_per_force: float = size("rad/N", 1e-7, 2e-6)

    def yaw(self, s, line):
        return self.yaw_per_force * line.force

    def scene(self, parts, case):
        force = float(case.settings.tension * case.belt.area)
        return parts.add_to_pulley("tail", yaw_offset=self.yaw_per_force * force)


# Shape and mounting of the pulleys.


class TaperFault(Fault):
    """The tail pulley is a cone: (dR/dy)/R = kappa_t turns the stuck belt, dtheta/ds = -(kappa + kappa_t)."""

    draw_order = 4
    kappa_t: float = size("1/m", 2e-5, 1e-3)

    def turn(self, s, line, y, kappa):
        return self.kappa_t * TAIL

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", taper=self.kappa_t)


class ThicknessWedgeFault(Fault):
    """The belt is thicker towards +y: its middle runs on the pulley's radius and half of what is below it, a cone."""

    slope: float = size("1", 7e-6, 1e-4)

    def turn(self, s, line, y, kappa):
        middle = np.stack([line.tail_radius, line.head_radius])
        return 0.5 * self.slope / middle

    def scene(self, parts, case):
        for pulley, radius in (("tail", case.rig.tail_radius), ("head", case.rig.head_radius)):
            parts = parts.add_to_pulley(pulley, taper=0.5 * self.slope / float(radius))
        return parts


class TaperDriftFault(Fault):
    """The tail pulley grows a taper as it warms up: kappa_t = rate tau (1 - exp(-t/tau)), t since travel 0."""

    draw_order = 17
    rate: float = size("1/(m s)", 2e-7, 5e-6)
    time_constant: float = time_constant()

    def turn(self, s, line, y, kappa):
        return self.rate * warm_up(s, line, self.time_constant) * TAIL


class BuildUpFault(Fault):
    """Dirt grows on one side of the tail pulley with the travel: a taper kappa_t = rate s."""

    draw_order = 18
    rate: float = size("1/m2", 5e-7, 1e-5)

    def turn(self, s, line, y, kappa):
        return self.rate * s * TAIL


class CrownFault(Fault):
    """The tail pulley is thicker in its middle: a taper -c y."""

    draw_order = 5
    c: float = size("1/m2", 5e-3, 0.5)

    def turn(self, s, line, y, kappa):
        return -self.c * y * TAIL

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", crown=self.c)


class PulleyDeflectionFault(Fault):
    """Both pulleys bend under the belt's pull as beams do: at y each is yawed by compliance F y, the ends apart."""

    draw_order = 19
    compliance: float = size("1/(N m)", 1e-6, 5e-6, positive=True)

    def set(self, line):
        return replace(line, deflection=line.deflection + self.compliance)

    def scene(self, parts, case):
        bow = self.compliance * float(case.settings.tension * case.belt.area)
        return parts.add_to_pulley("head", bow=-bow).add_to_pulley("tail", bow=bow)


class CantFault(Fault):
    """The tail pulley's axis rises by gamma towards +y: it shifts the belt on its wrap, and rolls the spans' ends."""

    draw_order = 3
    gamma: float = size("rad", 1e-3, 5e-3)

    def set(self, line):
        return replace(line, cant=line.cant + self.gamma)

    def loads(self, line):
        return roll_at_tail(line, True), roll_at_tail(line, False)

    def push(self, s, line, load, free, kept):
        return self.gamma + 0 * free, kept

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", cant=self.gamma)


class WobbleFault(Fault):
    """The tail pulley sits askew on its shaft: its axis describes a cone of half angle beta_1 about the bearings' axis.

    Put the cylinder's axis through the pulley's middle, turned from the shaft's by beta_1 towards the material angle q
    (from the shaft's +y, seen along it). A generator at the material angle a then stands R + beta_1 y cos(a - q) from
    the shaft. Where the belt runs up, a falls by s/R; the belt beside, y further out, is wound up on that much more
    radius and gets ahead: per metre it turns back by the radius's slope over R. The surface turns in itself, and rolls
    the spans' ends by beta_1 sin.

    Before travel 0 the belt ran straight round the cylinder, that is along the shaft's wave.

    Seen from above the axis swings by beta_1 cos(s/R + phase): the slope of the radius is a quarter turn late.
    """

    draw_order = 6
    beta_1: float = size("rad", 1e-3, 2e-3)
    phase: float = shape(0.0, any_phase, lambda plan: (0.0, np.pi / 2))

    def turn(self, s, line, y, kappa):
        slope = self.beta_1 * np.cos((s + line.start) / line.tail_radius + self.phase - np.pi / 2)
        return slope / line.tail_radius * TAIL

    def loads(self, line):
        return roll_at_tail(line, True), roll_at_tail(line, False)

    def push(self, s, line, load, free, kept):
        return line.direction * self.beta_1 * np.sin((s + line.start) / line.tail_radius + self.phase) + 0 * free, kept

    def initial_state(self, s, line):
        """What has the slope -y'' = turn and no more: y' = -alpha."""
        at = (s + line.start) / line.tail_radius + self.phase
        none = 0.0 * at
        return np.stack([-self.beta_1 * line.tail_radius * np.sin(at), self.beta_1 * np.cos(at), none, none])

    def scene(self, parts, case):
        """The scene counts the pulley's turn from head to tail on top, the fault along the travel."""
        phase = self.phase * float(case.settings.direction)
        return parts.with_pulley("tail", wobble=self.beta_1, wobble_phase=phase) if self.beta_1 else parts


# How the pulleys hold the belt: friction, cover, film, bending layer.


class SlipFault(Fault):
    """Both pulleys hold the belt by friction, given as 1/mu; 0 = they hold any moment.

    At each change of yaw the run-ups let go once, and the run-offs let go all the time (march.py).
    """

    draw_order = 8
    inverse_friction: float = size("1", 1 / 0.15, 20.0, positive=True)

    def set(self, line):
        slippery = np.broadcast_to(self.inverse_friction, line.friction.shape)
        with np.errstate(divide="ignore"):
            return replace(line, friction=np.minimum(line.friction, 1.0 / slippery))

    def scene(self, parts, case):
        held = 1 / self.inverse_friction if self.inverse_friction else np.inf
        return replace(parts, friction=min(parts.friction, held))


class SoftCoverFault(Fault):
    """Both pulleys yield under the entry moment M: dtheta/ds = -(kappa + c M)."""

    draw_order = 7
    c: float = size("1/(N m2)", 5e-6, 2e-4, positive=True)

    def set(self, line):
        return replace(line, cover=line.cover + self.c)


def _fastest(plan) -> float:
    return max(run.speed for run in plan.runs)


class TractionLossFault(Fault):
    """A film above a speed: the belt follows its contact angle in part, by 1 - loss (v - onset), on both pulleys."""

    draw_order = 20
    loss: float = size("s/m", 0.2, 1.0, positive=True)
    onset: float = shape(
        0.0,
        lambda plan, rng: rng.uniform(0.0, 0.8) * _fastest(plan),
        lambda plan: [share * _fastest(plan) for share in (0.0, 0.7)],
    )

    def slide(self, s, line, alpha):
        return np.maximum(1 - self.loss * np.maximum(line.speed - self.onset, 0.0), 0.0)


class LiftOffFault(Fault):
    """A belt that resists bending leaves its pulleys along a layer: the ends of its spans give way to their couples.

    They do so unlike above and below. 1 is the layer of the belt's own plate stiffness; nothing of it is fitted.
    """

    fixed = True
    strength: float = size("1", 1.0, 1.5)

    def set(self, line):
        return replace(line, layer=line.layer + self.strength)


# Tension and speed.


class TensionBiasFault(Fault):
    """The load cell errs: true tension sigma (1 + gain) + bias."""

    draw_order = 10
    gain: float = size("1", 0.1, 0.3)
    bias: float = size("Pa", 5e5, 3e6)

    def set(self, line):
        return replace(line, stress=line.stress * (1 + self.gain) + self.bias)


class SpeedTensionFault(Fault):
    """Centrifugal tension: the spans feel sigma - share rho v^2."""

    share: float = size("1", 1.0, 1.5, positive=True)

    def set(self, line):
        return replace(line, stress=line.stress - self.share * line.density * line.speed**2)


# Sensors and recorder.


def at_point(fault: Fault, letter: str, place: str):
    """The parameter of the sensor at a point; none for a tilt sensor."""
    return getattr(fault, letter + place[-1]) if place.startswith("point_") else 0.0


class SensorOffsetFault(Fault):
    """The sensor at point k shows y + ck in every run."""

    c1: float = size("m", 5e-4, 2e-2, place="point_1")
    c2: float = size("m", 5e-4, 2e-2, place="point_2")
    c3: float = size("m", 5e-4, 2e-2, place="point_3")
    c4: float = size("m", 5e-4, 2e-2, place="point_4")

    def read(self, value, place, s, line):
        return value + at_point(self, "c", place)


class SensorGainFault(Fault):
    """The sensor at point k shows (1 + gk) y."""

    draw_order = 12
    g1: float = size("1", 0.05, 0.3, place="point_1")
    g2: float = size("1", 0.05, 0.3, place="point_2")
    g3: float = size("1", 0.05, 0.3, place="point_3")
    g4: float = size("1", 0.05, 0.3, place="point_4")

    def read(self, value, place, s, line):
        return value * (1 + at_point(self, "g", place))


class SensorDriftFault(Fault):
    """The sensor at point k shows y + dk t, t since the yaw was applied."""

    draw_order = 13
    d1: float = size("m/s", 5e-6, 2e-5, place="point_1")
    d2: float = size("m/s", 5e-6, 2e-5, place="point_2")
    d3: float = size("m/s", 5e-6, 2e-5, place="point_3")
    d4: float = size("m/s", 5e-6, 2e-5, place="point_4")

    def read(self, value, place, s, line):
        return value + at_point(self, "d", place) * (s - line.yaw_at) / line.speed


class SensorDelayFault(Fault):
    """Every lateral reading shows what was there ``delay`` seconds ago."""

    draw_order = 26
    delay: float = size("s", 1.5, 5.0, positive=True)

    def sensor_travel(self, s, line):
        return s - self.delay * line.speed


class EncoderScaleFault(Fault):
    """The recorder shows (1 + e) s."""

    draw_order = 11
    e: float = size("1", 0.02, 0.1)

    def set(self, line):
        return replace(line, yaw_at=line.yaw_at / (1 + self.e))

    def true_travel(self, shown, line):
        return shown / (1 + self.e)
