"""A case: one rig (two cylindrical pulleys), one belt (an endless steel strip), and how they are set."""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import jax
import numpy as np

GRAVITY = 9.81  # [m/s2], the value behind the reference numbers of the physics sheet

#: a float, a NumPy array or a JAX array: physics is the same for one case and for many
Numbers = Any
C = TypeVar("C", bound=Any)


def pytree(cls: type[C]) -> type[C]:
    """Register a dataclass with JAX: every field is a leaf, unless ``field(metadata={"static": True})``.

    The class's name is part of the structure: jax 0.10.2 compares the structures of registered dataclasses without
    their type, and would hand the compiled code of one effect to another with as many numbers.
    """
    names = [f.name for f in dataclasses.fields(cls) if not f.metadata.get("static")]
    static = [f.name for f in dataclasses.fields(cls) if f.metadata.get("static")]
    mark = f"{cls.__module__}.{cls.__qualname__}"

    def flatten(x: C) -> tuple[list[Any], tuple[Any, ...]]:
        return [getattr(x, n) for n in names], (mark, *(getattr(x, n) for n in static))

    def flatten_with_keys(x: C) -> tuple[list[Any], tuple[Any, ...]]:
        leaves, aux = flatten(x)
        return [*zip(map(jax.tree_util.GetAttrKey, names), leaves, strict=True)], aux

    def unflatten(marks: tuple[Any, ...], leaves: Iterable[Any]) -> C:
        new = object.__new__(cls)
        for name, value in (*zip(names, leaves, strict=True), *zip(static, marks[1:], strict=True)):
            object.__setattr__(new, name, value)
        return new

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls


@pytree
@dataclass(frozen=True, kw_only=True)
class Rig:
    """Two pulleys, the head pulley (driven) at x = 0 and the tail pulley (steered) at x = centre_distance.

    centre_distance [m]; head_radius, tail_radius [m], to the belt's middle surface; gravity [m/s2]; face_width [m] of
    the pulleys, where it is known: no law reads it, and a run says when the belt runs over its edge.
    """

    centre_distance: float
    head_radius: float
    tail_radius: float
    gravity: float = GRAVITY
    face_width: float | None = field(default=None, metadata={"static": True})

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
        """Angle between a span and the line of centres [rad]; asin(d) by its series, exact to 5e-9 for d < 0.1."""
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


@pytree
@dataclass(frozen=True, kw_only=True)
class Schedule:
    """A yaw angle against belt travel: a sum of steps and ramps.

    at [m], over [m], change [rad]: arrays of one length; entry k turns the pulley by change[k], beginning at
    travel at[k] and spread evenly over over[k] metres (0 = a step). The angle before the first entry is 0.
    """

    at: Numbers
    over: Numbers
    change: Numbers

    @staticmethod
    def step(angle: float, at: float = 0.0) -> "Schedule":
        """The pulley is turned by ``angle`` [rad] at travel ``at`` [m]."""
        return Schedule(at=np.array([at]), over=np.array([0.0]), change=np.array([angle]))

    @staticmethod
    def ramp(angle: float, at: float, over: float) -> "Schedule":
        """The pulley is turned evenly by ``angle`` [rad] between travel ``at`` and ``at + over`` [m]."""
        return Schedule(at=np.array([at]), over=np.array([over]), change=np.array([angle]))

    def then(self, other: "Schedule") -> "Schedule":
        """Both schedules one after (or over) the other."""
        pairs = [(self.at, other.at), (self.over, other.over), (self.change, other.change)]
        at, over, change = (np.concatenate([np.asarray(a), np.asarray(b)]) for a, b in pairs)
        return Schedule(at=at, over=over, change=change)

    def last(self) -> Numbers:
        """The angle that the schedule ends at [rad]."""
        return self.change.sum(axis=-1)


@pytree
@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a case is run.

    tension [Pa]; yaw of the tail pulley and yaw_head of the head pulley, both about +z; speed [m/s];
    direction +1 (the upper span runs from head to tail) or -1; start: travel [m] that the belt had behind it at travel
    0, since its marked place lay at point 4: by so much belt and pulleys had turned; y0 [m]: how far off the middle of
    the machine the belt lay at travel 0, from where y counts.
    """

    tension: Numbers
    yaw: Schedule
    yaw_head: Schedule = field(default_factory=lambda: Schedule.step(0.0))
    speed: Numbers = 0.5
    direction: Numbers = 1.0
    start: Numbers = 0.0
    y0: Numbers = 0.0


@pytree
@dataclass(frozen=True, kw_only=True)
class Case:
    """Rig + Belt + Settings."""

    rig: Rig
    belt: Belt
    settings: Settings

    @property
    def tension_force(self) -> Numbers:
        """F = sigma b h [N]."""
        return self.settings.tension * self.belt.area

    @property
    def weight_per_length(self) -> Numbers:
        """q = rho g b h [N/m]."""
        return self.belt.mass_per_length * self.rig.gravity

    @property
    def sag_curvature(self) -> Numbers:
        """Z = q / F, the vertical curvature of the hanging span [1/m]."""
        return self.weight_per_length / self.tension_force
