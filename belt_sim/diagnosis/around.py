"""The neighbourhood of a fit: what every further candidate would do to the predictions, computed once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.workbench import Workbench

SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show
STRONG = 0.2  # whitened size above which a parameter's derivative at null can be trusted


@dataclass(frozen=True)
class Around:
    """slopes: position in the parameter vector -> shape (R, S, n) per unit; where the derivative at null vanishes while
    a plausible size moves the readings, the secant to that size stands in its place, and weak (effect id -> pairs of
    position and value) says from where a search may start.
    """

    fit: Fit
    slopes: dict[int, np.ndarray]
    weak: dict[str, list[tuple[int, float]]]

    def shapes(self, bench: Workbench, name: str) -> np.ndarray:
        """Shapes (k, R, S, n) of one effect."""
        return np.stack([self.slopes[k] for k in bench.forward.index(name)])

    def with_effect(self, bench: Workbench, name: str) -> Fit:
        """The fit with one more effect at null, evaluated already."""
        fit, shapes = self.fit, self.shapes(bench, name)
        white = bench.metric.whiten(shapes)
        return Fit(
            ids=(*fit.ids, name),
            free=[*fit.free, *bench.forward.index(name)],
            vector=fit.vector,
            chi2=fit.chi2,
            columns=np.concatenate([fit.columns.reshape(-1, white.shape[1]), white]),
            slopes=np.concatenate([fit.slopes.reshape(-1, *shapes.shape[1:]), shapes]),
            residual=fit.residual,
            values=fit.values,
        )


def around(bench: Workbench, fit: Fit, ids: Sequence[str]) -> Around:
    """Derivatives of the predictions near ``fit`` along every parameter of the effects ``ids``."""
    positions = [k for i in ids for k in bench.forward.index(i)]
    if not positions:
        return Around(fit, {}, {})
    rows = bench.slopes(fit.vector, positions)
    slopes = dict(zip(positions, rows, strict=True))
    size = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    faint = [k for k, length in zip(positions, size, strict=True) if length < STRONG and not bench.forward.linear[k]]
    if not faint:
        return Around(fit, slopes, {})
    tried = [(k, size) for k in faint for size in SIZES]
    vector = np.repeat(fit.vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        vector[row, k] = size
    moved = bench.forward.values(vector) - fit.values
    strong = np.linalg.norm(bench.metric.whiten(moved), axis=1) > STRONG
    starts = [(pair, m) for pair, m, s in zip(tried, moved, strong, strict=True) if s]
    secants = {k: m for (k, _), m in reversed(starts)}  # the smallest size that shows
    weak = {i: [pair for pair, _ in starts if pair[0] in bench.forward.index(i)] for i in ids}
    return Around(fit, slopes | secants, {i: pairs for i, pairs in weak.items() if pairs})
