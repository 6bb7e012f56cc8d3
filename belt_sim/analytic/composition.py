"""Which laws an analytic model is composed of, and which effects it can therefore represent."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from belt_sim.case import Case
from belt_sim.effects.base import AFTER_ENGINE, BEFORE_ENGINE, IN_MARCH, Effect, overrides
from belt_sim.errors import CannotRepresent
from belt_sim.laws.span import Span

#: hooks that a march can honour
ALL_HOOKS = frozenset({*BEFORE_ENGINE, *IN_MARCH, *AFTER_ENGINE})


@dataclass(frozen=True, kw_only=True)
class Composition:
    """A named composition of laws: run-up, wrap, drive and sensor law are shared, the span law is its own.

    span: Case -> Span; hooks: the laws it lets effects change; contains: ids of effects that its laws have built in,
    and built_in: effects that are always with it; moments: whether its spans bear bending moments that an effect may
    answer to.
    """

    name: str
    title: str
    span: Callable[[Case], Span]
    hooks: frozenset[str] = ALL_HOOKS
    contains: frozenset[str] = frozenset()
    built_in: tuple[Effect, ...] = ()
    moments: bool = True

    def refusal(self, effect: Effect | type[Effect]) -> str | None:
        """Why this model cannot represent ``effect``; None when it can."""
        if effect.id in self.contains:
            return f"model {self.name} has {effect.id} built in already"
        if effect.hanging and "sag_roll" not in self.contains:
            return f"the spans of model {self.name} do not hang, and {effect.id} acts through their roll"
        if effect.last and not self.moments:
            return f"the spans of model {self.name} bear no moment for {effect.id} to answer to"
        missing = overrides(effect, sorted(ALL_HOOKS)) - self.hooks
        if missing:
            return f"model {self.name} has no {'/'.join(sorted(missing))} law for {effect.id} to change"
        return None

    def admit(self, effects: Sequence[Effect]) -> None:
        """Raise CannotRepresent for the first effect that this model cannot honour."""
        for effect in effects:
            reason = self.refusal(effect)
            if reason:
                raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out or use model=beam_th2 or strip")
