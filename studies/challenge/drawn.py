"""Facts as pictures: what is taken for what, and what probabilities are worth."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.pictures import confusion_picture, reliability_picture
from studies.challenge.facts import NAMING, Facts
from studies.challenge.reliability import reliability

SMALLEST = 4.5  # d of an effect that is to be seen


def draw_confusion(path: Path, rows: Sequence[Facts]) -> bool:
    """One hidden effect, nothing, or a stranger, against the first name or the verdict; False when there is nothing."""
    seen = [(_hidden(f), answered(f)) for f in rows if _hidden(f)]
    if not seen:
        return False
    hidden, named = (_ordered({pair[k] for pair in seen}) for k in (0, 1))
    counts = np.zeros((len(hidden), len(named)))
    for row, column in seen:
        counts[hidden.index(row), named.index(column)] += 1
    confusion_picture(
        path, hidden, named, counts, "What is taken for what (one effect of d >= 4.5, nothing, strangers)"
    )
    return True


def _hidden(f: Facts) -> str:
    """The row of a campaign: adequate (nothing hidden), unknown (outside the library), or one effect."""
    if f.kind == "library" and (f.size or 0.0) >= SMALLEST:
        return f.hidden[0]
    return {"nothing": "adequate", "outside": "unknown"}.get(f.kind, "")


def answered(f: Facts) -> str:
    """The column of an answer: one name, several, or what the verdict says without a name."""
    if f.verdict in NAMING and f.named:
        return next(iter(f.named)) if len(f.named) == 1 else "several"
    return "unknown" if f.verdict in ("none_known", *NAMING) else f.verdict


def _ordered(names: set[str]) -> list[str]:
    last = ("several", "unknown", "adequate", "cannot_say", "crash")
    return sorted(names - {*last}) + [n for n in last if n in names]


def draw_reliability(path: Path, rows: Sequence[Facts]) -> bool:
    """Probabilities that were said against how often they were right; False when none was said."""
    bins = reliability(rows)
    if not bins:
        return False
    said, found = np.array([b.said for b in bins]), np.array([b.true.value for b in bins])
    low, high = np.array([b.true.interval for b in bins]).T
    names = [f"{b.name}\n{b.true.count} of {b.true.trials}" for b in bins]
    reliability_picture(path, names, said, found, low, high, "What a probability is worth")
    return True
