"""Effects that a law which the library lacks made look wrong: what they predict is judged beside that law.

While something unknown is in the readings, an effect that is there takes on part of it too, and carries that into runs
that were left out: the larger the unknown, the worse it predicts by itself, however well it would beside the law. So
what hold-out refuses may still be there. It is, where it is needed beside the one law that explains most of the rest,
and what is held out is then predicted no worse than by that law alone.
"""

import numpy as np

from belt_sim.diagnosis.choice.refits import Trial
from belt_sim.diagnosis.choice.select import Selection
from belt_sim.diagnosis.fits.candidate import is_plausible
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import held_out
from belt_sim.diagnosis.left_over.beside import DECISIVE, members_that_stay, unknown_columns
from belt_sim.diagnosis.left_over.openset import OpenSet
from belt_sim.diagnosis.left_over.unknown import Look, Unknown


def refused(found: Selection, left: OpenSet, unknown: Unknown) -> Trial | None:
    """Of the effects that beat chance, and of which hold-out let none join, the one that explains most beside what is
    ``left`` of the base model and the ``unknown`` that is seen there; None where none is needed.
    """
    first = found.rounds[0] if found.rounds and not found.chosen.ids else ()
    tried = [t for t in first if t.passes and found.chance.worse(t.held_out, found.base_held_out)]
    if not tried:
        return None
    columns = np.concatenate([unknown.columns(), unknown_columns(found.base_bench, left)])
    beside = [members_that_stay(found.base_bench, t.fit, columns, found.threshold) for t in tried]
    stay = [(s.chi2 + t.threshold, k) for k, (s, t) in enumerate(zip(beside, tried, strict=True)) if s is not None]
    return tried[min(stay)[1]] if stay else None


def stands(found: Selection, fit: Fit, look: Look) -> bool:
    """Whether a fit's effects are all needed beside one law, and predict no worse with it than the law does alone."""
    alone = found.bench.fit([found.bench.start(fit.ids, fit.vector)])[0]
    seen = look.together(found.bench, alone)
    if seen is None or not is_plausible(seen.bench.forward, seen.both):
        return False
    paid = DECISIVE * sum(map(found.threshold, fit.ids))
    if not seen.law.chi2 - seen.both.chi2 > paid:
        return False
    return not found.chance.worse(held_out(seen.bench, seen.both), held_out(seen.bench, seen.law))
