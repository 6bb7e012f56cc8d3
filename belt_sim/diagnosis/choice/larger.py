"""Sets of one effect more than was chosen: with one beside it, or two in its place.

The smaller set is chosen as long as the further effect does not pay for itself; but one look-alike may explain what two
faults do, and a second fault may be there that these readings nearly show. Both are told where they come near enough.
"""

from dataclasses import replace

from belt_sim.diagnosis.choice.decide import MAX_EFFECTS, Ids
from belt_sim.diagnosis.choice.refits import Refits, Trial
from belt_sim.results.words import TOGETHER

WITHIN = 12.0  # chi2 behind the chosen effect, up to which pairs are refitted: the linear range may be off by some
REFITTED = 8  # of them, those that promise most


def larger(evidence: Refits, ids: Ids) -> list[Trial]:
    """Sets of one effect more than ``ids``, which are chosen; gain over the base model, threshold of all members."""
    if not ids:
        return []
    gain, paid = evidence.gains([ids])[0], sum(map(evidence.threshold, ids))
    tried = evidence.trials(ids) if len(ids) < MAX_EFFECTS else []  # not yet, where a larger set was left for this one
    beside = [replace(t, gain=gain + t.gain, threshold=paid + t.threshold) for t in tried]
    return beside + (_in_place(evidence, ids[0]) if len(ids) == 1 else [])


def _in_place(evidence: Refits, name: str) -> list[Trial]:
    """Two effects in the place of one."""
    pairs = evidence.pairs_in_place(name, WITHIN)[:REFITTED]
    gains = evidence.gains(pairs)
    return [
        Trial(
            id=TOGETHER.join(pair),
            bench=evidence.bench,
            fit=evidence.fit(pair),
            gain=gain,
            threshold=sum(map(evidence.threshold, pair)),
        )
        for pair, gain in zip(pairs, gains, strict=True)
    ]
