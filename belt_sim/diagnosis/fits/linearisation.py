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
    rows = bench.forward.expand(fit.vector, asked)[1]
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


# From which points of a grid a search begins: the best of those that say different things.
#
# Where a guide stands beyond the end of a short span, or where a force acts on a stiff one, several points of a grid
# do the same to the readings. A search from each of them ends at the same place, and those that say something else
# never get their turn. One of them is enough: if they do not all ask for the same numbers, one by which a machine
# could have them.

ALIKE = 0.5  # chi2 between two predictions, below which they say the same


def best_of_grid(
    bench: Workbench, fit: Fit, name: str, alternatives: Alternatives, tried: Sequence[Point], most: int
) -> list[int]:
    """At most so many points of an effect's grid by what they promise in the linear range, best first, no two alike.

    tried: the points themselves. A number that a machine has on one side of null only promises nothing on the other.
    """
    columns = bench.metric.whiten(alternatives.columns)
    own = fit.columns.reshape(len(fit.free), columns.shape[1])
    onto = columns @ own.T @ pseudo_inverse((own @ own.T)[None])[0][0]
    gram, pull = columns @ columns.T - onto @ (own @ columns.T), columns @ fit.residual - onto @ (own @ fit.residual)
    choices = np.stack(alternatives.choices)
    free = [k for k in bench.forward.index(name) if k not in bench.forward.grids(name)]
    steps, sigma = _steps(bench, fit, free, gram[choices[:, :, None], choices[:, None, :]], pull[choices])
    does = np.zeros((len(choices), len(gram)))
    np.add.at(does, (np.arange(len(choices))[:, None], choices), steps)
    gains = 2.0 * does @ pull - np.sum((does @ gram) * does, axis=1)

    def alike(k: int, j: int) -> bool:
        apart = does[k] - does[j]
        return bool(apart @ gram @ apart < ALIKE)

    def possible(k: int) -> bool:
        slots = [bench.forward.slots[p] for p in free]
        return is_possible(slots, fit.vector[free] + steps[k], sigma[k])

    found: list[int] = []
    for k in np.argsort(-gains, kind="stable").tolist():
        same = next((i for i, j in enumerate(found) if alike(k, j)), None)
        if same is None and len(found) < most:
            found.append(k)
        elif same is not None and not possible(found[same]) and possible(k):
            found[same] = k
    return found


def _steps(
    bench: Workbench, fit: Fit, free: Sequence[int], gram: np.ndarray, pull: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The best numbers (p, k) at every point, on the side of null where a machine has them, and their sigmas."""
    inverted, _ = pseudo_inverse(gram)
    steps = np.einsum("pkl,pl->pk", inverted, pull)
    low, high = (side[list(free)] - fit.vector[list(free)] for side in bench.forward.sides)
    for k in np.flatnonzero(np.any((steps < low) | (steps > high), axis=1)):
        steps[k] = bounded_step(gram[k], pull[k], low, high)
    return steps, np.sqrt(np.maximum(np.diagonal(inverted, axis1=1, axis2=2), 0.0))


STARTS = 3  # points of a grid from which a refit starts


@dataclass(frozen=True)
class Linearisation:
    """slopes: position in the parameter vector -> shape (R, S, n) per unit; where the derivative at null vanishes while
    a plausible size moves the readings, the secant to that size stands in its place, and weak (effect id -> points,
    each pairs of position and value) says from where a search may start. alternatives: effect id -> shapes of its
    parameters at every point of its grid; tried: these points; points: the best of them, which are starts as well, and
    shaped: point -> shapes of the parameters there. sized: position and size -> predictions with that parameter of that
    size; shows: sizes of a parameter that are worth trying where its derivative vanishes.
    """

    fit: Fit
    slopes: dict[int, np.ndarray]
    weak: dict[str, list[Point]]
    alternatives: dict[str, Alternatives] = field(default_factory=dict)
    tried: dict[str, list[Point]] = field(default_factory=dict)
    points: dict[str, list[Point]] = field(default_factory=dict)
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
        return [null, *(self._start_at(bench, null, p) for p in self.points.get(name, []) if p in self.shaped)]

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
    if before is None:
        grids = shapes_on_grids(bench, fit, ids)
    else:
        grids = {i: (before.alternatives[i], before.tried[i]) for i in ids if i in before.alternatives}
    best = {i: best_of_grid(bench, fit, i, *grid, STARTS) for i, grid in grids.items()}
    points = {i: [grids[i][1][k] for k in best[i]] for i in grids}
    shaped = {grids[i][1][k]: _shapes_at_point(bench, i, grids[i][0], k) for i in grids for k in best[i]}
    weak = {i: [(s,) for s in sized if s[0] in bench.forward.index(i)] + points.get(i, []) for i in ids}
    return Linearisation(
        fit, slopes, {i: found for i, found in weak.items() if found},
        alternatives={i: found for i, (found, _) in grids.items()}, tried={i: tried for i, (_, tried) in grids.items()},
        points=points, shaped=shaped, sized=sized, shows=shows,
    )  # fmt: skip


def _shapes_at_point(bench: Workbench, name: str, grid: Alternatives, point: int) -> dict[int, np.ndarray]:
    """Position -> shape of each parameter of an effect at a point of its grid; none of what is on the grid."""
    tried = bench.forward.grids(name)
    others = [k for k in bench.forward.index(name) if k not in tried]
    shapes = dict.fromkeys(tried, np.zeros(grid.columns.shape[1:]))
    return shapes | dict(zip(others, grid.columns[grid.choices[point]], strict=True))
