"""The spans themselves: EI, T, Z or F that are not what the sheet says, or change with what the belt does."""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.virtual_rig.fault import Size, Unmodelled
from belt_sim.virtual_rig.span import DOUBLINGS, Sections

_BOTH, _UPPER, _LOWER = 0.0, 1.0, -1.0  # spans
_STATES = tuple(np.linspace(0.0, 1.0, 9))
_MIDDLES = (np.arange(2**DOUBLINGS) + 0.5) / 2**DOUBLINGS  # of the elements, as shares of a span
_FIBRES = np.linspace(-1.0, 1.0, 401)  # places across half the width


def _side(rng) -> float:
    return float(rng.choice((_BOTH, _UPPER, _LOWER)))


def _lies(side, upper):
    """Whether a change acts on spans that lie above (upper, (batch,)) or below."""
    return (np.asarray(side) == _BOTH) | ((np.asarray(side) > 0) == upper)


def _log_uniform(rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _tensions(plan) -> tuple[float, float]:
    """Least and largest tension of a plan [Pa], a fifth apart at least."""
    stresses = [run.tension for run in plan.runs]
    return min(stresses), max(max(stresses), 1.2 * min(stresses))


def _largest_yaw(plan) -> float:
    return max(abs(run.yaw) for run in plan.runs)


def _duration(plan) -> float:
    return plan.length / plan.runs[0].speed


@dataclass(frozen=True, kw_only=True)
class SlackSoftening(Unmodelled):
    """A slack belt ripples along its edges and bends more easily: EI (1 - share exp(-sigma/sigma_0))."""

    id = "slack_softening"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=0.95)}
    positive = True
    place, variable, form = "span_bending", "tension", "exponential"
    also = (("tension", "power"), ("tension", "threshold"), ("tension", "saturating"), ("tension", "linear"))
    share: float = 0.0
    stress: float = 1e7

    def sections(self, state, line, upper):
        return Sections(bending=1 - self.share * np.exp(-line.stress / self.stress))

    @classmethod
    def random_shape(cls, plan, rng):
        return {"stress": _log_uniform(rng, *_tensions(plan))}


@dataclass(frozen=True, kw_only=True)
class OneLongEdge(Unmodelled):
    """One edge was rolled too long, and buckles where the tension does not straighten it: that strip bends no more.

    The stress at rest is amplitude P_3 across the width; fibres that it would press carry nothing, the rest all of F.
    """

    id = "one_long_edge"
    blind = True
    sizes = {"amplitude": Size(unit="Pa", typical=1e7, limit=2e8)}
    positive = True
    place, variable, form = "span_bending", "tension", "threshold"
    also = (("tension", "power"), ("tension", "exponential"), ("tension", "linear"), ("tension", "saturating"))
    amplitude: float = 0.0

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


@dataclass(frozen=True, kw_only=True)
class SlackTwist(Unmodelled):
    """Below a tension the belt's cross-section gives way: T falls by ``share`` of what the tension is short of it."""

    id = "slack_twist"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.4, limit=0.95)}
    positive = True
    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "tension", "threshold"
    also = (("tension", "power"), ("tension", "linear"), ("tension", "exponential"), ("tension", "saturating"))
    share: float = 0.0
    onset: float = 3e7

    def sections(self, state, line, upper):
        return Sections(torsion=1 - self.share * np.clip(1 - line.stress / self.onset, 0.0, 1.0))

    @classmethod
    def random_shape(cls, plan, rng):
        low, high = _tensions(plan)
        return {"onset": _log_uniform(rng, 1.5 * low, 1.5 * high)}


@dataclass(frozen=True, kw_only=True)
class TorsionCreep(Unmodelled):
    """After a yaw step the spans twist more and more easily: T (1 - share (1 - exp(-t/time)))."""

    id = "torsion_creep"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.4, limit=0.95)}
    positive = True
    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "time_since_step", "exponential"
    also = (("time_since_step", "saturating"), ("travel", "exponential"), ("travel", "saturating"))
    span_states = _STATES
    share: float = 0.0
    time: float = 30.0

    def sections(self, state, line, upper):
        return Sections(torsion=1 - self.share * state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        return -np.expm1(-np.maximum(s - line.yaw_at, 0.0) / line.speed / self.time)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"time": _log_uniform(rng, 0.08 * _duration(plan), 0.4 * _duration(plan))}


@dataclass(frozen=True, kw_only=True)
class EdgeCracks(Unmodelled):
    """One edge is cracked: a span that is bent so that the cracks open bends by ``share`` more easily."""

    id = "edge_cracks"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.3, limit=0.95)}
    positive = True
    place, variable, form = "span_bending", "curvature", "threshold"
    also = (("curvature", "saturating"), ("yaw", "threshold"), ("yaw", "saturating"), ("contact_angle", "threshold"))
    span_states = _STATES
    share: float = 0.0
    sign: float = 1.0
    angle: float = 1e-4

    def sections(self, state, line, upper):
        return Sections(bending=1 - self.share * state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        """From the angle between the ends, which is the mean curvature times the length."""
        bent = ends[1][1] - ends[0][1]
        return (1 + np.tanh(self.sign * bent / self.angle)) / 2

    @classmethod
    def random_shape(cls, plan, rng):
        return {
            "sign": float(rng.choice((-1.0, 1.0))),
            "angle": float(rng.uniform(0.05, 0.3) * _largest_yaw(plan)),
        }


@dataclass(frozen=True, kw_only=True)
class FatigueCracks(Unmodelled):
    """The belt is breaking up all round: its spans bend the more easily the further it has run."""

    id = "fatigue_cracks"
    blind = True
    sizes = {"rate": Size(unit="1/m", typical=5e-3, limit=0.05)}
    positive = True
    place, variable, form = "span_bending", "travel", "linear"
    also = (("travel", "saturating"), ("time_since_step", "linear"), ("travel", "exponential"))
    span_states = tuple(np.linspace(0.0, 0.95, 20))
    rate: float = 0.0

    def sections(self, state, line, upper):
        return Sections(bending=1 - state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        return np.clip(self.rate * s, 0.0, 0.95)


@dataclass(frozen=True, kw_only=True)
class SpanStiffening(Unmodelled):
    """A span stiffens with its amplitude: EI (1 + c q/(1 + q)), q the mean square of its bend in units of ``bend``."""

    id = "span_stiffening"
    blind = True
    sizes = {"c": Size(unit="1", typical=0.4, limit=10.0)}
    positive = True
    place, variable, form = "span_bending", "curvature", "power"
    also = (("curvature", "saturating"), ("yaw", "power"), ("yaw", "saturating"), ("y", "power"), ("y", "saturating"))
    span_states = _STATES
    c: float = 0.0
    bend: float = 5e-4

    def sections(self, state, line, upper):
        return Sections(bending=1 + self.c * state + 0 * line.stress)

    def span_state(self, s, line, to_tail, ends):
        """The bend of a beam without tension: L times the mean square curvature of a cubic between the ends."""
        (y_off, off), (y_up, up) = ends
        chord = (y_up - y_off) / line.span_length
        q = ((up - off) ** 2 + 3 * (up + off - 2 * chord) ** 2) / np.square(self.bend)
        return q / (1 + q)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"bend": _log_uniform(rng, 0.5 * _largest_yaw(plan), 3.0 * _largest_yaw(plan))}


@dataclass(frozen=True, kw_only=True)
class SupportRoller(Unmodelled):
    """A belt that sags by more than ``gap`` touches a roller at mid-span, which holds its cross-section level."""

    id = "support_roller"
    blind = True
    sizes = {"stiffness": Size(unit="N m/rad", typical=5.0, limit=1e4)}
    positive = True
    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "tension", "threshold"
    also = (("tension", "power"), ("tension", "linear"), ("tension", "exponential"), ("travel", "constant"))
    stiffness: float = 0.0
    gap: float = 0.05
    side: float = _LOWER

    def sections(self, state, line, upper):
        sag = line.sag_curvature * line.span_length**2 / 8
        touches = np.clip((sag / self.gap - 1) / 0.1, 0.0, 1.0)
        return Sections(roll_spring=self.stiffness * touches * _lies(self.side, upper))

    @classmethod
    def random_shape(cls, plan, rng):
        low, high = _tensions(plan)
        stress = _log_uniform(rng, 1.2 * low, 1.2 * high)  # below which the roller touches
        sag = plan.belt.density.value * 9.81 / stress * plan.machine.centre_distance.value**2 / 8
        return {"gap": float(sag), "side": float(rng.choice((_UPPER, _LOWER)))}


@dataclass(frozen=True, kw_only=True)
class ThermalCrossbow(Unmodelled):
    """Heat on one face bows the belt across its width while it runs above: T (1 + share (1 - exp(-t/time)))."""

    id = "thermal_crossbow"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.5, limit=20.0)}
    positive = True
    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "travel", "exponential"
    also = (("travel", "saturating"), ("time_since_step", "exponential"), ("time_since_step", "saturating"))
    span_states = _STATES
    share: float = 0.0
    time: float = 30.0

    def sections(self, state, line, upper):
        return Sections(torsion=1 + self.share * state * _lies(_UPPER, upper))

    def span_state(self, s, line, to_tail, ends):
        return -np.expm1(-np.maximum(s, 0.0) / line.speed / self.time)

    @classmethod
    def random_shape(cls, plan, rng):
        return {"time": _log_uniform(rng, 0.08 * _duration(plan), 0.5 * _duration(plan))}


@dataclass(frozen=True, kw_only=True)
class SlackSide(Unmodelled):
    """The head pulley drives against a brake: the span that leaves it has a share less tension than the other."""

    id = "slack_side"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.15, limit=0.8)}
    positive = True
    place, variable, form = "span_tension", "tension", "linear"
    also = (("travel", "constant"), ("tension", "power"))
    share: float = 0.0

    def sections(self, state, line, upper):
        """What leaves the head pulley runs to the tail: above where the belt runs forwards."""
        left = np.where(upper == (line.direction > 0), 1 - self.share, 1.0)
        lost = (1 - left) * line.force * line.width**2 / 12
        return Sections(tension=left, sag=1 / left, torsion=1 - lost / line.torsion)


@dataclass(frozen=True, kw_only=True)
class _Passing(Unmodelled):
    """A stretch of the belt that is another while it passes a span."""

    span_states = tuple(np.linspace(-0.25, 1.25, 31))
    at: float = 3.0
    stretch: float = 0.2

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

    @classmethod
    def random_shape(cls, plan, rng):
        around = 2 * plan.machine.centre_distance.value + 2 * np.pi * plan.machine.tail_radius.value
        return {"at": float(rng.uniform(0.0, around)), "stretch": float(rng.uniform(0.15, 0.5))}


@dataclass(frozen=True, kw_only=True)
class SoftJoint(_Passing):
    """The belt bends more easily where it is joined: EI falls by ``share`` there, while the joint is in a span."""

    id = "soft_joint"
    blind = True
    sizes = {"share": Size(unit="1", typical=0.6, limit=0.95)}
    positive = True
    place, variable, form = "span_bending", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"), ("travel", "periodic"))
    share: float = 0.0

    def sections(self, state, line, upper):
        return Sections(bending=1 - np.reshape(self.share, (-1, 1)) * self.bump(state) + 0 * line.stress[:, None])


@dataclass(frozen=True, kw_only=True)
class RepairPlate(_Passing):
    """A plate welded on stiffens a stretch of the belt against twisting: T (1 + c) there."""

    id = "repair_plate"
    blind = True
    sizes = {"c": Size(unit="1", typical=5.0, limit=200.0)}
    positive = True
    idle_on = ("beam_th2",)
    place, variable, form = "span_torsion", "belt_phase", "periodic"
    also = (("belt_phase", "threshold"), ("wave", "periodic"), ("travel", "periodic"))
    c: float = 0.0

    def sections(self, state, line, upper):
        return Sections(torsion=1 + np.reshape(self.c, (-1, 1)) * self.bump(state) + 0 * line.stress[:, None])
