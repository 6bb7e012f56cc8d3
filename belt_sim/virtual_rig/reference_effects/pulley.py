"""Shape and mounting of the pulleys."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.virtual_rig.fault import TAIL, Fault, Size, add_to_pulley
from belt_sim.virtual_rig.time_courses import SLOWEST, Warming, warm_up


@dataclass(frozen=True, kw_only=True)
class Taper(Fault):
    """The tail pulley is a cone: (dR/dy)/R = kappa_t turns the stuck belt, dtheta/ds = -(kappa + kappa_t)."""

    id = "taper"
    sizes = {"kappa_t": Size(unit="1/m", typical=2e-5, limit=1e-3)}
    draw_order = 4
    kappa_t: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.kappa_t * TAIL

    def scene(self, parts, case):
        return add_to_pulley(parts, "tail", taper=self.kappa_t)


@dataclass(frozen=True, kw_only=True)
class TaperDrift(Warming, Fault):
    """The tail pulley grows a taper as it warms up: kappa_t = rate tau (1 - exp(-t/tau)), t since travel 0."""

    id = "taper_drift"
    sizes = {"rate": Size(unit="1/(m s)", typical=2e-7, limit=5e-6)}
    draw_order = 17
    rate: float = 0.0
    time_constant: float = SLOWEST

    def turn(self, s, line, y, kappa):
        return self.rate * warm_up(s, line, self.time_constant) * TAIL


@dataclass(frozen=True, kw_only=True)
class BuildUp(Fault):
    """Dirt grows on one side of the tail pulley with the travel: a taper kappa_t = rate s."""

    id = "build_up"
    sizes = {"rate": Size(unit="1/m2", typical=5e-7, limit=1e-5)}
    draw_order = 18
    rate: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.rate * s * TAIL


@dataclass(frozen=True, kw_only=True)
class Crown(Fault):
    """The tail pulley is thicker in its middle: a taper -c y."""

    id = "crown"
    sizes = {"c": Size(unit="1/m2", typical=5e-3, limit=0.5)}
    draw_order = 5
    c: float = 0.0

    def turn(self, s, line, y, kappa):
        return -self.c * y * TAIL

    def scene(self, parts, case):
        return add_to_pulley(parts, "tail", crown=self.c)


@dataclass(frozen=True, kw_only=True)
class PulleyDeflection(Fault):
    """Both shells bend under the belt's pull, thin in the middle: a taper + compliance F y, which drives outwards."""

    id = "pulley_deflection"
    sizes = {"compliance": Size(unit="1/(N m2)", typical=5e-6, limit=3e-4)}
    positive = True
    draw_order = 19
    compliance: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.compliance * line.force * y

    def scene(self, parts, case):
        crown = -self.compliance * float(case.settings.tension * case.belt.area)
        return add_to_pulley(add_to_pulley(parts, "head", crown=crown), "tail", crown=crown)


@dataclass(frozen=True, kw_only=True)
class Cant(Fault):
    """The tail pulley's axis rises by gamma towards +y."""

    id = "cant"
    sizes = {"gamma": Size(unit="rad", typical=1e-3, limit=5e-3)}
    draw_order = 3
    gamma: float = 0.0

    def set(self, line):
        return replace(line, cant=line.cant + self.gamma)

    def scene(self, parts, case):
        return add_to_pulley(parts, "tail", cant=self.gamma)


@dataclass(frozen=True, kw_only=True)
class Wobble(Fault):
    """The tail pulley sits askew on its shaft: its axis describes a cone of half angle beta_1 about the bearings' axis.

    Put the cylinder's axis through the pulley's middle, turned from the shaft's by beta_1 towards the material angle q
    (from the shaft's +y, seen along it). A generator at the material angle a then stands R + beta_1 y cos(a - q) from
    the shaft. Where the belt runs up, a falls by s/R; the belt beside, y further out, is wound up on that much more
    radius and gets ahead: per metre it turns back by the radius's slope over R. Nothing else happens: the surface turns
    in itself.

    Before travel 0 the belt ran straight round the cylinder, that is along the shaft's wave.

    Seen from above the axis swings by beta_1 cos(s/R + phase): the slope of the radius is a quarter turn late.
    """

    id = "wobble"
    sizes = {"beta_1": Size(unit="rad", typical=1e-3, limit=2e-3)}
    draw_order = 6
    beta_1: float = 0.0
    phase: float = 0.0

    def turn(self, s, line, y, kappa):
        slope = self.beta_1 * np.cos((s + line.start) / line.tail_radius + self.phase - np.pi / 2)
        return slope / line.tail_radius * TAIL

    def initial_state(self, s, line):
        """What has the slope -y'' = turn and no more: y' = -alpha."""
        at = (s + line.start) / line.tail_radius + self.phase
        none = 0.0 * at
        return np.stack([-self.beta_1 * line.tail_radius * np.sin(at), self.beta_1 * np.cos(at), none, none])

    def scene(self, parts, case):
        """The scene counts the pulley's turn from head to tail on top, the fault along the travel."""
        phase = self.phase * float(case.settings.direction)
        return parts.with_pulley("tail", wobble=self.beta_1, wobble_phase=phase) if self.beta_1 else parts

    @classmethod
    def random_shape(cls, plan, rng):
        return {"phase": float(rng.uniform(0.0, 2 * np.pi))}

    @classmethod
    def shapes(cls, plan):
        return {"phase": 0.0}, {"phase": np.pi / 2}
