"""A run as a parameter vector has it: effects with their numbers, and the case as it was really set."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, Numbers, Rig, Schedule
from belt_sim.effects.base import Effect, Parameter

NUISANCES = ("stiffness", "tension", "yaw", "yaw_at", "belt_length", "start")


@dataclass(frozen=True)
class Slot:
    """One parameter of one effect in the parameter vector."""

    effect: type[Effect]
    name: str

    @property
    def parameter(self) -> Parameter:
        """What the effect says of it."""
        return self.effect.parameters[self.name]

    @property
    def scale(self) -> float:
        return self.parameter.scale

    @property
    def null(self) -> float:
        return self.parameter.null

    @property
    def only_shapes(self) -> bool:
        """Whether it only shapes what others of its effect do, and so moves nothing while these are null."""
        return self.parameter.modifier

    @property
    def side(self) -> tuple[float, float]:
        """Lowest and highest value in units of scale that a fit may take.

        A size has null for one, where a machine has it on one side of null only: how large it is, is for the readings
        to say. What only shapes an effect ends where no machine goes on: a weld of many metres is a camber, and one of
        a hair's breadth is whatever noise did when it passed.
        """
        low, high = self.parameter.plausible
        ends = self.null if self.null <= low else -np.inf, self.null if self.null >= high else np.inf
        if self.only_shapes:
            ends = min(low, self.null), max(high, self.null)
        return ends[0] / self.scale, ends[1] / self.scale


def effects_and_case(vector, slots: Sequence[Slot], case: Case) -> tuple[tuple[Effect, ...], Case]:
    """Effects with their numbers, and the case as it was really set."""
    numbers: dict[type[Effect], dict] = {}
    for k, slot in enumerate(slots):
        numbers.setdefault(slot.effect, {})[slot.name] = vector[k]
    return tuple(cls(**values) for cls, values in numbers.items()), actual_case(case, vector[len(slots) :])


def lengthen_belt(rig: Rig, longer: Numbers) -> Rig:
    """The rig with a belt that is so much longer [1], all in its spans: what comes once a turn does not feel where."""
    return replace(rig, centre_distance=rig.centre_distance + 0.5 * longer * rig.belt_length)


def actual_case(case: Case, nuisance) -> Case:
    """The case as it was really set: stiffness, tension, yaw, its place, the belt's length and where on it a run
    starts off by ``nuisance``."""
    stiffness, tension, yaw, late, longer, further = nuisance
    belt = replace(case.belt, youngs_modulus=case.belt.youngs_modulus * (1.0 + stiffness))
    schedule = case.settings.yaw
    last = jnp.zeros_like(schedule.change).at[-1].set(yaw)
    turned = Schedule(at=schedule.at + late, over=schedule.over, change=schedule.change + last)
    head = replace(case.settings.yaw_head, at=case.settings.yaw_head.at + late)
    settings = replace(case.settings, tension=case.settings.tension * (1.0 + tension), yaw=turned, yaw_head=head)
    settings = replace(settings, start=case.settings.start + further)
    return Case(rig=lengthen_belt(case.rig, longer), belt=belt, settings=settings)
