"""The linearisation at a fit: what every further candidate would do to the predictions, computed once.

Where the derivative along a size vanishes at null (a belt touches a guide from some gap on), the change that a
plausible size makes stands in its place, and a search may begin at the size that promises most. What only shapes an
effect is tried on a grid (``grids``), and a search may begin at its best points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.grids import STRONG, Point, ShapeGrid, best_of_grid, shapes_on_grids
from belt_sim.diagnosis.fits.workbench import Workbench

GRID_STARTS = 3  # points of a grid from which a refit starts


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
    """A number, by position, at a size at which it shows, and the predictions (R, S, n) there."""

    position: int
    size: float
    values: np.ndarray

    def begin(self, bench: Workbench, null: Fit) -> Fit:
        """The fit ``null`` with the number at that size, where the derivatives of its effect are due."""
        vector = null.vector.copy()
        vector[self.position] = self.size
        residual = bench.metric.whiten(bench.fitted.y - self.values)
        effect = bench.forward.slots[self.position].effect
        due = np.array([bench.forward.slots[p].effect is effect for p in null.free])
        chi2 = float(residual @ residual)
        return replace(null, vector=vector, values=self.values, residual=residual, chi2=chi2, due=due, exact=False)


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

    def linear_starts(self, bench: Workbench, name: str) -> list[Fit]:
        """Where one step may begin: from null, and from the best points of a grid, whose shapes are known there."""
        null = self.with_effect(bench, name)
        return [null, *(s.begin(bench, null) for s in self.starts.get(name, []) if isinstance(s, GridStart))]


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
        slopes[k] = changes[0].values
        sizes.setdefault(k, sorted({changes[0].size, likeliest.size}))
        start = SizeStart(k, likeliest.size, fit.values + likeliest.values)
        starts[bench.forward.slots[k].effect.id].append(start)
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


@dataclass(frozen=True)
class _Change:
    """What a number of some size changes of the predictions: values (R, S, n), white (N,): the same whitened."""

    size: float
    values: np.ndarray
    white: np.ndarray

    @property
    def is_possible(self) -> bool:
        """Whether it keeps every belt on its pulleys."""
        return bool(np.isfinite(self.values).all())

    @property
    def shows(self) -> bool:
        return bool(np.linalg.norm(self.white) > STRONG)


def _visible_changes(
    bench: Workbench, fit: Fit, faint: Sequence[int], sizes: Mapping[int, Sequence[float]]
) -> dict[int, list[_Change]]:
    """Position -> the changes that are seen and keep every belt on its pulleys, the smallest size first.

    sizes: those that are worth trying; by default all, the smaller ones where the largest shows, or is too much for a
    belt.
    """
    first = _changes(bench, fit, [(k, size) for k in faint for size in sizes.get(k, SIZES[-1:])])
    more = [k for k, change in first if k not in sizes and (change.shows or not change.is_possible)]
    tried = [*_changes(bench, fit, [(k, size) for k in more for size in SIZES[:-1]]), *first]
    found = {k: [change for j, change in tried if j == k and change.shows and change.is_possible] for k in faint}
    return {k: changes for k, changes in found.items() if changes}


def _changes(bench: Workbench, fit: Fit, tried: Sequence[tuple[int, float]]) -> list[tuple[int, _Change]]:
    """What numbers at (position, size) change, one at a time."""
    points = np.repeat(fit.vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        points[row, k] = size
    changes = bench.forward.values(points) - fit.values
    return [(k, _Change(size, x, bench.metric.whiten(x))) for (k, size), x in zip(tried, changes, strict=True)]
