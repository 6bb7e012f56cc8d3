"""The decision which effects are missing, from evidence alone.

Forward with swaps, at most four, and from the best of all pairs where that promises more than what was seen; where
effects stand out that each mislead without another, also from the best pair with the one that stands out most. Then
every set seen on the way is compared with all its subsets, the empty one too, by one final metric: gain over the base
model beyond what chance gives, and beyond the odds of one fault more. No larger set wins that predicts held-out
conditions worse than a smaller one.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from belt_sim.results.found import Explanation, best_explanation

MAX_EFFECTS = 4
NESTING = 1.0  # differences of chi2 below this are the optimiser's, not the readings'
#: chi2 (a likelihood ratio of 10): of machines with a fault so few have one more. Thresholds say how seldom chance does
#: as well; whether a name that just beats its own is chance or a fault hangs on how often there is such a fault
ODDS = 4.6
NO_MACHINE = "no machine has such numbers"
TOO_LATE = "the search had not seen it"

Ids = tuple[str, ...]


class Beside(Protocol):
    """One candidate beside a set: its gain over that set, what chance would give, whether its numbers are plausible."""

    @property
    def id(self) -> str:
        """Of the candidate."""

    @property
    def passes(self) -> bool:
        """Whether it beats chance with plausible numbers."""

    @property
    def score(self) -> float:
        """Gain above what chance would give."""


class Evidence(Protocol):
    """What readings say of sets of effects."""

    def trials(self, ids: Ids) -> Sequence[Beside]:
        """Every other candidate beside ``ids``."""

    def gains(self, sets: Sequence[Ids]) -> Sequence[float]:
        """chi2 gain of sets over the base model, all on one metric."""

    def threshold(self, name: str) -> float:
        """The gain of one effect that chance beats as seldom as agreed."""

    def plausible(self, ids: Ids) -> bool:
        """Whether a real machine could have all numbers of a set."""

    def worse(self, larger: Ids, smaller: Ids) -> tuple[str, ...]:
        """What of the held-out error is larger with the larger set."""

    def pair(self, seen: Sequence[Ids]) -> Ids | None:
        """The best of all pairs of candidates, if it promises more than each of the sets that were seen."""

    def moved(self, ids: Ids) -> Self:
        """The evidence with everything small linearised about a set."""


E = TypeVar("E", bound=Evidence)


@dataclass(frozen=True)
class Decision(Generic[E]):
    """The set of effects that the readings ask for, the evidence laid out at it, the trials of every round, and the
    table of sets that were compared at last.
    """

    ids: Ids
    evidence: E
    rounds: tuple[Sequence[Beside], ...]
    table: tuple[Explanation, ...]


def decide(evidence: E, *, limit: int = MAX_EFFECTS, tell: Callable[[str], None] = lambda text: None) -> Decision[E]:
    """Which effects are missing."""
    first, rounds = evidence, list[Sequence[Beside]]()
    seen: list[Ids] = [()]
    evidence, about = _forward(evidence, seen, rounds, limit, tell)
    if len(seen) == 1 and not any(t.passes for tried in rounds for t in tried):
        return Decision((), evidence, tuple(rounds), compared(evidence, seen))
    table, pairs = compared(evidence, seen), _pairs(first, seen, rounds[-1]) if limit > 1 else []
    for pair in pairs:
        tell(f"{' and '.join(pair)} together")
        seen.append(pair)
    if pairs:
        table = compared(evidence, seen)
        best = best_explanation(table).effects
        if frozenset(best) in map(frozenset, pairs):
            seen.append(best)
            evidence, about = _forward(evidence.moved(best), seen, rounds, limit, tell)
            table = compared(evidence, seen)
    if frozenset(best_explanation(table).effects) != frozenset(about):
        evidence, table = _settled(evidence, best_explanation(table).effects)
    return Decision(best_explanation(table).effects, evidence, tuple(rounds), table)


def _pairs(evidence: Evidence, seen: Sequence[Ids], tried: Sequence[Beside]) -> list[Ids]:
    """Pairs that are worth trying whatever their members do alone: the best of all, as columns have them, and where no
    effect that stands out joined, the best beside the best of these.

    Each of two faults may predict worse what the other does; and columns say little of what an effect that bends does.
    """
    pair = evidence.pair(seen)
    found = [pair] if pair is not None else []
    first = max((t for t in tried if t.passes), key=lambda t: t.score, default=None) if len(seen) == 1 else None
    if first is not None:
        second = max((t for t in evidence.trials((first.id,)) if t.passes), key=lambda t: t.score, default=None)
        found += [(first.id, second.id)] if second is not None else []
    return found


def _settled(evidence: E, ids: Ids) -> tuple[E, tuple[Explanation, ...]]:
    """The evidence about a set, and what of the set stands there.

    Elsewhere settings are taken to have been others, and a member may be needed to make up for that.
    """
    while True:
        evidence = evidence.moved(ids)
        table = compared(evidence, [ids])
        best = best_explanation(table).effects
        if frozenset(best) == frozenset(ids):
            return evidence, table
        ids = best


def _forward(
    evidence: E, seen: list[Ids], rounds: list[Sequence[Beside]], limit: int, tell: Callable[[str], None]
) -> tuple[E, Ids]:
    """From the set seen last, one effect more as long as that helps; ``seen`` and ``rounds`` grow by what was tried.

    Returns the evidence, and the set that it is linearised about.
    """
    current = about = seen[-1]
    while len(current) < limit:
        tell(f"candidates beside {', '.join(current) or 'the base model'}")
        rounds.append(evidence.trials(current))
        better = sorted((t for t in rounds[-1] if t.passes), key=lambda t: -t.score)
        larger = next((s for t in better if not evidence.worse(s := (*current, t.id), current)), None)
        if larger is None:
            break
        seen.append(larger)
        evidence, about = evidence.moved(larger), larger
        current = swapped(evidence, larger, tell)
        if frozenset(current) in map(frozenset, seen[:-1]):
            break
        seen.append(current)
    return evidence, about


def swapped(evidence: Evidence, ids: Ids, tell: Callable[[str], None] = lambda text: None) -> Ids:
    """The set after single effects were replaced while that fits better, or where no machine could have them so."""
    for _ in range(MAX_EFFECTS):
        for name in ids:
            rest = tuple(i for i in ids if i != name)
            trials = evidence.trials(rest)
            own = next((t.score for t in trials if t.id == name and t.passes), -np.inf)
            winner = max((t for t in trials if t.passes), key=lambda t: t.score, default=None)
            if winner is not None and winner.id != name and winner.score > own + NESTING:
                tell(f"{winner.id} explains more than {name}")
                ids = (*rest, winner.id)
                break
        else:
            return ids
    return ids


def compared(evidence: Evidence, seen: Sequence[Ids]) -> tuple[Explanation, ...]:
    """All sets seen and all their subsets, the empty one too, worth most first; what speaks against one is asked until
    nothing does.
    """
    family = sorted(_subsets(seen), key=len)
    each = [explanation(evidence, ids, gain) for ids, gain in zip(family, evidence.gains(family), strict=True)]
    found: list[Explanation] = []
    for e in _worth_most_first(each):
        asked = bool(e.effects) and all(better.refused for better in found)
        found.append(replace(e, refused=_refused(evidence, e.effects)) if asked else e)
    return tuple(found)


def explanation(evidence: Evidence, ids: Ids, gain: float) -> Explanation:
    """A set as an explanation, before anybody asks what speaks against it."""
    by_chance = float(sum(evidence.threshold(i) for i in ids))
    return Explanation(effects=ids, gain=float(gain), by_chance=by_chance, rarity=one_more(ids))


def completed(
    table: Sequence[Explanation], evidence: Evidence, others: Iterable[Explanation]
) -> tuple[Explanation, ...]:
    """A table with other sets, which were seen when it was decided already; what speaks against one that is worth more
    is asked.
    """
    found, best = {frozenset(e.effects): e for e in table}, best_explanation(table)
    for e in others:
        if frozenset(e.effects) not in found:
            ahead = e.worth > best.worth and not e.refused
            why = (_refused(evidence, e.effects) or TOO_LATE) if ahead else e.refused
            found[frozenset(e.effects)] = replace(e, refused=why)
    return tuple(_worth_most_first(found.values()))


def _worth_most_first(each: Iterable[Explanation]) -> list[Explanation]:
    return sorted(each, key=lambda e: (-e.worth, len(e.effects)))


def one_more(ids: Ids) -> float:
    """What a set has to gain for every effect beyond its first [chi2]."""
    return ODDS * max(len(ids) - 1, 0)


def _refused(evidence: Evidence, ids: Ids) -> str:
    """What speaks against a set: a member that is not needed, numbers of no machine, a subset that predicts better."""
    whole, *without = evidence.gains([ids, *(tuple(i for i in ids if i != name) for name in ids)])
    for name, rest in zip(ids, without, strict=True):
        if not whole - rest > evidence.threshold(name):
            return f"{name} is not needed"
    if not evidence.plausible(ids):
        return NO_MACHINE
    for smaller in _subsets([ids]):
        worse = evidence.worse(ids, smaller) if len(smaller) < len(ids) else ()
        if worse:
            return f"predicts what is held out worse than {' + '.join(smaller) or 'the base model'} does"
    return ""


def _subsets(sets: Iterable[Ids]) -> list[Ids]:
    """All subsets of all sets, each once."""
    found: dict[frozenset, Ids] = {}
    for ids in sets:
        for size in range(len(ids) + 1):
            for part in combinations(ids, size):
                found.setdefault(frozenset(part), part)
    return list(found.values())
