"""The neighbourhood of a fit: what every further candidate would do to the predictions, computed once."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.diagnosis.fits.alternatives import Alternatives, Point, shapes_at, shapes_on_grids
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.plausibility import is_possible
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import bounded_step, pseudo_inverse

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
