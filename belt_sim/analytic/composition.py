"""Composition of laws of an analytic model, and the effects that it can represent."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from belt_sim.case import Case
from belt_sim.effects.base import AFTER_ENGINE, BEFORE_ENGINE, IN_MARCH, Effect, overrides
from belt_sim.errors import CannotRepresent
from belt_sim.laws.span import Span

#: hooks that a march can apply
ALL_HOOKS = frozenset({*BEFORE_ENGINE, *IN_MARCH, *AFTER_ENGINE})


@dataclass(frozen=True, kw_only=True)
class Composition:
    """A named composition of laws; all share the run-up, wrap, drive and sensor laws.

    span: span law, Case -> Span; hooks: hooks of effects that it applies; contains: ids of effects that are part of its
    laws; built_in: effects that always act; moments: whether its spans carry bending moments.
    """

    name: str
    title: str
    span: Callable[[Case], Span]
    hooks: frozenset[str] = ALL_HOOKS
    contains: frozenset[str] = frozenset()
    built_in: tuple[Effect, ...] = ()
    moments: bool = True

    def refusal(self, effect: Effect | type[Effect]) -> str | None:
        """Return why this model cannot represent ``effect``; None if it can."""
        if effect.id in self.contains:
            return f"model {self.name} has {effect.id} built in already"
        if "sag" in effect.needs and "sag_roll" not in self.contains:
            return f"the spans of model {self.name} do not hang, and {effect.id} acts through their roll"
        if "moment" in effect.needs and not self.moments:
            return f"the spans of model {self.name} bear no moment for {effect.id} to answer to"
        missing = overrides(effect, sorted(ALL_HOOKS)) - self.hooks
        if missing:
            return f"model {self.name} has no {'/'.join(sorted(missing))} law for {effect.id} to change"
        return None

    def admit(self, effects: Sequence[Effect]) -> None:
        """Raise CannotRepresent for the first effect that this model cannot represent."""
        for effect in effects:
            reason = self.refusal(effect)
            if reason:
                raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out or use model=beam_th2 or strip")
