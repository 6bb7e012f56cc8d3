"""A batch of belt lines as they truly are: machine, belt, settings and constant faults, one entry a run."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from belt_sim.case import Belt, Numbers, Rig
from belt_sim.virtual_rig.span import Sections, SpanResponse, curvature_along, solve_span, solve_varied_span


@dataclass(frozen=True, kw_only=True)
class Line:
    """All fields [SI], shape (batch,); those with a default are those of a faultless line.

    run: index of the run in its campaign; yaw, yaw_head: angles that the pulleys are turned to at travel
    yaw_at; offset_tail, offset_head: angles that they are off from travel 0 on; sag_roll: share of the
    sag-roll coupling, 0 for a flat strip (Th2), 1 for the strip; friction: mu on both pulleys, inf = sticking;
    cover: extra rotation per metre and moment [1/(N m2)]; compliance [rad/(N m)] of the tail pulley's yaw;
    cant [rad] of the tail pulley; deflection [1/(N m)]: curvature of both axes per force; layer: share of the bending
    layer with which the belt leaves its pulleys; start: travel [m] that the belt had behind it at travel 0.
    """

    run: np.ndarray
    span_length: np.ndarray
    wrap_tail: np.ndarray
    wrap_head: np.ndarray
    tail_radius: np.ndarray
    head_radius: np.ndarray
    width: np.ndarray
    thickness: np.ndarray
    youngs_modulus: np.ndarray
    density: np.ndarray
    poisson_ratio: np.ndarray
    gravity: np.ndarray
    stress: np.ndarray
    yaw: np.ndarray
    yaw_head: Numbers = 0.0
    yaw_at: Numbers = 0.0
    speed: Numbers = 0.5
    direction: Numbers = 1.0
    sag_roll: Numbers = 0.0
    offset_tail: Numbers = 0.0
    offset_head: Numbers = 0.0
    friction: Numbers = np.inf
    cover: Numbers = 0.0
    compliance: Numbers = 0.0
    cant: Numbers = 0.0
    deflection: Numbers = 0.0
    layer: Numbers = 0.0
    residual: Numbers = 0.0
    start: Numbers = 0.0

    @property
    def bending(self) -> np.ndarray:
        """EI = E b^3 h / 12 [N m2]."""
        return self.youngs_modulus * self.width**3 * self.thickness / 12

    @property
    def force(self) -> np.ndarray:
        """F = sigma b h [N]."""
        return self.stress * self.width * self.thickness

    @property
    def sag_curvature(self) -> np.ndarray:
        """Z = rho g / sigma [1/m]."""
        return self.density * self.gravity / self.stress

    @property
    def torsion(self) -> np.ndarray:
        """T = F b^2/12 + G b h^3/3 [N m2], and what the stress at rest does to a twist, integral of s y^2."""
        shear = self.youngs_modulus / (2 * (1 + self.poisson_ratio))
        places, weights = np.polynomial.legendre.leggauss(3)  # exact for the fourth order that it has
        at_rest = self.residual * sum(w * (1 - 3 * u**2) * u**2 for u, w in zip(places, weights, strict=True))
        return (
            self.force * self.width**2 / 12
            + shear * self.width * self.thickness**3 / 3
            + self.thickness * (self.width / 2) ** 3 * at_rest
        )

    @property
    def belt_length(self) -> np.ndarray:
        """Length of the endless belt [m]."""
        return 2 * self.span_length + self.wrap_tail + self.wrap_head

    def wrap_shift(self, s) -> np.ndarray:
        """What the belt has gained sideways where it leaves a canted tail pulley [m], at travel s.

        The belt follows y + gamma z = const round the pulley, in all y_2 = y_1 + 2 R gamma; what lay on the
        pulley at travel 0 gains only what was left of its way: R gamma (1 - cos(s/R)).
        """
        turned = np.clip(s / self.tail_radius, 0.0, np.pi)
        return self.tail_radius * self.cant * self.direction * (1 - np.cos(turned))

    def along_bent_axes(self, y, past):
        """State (4, ...) at the run-ups and (y, alpha) (2, ...) of what leaves the tail and the head pulley, their
        angles counted from the straight line between the bearings: a bent pulley is yawed where the belt lies."""
        if not np.any(self.deflection):
            return y, past
        bow, lean = self.deflection * self.force, np.zeros_like(y)
        lean[1::2] = -bow * y[::2]
        return y + lean, tuple(np.stack([off[0], off[1] + bow * off[0]]) for off in past)

    @property
    def sag_yaw(self) -> np.ndarray:
        """Part of the cant that acts as yaw: -gamma sin(psi), the belt landing psi = Z L/2 before the top."""
        return -self.cant * np.sin(self.sag_roll * self.sag_curvature * self.span_length / 2)

    def span(self, tension_share: float | np.ndarray = 1.0, *, to_tail: bool = True) -> SpanResponse:
        """The response at a share of the tension of the free span that runs to the tail (or to the head) pulley."""
        line = replace(self, stress=self.stress * tension_share)
        coupling = line.sag_roll * line.sag_curvature
        yields = line.end_compliance(to_tail) if np.any(self.layer) else None
        return solve_span(line.span_length, line.bending, line.force, line.torsion, coupling, yields)

    def varied_span(self, sections: Sections, *, to_tail: bool) -> SpanResponse:
        """The response of the span that runs to the tail (or to the head) pulley, its properties changed by factors."""
        coupling = self.sag_roll * self.sag_curvature
        yields = self.end_compliance(to_tail) if np.any(self.layer) else None
        whole = self.span_length, self.bending, self.force, self.torsion, coupling
        return solve_varied_span(*whole, sections, yields)

    def end_compliance(self, to_tail: bool) -> tuple[np.ndarray, np.ndarray]:
        """How run-off and run-up give way to the span: (slope, tilt) per (couple about z, couple about x), symmetric.

        Shape (batch, 2, 2) each [rad/(N m)]. The belt lies on the pulley to where its bending layer begins, whose slope
        is (length/R) exp(-x/length) towards the straight line. There a couple M about z twists it. The rate of twist t
        obeys D b^3/12 t'' - T t = M times that slope, t = 0 at the pulley: the difference of two exponentials.
        """
        plate = self.youngs_modulus * self.thickness**3 / (12 * (1 - self.poisson_ratio**2))
        length = np.sqrt(plate / (self.stress * self.thickness))
        upper = np.where((self.direction > 0) == to_tail, 1.0, -1.0)
        pulleys = (self.head_radius, self.tail_radius) if to_tail else (self.tail_radius, self.head_radius)
        twist = np.sqrt(plate * self.width**3 / 12 / self.torsion)  # the other length, along which a twist dies out
        found = []
        for radius, at_runup in zip(pulleys, (-1.0, 1.0), strict=True):
            rolled = length**3 / (length + twist) / radius  # integral of t, times T/M
            turned = rolled * length / (2 * radius) / (1 + twist / length)  # of the layer's slope times t
            slope = -self.layer * turned / self.torsion
            cross = at_runup * upper * self.layer * rolled / self.torsion
            found.append(np.stack([np.stack([slope, cross], -1), np.stack([cross, 0 * cross], -1)], -2))
        return found[0], found[1]

    def belt_coordinate(self, place: str, s):
        """Which part of the belt lies at a point at travel s [m], counted from what was at point 4 at travel 0."""
        along = {
            "point_4": 0.0 * self.span_length,
            "point_1": self.span_length,
            "point_2": self.span_length + self.wrap_tail,
            "point_3": 2 * self.span_length + self.wrap_tail,
        }
        return along[place] - self.direction * (s + self.start)

    @cached_property
    def runup_sensitivity(self) -> np.ndarray:
        """Curvature in the middle of every element per unit run-up angle [1/m], shape (batch, n)."""
        coupling = self.sag_roll * self.sag_curvature
        return curvature_along(self.span().nodes, self.span_length, coupling)[:, :, 3]


_OF_RIG = ("span_length", "wrap_tail", "wrap_head", "tail_radius", "head_radius", "gravity")
_OF_BELT = ("width", "thickness", "youngs_modulus", "density", "poisson_ratio")


def line_from(rig: Rig, belt: Belt, **settings: np.ndarray) -> Line:
    """A faultless batch on one machine (its numbers may be arrays); ``settings``: the remaining fields."""
    constants = {name: getattr(rig, name) for name in _OF_RIG} | {name: getattr(belt, name) for name in _OF_BELT}
    count = len(settings["stress"])
    line = Line(run=np.arange(count), **constants, **settings)
    return replace(line, **{name: np.broadcast_to(np.asarray(v), (count,)) for name, v in vars(line).items()})


def stack(lines: list[Line]) -> Line:
    """Several batches as one."""
    names = Line.__dataclass_fields__
    return Line(**{name: np.concatenate([getattr(line, name) for line in lines]) for name in names})
