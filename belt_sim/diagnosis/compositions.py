"""Which effects are compiled into a march: no row pays for what is null in it, and few programs serve all rows.

Effects stand in groups: those that a march does not ask at its steps are always there; those that move the pulleys or
the run-up are one group, those that bend the spans another; and each that is dear is one by itself.
"""

from collections.abc import Iterable, Sequence

from belt_sim.effects.base import Effect, overrides

READ, MOVED, BENT = "read", "moved", "bent"
_AT_STEPS = ("yaw", "runup", "slide", "wrap")
Groups = frozenset[str]
CHEAP: Groups = frozenset({MOVED, BENT})


def group_of(cls: type[Effect]) -> str:
    """The group of an effect: its own id where it is dear."""
    if cls.heavy or cls.dear or not cls.__module__.startswith("belt_sim."):
        return cls.id
    if overrides(cls, ("bend",)):
        return BENT
    return MOVED if overrides(cls, _AT_STEPS) else READ


def composed(active: Iterable[str]) -> Groups:
    """Groups that are compiled for those that are active: a dear one is alone or with both that are not."""
    found = frozenset(active) - {READ}
    return found | CHEAP if found & CHEAP and found - CHEAP else found


def members(classes: Sequence[type[Effect]], groups: Groups) -> list[type[Effect]]:
    """Those of ``classes`` that are compiled, in their order."""
    return [c for c in classes if group_of(c) in groups or group_of(c) == READ]
