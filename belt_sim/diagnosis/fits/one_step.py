"""What one more effect promises: one Gauss-Newton step, exact where it enters linearly.

A number that only shapes an effect (where a weld is) says nothing while that is null: a step from null tries its null
value alone, and an effect that is somewhere else promises next to nothing there. So a step is taken from each of the
best points of its grid as well, and the best counts.

Of an effect that bends (a cover that soon is as soft as can be) a step may promise far too little: it goes nowhere near
the size that the effect has, and what it does there is another shape. One prediction at the step's end tells.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.fits.around import Around
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench

BENT = 0.3  # of what a step should do, by which it may do something else


def projected(bench: Workbench, near: Around, name: str) -> Fit:
    """The best of what ``near`` is around with one more effect, one step from null and from points of its grid."""
    return min(map(_stepped, near.linear_starts(bench, name)), key=lambda fit: fit.chi2)


def bent(bench: Workbench, near: Around, stepped: Mapping[str, Fit]) -> list[str]:
    """Those of effects beside what ``near`` is around that do something else at the ends of their steps than the step
    foresaw; none that a machine has on the other side of null only.
    """
    null, (low, high) = bench.forward.null(), bench.forward.sides
    ends = {n: np.clip(f.vector, low, high) for n, f in stepped.items()}
    asked = [n for n in stepped if _curves(bench, n) and (ends[n] != null)[bench.forward.index(n)].any()]
    if not asked:
        return []
    there = bench.forward.values(np.stack([ends[n] for n in asked]))
    foreseen = np.stack([_foreseen(stepped[n], ends[n]) for n in asked])
    does, by_slopes = (bench.metric.whiten(v - near.fit.values) for v in (there, foreseen))
    with np.errstate(over="ignore", invalid="ignore"):  # a step may end anywhere
        off, size = (np.linalg.norm(rows, axis=1) for rows in (does - by_slopes, by_slopes))
    known = np.isfinite(there).all(axis=(1, 2, 3))
    return [n for n, o, s, k in zip(asked, off, size, known, strict=True) if not (k and o <= BENT * s)]


def _curves(bench: Workbench, name: str) -> bool:
    return not all(bench.forward.linear[k] for k in bench.forward.index(name))


def _foreseen(fit: Fit, vector: np.ndarray) -> np.ndarray:
    """What a step's derivatives have at another point."""
    return fit.values + np.einsum("k,krsn->rsn", (vector - fit.vector)[fit.free], fit.slopes)


def _stepped(start: Fit) -> Fit:
    size = np.linalg.norm(start.columns, axis=1)
    scale = np.where(size > 1e-6, 1.0 / np.maximum(size, 1e-6), 0.0)
    step = scale * np.linalg.lstsq((start.columns * scale[:, None]).T, start.residual, rcond=1e-8)[0]
    vector = start.vector.copy()
    vector[start.free] += step
    residual = start.residual - step @ start.columns
    return replace(
        start,
        vector=vector,
        residual=residual,
        chi2=float(residual @ residual),
        values=start.values + np.einsum("k,krsn->rsn", step, start.slopes),
    )
