"""The neighbourhood of a fit: what every further candidate would do to the predictions, computed once."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.projection import Projection
from belt_sim.diagnosis.workbench import Workbench

SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show
STARTS = 3  # points of a grid from which a refit starts
STRONG = 0.2  # whitened size above which a parameter's derivative at null can be trusted


@dataclass(frozen=True)
class Around:
    """slopes: position in the parameter vector -> shape (R, S, n) per unit; where the derivative at null vanishes while
    a plausible size moves the readings, the secant to that size stands in its place, and weak (effect id -> pairs of
    position and value) says from where a search may start. alternatives: effect id -> shapes of its parameters at every
    point of its grid; the best points are starts as well.
    """

    fit: Fit
    slopes: dict[int, np.ndarray]
    weak: dict[str, list[tuple[int, float]]]
    alternatives: dict[str, tuple[np.ndarray, ...]] = field(default_factory=dict)

    def shapes(self, bench: Workbench, name: str) -> np.ndarray | tuple[np.ndarray, ...]:
        """Shapes (k, R, S, n) of one effect; of an effect with a grid, those at every point of it."""
        return self.alternatives.get(name) or self.here(bench, name)

    def here(self, bench: Workbench, name: str) -> np.ndarray:
        """Shapes (k, R, S, n) of all parameters of one effect where the fit stands."""
        return np.stack([self.slopes[k] for k in bench.forward.index(name)])

    def with_effect(self, bench: Workbench, name: str) -> Fit:
        """The fit with one more effect at null, evaluated already."""
        fit, shapes = self.fit, self.here(bench, name)
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
    slopes, starts = _shapes_at(bench, fit, positions, fit.vector, fit.values)
    weak = {i: [pair for pair in starts if pair[0] in bench.forward.index(i)] for i in ids}
    alternatives = {}
    for i in ids:
        points = list(product(*([(k, v) for v in grid] for k, grid in bench.forward.grids(i).items())))
        if points == [()]:
            continue
        alternatives[i] = tuple(_at_grid(bench, fit, i, point) for point in points)
        weak[i] += [pair for k in _best(bench, fit, alternatives[i]) for pair in points[k]]
    return Around(fit, slopes, {i: pairs for i, pairs in weak.items() if pairs}, alternatives)


def _shapes_at(bench: Workbench, fit: Fit, positions: Sequence[int], vector: np.ndarray, values: np.ndarray):
    """Slopes by position at ``vector``, secants where they vanish, and the sizes at which those begin to show."""
    rows = bench.slopes(vector, positions)
    slopes = dict(zip(positions, rows, strict=True))
    length = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    tried = [(k, size) for k, seen in zip(positions, length, strict=True) if seen < STRONG for size in SIZES]
    if not tried:
        return slopes, []
    points = np.repeat(vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        points[row, k] = size
    moved = bench.forward.values(points) - values
    strong = np.linalg.norm(bench.metric.whiten(moved), axis=1) > STRONG
    starts = [(pair, m) for pair, m, s in zip(tried, moved, strong, strict=True) if s]
    secants = {k: m for (k, _), m in reversed(starts)}  # the smallest size that shows
    return slopes | secants, [pair for pair, _ in starts]


def _at_grid(bench: Workbench, fit: Fit, name: str, point) -> np.ndarray:
    """Shapes (k, R, S, n) of an effect's other parameters at a point of its grid, pairs of position and value."""
    vector = fit.vector.copy()
    for k, value in point:
        vector[k] = value
    others = [k for k in bench.forward.index(name) if k not in dict(point)]
    slopes, _ = _shapes_at(bench, fit, others, vector, fit.values)
    return np.stack([slopes[k] for k in others])


def _best(bench: Workbench, fit: Fit, alternatives: Sequence[np.ndarray]) -> list[int]:
    """Which alternatives promise most in the linear range."""
    families = {-1: fit.slopes.reshape(-1, *fit.values.shape)} | dict(enumerate(alternatives))
    projection = Projection(bench.fitted, bench.shapes, bench.shared, families)
    left = projection.sums((bench.fitted.y - fit.values)[None], [bench.levels]).beside(-1)
    gains = [left.gains(k)[0][0] for k in range(len(alternatives))]
    return [int(k) for k in np.argsort(gains)[::-1][:STARTS]]
