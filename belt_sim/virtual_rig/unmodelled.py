"""Faults that no catalogue lists: of yaw, pulleys, contact, tension, sensors; then loads on spans, and EI, T, Z, F."""

from dataclasses import replace

import numpy as np

from belt_sim.case import GRAVITY
from belt_sim.virtual_rig.fault import (
    HEAD,
    TAIL,
    UnmodelledFault,
    any_phase,
    any_place_on_belt,
    any_seed,
    duration,
    largest_yaw,
    log_uniform,
    random_course,
    shape,
    size,
    smooth_step,
)
from belt_sim.virtual_rig.line import DOUBLINGS, Sections, force_at

# Yaw of the pulleys.


class ProgressiveYaw(UnmodelledFault):
    """The steering's lever turns the pulley more than in proportion: share yaw |yaw|/1 mrad is added."""

    place, variable, form = "yaw_tail", "yaw", "power"
    also = (("yaw", "linear"),)
    share: float = size("1", 0.3, 5.0)

    def yaw(self, s, line):
        return self.share * line.yaw * np.abs(line.yaw) / 1e-3 * (s >= line.yaw_at)


class SpeedBow(UnmodelledFault):
    """The frame bows under the drive: the tail pulley turns by c v^2."""

    place, variable, form = "yaw_tail", "speed", "power"
    also = (("speed", "linear"),)
    c: float = size("rad s2/m2", 2e-4, 2e-2)

    def yaw(self, s, line):
        return self.c * line.speed**2


class FrameTwist(UnmodelledFault):
    """The frame twists under the belt's pull more than in proportion: the head pulley turns by c (sigma/10 N/mm2)^2."""

    place, variable, form = "yaw_head", "tension", "power"
    also = (("tension", "linear"),)
    c: float = size("rad", 2e-5, 2e-3)

    def yaw_head(self, s, line):
        return self.c * (line.stress / 1e7) ** 2


class YawCreep(UnmodelledFault):
    """The steering relaxes after its step: share (1 - exp(-t/time)) of the yaw is added in time."""

    place, variable, form = "yaw_tail", "time_since_step", "exponential"
    also = (("time_since_step", "saturating"), ("travel", "exponential"))
    share: float = size("1", 0.2, 3.0)
    time: float = shape(25.0, lambda plan, rng: rng.uniform(0.1, 0.5) * plan.length / plan.runs[0].speed)

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * (1 - np.exp(-t / self.time))


class RingingYaw(UnmodelledFault):
    """The steering swings about its new position after the step, by a share of it that dies out in time."""

    place, variable, form = "yaw_tail", "time_since_step", "exponential"
    also = (("time_since_step", "periodic"), ("wave", "periodic"), ("travel", "exponential"))
    share: float = size("1", 0.3, 3.0)
    time: float = shape(30.0, lambda plan, rng: rng.uniform(0.1, 0.6) * duration(plan))
    period: float = shape(20.0, lambda plan, rng: rng.uniform(0.1, 0.4) * duration(plan))

    def yaw(self, s, line):
        t = np.maximum(s - line.yaw_at, 0.0) / line.speed
        return self.share * line.yaw * np.exp(-t / self.time) * np.sin(2 * np.pi * t / self.period)


class StrangeWave(UnmodelledFault):
    """The tail pulley's yaw swings with a wavelength that belongs to no part of the machine."""

    place, variable, form = "yaw_tail", "wave", "periodic"
    amplitude: float = size("rad", 1e-4, 5e-3)
    wavelength: float = shape(7.3, lambda plan, rng: rng.uniform(3.0, 9.0))
    phase: float = shape(0.0, any_phase)

    def yaw(self, s, line):
        return self.amplitude * np.sin(2 * np.pi * s / self.wavelength + self.phase)


class BeatingHead(UnmodelledFault):
    """Two gears of nearly the same pitch turn the head pulley to and fro: its swing comes and goes."""

    place, variable, form = "yaw_head", "wave", "periodic"
    also = (("travel", "periodic"),)
    amplitude: float = size("rad", 1e-4, 5e-3)
    wavelength: float = shape(4.0, lambda plan, rng: rng.uniform(2.5, 7.0))
    ratio: float = shape(1.15, lambda plan, rng: rng.uniform(1.08, 1.3))
    phase: float = shape(0.0, any_phase)

    def yaw_head(self, s, line):
        way = 2 * np.pi * s / self.wavelength
        return self.amplitude * (np.sin(way + self.phase) + np.sin(way / self.ratio))


class ThermostatHead(UnmodelledFault):
    """A fan cools the head pulley's bearing in turns: its yaw swings to and fro in straight strokes, in time."""

    place, variable, form = "yaw_head", "wave", "periodic"
    also = (("time_since_step", "periodic"), ("travel", "periodic"))
    amplitude: float = size("rad", 1e-4, 5e-3)
    period: float = shape(40.0, lambda plan, rng: rng.uniform(0.1, 0.5) * duration(plan))
    phase: float = shape(0.0, any_phase)

    def yaw_head(self, s, line):
        return self.amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * s / line.speed / self.period + self.phase))


# Run-up: what turns the belt where it lands.


class QuadraticContact(UnmodelledFault):
    """The tail pulley turns the belt by c y^2 per metre."""

    place, variable, form = "runup_tail", "y", "power"
    c: float = size("1/m3", 0.05, 50.0)

    def turn(self, s, line, y, kappa):
        return self.c * y**2 * TAIL


class SoftShoulder(UnmodelledFault):
    """The head pulley has shoulders: off the middle it turns the belt back by kappa at most, kappa tanh(y/y0)."""

    place, variable, form = "runup_head", "y", "saturating"
    also = (("y", "power"), ("y", "threshold"))
    kappa: float = size("1/m", 3e-5, 2e-3)
    width: float = shape(1e-3, lambda plan, rng: 10 ** rng.uniform(-3.7, -2.5))

    def turn(self, s, line, y, kappa):
        return -self.kappa * np.tanh(y / self.width) * HEAD


class DeadZone(UnmodelledFault):
    """Curvature below kappa_d does not turn the belt on the pulley."""

    place, variable, form = "runup_both", "curvature", "threshold"
    also = (("curvature", "saturating"),)
    kappa_d: float = size("1/m", 1e-5, 5e-4, positive=True)

    def turn(self, s, line, y, kappa):
        return -np.clip(kappa, -self.kappa_d, self.kappa_d)


class SquareMoment(UnmodelledFault):
    """The cover gives way more than in proportion: both pulleys turn the belt by c kappa |kappa| more."""

    place, variable, form = "runup_both", "curvature", "power"
    c: float = size("m", 800.0, 2e5)

    def turn(self, s, line, y, kappa):
        return kappa * np.maximum(self.c * np.abs(kappa), -0.95)


class BaldPatch(UnmodelledFault):
    """The tail pulley's lagging is gone on one side of a patch: a taper that acts while the patch takes the belt up."""

    place, variable, form = "runup_tail", "pulley_phase", "periodic"
    also = (("wave", "periodic"), ("travel", "periodic"))
    kappa: float = size("1/m", 1e-4, 1e-2)
    phase: float = shape(0.0, any_phase)
    narrow: float = shape(3.0, lambda plan, rng: rng.uniform(1.5, 5.0))

    def turn(self, s, line, y, kappa):
        return self.kappa * np.exp(self.narrow * (np.cos((s + line.start) / line.tail_radius - self.phase) - 1)) * TAIL


_FULL = 1e-4  # [rad]


class LaggingSet(UnmodelledFault):
    """The tail pulley's rubber stays askew after a yaw step and recovers in time: it turns the belt meanwhile.

    Fully from a yaw of ``_FULL`` on; a pulley that is set to no yaw, and errs by a microradian, sets nothing.
    """

    place, variable, form = "runup_tail", "time_since_step", "exponential"
    also = (("travel", "exponential"), ("time_since_step", "saturating"))
    kappa: float = size("1/m", 1e-4, 5e-3)
    time: float = shape(20.0, lambda plan, rng: rng.uniform(0.08, 0.5) * plan.length / plan.runs[0].speed)

    def turn(self, s, line, y, kappa):
        t = (s - line.yaw_at) / line.speed
        left = np.where(t >= 0, np.exp(-np.maximum(t, 0.0) / self.time), 0.0)
        return self.kappa * np.clip(line.yaw / _FULL, -1.0, 1.0) * left * TAIL


class Rut(UnmodelledFault):
    """The belt wears a rut into the tail pulley: it is turned as it lay there one revolution of the belt ago."""

    place, variable, form = "runup_tail", "y", "linear"
    also = (("belt_phase", "linear"), ("belt_phase", "periodic"))
    c: float = size("1/m2", 1e-2, 1.0)

    def recall(self, s, past):
        return self.c * past.state_at(s - past.line.belt_length, 0, 1) * TAIL


class WalkingAngle(UnmodelledFault):
    """The contact angle on the tail pulley takes a random walk of its own in every run."""

    place, variable, form = "runup_tail", "travel", "random"
    size: float = size("rad/m^0.5", 5e-6, 1e-3, positive=True)
    seed: int = shape(0, any_seed)

    def turn(self, s, line, y, kappa):
        return self.size * random_course(self.seed, line.run, s) * TAIL


# Run-up and wrap: how the belt follows its contact angle, and slides.


class AdhesionLoss(UnmodelledFault):
    """From travel ``after`` on, the belt climbs faster or slower sideways than it should by ``share``."""

    place, variable, form = "runup_both", "travel", "threshold"
    also = (("travel", "saturating"), ("time_since_step", "threshold"))
    share: float = size("1", 0.15, 2.0)
    after: float = shape(20.0, lambda plan, rng: rng.uniform(0.15, 0.5) * plan.length)

    def slide(self, s, line, alpha):
        return 1 + self.share * smooth_step(s, self.after, 4.0)


class MidStick(UnmodelledFault):
    """In mid run the belt runs straight for a while, sideways held by ``share``."""

    place, variable, form = "runup_both", "travel", "threshold"
    also = (("time_since_step", "threshold"),)
    share: float = size("1", 0.5, 1.0, positive=True)
    begin: float = shape(25.0, lambda plan, rng: rng.uniform(0.15, 0.6) * plan.length)
    length: float = shape(6.0, lambda plan, rng: rng.uniform(0.1, 0.25) * plan.length)

    def slide(self, s, line, alpha):
        return 1 - self.share * smooth_step(s, self.begin, 1) * (1 - smooth_step(s, self.begin + self.length, 1))


class GreasyStretch(UnmodelledFault):
    """A stretch of the belt is greasy: while it runs up on a pulley, the belt follows its contact angle less."""

    place, variable, form = "runup_both", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"))
    share: float = size("1", 0.3, 1.0, positive=True)
    at: float = shape(0.3, lambda plan, rng: rng.uniform(0.0, 1.0))
    stretch: float = shape(0.3, lambda plan, rng: rng.uniform(0.15, 0.5))

    def slide(self, s, line, alpha):
        """at, stretch: shares of the belt's length, from what runs up to the tail pulley at travel 0, backwards."""
        run = (np.stack([s + 0.0 * line.start, s - line.span_length - line.wrap_tail]) + line.start) / line.belt_length
        off = np.mod(run - self.at + 0.5, 1.0) - 0.5
        return 1 - self.share * np.where(np.abs(off) < self.stretch / 2, np.cos(np.pi * off / self.stretch) ** 2, 0.0)


class FollowPower(UnmodelledFault):
    """On the tail pulley the belt climbs by a power of its contact angle, |alpha|^(1 + p), alike at 0.1 mrad."""

    place, variable, form = "runup_tail", "contact_angle", "power"
    p: float = size("1", 0.2, 1.5)
    REFERENCE, SMALLEST = 1e-4, 1e-5  # [rad]

    def slide(self, s, line, alpha):
        size = np.sqrt(alpha[:1] ** 2 + self.SMALLEST**2) / self.REFERENCE
        return np.concatenate([size**self.p, np.ones_like(size)])


class GripLimit(UnmodelledFault):
    """The belt follows its contact angle less and less, the larger it is: alpha becomes a tanh(alpha/a)."""

    place, variable, form = "runup_both", "contact_angle", "saturating"
    also = (("contact_angle", "power"),)
    inverse_angle: float = size("1/rad", 2e3, 2e5, positive=True)

    def slide(self, s, line, alpha):
        x = np.abs(alpha * self.inverse_angle)
        return np.where(x > 1e-6, np.tanh(x) / np.maximum(x, 1e-6), 1.0)


class WrapCreep(UnmodelledFault):
    """Wrapped round both pulleys, the belt goes on sideways by a share of what its contact angle asks for."""

    place, variable, form = "wrap", "contact_angle", "linear"
    share: float = size("1", 0.3, 5.0)

    def creep(self, s, line, alpha):
        return -self.share * np.stack([line.wrap_tail * alpha[0], line.wrap_head * alpha[1]])


class WrapSlide(UnmodelledFault):
    """On the tail pulley a belt that lies too much askew slides on: by ``length`` times the angle beyond a limit."""

    place, variable, form = "wrap", "contact_angle", "threshold"
    also = (("contact_angle", "linear"),)
    length: float = size("m", 0.5, 5.0, positive=True)
    limit: float = shape(1e-4, lambda plan, rng: rng.uniform(0.1, 0.4) * largest_yaw(plan))

    def creep(self, s, line, alpha):
        beyond = np.sign(alpha[:1]) * np.maximum(np.abs(alpha[:1]) - self.limit, 0.0)
        return np.concatenate([-self.length * beyond, np.zeros_like(beyond)])


# Tension.


class TensionDecay(UnmodelledFault):
    """The belt loses ``share`` of its tension over ``length`` metres of travel."""

    place, variable, form = "tension", "travel", "exponential"
    also = (("travel", "saturating"), ("time_since_step", "exponential"))
    share: float = size("1", 0.15, 0.6, positive=True)
    length: float = shape(20.0, lambda plan, rng: rng.uniform(0.15, 0.6) * plan.length)

    def tension(self, s, line):
        return -self.share * (1 - np.exp(-s / self.length))

    @property
    def swing(self):
        return -self.share, 0.0


class RatchetSlip(UnmodelledFault):
    """The take-up slips a tooth at travel ``at``: the belt loses a share of its tension at once."""

    place, variable, form = "tension", "travel", "threshold"
    also = (("travel", "constant"), ("time_since_step", "threshold"))
    share: float = size("1", 0.15, 0.6, positive=True)
    at: float = shape(15.0, lambda plan, rng: rng.uniform(0.15, 0.6) * plan.length)

    def tension(self, s, line):
        return -self.share * smooth_step(s, self.at, 1.0)

    @property
    def swing(self):
        return -self.share, 0.0


class TensionBeat(UnmodelledFault):
    """The tension swings by a share once a revolution of the belt, as a stiff splice goes round."""

    place, variable, form = "tension", "belt_phase", "periodic"
    also = (("wave", "periodic"), ("travel", "periodic"))
    share: float = size("1", 0.1, 0.6, positive=True)
    phase: float = shape(0.0, any_phase)

    def tension(self, s, line):
        return self.share * np.cos(2 * np.pi * (s + line.start) / line.belt_length + self.phase)

    @property
    def swing(self):
        return -self.share, self.share


# Sensors and recorder.


class SensorCubic(UnmodelledFault):
    """The sensor at point 1 shows y + c y^3."""

    place, variable, form = "sensor_y1", "y", "power"
    c: float = size("1/m2", 1000.0, 1e5)

    def read(self, value, place, s, line):
        return value + self.c * value**3 if place == "point_1" else value


class ShortRange(UnmodelledFault):
    """The sensors' optics flatten towards the ends of their range: tanh(c y)/c instead of y."""

    place, variable, form = "sensor_all", "y", "saturating"
    also = (("y", "power"),)
    c: float = size("1/m", 40.0, 2e3, positive=True)

    def read(self, value, place, s, line):
        if not place.startswith("point_"):
            return value
        x = self.c * value
        return value * np.where(np.abs(x) > 1e-6, np.tanh(x) / np.where(np.abs(x) > 1e-6, x, 1.0), 1.0)


class StickyGauge(UnmodelledFault):
    """The feeler at point 1 sticks: it follows the belt only once it is ``half`` behind."""

    place, variable, form = "sensor_y1", "y", "threshold"
    also = (("y", "constant"), ("y", "saturating"))
    half: float = size("m", 1e-4, 1e-2, positive=True)

    def read(self, value, place, s, line):
        if place != "point_1":
            return value
        shown = np.empty_like(value)
        last = value[0]
        for k, true in enumerate(value):
            last = shown[k] = np.clip(last, true - self.half, true + self.half)
        return shown


class WarmingStand(UnmodelledFault):
    """The sensors' stand moves with the square root of time, as heat does."""

    place, variable, form = "sensor_all", "time_since_step", "power"
    also = (("travel", "power"), ("time_since_step", "saturating"))
    c: float = size("m/s^0.5", 3e-5, 2e-3)

    def read(self, value, place, s, line):
        return value + self.c * np.sqrt(np.maximum(s - line.yaw_at, 0) / line.speed)


class WearingWheel(UnmodelledFault):
    """The measuring wheel wears down while it runs: the recorder shows s + c s^2."""

    place, variable, form = "travel", "travel", "power"
    also = (("travel", "linear"),)
    c: float = size("1/m", 5e-4, 2e-3)

    def set(self, line):
        return replace(line, yaw_at=self.true_travel(line.yaw_at, line))

    def true_travel(self, shown, line):
        root = np.sqrt(np.maximum(1 + 4 * self.c * shown, 0.05))
        return 2 * shown / (1 + root)


# Loads on the spans.


class BentIdler(UnmodelledFault):
    """A bent idler under the lower span pushes it to and fro as it turns."""

    place, variable, form = "span", "wave", "periodic"
    also = (("travel", "periodic"),)
    force: float = size("N", 1.0, 200.0)
    wavelength: float = shape(2.2, lambda plan, rng: rng.uniform(1.5, 4.5))
    phase: float = shape(0.0, any_phase)
    share: float = shape(0.5, lambda plan, rng: rng.uniform(0.2, 0.8))

    def loads(self, line):
        return (force_at(line, False, self.share),)

    def push(self, s, line, load, free, kept):
        return self.force * np.cos(2 * np.pi * s / self.wavelength + self.phase) + 0 * free, kept


class StickyRest(UnmodelledFault):
    """A rest under the upper span sticks to the belt up to a force, then slides with it: it remembers the belt."""

    place, variable, form = "span", "y", "saturating"
    also = (("y", "threshold"), ("y", "linear"), ("contact_angle", "threshold"), ("contact_angle", "constant"))
    force: float = size("N", 0.5, 100.0, positive=True)
    stiffness: float = shape(5e3, lambda plan, rng: 10 ** rng.uniform(2.5, 4.5))
    share: float = shape(0.5, lambda plan, rng: rng.uniform(0.2, 0.8))

    def loads(self, line):
        return (force_at(line, True, self.share),)

    def push(self, s, line, load, free, kept):
        stiffness = self.stiffness / (1 + self.stiffness * load.give)
        held = np.clip(stiffness * (free - kept), -self.force, self.force)
        return -held, free - held / stiffness


class WindSteps(UnmodelledFault):
    """Wind presses on both spans, changing every 9 m: p bends a clamped span by p L^2/(12 EI) at its end."""

    place, variable, form = "span", "travel", "random"
    pressure: float = size("N/m", 0.03, 5.0, positive=True)
    seed: int = shape(0, any_seed)

    def turn(self, s, line, y, kappa):
        gust = random_course(self.seed, line.run, s / 9.0)
        return np.broadcast_to(self.pressure * gust * line.span_length**2 / (12 * line.bending), y.shape)


# The spans themselves: EI, T, Z or F that are not what the sheet says, or change with what the belt does.


_UPPER, _LOWER = 1.0, -1.0
_STATES = tuple(np.linspace(0.0, 1.0, 9))
_MIDDLES = (np.arange(2**DOUBLINGS) + 0.5) / 2**DOUBLINGS  # of the elements, as shares of a span
_FIBRES = np.linspace(-1.0, 1.0, 401)  # places across half the width


def _lies(side, upper):
    """Whether a change acts on spans that lie above (upper, (batch,)) or below."""
    return (np.asarray(side) > 0) == upper


def _tensions(plan) -> tuple[float, float]:
    """Least and largest tension of a plan [Pa], a fifth apart at least."""
    stresses = [run.tension for run in plan.runs]
    return min(stresses), max(max(stresses), 1.2 * min(stresses))


def _sag(plan, stress: float) -> float:
    """Sag [m] of a span at a tension [Pa]."""
    return plan.belt.density.value * GRAVITY / stress * plan.machine.centre_distance.value**2 / 8


class SlackSoftening(UnmodelledFault):
    """A slack belt ripples along its edges and bends more easily: EI (1 - share exp(-sigma/sigma_0))."""

    place, variable, form = "span_bending", "tension", "exponential"
    also = (("tension", "power"), ("tension", "threshold"), ("tension", "saturating"), ("tension", "linear"))
    share: float = size("1", 0.3, 0.95, positive=True)
    stress: float = shape(1e7, lambda plan, rng: log_uniform(rng, *_tensions(plan)))

    def sections(self, state, line, upper):
        return Sections(bending=1 - self.share * np.exp(-line.stress / self.stress))


class OneLongEdge(UnmodelledFault):
    """One edge was rolled too long, and buckles where the tension does not straighten it: that strip bends no more.

    The stress at rest is amplitude P_3 across the width; fibres that it would press carry nothing, the rest all of F.
    """

    place, variable, form = "span_bending", "tension", "threshold"
    also = (("tension", "power"), ("tension", "exponential"), ("tension", "linear"), ("tension", "saturating"))
    amplitude: float = size("Pa", 1e7, 2e8, positive=True)

    def sections(self, state, line, upper):
        rest = np.multiply.outer(self.amplitude * np.ones_like(line.stress), (5 * _FIBRES**3 - 3 * _FIBRES) / 2)
        mean, low, high = line.stress, line.stress - 2 * np.abs(self.amplitude), line.stress
        for _ in range(50):  # the mean strain at which what is left carries the belt's force
            middle = (low + high) / 2
            too_much = np.maximum(middle[:, None] + rest, 0.0).mean(axis=1) > mean
            low, high = np.where(too_much, low, middle), np.where(too_much, middle, high)
        carries = high[:, None] + rest >= 0
        count = carries.sum(axis=1)
        off_centre = (carries * _FIBRES).sum(axis=1) / count
        left = (carries * (_FIBRES - off_centre[:, None]) ** 2).sum(axis=1) / np.sum(_FIBRES**2)
        return Sections(bending=left)


class SlackTwist(UnmodelledFault):
    """Below a tension the belt's cross-section gives way: T falls by ``share`` of what the tension is short of it."""

    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "tension", "threshold"
    also = (("tension", "power"), ("tension", "linear"), ("tension", "exponential"), ("tension", "saturating"))
    share: float = size("1", 0.4, 0.95, positive=True)
    onset: float = shape(3e7, lambda plan, rng: 1.5 * log_uniform(rng, *_tensions(plan)))

    def sections(self, state, line, upper):
        return Sections(torsion=1 - self.share * np.clip(1 - line.stress / self.onset, 0.0, 1.0))


class TorsionCreep(UnmodelledFault):
    """After a yaw step the spans twist more and more easily: T (1 - share (1 - exp(-t/time)))."""

    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "time_since_step", "exponential"
    also = (("time_since_step", "saturating"), ("travel", "exponential"), ("travel", "saturating"))
    span_states = _STATES
    share: float = size("1", 0.4, 0.95, positive=True)
    time: float = shape(30.0, lambda plan, rng: log_uniform(rng, 0.08 * duration(plan), 0.4 * duration(plan)))

    def sections(self, state, line, upper):
        return Sections(torsion=1 - self.share * state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        return -np.expm1(-np.maximum(s - line.yaw_at, 0.0) / line.speed / self.time)


class EdgeCracks(UnmodelledFault):
    """One edge is cracked: a span that is bent so that the cracks open bends by ``share`` more easily."""

    place, variable, form = "span_bending", "curvature", "threshold"
    also = (("curvature", "saturating"), ("yaw", "threshold"), ("yaw", "saturating"), ("contact_angle", "threshold"))
    span_states = _STATES
    share: float = size("1", 0.3, 0.95, positive=True)
    sign: float = shape(1.0, lambda plan, rng: rng.choice((-1.0, 1.0)))
    angle: float = shape(1e-4, lambda plan, rng: rng.uniform(0.05, 0.3) * largest_yaw(plan))

    def sections(self, state, line, upper):
        return Sections(bending=1 - self.share * state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        """From the angle between the ends, which is the mean curvature times the length."""
        bent = ends[1][1] - ends[0][1]
        return (1 + np.tanh(self.sign * bent / self.angle)) / 2


class FatigueCracks(UnmodelledFault):
    """The belt is breaking up all round: its spans bend the more easily the further it has run."""

    place, variable, form = "span_bending", "travel", "linear"
    also = (("travel", "saturating"), ("time_since_step", "linear"), ("travel", "exponential"))
    span_states = tuple(np.linspace(0.0, 0.95, 20))
    rate: float = size("1/m", 5e-3, 0.05, positive=True)

    def sections(self, state, line, upper):
        return Sections(bending=1 - state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        return np.clip(self.rate * s, 0.0, 0.95)


class SpanStiffening(UnmodelledFault):
    """A span stiffens with its amplitude: EI (1 + c q/(1 + q)), q the mean square of its bend in units of ``bend``."""

    place, variable, form = "span_bending", "curvature", "power"
    also = (("curvature", "saturating"), ("yaw", "power"), ("yaw", "saturating"), ("y", "power"), ("y", "saturating"))
    span_states = _STATES
    c: float = size("1", 0.4, 10.0, positive=True)
    bend: float = shape(5e-4, lambda plan, rng: log_uniform(rng, 0.5 * largest_yaw(plan), 3.0 * largest_yaw(plan)))

    def sections(self, state, line, upper):
        return Sections(bending=1 + self.c * state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        """The bend of a beam without tension: L times the mean square curvature of a cubic between the ends."""
        (y_off, off), (y_up, up) = ends
        chord = (y_up - y_off) / line.span_length
        q = ((up - off) ** 2 + 3 * (up + off - 2 * chord) ** 2) / np.square(self.bend)
        return q / (1 + q)


class SupportRoller(UnmodelledFault):
    """A belt that sags by more than ``gap`` touches a roller at mid-span, which holds its cross-section level."""

    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "tension", "threshold"
    also = (("tension", "power"), ("tension", "linear"), ("tension", "exponential"), ("travel", "constant"))
    stiffness: float = size("N m/rad", 5.0, 1e4, positive=True)
    gap: float = shape(0.05, lambda plan, rng: _sag(plan, 1.2 * log_uniform(rng, *_tensions(plan))))
    side: float = shape(_LOWER, lambda plan, rng: rng.choice((_UPPER, _LOWER)))

    def sections(self, state, line, upper):
        sag = line.sag_curvature * line.span_length**2 / 8
        touches = np.clip((sag / self.gap - 1) / 0.1, 0.0, 1.0)
        return Sections(roll_spring=self.stiffness * touches * _lies(self.side, upper))


class ThermalCrossbow(UnmodelledFault):
    """Heat on one face bows the belt across its width while it runs above: T (1 + share (1 - exp(-t/time)))."""

    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "travel", "exponential"
    also = (("travel", "saturating"), ("time_since_step", "exponential"), ("time_since_step", "saturating"))
    span_states = _STATES
    share: float = size("1", 0.5, 20.0, positive=True)
    time: float = shape(30.0, lambda plan, rng: log_uniform(rng, 0.08 * duration(plan), 0.5 * duration(plan)))

    def sections(self, state, line, upper):
        return Sections(torsion=1 + self.share * state * _lies(_UPPER, upper))

    def span_state(self, s, line, to_tail, ends):
        return -np.expm1(-np.maximum(s, 0.0) / line.speed / self.time)


class SlackSide(UnmodelledFault):
    """The head pulley drives against a brake: the span that leaves it has a share less tension than the other."""

    place, variable, form = "span_tension", "tension", "linear"
    also = (("travel", "constant"), ("tension", "power"))
    share: float = size("1", 0.15, 0.8, positive=True)

    def sections(self, state, line, upper):
        """What leaves the head pulley runs to the tail: above where the belt runs forwards."""
        left = np.where(upper == (line.direction > 0), 1 - self.share, 1.0)
        lost = (1 - left) * line.force * line.width**2 / 12
        return Sections(tension=left, sag=1 / left, torsion=1 - lost / line.torsion)


class _PassingStretch:
    """A stretch of the belt that is another while it passes a span."""

    span_states = tuple(np.linspace(-0.25, 1.25, 31))
    at: float
    stretch: float

    def bump(self, place: float):
        """How much of the stretch lies in every element when its middle is at a share ``place`` of the span."""
        off = np.subtract.outer(np.zeros(np.shape(self.stretch)) + place, _MIDDLES)
        width = np.asarray(self.stretch)[..., None]
        return np.where(np.abs(off) < width / 2, np.cos(np.pi * off / width) ** 2, 0.0)

    def span_state(self, s, line, to_tail, ends):
        """Where the stretch is, as a share of the span behind its run-off, on its last way round."""
        ahead = np.where(line.direction > 0, self.at, 2 * line.span_length + line.wrap_tail - self.at)
        place = ahead + s + line.start - (0.0 if to_tail else line.span_length + line.wrap_tail)
        before = 0.25 * line.span_length
        return (np.mod(place + before, line.belt_length) - before) / line.span_length


class SoftJoint(_PassingStretch, UnmodelledFault):
    """The belt bends more easily where it is joined: EI falls by ``share`` there, while the joint is in a span."""

    place, variable, form = "span_bending", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"), ("travel", "periodic"))
    share: float = size("1", 0.6, 0.95, positive=True)
    at: float = shape(3.0, any_place_on_belt)
    stretch: float = shape(0.2, lambda plan, rng: rng.uniform(0.15, 0.5))

    def sections(self, state, line, upper):
        return Sections(bending=1 - np.reshape(self.share, (-1, 1)) * self.bump(state) + 0 * line.stress[:, None])


class RepairPlate(_PassingStretch, UnmodelledFault):
    """A plate welded on stiffens a stretch of the belt against twisting: T (1 + c) there."""

    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"), ("travel", "periodic"))
    c: float = size("1", 5.0, 200.0, positive=True)
    at: float = shape(3.0, any_place_on_belt)
    stretch: float = shape(0.2, lambda plan, rng: rng.uniform(0.15, 0.5))

    def sections(self, state, line, upper):
        return Sections(torsion=1 + np.reshape(self.c, (-1, 1)) * self.bump(state) + 0 * line.stress[:, None])
