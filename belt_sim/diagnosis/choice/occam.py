"""Occam's razor: known effects are no finding where one unknown law does better, or several where it does as well.

Effects that no list holds are imitated by two, three or four that one holds: their columns together span almost
anything smooth. Every member of a set is charged what chance would give it, and a law what its numbers and its being
the best of a whole dictionary have to earn. What is left decides, at the odds of what a machine has: one known fault is
likelier than an unknown law, and several at once are less likely, the more they are. A set that a law is ahead of only
for its last member, whose evidence does not pay for its being one fault more, gives way to the law no more than it
would without that member; and a law that explains less than the set must at least beat chance by itself.

Of the laws of a dictionary some say nearly what the one right effect says, and the best of them follows the noise
better. So a law that is ahead of one effect has to be further ahead than the best law gets by chance where that effect
is right.
"""

from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.choice.decide import ODDS
from belt_sim.diagnosis.choice.select import Selection
from belt_sim.diagnosis.left_over.unknown import Look

SURER = 6.0  # chi2: a likelihood ratio of 20
LEVEL = 0.02  # of campaigns with one effect, in which it loses its name to a law by chance


def imitated(found: Selection, look: Look) -> tuple[str, ...]:
    """The law that does better than the chosen effects, as a failed test; none where they do."""
    chosen, bench = found.chosen, found.bench
    charged, worth = [found.threshold(i) for i in chosen.ids], _worth(found)
    before = found.base_bench.at_levels(bench.levels)  # noise as the set is judged by, not swollen by what is missing
    base = replace(found.base, chi2=float(before.metric.chi2(before.fitted.y - found.base.values)))
    law = look.one_law(before, base, worth, closely=len(chosen.ids) > 1)  # several imitate what one law alone does
    if law is None:
        return ()
    gain = chosen.chi2 + found.gain - float(bench.metric.chi2(bench.fitted.y - law.values))
    uncertain = max(found.null.inflation(i) for i in chosen.ids)  # noise levels are: chance gives a law more as well
    if gain - max(law.price * uncertain, *charged) < worth:  # saying what an effect says is no cheaper than that
        return ()
    if gain < found.gain and not look(before, base, False).failed:
        return ()
    if len(chosen.ids) == 1 and _by_chance(found, look, gain - law.cost - found.gain):
        return ()
    return (f"one law in their place (it explains a chi2 of {gain:.0f}, they {found.gain:.0f}; {law.words})",)


def outdone(found: Selection, gain: float, look: Look) -> bool:
    """Whether one law beside the base model explains more than another model of the house does, all that it had to earn
    being paid: that other model has no number of its own, and what makes most of a law's work is not the law.
    """
    bench, base = found.base_bench, found.base
    law = look.one_law(bench, base, gain + SURER, closely=True)
    return (
        law is not None and base.chi2 - float(bench.metric.chi2(bench.fitted.y - law.values)) - law.price > gain + SURER
    )


def _worth(found: Selection) -> float:
    """What the chosen effects, or all of them but one, explain beyond chance, at the odds of as many faults."""
    ids, gains = found.chosen.ids, {found.chosen.ids: found.gain}
    for name in ids if len(ids) > 1 else ():
        own = next(t for t in found.swaps[name] if t.id == name)
        gains[tuple(i for i in ids if i != name)] = found.gain - own.gain
    return max(g - sum(map(found.threshold, s)) + ODDS * likelier(len(s)) for s, g in gains.items())


def _by_chance(found: Selection, look: Look, lead: float) -> bool:
    """Whether the best law gets so much chi2 ahead of the one chosen effect by chance where that is right."""
    leads = look.lead_by_chance(found.bench, found.base, found.chosen)
    return lead <= float(np.quantile(leads, 1.0 - LEVEL, method="weibull"))


def likelier(effects: int) -> int:
    """By how many factors of odds so many faults at once are likelier than one unknown law."""
    return 1 if effects == 1 else 1 - effects
