"""Facts as pictures: what is taken for what, and what probabilities are worth."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.challenge.facts import NAMING, Facts
from belt_sim.challenge.wilson import Share
from belt_sim.pictures import confusion_picture, reliability_picture

EDGES = (0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
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
    said = np.array([mean for mean, _ in bins])
    found = np.array([s.value for _, s in bins])
    low, high = np.array([s.interval for _, s in bins]).T
    counts = np.array([s.trials for _, s in bins])
    reliability_picture(path, said, found, low, high, counts, "What a probability is worth")
    return True


def reliability(rows: Sequence[Facts]) -> list[tuple[float, Share]]:
    """(mean probability said, share truly hidden) of every bin of EDGES that holds a named effect."""
    said = np.array([p for f in rows for p in f.named.values()])
    true = np.array([name in f.hidden for f in rows for name in f.named], dtype=bool)
    which = np.clip(np.searchsorted(EDGES, said, side="right") - 1, 0, len(EDGES) - 2)
    return [
        (float(said[which == k].mean()), Share(int(true[which == k].sum()), int((which == k).sum())))
        for k in range(len(EDGES) - 1)
        if (which == k).any()
    ]
