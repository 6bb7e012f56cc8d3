"""The machine and the belt: two cylindrical pulleys and an endless steel strip."""

import math
from dataclasses import dataclass

from belt_sim.pytree import Numbers, pytree

GRAVITY = 9.81  # [m/s2], the value behind the reference numbers of the physics sheet


@pytree
@dataclass(frozen=True, kw_only=True)
class Rig:
    """Two pulleys, the head pulley (driven) at x = 0 and the tail pulley (steered) at x = centre_distance.

    centre_distance [m]; head_radius, tail_radius [m], to the belt's middle surface; gravity [m/s2].
    """

    centre_distance: float
    head_radius: float
    tail_radius: float
    gravity: float = GRAVITY

    @property
    def span_length(self) -> Numbers:
        """Free length of either span [m]: the common tangent of the two circles."""
        return (self.centre_distance**2 - (self.tail_radius - self.head_radius) ** 2) ** 0.5

    @property
    def wrap_head(self) -> Numbers:
        """Wrapped arc on the head pulley [m] (pi R for equal pulleys)."""
        return (math.pi + 2.0 * self._lean) * self.head_radius

    @property
    def wrap_tail(self) -> Numbers:
        """Wrapped arc on the tail pulley [m]."""
        return (math.pi - 2.0 * self._lean) * self.tail_radius

    @property
    def belt_length(self) -> Numbers:
        """Length of the endless belt [m]."""
        return 2.0 * self.span_length + self.wrap_head + self.wrap_tail

    @property
    def _lean(self) -> Numbers:
        """Angle between a span and the line of centres [rad]; asin(d) by its series, exact to 1e-9 for d < 0.1."""
        d = (self.head_radius - self.tail_radius) / self.centre_distance
        return d + d**3 / 6.0 + 3.0 * d**5 / 40.0


@pytree
@dataclass(frozen=True, kw_only=True)
class Belt:
    """A steel strip: width, thickness [m]; youngs_modulus [Pa]; density [kg/m3]; poisson_ratio [1]."""

    width: float
    thickness: float
    youngs_modulus: float
    density: float
    poisson_ratio: float = 0.3

    @property
    def area(self) -> Numbers:
        """Cross-section b h [m2]."""
        return self.width * self.thickness

    @property
    def bending_stiffness(self) -> Numbers:
        """In-plane bending stiffness EI = E b^3 h / 12 [N m2]."""
        return self.youngs_modulus * self.width**3 * self.thickness / 12.0

    @property
    def plate_stiffness(self) -> Numbers:
        """D = E h^3 / (12 (1 - nu^2)), bending stiffness out of the belt's plane per unit of width [N m]."""
        return self.youngs_modulus * self.thickness**3 / (12.0 * (1.0 - self.poisson_ratio**2))

    @property
    def shear_modulus(self) -> Numbers:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def mass_per_length(self) -> Numbers:
        """rho b h [kg/m]."""
        return self.density * self.area
