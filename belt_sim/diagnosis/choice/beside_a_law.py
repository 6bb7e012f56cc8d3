"""Effects beside a law that the library lacks: which it made look wrong, and which only look right because of it.

While something unknown is in the readings, an effect that is there takes on part of it too, and carries that into runs
that were left out: the larger the unknown, the worse it predicts by itself, however well it would beside the law. So
what hold-out refuses may still be there. It is, where it is needed beside the one law that explains most of the rest,
and what is held out is then predicted no worse than by that law alone.

An effect that is not there takes on part of the unknown too, where it does nearly the same: then a law of no more terms
describes as much without it. Smooth columns do not show that: an effect that bends has a shape of its own, as the law
has, and what neither of the two is like is no reason for both.
"""

from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.choice.decide import Ids
from belt_sim.diagnosis.choice.refits import Trial
from belt_sim.diagnosis.choice.select import Selection
from belt_sim.diagnosis.fits.candidate import is_plausible
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import held_out
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.beside import DECISIVE, members_that_stay, unknown_columns
from belt_sim.diagnosis.left_over.openset import OpenSet
from belt_sim.diagnosis.left_over.unknown import InTheMarch, Look, Unknown

#: of what a law explains, by which one that is nearly right may miss it, and by which an effect may make up for that
FORMS = 0.02
FAINT = 1e-6  # of the largest direction in which numbers make up for each other


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


def needed_beside_laws(found: Selection, fit: Fit, beside: Unknown, bare: Unknown, look: Look) -> Ids:
    """Those effects of a ``fit`` without which no law describes the readings as well as one does beside all of them.

    beside: what is seen beside the fit; bare: beside the base model. The law is tried where it is, its numbers free,
    and the best of those that are found where an effect is left out; all that it does without go at once, since of
    several that stand in for each other none is known to be there.
    """
    law = beside.law()
    if law is None:
        return fit.ids
    rests = {i: tuple(j for j in fit.ids if j != i) for i in fit.ids}
    without = dict(zip(rests, found.bench.fit([only(found.bench, fit, r) for r in rests.values()]), strict=True))

    def does(name: str, other: InTheMarch | None) -> bool:
        if other is None or other.terms > law.terms:
            return False
        left = _left(found, other)
        missed = FORMS * max(without[name].chi2 - left, 0.0)
        return left - _left(found, law) <= DECISIVE * found.threshold(name) + missed

    kept = tuple(i for i, other in zip(fit.ids, _alone(law, fit.ids), strict=True) if not does(i, other))
    if kept != fit.ids:
        return kept
    several = len(fit.ids) > 1
    seen = {i: look(found.bench, _held(found.bench, fit, rests[i]), True, beside) if several else bare for i in fit.ids}
    return tuple(i for i in fit.ids if not does(i, seen[i].law()))


def _held(bench: Workbench, fit: Fit, ids: Ids) -> Fit:
    """Some of a fit's effects, where a law is sought without the others: in the march it does without, and the search
    begins where these act as they were fitted. Refitted alone the rest takes on what they do, and is far from what it
    is beside a law; and what a law does as they do is not taken out.
    """
    return bench.fit([bench.start(ids, fit.vector)])[0]


def only(bench: Workbench, fit: Fit, ids: Ids) -> Fit:
    """Where a refit of some of a fit's effects begins: with their numbers, the others gone."""
    vector, where = bench.forward.null(), [p for i in ids for p in bench.forward.index(i)]
    vector[where] = fit.vector[where]
    return bench.start(ids, vector)


def _alone(law: InTheMarch, names: Ids) -> list[InTheMarch]:
    """A law without each of the effects beside it, refitted."""
    starts = [start for name in names for start in _starts(law, name)]
    fits = law.bench.fit(starts)
    best = [min(pair, key=lambda f: f.chi2) for pair in zip(fits[::2], fits[1::2], strict=True)]
    return [replace(law, fit=f) for f in best]


def _starts(law: InTheMarch, name: str) -> list[Fit]:
    """Where a refit without an effect begins: with all other numbers as they were, and as they make up for it."""
    forward, both = law.bench.forward, law.fit
    own = [k for k, p in enumerate(both.free) if p in forward.index(name)]
    others = [k for k in range(len(both.free)) if k not in own]
    free = [both.free[k] for k in others]
    gone, null = both.vector.copy(), forward.null()
    gone[forward.index(name)] = null[forward.index(name)]
    lost = (both.vector - gone)[[both.free[k] for k in own]] @ both.columns[own]
    instead = gone.copy()
    instead[free] += np.linalg.lstsq(both.columns[others].T, lost, rcond=FAINT)[0]
    ids = tuple(i for i in both.ids if i != name)
    return [Fit(ids=ids, free=free, vector=np.clip(v, *forward.sides)) for v in (gone, instead)]


def _left(found: Selection, law: InTheMarch) -> float:
    """chi2 that a law leaves with all beside it, by one noise; where it fitted by that, with its settings."""
    left = float(found.bench.metric.chi2(found.bench.fitted.y - law.fit.values))
    return min(left, law.fit.chi2) if law.bench.levels == found.bench.levels else left
