"""The linearisation at a fit: what every further candidate would do to the predictions, computed once.

Where the derivative along a size vanishes at null (a belt touches a guide from some gap on), the change that a
plausible size makes stands in its place, and a search may begin at the size that promises most. A number that only
shapes an effect (where a weld is, how far off a radius) moves nothing where the effect is null, so that no derivative
tells of it. It is tried point by point on a grid: such an effect is one candidate with alternatives, and the best point
counts, in readings and in the bootstrap.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.plausibility import is_possible
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import bounded_step, pseudo_inverse
from belt_sim.diagnosis.readings.forward import DIFFERENCE

STRONG = 0.2  # whitened size above which a derivative can be trusted, and a change is seen
SECANTS = (1.0, 3.0)  # of a parameter's scale, at which it is tried where its derivative is not seen
GRID_STARTS = 3  # points of a grid from which a refit starts

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


@dataclass(frozen=True)
class GridStart:
    """A point of an effect's grid, and the shapes (R, S, n) of the effect's parameters there, by position."""

    point: Point
    shapes: Mapping[int, np.ndarray]

    def begin(self, bench: Workbench, null: Fit) -> Fit:
        """The fit ``null`` with numbers at the point: while all sizes are null, the predictions are the same."""
        vector = null.vector.copy()
        for position, value in self.point:
            vector[position] = value
        slopes = np.stack([self.shapes.get(p, slope) for p, slope in zip(null.free, null.slopes, strict=True)])
        return replace(null, vector=vector, slopes=slopes, columns=bench.metric.whiten(slopes), exact=False)


@dataclass(frozen=True)
class SizeStart:
    """A number, by position, at a size, and what that changes of the predictions: (R, S, n), white (N,) the same
    whitened.
    """

    position: int
    size: float
    change: np.ndarray
    white: np.ndarray

    @property
    def is_possible(self) -> bool:
        """Whether it keeps every belt on its pulleys."""
        return bool(np.isfinite(self.change).all())

    @property
    def shows(self) -> bool:
        return bool(np.linalg.norm(self.white) > STRONG)

    def begin(self, bench: Workbench, null: Fit) -> Fit:
        """The fit ``null`` with the number at that size, where the derivatives of its effect are due."""
        vector, values = null.vector.copy(), null.values + self.change
        vector[self.position] = self.size
        residual = bench.metric.whiten(bench.fitted.y - values)
        effect = bench.forward.slots[self.position].effect
        due = np.array([bench.forward.slots[p].effect is effect for p in null.free])
        chi2 = float(residual @ residual)
        return replace(null, vector=vector, values=values, residual=residual, chi2=chi2, due=due, exact=False)


Start = GridStart | SizeStart


@dataclass(frozen=True)
class Linearisation:
    """What every effect would do to the predictions of a fit.

    slopes: position in the parameter vector -> shape (R, S, n) per unit; where the derivative at null vanishes while a
    plausible size moves the readings, the change at that size. starts: effect id -> where else than at null a search
    may begin. About other fits serve as well grids: of effects that have one; sizes: position -> sizes that are worth
    trying where the derivative vanishes.
    """

    fit: Fit
    slopes: Mapping[int, np.ndarray]
    starts: Mapping[str, Sequence[Start]] = field(default_factory=dict)
    grids: Mapping[str, ShapeGrid] = field(default_factory=dict)
    sizes: Mapping[int, Sequence[float]] = field(default_factory=dict)

    def shapes_of(self, bench: Workbench, name: str) -> np.ndarray:
        """Shapes (k, R, S, n) of all parameters of one effect where the fit stands."""
        return np.stack([self.slopes[k] for k in bench.forward.index(name)])

    def with_effect(self, bench: Workbench, name: str) -> Fit:
        """The fit with one more effect at null, evaluated already."""
        fit, shapes = self.fit, self.shapes_of(bench, name)
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

    def refit_starts(self, bench: Workbench, name: str, known: Fit | None = None) -> list[Fit]:
        """Where a search for the fit with one more effect may begin: from null, so that no super-model ends above its
        sub-model; from points of its grid, where what only shapes it moves nothing yet; from sizes that show.

        known: a fit with that effect; of the same set it says where to begin.
        """
        null, starts = self.with_effect(bench, name), self.starts.get(name, [])
        if known is not None and starts and set(known.ids) == set(null.ids):
            return [null, _with_numbers(null, known, null.free)]
        own = [] if known is None or not starts else [_with_numbers(null, known, bench.forward.index(name))]
        return [null, *own, *(start.begin(bench, null) for start in starts)]


def _with_numbers(null: Fit, known: Fit, taken: Sequence[int]) -> Fit:
    """The fit ``null``, with its derivatives, and with the numbers at positions ``taken`` as another fit knows them."""
    vector = null.vector.copy()
    vector[list(taken)] = known.vector[list(taken)]
    return replace(null, vector=vector, chi2=np.inf, exact=False)


def linearise(bench: Workbench, fit: Fit, ids: Sequence[str], before: Linearisation | None = None) -> Linearisation:
    """Derivatives of the predictions near ``fit`` along every parameter of the effects ``ids``.

    before: about another fit, whose shapes on grids serve here too, but which of them are best is asked of what is left
    here; by default grids are gone through anew.
    """
    positions = [k for i in ids for k in bench.forward.index(i)]
    if not positions:
        return Linearisation(fit, {})
    slopes, faint = _derivatives(bench, fit, positions)
    sizes = {} if before is None else dict(before.sizes)
    starts: dict[str, list[Start]] = {i: [] for i in ids}
    for k, changes in _visible_changes(bench, fit, faint, sizes).items():
        likeliest = min(changes, key=lambda change: float(np.sum((fit.residual - change.white) ** 2)))
        slopes[k] = changes[0].change
        sizes.setdefault(k, sorted({changes[0].size, likeliest.size}))
        starts[bench.forward.slots[k].effect.id].append(likeliest)
    known = shapes_on_grids(bench, fit, ids) if before is None else before.grids
    grids = {i: known[i] for i in ids if i in known}
    for i, grid in grids.items():
        best = best_of_grid(bench, fit, grid, GRID_STARTS)
        starts[i] += [GridStart(grid.points[k], grid.shapes_at(k)) for k in best]
    return Linearisation(fit, slopes, {i: found for i, found in starts.items() if found}, grids, sizes)


def _derivatives(bench: Workbench, fit: Fit, positions: Sequence[int]) -> tuple[dict[int, np.ndarray], list[int]]:
    """Derivatives (R, S, n) by position, none along what only shapes; and where they are too small to be trusted."""
    sizes = [k for k in positions if not bench.forward.slots[k].only_shapes]
    _, rows = bench.forward.expand(fit.vector, sizes)
    length = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    faint = [k for k, seen in zip(sizes, length, strict=True) if seen < STRONG and not bench.forward.linear[k]]
    return dict.fromkeys(positions, np.zeros_like(fit.values)) | dict(zip(sizes, rows, strict=True)), faint


# What sizes of a number change, where its derivative at null says nothing.

SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show


def _visible_changes(
    bench: Workbench, fit: Fit, faint: Sequence[int], sizes: Mapping[int, Sequence[float]]
) -> dict[int, list[SizeStart]]:
    """Position -> the changes that are seen and keep every belt on its pulleys, the smallest size first.

    sizes: those that are worth trying; by default all, the smaller ones where the largest shows, or is too much for a
    belt.
    """
    first = _changes(bench, fit, [(k, size) for k in faint for size in sizes.get(k, SIZES[-1:])])
    more = [s.position for s in first if s.position not in sizes and (s.shows or not s.is_possible)]
    tried = [*_changes(bench, fit, [(k, size) for k in more for size in SIZES[:-1]]), *first]
    found = {k: [s for s in tried if s.position == k and s.shows and s.is_possible] for k in faint}
    return {k: changes for k, changes in found.items() if changes}


def _changes(bench: Workbench, fit: Fit, tried: Sequence[tuple[int, float]]) -> list[SizeStart]:
    """What numbers at (position, size) change, one at a time."""
    points = np.repeat(fit.vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        points[row, k] = size
    changes = bench.forward.values(points) - fit.values
    return [SizeStart(*pair, x, bench.metric.whiten(x)) for pair, x in zip(tried, changes, strict=True)]


# Shapes of an effect at the points of a grid.


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
