"""Occam's razor: known effects are no finding where one unknown law does better, or several where it does as well.

Effects that no list holds are imitated by two, three or four that one holds: their columns together span almost
anything smooth. Every member of a set is charged what chance would give it, and a law what its numbers and its being
the best of a whole dictionary have to earn. What is left decides, at the odds of what a machine has: one known fault is
likelier than an unknown law, and several at once are less likely, the more they are.
"""

from belt_sim.diagnosis.select import Selection
from belt_sim.diagnosis.unknown import Look

ODDS = 4.6  # chi2 (a likelihood ratio of 10)


def imitated(found: Selection, look: Look) -> tuple[str, ...]:
    """The law that does better than the chosen effects, as a failed test; none where they do."""
    chosen, bench = found.chosen, found.bench
    worth = found.gain - sum(found.threshold(i) for i in chosen.ids) + ODDS * likelier(len(chosen.ids))
    law = look.one_law(found.base_bench, found.base, worth)
    if law is None:
        return ()
    base = chosen.chi2 + found.gain  # of the base model, on the metric that the set is judged by
    gain = base - float(bench.metric.chi2(bench.fitted.y - law.values))
    if gain - law.price < worth:
        return ()
    return (f"one law in their place explains as much (chi2 {gain:.0f} for {found.gain:.0f}; {law.words})",)


def likelier(effects: int) -> int:
    """By how many factors of odds so many faults at once are likelier than one unknown law."""
    return 1 if effects == 1 else 1 - effects
