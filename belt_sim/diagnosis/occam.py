"""Occam's razor: several known effects are no finding where one law alone does as well as all of them together.

Effects that no list holds are imitated by two, three or four that one holds: their columns together span almost
anything smooth. Every member of a set is charged what chance would give it, and a law what its numbers and its being
the best of a whole dictionary have to earn; what is left decides, with the odds that a machine has several faults at
once against one.
"""

from belt_sim.diagnosis.select import Selection
from belt_sim.diagnosis.unknown import Look

SEVERAL = 2  # effects, from which on one law is asked for
ODDS = 4.6  # chi2 (a likelihood ratio of 10) by which several faults have to explain more than one law


def imitated(found: Selection, look: Look) -> tuple[str, ...]:
    """The law that does as well as the chosen effects together, as a failed test; none where they do better."""
    chosen, bench = found.chosen, found.bench
    if len(chosen.ids) < SEVERAL:
        return ()
    worth = found.gain - sum(found.threshold(i) for i in chosen.ids) - ODDS
    law = look.one_law(found.base_bench, found.base, worth)
    if law is None:
        return ()
    base = chosen.chi2 + found.gain  # of the base model, on the metric that the set is judged by
    gain = base - float(bench.metric.chi2(bench.fitted.y - law.values))
    if gain - law.price < worth:
        return ()
    return (f"one law explains as much as all of them (chi2 {gain:.0f} for {found.gain:.0f}; {law.words})",)
