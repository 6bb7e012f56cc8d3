"""What stands in a three-dimensional scene, before any engine builds it: pulleys, gravity, friction, the belt's shape.

An effect's geometric half changes these parts; ``belt_sim.space`` builds them. Needs no MuJoCo.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim.case import Case

#: natural in-plane curvature [1/m] at places s [m] along the belt
CurvatureAlongBelt = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class PulleySurface:
    """A pulley nearly cylindrical about an axis nearly along +y.

    radius [m], to the belt's middle surface; taper = (dR/dy)/R [1/m]; crown c [1/m2]: local taper -c y, so that the
    radius at y is R (1 + taper y - c y^2 / 2);
    cant [rad]: roll of the axis about +x; yaw_offset [rad]: added to the commanded yaw; wobble [rad]: half angle of
    the cone that the axis describes about the bearings' axis: yaw wobble cos(spin + wobble_phase), roll wobble
    sin(spin + wobble_phase), where ``spin`` is the rotation since travel 0, which takes the top towards +x;
    bow [1/m]: curvature of the axis, which keeps the radius; + where its middle lies furthest towards -x;
    yaw_compliance [rad/(N m)]: the pulley gives way to the belt's moment about z.
    """

    radius: float
    taper: float = 0.0
    crown: float = 0.0
    cant: float = 0.0
    yaw_offset: float = 0.0
    wobble: float = 0.0
    wobble_phase: float = 0.0
    bow: float = 0.0
    yaw_compliance: float = 0.0


@dataclass(frozen=True, kw_only=True)
class GuideRoller:
    """A one-sided roller beside the belt's edge: span "upper" or "lower", x [m], gap [m] between the roller and the
    edge of a belt that runs in the middle, side +1 (at +y) or -1, stiffness [N/m]."""

    span: str
    x: float
    gap: float
    side: float
    stiffness: float


@dataclass(frozen=True, kw_only=True)
class Push:
    """What acts at a place of a span from travel 0 on: span "upper" or "lower", x [m]; force [N] along the belt, +x,
    and across, +y, on its middle; couple [N m] about its normal, which turns +x towards +y."""

    span: str
    x: float
    along: float = 0.0
    across: float = 0.0
    couple: float = 0.0


@dataclass(frozen=True, kw_only=True)
class SceneParts:
    """The parts of one scene.

    head, tail: PulleySurface; gravity [m/s2]; friction [1], inf = sticking; camber(s) [1/m]: natural in-plane
    curvature of the belt (y'' > 0) against the position s [m] along it at travel 0, counted from point 4 in the order
    of the points 4, 1, 2, 3 (None = straight); edge_guides: rollers beside the spans; lift_off: share of the bending
    layer with which the belt leaves its pulleys (0 = like a thread, 1 = like a plate); pushes: forces and couples at
    places of the spans; residual [Pa]: amplitude of the strip's residual stress, residual (1 - 12 y^2/b^2) across its
    width; lean [rad]: of the machine about its long axis, the share of the belt's weight that pulls
    towards +y; roll, roll_lower [N]: couple per metre about +x on the upper and the lower span, which raises the side
    y > 0.
    """

    head: PulleySurface
    tail: PulleySurface
    gravity: float
    friction: float = math.inf
    camber: CurvatureAlongBelt | None = None
    edge_guides: tuple[GuideRoller, ...] = ()
    lift_off: float = 0.0
    pushes: tuple[Push, ...] = ()
    lean: float = 0.0
    roll: float = 0.0
    roll_lower: float = 0.0
    residual: float = 0.0

    @property
    def sets_in(self) -> bool:
        """Whether something besides the yaw begins at travel 0, for which the belt stands still."""
        turned = any(s.yaw_offset or s.cant or s.bow for s in (self.head, self.tail))
        acts = self.lift_off or self.pushes or self.lean or self.roll or self.roll_lower
        return turned or self.camber is not None or bool(acts)

    @property
    def tapered(self) -> bool:
        """Whether a pulley is a cone; one with a crown is none."""
        return any(surface.taper and not surface.crown for surface in (self.head, self.tail))

    @staticmethod
    def from_case(case: Case, friction: float = math.inf) -> "SceneParts":
        """A case's plain cylinders, its gravity and a straight belt."""
        head, tail = (PulleySurface(radius=float(r)) for r in (case.rig.head_radius, case.rig.tail_radius))
        return SceneParts(head=head, tail=tail, gravity=float(case.rig.gravity), friction=float(friction))

    def with_pulley(self, pulley: str, **values: float) -> "SceneParts":
        """With fields of the surface of ``pulley`` ("head" or "tail") replaced."""
        return replace(self, **{pulley: replace(getattr(self, pulley), **values)})

    def add_to_pulley(self, pulley: str, **values: float) -> "SceneParts":
        """With values added to fields of the surface of ``pulley`` ("head" or "tail")."""
        there = vars(getattr(self, pulley))
        return self.with_pulley(pulley, **{name: there[name] + value for name, value in values.items()})

    def with_camber(self, camber: CurvatureAlongBelt) -> "SceneParts":
        """With a natural curvature [1/m] added to what the belt has."""
        there = self.camber
        return replace(self, camber=camber if there is None else lambda s: there(s) + camber(s))

    def with_guide(self, **values: Any) -> "SceneParts":
        """With one more EdgeGuide of these values."""
        return replace(self, edge_guides=(*self.edge_guides, GuideRoller(**values)))

    def with_push(self, **values: Any) -> "SceneParts":
        """With one more Push of these values, if it pushes at all."""
        push = Push(**values)
        return replace(self, pushes=(*self.pushes, push)) if push.along or push.across or push.couple else self
