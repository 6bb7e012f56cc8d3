"""Shapes of an effect at the points of a grid, and from which of these a search begins.

A number that only shapes an effect (where a weld is, how far off a radius) moves nothing where the effect is null, so
that no derivative tells of it. It is tried point by point on a grid: such an effect is one candidate with alternatives,
and the best point counts, in readings and in the bootstrap.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.plausibility import is_possible
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import bounded_step, pseudo_inverse
from belt_sim.diagnosis.readings.forward import DIFFERENCE

STRONG = 0.2  # whitened size above which a derivative can be trusted, and a change is seen
SECANTS = (1.0, 3.0)  # of a parameter's scale, at which it is tried where its derivative is not seen

Point = tuple[tuple[int, float], ...]  # numbers on a grid: pairs of position and value
Key = tuple[int, Point]  # a parameter, by position, while numbers of its effect are at a point


@dataclass(frozen=True)
class ShapeGrid:
    """Shapes of an effect's parameters at all points of its grid.

    free (k,): positions of the parameters that are not on the grid; columns (m, R, S, n): their shapes, each once;
    choices (points, k): which of the columns stand at every point.
    """

    points: Sequence[Point]
    free: Sequence[int]
    columns: np.ndarray
    choices: np.ndarray

    def shapes_at(self, point: int) -> dict[int, np.ndarray]:
        """Position -> shape of each parameter at a point; none of what is on the grid."""
        none = dict.fromkeys((position for position, _ in self.points[point]), np.zeros(self.columns.shape[1:]))
        return none | dict(zip(self.free, self.columns[self.choices[point]], strict=True))


def shapes_on_grids(bench: Workbench, fit: Fit, names: Sequence[str]) -> dict[str, ShapeGrid]:
    """Shapes about ``fit`` of those effects that have a grid, at every point of it."""
    axes = {n: own for n in names if (own := bench.forward.grids(n))}
    free = {n: [k for k in bench.forward.index(n) if k not in axes[n]] for n in axes}
    shapes = _compute_shapes(bench, fit, [key for n in axes for key in _probes(axes[n], free[n])])
    points = {n: list(product(*([(k, value) for value in own[k]] for k in own))) for n, own in axes.items()}
    keys = {n: _keys_at(points[n], axes[n], free[n], shapes) for n in axes}
    asked = {key for of_effect in keys.values() for row in of_effect for key in row}
    shapes |= _compute_shapes(bench, fit, sorted(asked - set(shapes)))
    found = {}
    for n in axes:
        place = {key: k for k, key in enumerate(dict.fromkeys(key for row in keys[n] for key in row))}
        choices = np.array([[place[key] for key in row] for row in keys[n]])
        found[n] = ShapeGrid(points[n], free[n], np.stack([shapes[key] for key in place]), choices)
    return found


# A parameter that feels only one of several numbers on a grid (the swing of one pulley) is computed for that alone.

Axes = Mapping[int, Sequence[float]]  # position -> values of a number on a grid


def _probes(axes: Axes, free: Sequence[int]) -> list[Key]:
    """Every parameter at two points of each of several numbers: these tell which of them it feels."""
    pairs = [((k, value),) for k, values in axes.items() for value in values[:2]] if len(axes) > 1 else []
    return [(p, point) for point in pairs for p in free]


def _keys_at(
    points: Sequence[Point], axes: Axes, free: Sequence[int], shapes: Mapping[Key, np.ndarray]
) -> list[list[Key]]:
    """For every point, each parameter with the numbers that it feels; shapes: of the ``_probes``."""

    def feels(p: int, k: int) -> bool:
        """Whether the shape of a parameter depends on where on an axis it was taken."""
        rows = [shapes[p, ((k, v),)] for v in axes[k][:2]]
        return any(float(np.abs(r - rows[0]).max()) > 1e-6 * max(np.abs(x).max() for x in rows) for r in rows)

    felt = {p: [k for k in axes if len(axes) == 1 or feels(p, k)] for p in free}
    return [[(p, tuple(pair for pair in point if pair[0] in felt[p]) or point[:1]) for p in free] for point in points]


def _compute_shapes(bench: Workbench, fit: Fit, keys: Sequence[Key]) -> dict[Key, np.ndarray]:
    """Shape (R, S, n) of each parameter: its derivative, or else the change at the smallest of SECANTS that shows."""
    still = {key: np.zeros_like(fit.values) for key in keys if bench.forward.slots[key[0]].only_shapes}
    moving = [key for key in keys if key not in still]
    vectors = np.repeat(fit.vector[None], len(moving), axis=0)
    for row, (_, point) in zip(vectors, moving, strict=True):
        for k, value in point:
            row[k] = value
    positions, rows = np.array([p for p, _ in moving], dtype=int), np.arange(len(moving))

    def per_unit(chosen: np.ndarray, size: float) -> np.ndarray:
        """Change of the predictions per unit of each parameter: while all are null, what shapes them moves nothing."""
        moved = vectors[chosen]
        moved[np.arange(len(chosen)), positions[chosen]] += size
        return (bench.forward.values(moved) - fit.values) / size

    shapes = per_unit(rows, DIFFERENCE)
    faint = rows[np.linalg.norm(bench.metric.whiten(shapes), axis=1) < STRONG]
    for size in reversed(SECANTS):  # what does not show at the largest is not asked for more
        secants = size * per_unit(faint, size)
        finite = np.isfinite(secants).all(axis=(1, 2, 3))
        shows = np.linalg.norm(bench.metric.whiten(secants), axis=1) > STRONG
        shapes[faint[shows & finite]] = secants[shows & finite]
        faint = faint[shows | ~finite]
    return still | dict(zip(moving, shapes, strict=True))


# From which points of a grid a search begins: the best of those that say different things.
#
# Where a guide stands beyond the end of a short span, or where a force acts on a stiff one, several points of a grid
# do the same to the readings. A search from each of them ends at the same place, and those that say something else
# never get their turn. One of them is enough: if they do not all ask for the same numbers, one by which a machine
# could have them.

ALIKE = 0.5  # chi2 between two predictions, below which they say the same


def best_of_grid(bench: Workbench, fit: Fit, grid: ShapeGrid, most: int) -> list[int]:
    """At most so many points of a grid by what they promise in the linear range, best first, no two alike.

    A number that a machine has on one side of null only promises nothing on the other.
    """
    gram, pull = _products(fit, bench.metric.whiten(grid.columns))
    steps, sigma = _steps_on_grid(bench, fit, grid, gram, pull)
    changes = np.zeros((len(steps), len(gram)))  # at every point, as a sum of the grid's columns
    np.add.at(changes, (np.arange(len(steps))[:, None], grid.choices), steps)
    gains = 2.0 * changes @ pull - np.sum((changes @ gram) * changes, axis=1)
    free, slots = list(grid.free), [bench.forward.slots[p] for p in grid.free]

    def alike(k: int, j: int) -> bool:
        apart = changes[k] - changes[j]
        return bool(apart @ gram @ apart < ALIKE)

    def possible(k: int) -> bool:
        return is_possible(slots, fit.vector[free] + steps[k], sigma[k])

    found: list[int] = []
    for k in np.argsort(-gains, kind="stable").tolist():
        same = next((i for i, j in enumerate(found) if alike(k, j)), None)
        if same is None and len(found) < most:
            found.append(k)
        elif same is not None and not possible(found[same]) and possible(k):
            found[same] = k
    return found


def _products(fit: Fit, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gram matrix (m, m) of whitened columns (m, N) and their products (m,) with the residual of a fit, of both what
    the fit's own numbers do not take up."""
    own = fit.columns.reshape(len(fit.free), columns.shape[1])
    onto = columns @ own.T @ pseudo_inverse((own @ own.T)[None])[0]
    return columns @ columns.T - onto @ (own @ columns.T), columns @ fit.residual - onto @ (own @ fit.residual)


def _steps_on_grid(
    bench: Workbench, fit: Fit, grid: ShapeGrid, gram: np.ndarray, pull: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Newton steps (points, k) of an effect's parameters, and one sigma of each; gram, pull: ``_products``."""
    choices, free = grid.choices, list(grid.free)
    grams, pulls = gram[choices[:, :, None], choices[:, None, :]], pull[choices]
    inverses = pseudo_inverse(grams)
    steps = np.einsum("pkl,pl->pk", inverses, pulls)
    low, high = (side[free] - fit.vector[free] for side in bench.forward.sides)
    for k in np.flatnonzero(np.any((steps < low) | (steps > high), axis=1)):
        steps[k] = bounded_step(grams[k], pulls[k], low, high)
    return steps, np.sqrt(np.maximum(np.diagonal(inverses, axis1=1, axis2=2), 0.0))
