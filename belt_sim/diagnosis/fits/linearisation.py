"""The linearisation at a fit: what every further candidate would do to the predictions, computed once.

A number that only shapes an effect (where a weld is, how far off a radius) moves nothing where the effect is null, so
that no derivative tells of it. It is tried point by point on a grid: such an effect is one candidate with alternatives,
and the best point counts, in readings and in the bootstrap.
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

SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show
STRONG = 0.2  # whitened size above which a parameter's derivative at null can be trusted
SECANTS = (1.0, 3.0)  # the same at the points of a grid

Point = tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class ShapeGrid:
    """Shapes of an effect's parameters at all points of its grid.

    points: pairs of position and value; free (k,): positions of the parameters that are not on the grid; columns
    (m, R, S, n): their shapes, each once; choices (points, k): which of the columns stand at every point.
    """

    points: Sequence[Point]
    free: Sequence[int]
    columns: np.ndarray
    choices: np.ndarray

    def shapes_at(self, point: int) -> dict[int, np.ndarray]:
        """Position -> shape of each parameter at a point; none of what is on the grid."""
        none = dict.fromkeys((position for position, _ in self.points[point]), np.zeros(self.columns.shape[1:]))
        return none | dict(zip(self.free, self.columns[self.choices[point]], strict=True))


def shapes_at(bench: Workbench, fit: Fit, positions: Sequence[int], shows: Mapping[int, Sequence[float]] | None = None):
    """Slopes by position at ``fit``, secants where slopes vanish; of each of those predictions at the (position, size)
    that promises most; and its sizes that are worth trying about other fits too.

    shows: such sizes, about another fit; by default all are tried, the smaller ones where the largest shows, or is too
    much for a belt.
    """
    asked = [k for k in positions if not bench.forward.slots[k].only_shapes]
    _, rows = bench.forward.expand(fit.vector, asked)
    slopes = dict.fromkeys(positions, np.zeros_like(fit.values)) | dict(zip(asked, rows, strict=True))
    length = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    faint = [k for k, seen in zip(asked, length, strict=True) if seen < STRONG and not bench.forward.linear[k]]
    known = {k: sizes for k, sizes in (shows or {}).items() if k in faint}
    moved = _changes(bench, fit, [(k, size) for k in faint for size in known.get(k, SIZES[-1:])])
    more = [k for k, size in moved if k not in known and not _is_nothing(bench, moved[k, size])]
    moved |= _changes(bench, fit, [(k, size) for k in more for size in SIZES[:-1]])
    secants, sized, found = {}, {}, dict(shows or {})
    for k in faint:
        white = {s: bench.metric.whiten(moved[k, s]) for s in SIZES if (k, s) in moved}
        seen = [s for s, w in white.items() if _is_visible(moved[k, s][None], w[None])[0]]
        if seen:
            best = min(seen, key=lambda s: float(np.sum((fit.residual - white[s]) ** 2)))  # were it of that size
            secants[k], sized[k, best] = moved[k, seen[0]], fit.values + moved[k, best]
            found.setdefault(k, tuple(sorted({seen[0], best})))
    return slopes | secants, sized, found


def _is_nothing(bench: Workbench, moved: np.ndarray) -> bool:
    """Whether a change of the predictions (R, S, n) is one, and is not seen."""
    return bool(np.isfinite(moved).all() and np.linalg.norm(bench.metric.whiten(moved)) <= STRONG)


def _changes(bench: Workbench, fit: Fit, tried: Sequence[tuple[int, float]]) -> dict[tuple[int, float], np.ndarray]:
    """What numbers at (position, size) change of the predictions (R, S, n), one at a time."""
    if not tried:
        return {}
    points = np.repeat(fit.vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        points[row, k] = size
    return dict(zip(tried, bench.forward.values(points) - fit.values, strict=True))


def shapes_on_grids(bench: Workbench, fit: Fit, names: Sequence[str]) -> dict[str, ShapeGrid]:
    """Shapes of effects about ``fit`` at every point of their grids.

    A parameter that feels only one of several numbers on a grid (the swing of one pulley) is computed for that alone;
    two points of each number tell.
    """
    grids = {n: g for n in names if (g := bench.forward.grids(n))}
    free = {n: [k for k in bench.forward.index(n) if k not in g] for n, g in grids.items()}
    points: dict[str, list[Point]] = {
        n: list(product(*([(k, value) for value in values] for k, values in g.items()))) for n, g in grids.items()
    }
    ends = {n: {k: [((k, v),) for v in values[:2]] for k, values in g.items()} for n, g in grids.items() if len(g) > 1}
    alone = [(p, point) for n, axes in ends.items() for pair in axes.values() for point in pair for p in free[n]]
    shapes = _shapes_of(bench, fit, alone)
    felt = {
        p: [k for k, pair in axes.items() if _differ([shapes[p, point] for point in pair])]
        for n, axes in ends.items()
        for p in free[n]
    }

    def felt_by(p: int, point: Point) -> Point:
        return tuple(pair for pair in point if p not in felt or pair[0] in felt[p]) or point[:1]

    rows = {n: [[(p, felt_by(p, point)) for p in free[n]] for point in points[n]] for n in grids}
    asked = {key for of_effect in rows.values() for row in of_effect for key in row}
    shapes |= _shapes_of(bench, fit, sorted(asked - set(shapes)))
    found = {}
    for n in grids:
        place = {key: k for k, key in enumerate(dict.fromkeys(key for row in rows[n] for key in row))}
        choices = np.array([[place[key] for key in row] for row in rows[n]])
        found[n] = ShapeGrid(points[n], free[n], np.stack([shapes[key] for key in place]), choices)
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
    columns, choices = bench.metric.whiten(grid.columns), grid.choices
    own = fit.columns.reshape(len(fit.free), columns.shape[1])
    onto = columns @ own.T @ pseudo_inverse((own @ own.T)[None])[0]
    gram, pull = columns @ columns.T - onto @ (own @ columns.T), columns @ fit.residual - onto @ (own @ fit.residual)
    grams, pulls = gram[choices[:, :, None], choices[:, None, :]], pull[choices]
    inverses = pseudo_inverse(grams)
    steps = np.einsum("pkl,pl->pk", inverses, pulls)
    sigma = np.sqrt(np.maximum(np.diagonal(inverses, axis1=1, axis2=2), 0.0))
    free, slots = list(grid.free), [bench.forward.slots[p] for p in grid.free]
    low, high = (side[free] - fit.vector[free] for side in bench.forward.sides)
    for k in np.flatnonzero(np.any((steps < low) | (steps > high), axis=1)):
        steps[k] = bounded_step(grams[k], pulls[k], low, high)
    does = np.zeros((len(choices), len(gram)))
    np.add.at(does, (np.arange(len(choices))[:, None], choices), steps)
    gains = 2.0 * does @ pull - np.sum((does @ gram) * does, axis=1)

    def alike(k: int, j: int) -> bool:
        apart = does[k] - does[j]
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


STARTS = 3  # points of a grid from which a refit starts


@dataclass(frozen=True)
class Linearisation:
    """What every effect would do to the predictions of a fit.

    slopes: position in the parameter vector -> shape (R, S, n) per unit; where the derivative at null vanishes while a
    plausible size moves the readings, the secant to that size stands in its place, and weak (effect id -> points, each
    pairs of position and value) says from where a search may start. grids: of effects that have one; shaped: the best
    points of these, which are starts as well -> shapes of the parameters there, by position; sized: position and size
    -> predictions with that parameter of that size; shows: sizes of a parameter that are worth trying where its
    derivative vanishes.
    """

    fit: Fit
    slopes: dict[int, np.ndarray]
    weak: dict[str, list[Point]]
    grids: dict[str, ShapeGrid] = field(default_factory=dict)
    shaped: dict[Point, dict[int, np.ndarray]] = field(default_factory=dict)
    sized: dict[tuple[int, float], np.ndarray] = field(default_factory=dict)
    shows: dict[int, tuple[float, ...]] = field(default_factory=dict)

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

    def starts(self, bench: Workbench, name: str, known: Fit | None = None) -> list[Fit]:
        """Where a search for the fit with one more effect may begin: from null, so that no super-model ends above its
        sub-model; from points of its grid, where what only shapes it moves nothing yet; from sizes that show.

        known: a fit with that effect; of the same set it says where to begin.
        """
        null, points = self.with_effect(bench, name), self.weak.get(name, [])
        if known is None or not points:
            return [null, *(self._start_at(bench, null, point) for point in points)]
        if set(known.ids) == set(null.ids):
            return [null, _with_numbers(null, known, null.free)]
        own = _with_numbers(null, known, bench.forward.index(name))
        return [null, own, *(self._start_at(bench, null, point) for point in points)]

    def linear_starts(self, bench: Workbench, name: str) -> list[Fit]:
        """Where one step may begin: from null, and from the best points of a grid, whose shapes are known there."""
        null = self.with_effect(bench, name)
        return [null, *(self._start_at(bench, null, p) for p in self.weak.get(name, []) if p in self.shaped)]

    def _start_at(self, bench: Workbench, null: Fit, point: Point) -> Fit:
        """The fit ``null`` with numbers at a point, as far as it is known there: without a prediction of its own."""
        vector, slopes, due = null.vector.copy(), null.slopes.copy(), np.zeros(len(null.free), dtype=bool)
        for position, value in point:
            vector[position] = value
        if point in self.shaped:
            for k, position in enumerate(null.free):
                slopes[k] = self.shaped[point].get(position, slopes[k])
            return replace(null, vector=vector, slopes=slopes, columns=bench.metric.whiten(slopes), exact=False)
        values = self.sized[point[0]]
        residual = bench.metric.whiten(bench.fitted.y - values)
        due[len(self.fit.free) :] = True
        chi2 = float(residual @ residual)
        return replace(null, vector=vector, values=values, residual=residual, chi2=chi2, due=due, exact=False)


def _with_numbers(null: Fit, known: Fit, taken: Sequence[int]) -> Fit:
    """The fit ``null`` with the numbers at positions ``taken``, and their derivatives, as another fit knows them."""
    vector, slopes = null.vector.copy(), null.slopes.copy()
    vector[list(taken)] = known.vector[list(taken)]
    for k, position in enumerate(null.free):
        if position in taken:
            slopes[k] = known.slopes[known.free.index(position)]
    return replace(null, vector=vector, slopes=slopes, chi2=np.inf, exact=False)


def linearise(bench: Workbench, fit: Fit, ids: Sequence[str], before: Linearisation | None = None) -> Linearisation:
    """Derivatives of the predictions near ``fit`` along every parameter of the effects ``ids``.

    before: about another fit, whose shapes on grids serve here too, but which of them are best is asked of what is left
    here; by default grids are gone through anew.
    """
    positions = [k for i in ids for k in bench.forward.index(i)]
    if not positions:
        return Linearisation(fit, {}, {})
    slopes, sized, shows = shapes_at(bench, fit, positions, None if before is None else before.shows)
    grids = (
        shapes_on_grids(bench, fit, ids) if before is None else {i: before.grids[i] for i in ids if i in before.grids}
    )
    best = {i: best_of_grid(bench, fit, grid, STARTS) for i, grid in grids.items()}
    shaped = {i: {grids[i].points[k]: grids[i].shapes_at(k) for k in chosen} for i, chosen in best.items()}
    weak = {i: [(s,) for s in sized if s[0] in bench.forward.index(i)] + list(shaped.get(i, ())) for i in ids}
    starts = {point: shapes for of_effect in shaped.values() for point, shapes in of_effect.items()}
    return Linearisation(fit, slopes, {i: found for i, found in weak.items() if found}, grids, starts, sized, shows)
