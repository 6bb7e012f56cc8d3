"""Which effects are compiled into a march: few rows pay for what is null in them, and few programs serve all rows.

Effects stand in groups: those that a march does not ask at its steps are always there; of the others the slow ones are
one group, and the rest another, each compiled where any of it acts.
"""

from collections.abc import Sequence

from belt_sim.diagnosis.readings.effect_hints import SLOW
from belt_sim.effects.base import Effect, overrides

READ, LIGHT, HEAVY = "read", "light", "heavy"
_AT_STEPS = ("yaw", "runup", "bend", "slide", "wrap")
Groups = frozenset[str]


def group_of(cls: type[Effect]) -> str:
    """The group of an effect: its own id where it need not be compiled at all."""
    if cls.is_additive():
        return cls.id
    if cls.id in SLOW:
        return HEAVY
    return LIGHT if overrides(cls, _AT_STEPS) else READ


def members(classes: Sequence[type[Effect]], groups: Groups) -> list[type[Effect]]:
    """Those of ``classes`` that are compiled, in their order."""
    return [c for c in classes if group_of(c) in {READ, *groups}]
