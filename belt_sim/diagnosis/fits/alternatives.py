"""An effect whose numbers act differently from place to place of a grid: one candidate with alternatives.

A number that only shapes an effect (where a weld is, how far off a radius) moves nothing where the effect is null, so
that no derivative tells of it. It is tried point by point; the best point counts, in readings and in the bootstrap.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.forward import DIFFERENCE

SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show
STRONG = 0.2  # whitened size above which a parameter's derivative at null can be trusted
SECANTS = (1.0, 3.0)  # the same at the points of a grid

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


def shapes_at(bench: Workbench, fit: Fit, positions: Sequence[int], shows: Mapping[int, Sequence[float]] | None = None):
    """Slopes by position at ``fit``, secants where slopes vanish; of each of those predictions at the (position, size)
    that promises most; and its sizes that are worth trying about other fits too.

    shows: such sizes, about another fit; by default all are tried.
    """
    slopes: dict[int, np.ndarray] = dict.fromkeys(positions, np.zeros_like(fit.values))
    asked = [k for k in positions if not bench.forward.slots[k].only_shapes]
    rows = bench.slopes(fit.vector, asked)
    slopes |= dict(zip(asked, rows, strict=True))
    length = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    faint = [k for k, seen in zip(asked, length, strict=True) if seen < STRONG and not bench.forward.linear[k]]
    of_known = {k: shows[k] for k in faint if shows is not None and k in shows}
    moved = _changes(bench, fit, [(k, size) for k, sizes in of_known.items() for size in sizes])
    moved |= _changes_by_size(bench, fit, [k for k in faint if k not in of_known])
    first: dict[int, float] = {}
    best: dict[int, tuple[float, float]] = {}
    for k, size in sorted(moved):
        white = bench.metric.whiten(moved[k, size])
        if not _is_visible(moved[k, size][None], white[None])[0]:
            continue
        first.setdefault(k, size)
        fall = fit.chi2 - float(np.sum((fit.residual - white) ** 2))  # of chi2, were the parameter of that size
        best[k] = max(best.get(k, (-np.inf, 0.0)), (fall, -size))
    secants = {k: moved[k, size] for k, size in first.items()}
    sized = {(k, -size): fit.values + moved[k, -size] for k, (_, size) in best.items()}
    found = dict(shows or {}) | {k: tuple(sorted({first[k], -best[k][1]})) for k in first if k not in of_known}
    return slopes | secants, sized, found


def _changes_by_size(bench: Workbench, fit: Fit, faint: Sequence[int]) -> dict[tuple[int, float], np.ndarray]:
    """What sizes of parameters that do not show by their slopes do to the predictions, by (position, size); the smaller
    ones where the largest shows, or is too much for a belt.
    """
    moved = _changes(bench, fit, [(k, SIZES[-1]) for k in faint])
    white = {key: np.linalg.norm(bench.metric.whiten(m)) for key, m in moved.items()}
    more = [k for k, size in moved if white[k, size] > STRONG or not np.isfinite(moved[k, size]).all()]
    return moved | _changes(bench, fit, [(k, size) for k in more for size in SIZES[:-1]])


def _changes(bench: Workbench, fit: Fit, tried: Sequence[tuple[int, float]]) -> dict[tuple[int, float], np.ndarray]:
    """What numbers at (position, size) change of the predictions (R, S, n), one at a time."""
    if not tried:
        return {}
    points = np.repeat(fit.vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        points[row, k] = size
    return dict(zip(tried, bench.forward.values(points) - fit.values, strict=True))


def shapes_on_grids(bench: Workbench, fit: Fit, names: Sequence[str]) -> dict[str, tuple[Alternatives, list[Point]]]:
    """Shapes of effects about ``fit`` at every point of their grids, and these points as pairs of position and value.

    A parameter that feels only one of several numbers on a grid (the swing of one pulley) is computed for that alone;
    two points of each number tell.
    """
    grids = {n: g for n in names if (g := bench.forward.grids(n))}
    others = {n: [k for k in bench.forward.index(n) if k not in g] for n, g in grids.items()}
    axes = {n: {k: [((k, value),) for value in values] for k, values in g.items()} for n, g in grids.items()}
    several = [n for n in grids if len(grids[n]) > 1]
    alone = [(p, point) for n in several for axis in axes[n].values() for point in axis[:2] for p in others[n]]
    shapes = _shapes_of(bench, fit, alone)
    felt = {
        p: [k for k, axis in axes[n].items() if n not in several or _differ([shapes[p, point] for point in axis[:2]])]
        for n in grids
        for p in others[n]
    }
    points: dict[str, list[Point]] = {
        n: list(product(*([point[0] for point in axis] for axis in axes[n].values()))) for n in grids
    }

    def seen_by(p: int, point: Point) -> Point:
        return tuple(pair for pair in point if pair[0] in felt[p]) or point[:1]

    asked = {(p, seen_by(p, point)) for n in grids for point in points[n] for p in others[n]}
    shapes |= _shapes_of(bench, fit, sorted(asked - set(shapes)))
    found = {}
    for n in grids:
        rows = [[(p, seen_by(p, point)) for p in others[n]] for point in points[n]]
        place = {key: k for k, key in enumerate(dict.fromkeys(key for row in rows for key in row))}
        choices = tuple(np.array([place[key] for key in row]) for row in rows)
        found[n] = Alternatives(np.stack([shapes[key] for key in place]), choices), points[n]
    return found


def _shapes_of(bench: Workbench, fit: Fit, asked: Sequence[tuple[int, Point]]) -> dict[tuple[int, Point], np.ndarray]:
    """Shape of each parameter asked for, by position, with other numbers at a point of a grid; all at once."""
    still = {key: np.zeros_like(fit.values) for key in asked if bench.forward.slots[key[0]].only_shapes}
    asked = [key for key in asked if key not in still]
    if not asked:
        return still
    vectors = np.repeat(fit.vector[None], len(asked), axis=0)
    for row, (_, point) in zip(vectors, asked, strict=True):
        for k, value in point:
            row[k] = value
    positions, rows = np.array([p for p, _ in asked]), np.arange(len(asked))

    def per_unit(chosen: np.ndarray, size: float) -> np.ndarray:
        """Change of the predictions per unit of each parameter: while all are null, what shapes them moves nothing."""
        moved = vectors[chosen]
        moved[np.arange(len(chosen)), positions[chosen]] += size
        return (bench.forward.values(moved) - fit.values) / size

    slopes = per_unit(rows, DIFFERENCE)
    faint = rows[np.linalg.norm(bench.metric.whiten(slopes), axis=1) < STRONG]
    for size in reversed(SECANTS):  # the smallest that shows counts; what does not at the largest is not asked for more
        secants = size * per_unit(faint, size) if len(faint) else slopes[:0]
        strong = _is_visible(secants, bench.metric.whiten(secants)) if len(faint) else np.zeros(0, dtype=bool)
        slopes[faint[strong]] = secants[strong]
        faint = faint[strong | ~np.isfinite(secants).all(axis=(1, 2, 3))]
    return still | dict(zip(asked, slopes, strict=True))


def _is_visible(moved: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Which changes (k, R, S, n), whitened (k, N), are seen and keep every belt on its pulleys."""
    return (np.linalg.norm(white, axis=1) > STRONG) & np.isfinite(moved).all(axis=(1, 2, 3))


def _differ(rows: Sequence[np.ndarray]) -> bool:
    """Whether a shape depends on where on the grid it was taken."""
    size = max(float(np.abs(r).max()) for r in rows)
    return any(float(np.abs(r - rows[0]).max()) > 1e-6 * size for r in rows)
