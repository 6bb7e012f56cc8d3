"""Faults that no catalogue lists, of the spans: loads on them, and their own EI, T, Z and F."""

import numpy as np

from belt_sim.case import GRAVITY
from belt_sim.virtual_rig.fault import (
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
)
from belt_sim.virtual_rig.load import force_at
from belt_sim.virtual_rig.span import DOUBLINGS, Sections

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
