"""Twins of the library's effects on the machine: yaw, pulleys, how they hold the belt, drive, sensors."""

from dataclasses import replace

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Fault, any_phase, shape, size, time_constant, warm_up
from belt_sim.virtual_rig.load import roll_at_tail

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
