"""An effect whose numbers act differently from place to place of a grid: one candidate with alternatives.

A number that only shapes an effect (where a weld is, how far off a radius) moves nothing where the effect is null, so
that no derivative tells of it. It is tried point by point; the best point counts, in readings and in the bootstrap.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.projection import Projection
from belt_sim.diagnosis.workbench import Workbench

SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show
STRONG = 0.2  # whitened size above which a parameter's derivative at null can be trusted

Point = tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class Alternatives:
    """columns (m, R, S, n): shapes of an effect's parameters at all points of its grid, each once; choices: for every
    point, which of the columns (k,) stand there.
    """

    columns: np.ndarray
    choices: tuple[np.ndarray, ...]

    def __len__(self) -> int:
        return len(self.choices)


def shapes_at(bench: Workbench, vector: np.ndarray, values: np.ndarray, positions: Sequence[int]):
    """Slopes by position at ``vector``, which predicts ``values``; secants where slopes vanish, and the sizes at which
    those begin to show.
    """
    rows = bench.slopes(vector, positions)
    slopes: dict[int, np.ndarray] = dict(zip(positions, rows, strict=True))
    length = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    faint = [k for k, seen in zip(positions, length, strict=True) if seen < STRONG and not bench.forward.linear[k]]
    tried = [(k, size) for k in faint for size in SIZES]
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


def on_grid(bench: Workbench, fit: Fit, name: str) -> tuple[Alternatives, list[Point]]:
    """Shapes of an effect about ``fit`` at every point of its grid, and these points as pairs of position and value.

    A parameter that feels only one of several numbers on a grid (the swing of one pulley) is computed for that alone.
    """
    grids = bench.forward.grids(name)
    others = [k for k in bench.forward.index(name) if k not in grids]
    shapes: dict[Point, dict[int, np.ndarray]] = {}
    axes: dict[int, list[Point]] = {k: [((k, value),) for value in grid] for k, grid in grids.items()}
    for point in (p for axis in axes.values() for p in axis):
        shapes[point] = _at(bench, fit, point, others)
    felt = {p: [k for k, axis in axes.items() if _differ([shapes[point][p] for point in axis])] for p in others}
    points: list[Point] = list(product(*([point[0] for point in axis] for axis in axes.values())))
    rows: list[np.ndarray] = []
    place: dict[tuple[int, Point], int] = {}
    choices = []
    for point in points:
        chosen = []
        for p in others:
            part = tuple(pair for pair in point if pair[0] in felt[p])
            if (p, part) not in place:
                place[p, part] = len(rows)
                at = part or point[:1]
                if at not in shapes:
                    shapes[at] = _at(bench, fit, at, [q for q in others if set(felt[q]) == set(felt[p])])
                rows.append(shapes[at][p])
            chosen.append(place[p, part])
        choices.append(np.array(chosen))
    return Alternatives(np.stack(rows), tuple(choices)), points


def _at(bench: Workbench, fit: Fit, point: Point, positions: Sequence[int]) -> dict[int, np.ndarray]:
    """Shapes of the parameters at ``positions`` with an effect's other numbers at a point of its grid."""
    vector = fit.vector.copy()
    for k, value in point:
        vector[k] = value
    return shapes_at(bench, vector, fit.values, positions)[0]


def _differ(rows: Sequence[np.ndarray]) -> bool:
    """Whether a shape depends on where on the grid it was taken."""
    size = max(float(np.abs(r).max()) for r in rows)
    return any(float(np.abs(r - rows[0]).max()) > 1e-6 * size for r in rows)


def best_of_grid(bench: Workbench, fit: Fit, alternatives: Alternatives) -> list[int]:
    """Points of a grid by what they promise in the linear range, best first."""
    families = {"fit": fit.slopes.reshape(-1, *fit.values.shape), "grid": alternatives.columns}
    projection = Projection(bench.fitted, bench.shapes, bench.shared, families)
    left = projection.sums((bench.fitted.y - fit.values)[None], [bench.levels]).beside("fit")
    gains = [left.gains("grid", choice)[0][0] for choice in alternatives.choices]
    return [int(k) for k in np.argsort(gains)[::-1]]
