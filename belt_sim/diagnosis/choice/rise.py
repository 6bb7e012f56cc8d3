"""Whether the held-out error, as the report would show it, is larger with a set of effects than without any.

Such a set is not named by itself, however much it explains (beside an unknown law: ``beside_a_law``). But of effects
that readings do not tell apart one may be held out worse by chance, or for a number more that it has: then the
likeliest that is not is as good an answer, and is taken.
"""

from belt_sim.diagnosis.choice.decide import NESTING, Decision, Ids, compared
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.errors.own_errors import OwnErrors
from belt_sim.diagnosis.fits.heldout import HeldOut
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.results.found import Explanation, best_explanation

SHOWN_RISE = 1.005  # of the held-out error, from which two decimals show it
ALIKE = 6.0  # chi2 (a likelihood ratio of 20) behind an effect, up to which another may stand for it


def rises(bench: Workbench, base: HeldOut, bare: HeldOut, held: HeldOut) -> tuple[str, ...]:
    """The held-out error as the report would show it, as a failed test, where it is larger than the base model's.

    base, bare: held-out errors of no effect, as the campaign was laid out, and on ``bench``. In plain rms slow wander
    counts most, and small effects hide in it: a rise that the report would not show, or that stays within what a
    perfect model would leave, is none where every condition becomes likelier: at one noise, for that beside the effects
    is less than beside none.
    """
    own = OwnErrors(bench)
    before, after = (own.rms(h, held.tested) for h in (base, held))
    if after <= before:
        return ()
    less_likely = max(held.conditions[n].surprise - bare.conditions[n].surprise for n in held.tested) > NESTING
    if after <= max(SHOWN_RISE * before, own.floor) and not less_likely:
        return ()
    return (f"held-out error, {after / before:.2f} times the base model's",)


def without_a_rise(decision: Decision[Refits], base: HeldOut) -> tuple[Refits, tuple[Explanation, ...]]:
    """The evidence and the table of a decision; where the error rises with the set that was chosen, those about the
    likeliest that has a look-alike for one of its effects and stands without a rise.

    base: held-out errors of no effect.
    """
    evidence, ids = decision.evidence, decision.ids
    if not ids or not _rises(evidence, ids, base):
        return evidence, decision.table
    for other in _look_alikes(evidence, ids):
        about = evidence.moved(other)
        table = compared(about, [other])
        if best_explanation(table).effects == other and not _rises(about, other, base):
            return about, table
    return evidence, decision.table


def _rises(evidence: Refits, ids: Ids, base: HeldOut) -> bool:
    return bool(rises(evidence.bench, base, evidence.held_out(()), evidence.held_out(ids)))


def _look_alikes(evidence: Refits, ids: Ids) -> list[Ids]:
    """Sets with one effect exchanged for another that explains about as much, likeliest first."""
    found: dict[Ids, float] = {}
    for name in ids:
        rest = tuple(i for i in ids if i != name)
        trials = evidence.trials(rest)
        own = next(t.score for t in trials if t.id == name)
        found |= {(*rest, t.id): t.score - own for t in trials if t.id != name and t.passes and t.score > own - ALIKE}
    return sorted(found, key=lambda other: -found[other])
