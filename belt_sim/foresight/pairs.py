"""Pairs of effects that the readings could not tell apart, and the further run that would."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from belt_sim.diagnosis.answer.nextrun import Outlook
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.effect_hints import SLOWEST
from belt_sim.foresight.sizes import best_column
from belt_sim.results.check import Pair, Visible
from belt_sim.results.found import RESOLVED

#: Size at which a pair is judged, in whitened units: an effect that is plain to see.
PLAIN = 12.0


def pairs(bench: Workbench, fit: Fit, seen: list[Visible], *, advise: bool) -> list[Pair]:
    """Pairs of visible effects: the one, at PLAIN, leaves less than RESOLVED when the other is fitted in its place."""
    names = [v.effect for v in seen if v.share < 1.0]
    outlook = _further(bench, fit) if advise and names else None
    alike = []
    for a, b in combinations(names, 2):
        sigma = _apart(bench, fit, a, b)
        if sigma < RESOLVED:
            alike.append((sigma, a, b))
    found = []
    for sigma, a, b in sorted(alike):
        action, after = _best(bench, fit, outlook, a, b) if outlook else ("", 0.0)
        found.append(Pair(effects=(a, b), sigma=sigma, action=action, sigma_after=after))
    return found


def _apart(bench: Workbench, fit: Fit, a: str, b: str, extra: np.ndarray | None = None) -> float:
    """Sigmas by which one at PLAIN differs from the other fitted in its place, whichever is less; extra (k, m): columns
    of a further run."""
    columns = fit.columns if extra is None else np.concatenate([fit.columns, extra], axis=1)
    left = []
    for own, other in ((a, b), (b, a)):
        best = best_column(bench, fit, own)
        size = PLAIN / np.linalg.norm(fit.columns[best])
        span = columns[bench.forward.index(other)]
        span = span[np.linalg.norm(span, axis=1) > 1e-9 * np.linalg.norm(span)]
        target = size * columns[best]
        fitted = np.linalg.lstsq(span.T, target, rcond=1e-9)[0] if len(span) else np.zeros(0)
        left.append(float(np.linalg.norm(target - fitted @ span)))
    return min(left)


def _further(bench: Workbench, fit: Fit) -> tuple[list[str], np.ndarray]:
    """Words of every action of the menu, and the whitened columns of its run (k, actions, m); SLOWEST effects are
    left out, a second compilation for each of them would take longer than all else."""
    light = [k for k, s in enumerate(bench.forward.slots) if s.effect.id not in SLOWEST]
    outlook = Outlook(bench, replace(fit, free=light, columns=fit.columns[light], slopes=fit.slopes[light]))
    slopes = outlook.white(outlook.predict(fit, light)[1])
    columns = np.full((len(fit.free), *slopes.shape[1:]), np.nan)
    columns[light] = slopes
    return [a.words for a in outlook.actions], columns


def _best(bench: Workbench, fit: Fit, further: tuple[list[str], np.ndarray], a: str, b: str) -> tuple[str, float]:
    words, columns = further
    rows = [*bench.forward.index(a), *bench.forward.index(b)]
    if np.isnan(columns[rows]).any():
        return "", 0.0
    after = [_apart(bench, fit, a, b, columns[:, k]) for k in range(len(words))]
    best = int(np.argmax(after))
    return words[best], after[best]
