"""Linearisation at a fit, and what is read off it: where runs start on the belt, and what chance gains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fit import Fit, basis, bounded_step, inverse_roots
from belt_sim.diagnosis.forward import DIFFERENCE, FURTHER
from belt_sim.diagnosis.noise import MATERN_ROOT, Levels, metric_of
from belt_sim.diagnosis.plausibility import is_possible
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.line.hooks import overrides

# The linearisation at a fit: what every further candidate would do to the predictions, computed once.
#
# Where the derivative along a size vanishes at null (a belt touches a guide from some gap on), the change that a
# plausible size makes stands in its place, and a search may begin at the size that promises most. A number that only
# shapes an effect (where a weld is, how far off a radius) moves nothing where the effect is null, so that no derivative
# tells of it. It is tried point by point on a grid: such an effect is one candidate with alternatives, and the best
# point counts, in readings and in the bootstrap.


STRONG = 0.2  # whitened size above which a derivative can be trusted, and a change is seen
SECANTS = (1.0, 3.0)  # of a parameter's scale, at which it is tried where its derivative is not seen
GRID_STARTS = 3  # points of a grid from which a refit starts

GridPoint = tuple[tuple[int, float], ...]  # numbers on a grid: pairs of position and value
Key = tuple[int, GridPoint]  # a parameter, by position, while numbers of its effect are at a point


@dataclass(frozen=True)
class ShapeGrid:
    """Shapes of an effect's parameters at all points of its grid.

    free (k,): positions of the parameters that are not on the grid; columns (m, R, S, n): their shapes, each once;
    choices (points, k): which of the columns stand at every point.
    """

    points: Sequence[GridPoint]
    free: Sequence[int]
    columns: np.ndarray
    choices: np.ndarray


@dataclass(frozen=True)
class GridStart:
    """A point of an effect's grid, and the shapes (R, S, n) of the effect's parameters there, by position."""

    point: GridPoint
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
    whitened; is_possible: whether it keeps every belt on its pulleys; shows: whether readings see it.
    """

    position: int
    size: float
    change: np.ndarray
    white: np.ndarray
    is_possible: bool
    shows: bool

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


def linearise_effects(
    bench: Workbench, fit: Fit, ids: Sequence[str], before: Linearisation | None = None
) -> Linearisation:
    """Derivatives of the predictions near ``fit`` along every parameter of the effects ``ids``.

    before: about another fit, whose shapes on grids serve here too, but which of them are best is asked of what is left
    here; by default grids are gone through anew.
    """
    positions = [k for i in ids for k in bench.forward.index(i)]
    if not positions:
        return Linearisation(fit, {})
    # derivatives, none along what only shapes; those that are too small to be trusted are faint
    sized = [k for k in positions if not bench.forward.slots[k].parameter.modifier]
    _, rows = bench.forward.expand(fit.vector, sized)
    length = np.linalg.norm(bench.metric.whiten(rows), axis=1)
    faint = [k for k, seen in zip(sized, length, strict=True) if seen < STRONG and not bench.forward.linear[k]]
    slopes = dict.fromkeys(positions, np.zeros_like(fit.values)) | dict(zip(sized, rows, strict=True))

    # along these the change at a size, of those that are known to be worth trying; by default at all of
    # NONLINEAR_SIZES, the smaller ones where the largest shows, or is too much for a belt
    sizes = {} if before is None else dict(before.sizes)
    starts: dict[str, list[Start]] = {i: [] for i in ids}
    first = _changes(bench, fit, [(k, size) for k in faint for size in sizes.get(k, NONLINEAR_SIZES[-1:])])
    more = [s.position for s in first if s.position not in sizes and (s.shows or not s.is_possible)]
    tried = [*_changes(bench, fit, [(k, size) for k in more for size in NONLINEAR_SIZES[:-1]]), *first]
    for k in faint:
        changes = [s for s in tried if s.position == k and s.shows and s.is_possible]  # the smallest size first
        if changes:
            likeliest = min(changes, key=lambda change: float(np.sum((fit.residual - change.white) ** 2)))
            slopes[k] = changes[0].change
            sizes.setdefault(k, sorted({changes[0].size, likeliest.size}))
            starts[bench.forward.slots[k].effect.id].append(likeliest)
    for start in _shifts(bench, fit, positions):
        starts[bench.forward.slots[start.position].effect.id].append(start)

    known = shapes_on_grids(bench, fit, ids) if before is None else before.grids
    grids = {i: known[i] for i in ids if i in known}
    for i, grid in grids.items():
        for k in best_of_grid(bench, fit, grid, GRID_STARTS):  # what is on the grid has no shape of its own
            none = dict.fromkeys((position for position, _ in grid.points[k]), np.zeros(grid.columns.shape[1:]))
            own = dict(zip(grid.free, grid.columns[grid.choices[k]], strict=True))
            starts[i].append(GridStart(grid.points[k], none | own))
    return Linearisation(fit, slopes, {i: found for i, found in starts.items() if found}, grids, sizes)


# What sizes of a number change, where its derivative at null says nothing.

SHIFTS = (1.0, 2.0, 4.0, 8.0)  # of a parameter's scale: delays of 0.1 to 0.8 s are parts of a pulley's turn
NONLINEAR_SIZES = (0.5, 1.0, 2.0, 3.0)  # of a parameter's scale, at which a nonlinear effect may begin to show


def _shifts(bench: Workbench, fit: Fit, positions: Sequence[int]) -> list[SizeStart]:
    """The best of SHIFTS of each number that shifts readings along the travel, beside a fit with what comes round.

    Its phase turns with them: a step from null goes astray, but the fit's own numbers take a turned phase up.
    """
    slots, (low, high) = bench.forward.slots, bench.forward.sides
    shifting = [k for k in positions if overrides(slots[k].effect, FURTHER) and not slots[k].parameter.modifier]
    if not shifting or not any(c.comes_round for c in bench.forward.classes if c.id in fit.ids):
        return []
    tried = [(k, sign * size) for k in shifting for size in SHIFTS for sign in (1.0, -1.0)]
    own, best = basis(fit.columns), dict[int, tuple[float, SizeStart]]()
    for start in _changes(bench, fit, [(k, size) for k, size in tried if low[k] <= size <= high[k]]):
        rest = fit.residual - start.white
        left, least = float(np.sum((rest - (rest @ own.T) @ own) ** 2)), best.get(start.position, (fit.chi2,))[0]
        if start.shows and start.is_possible and left < least:
            best[start.position] = left, start
    return [start for _, start in best.values()]


def _changes(bench: Workbench, fit: Fit, tried: Sequence[tuple[int, float]]) -> list[SizeStart]:
    """What numbers at (position, size) change, one at a time."""
    points = np.repeat(fit.vector[None], len(tried), axis=0)
    for row, (k, size) in enumerate(tried):
        points[row, k] = size
    found = []
    for (k, size), change in zip(tried, bench.forward.values(points) - fit.values, strict=True):
        white = bench.metric.whiten(change)
        shows, stays = bool(np.linalg.norm(white) > STRONG), bool(np.isfinite(change).all())
        found.append(SizeStart(k, size, change, white, is_possible=stays, shows=shows))
    return found


# Shapes of an effect at the points of a grid.


def shapes_on_grids(bench: Workbench, fit: Fit, names: Sequence[str]) -> dict[str, ShapeGrid]:
    """Shapes about ``fit`` of those effects that have a grid, at every point of it.

    A parameter that feels only one of several numbers on a grid (the swing of one pulley) is computed for that alone.
    """
    axes = {n: own for n in names if (own := bench.forward.grids(n))}
    free = {n: [k for k in bench.forward.index(n) if k not in axes[n]] for n in axes}
    # every parameter at two points of each of several numbers: these tell which of them it feels
    pairs = {n: [((k, v),) for k, own in axes[n].items() for v in own[:2]] if len(axes[n]) > 1 else [] for n in axes}
    shapes = _compute_shapes(bench, fit, [(p, point) for n in axes for point in pairs[n] for p in free[n]])
    points = {n: list(product(*([(k, value) for value in own[k]] for k in own))) for n, own in axes.items()}
    keys: dict[str, list[list[Key]]] = {}
    for n, own in axes.items():
        felt = {p: [*own] if len(own) == 1 else [] for p in free[n]}
        for p, k in product(free[n], own if len(own) > 1 else ()):
            one, other = (shapes[p, ((k, v),)] for v in own[k][:2])
            if float(np.abs(other - one).max()) > 1e-6 * max(np.abs(one).max(), np.abs(other).max()):
                felt[p].append(k)
        at = [[(p, tuple(pair for pair in x if pair[0] in felt[p]) or x[:1]) for p in free[n]] for x in points[n]]
        keys[n] = at
    asked = {key for of_effect in keys.values() for row in of_effect for key in row}
    shapes |= _compute_shapes(bench, fit, sorted(asked - set(shapes)))
    found = {}
    for n in axes:
        place = {key: k for k, key in enumerate(dict.fromkeys(key for row in keys[n] for key in row))}
        choices = np.array([[place[key] for key in row] for row in keys[n]])
        found[n] = ShapeGrid(points[n], free[n], np.stack([shapes[key] for key in place]), choices)
    return found


def _compute_shapes(bench: Workbench, fit: Fit, keys: Sequence[Key]) -> dict[Key, np.ndarray]:
    """Shape (R, S, n) of each parameter: its derivative, or else the change at the smallest of SECANTS that shows."""
    still = {key: np.zeros_like(fit.values) for key in keys if bench.forward.slots[key[0]].parameter.modifier}
    moving = [key for key in keys if key not in still]
    vectors = np.repeat(fit.vector[None], len(moving), axis=0)
    for row, (_, point) in zip(vectors, moving, strict=True):
        for k, value in point:
            row[k] = value
    positions, rows = np.array([p for p, _ in moving], dtype=int), np.arange(len(moving))

    # change of the predictions per unit of each parameter: while all are null, what shapes them moves nothing
    shapes, faint = np.empty((0, *fit.values.shape)), rows
    for size in (DIFFERENCE, *reversed(SECANTS)):  # what does not show at the largest is not asked for more
        moved = vectors[faint]
        moved[np.arange(len(faint)), positions[faint]] += size
        per_unit = (bench.forward.values(moved) - fit.values) / size
        if size == DIFFERENCE:
            shapes = per_unit
            faint = rows[np.linalg.norm(bench.metric.whiten(shapes), axis=1) < STRONG]
            continue
        secants = size * per_unit
        finite = np.isfinite(secants).all(axis=(1, 2, 3))
        shows = np.linalg.norm(bench.metric.whiten(secants), axis=1) > STRONG
        shapes[faint[shows & finite]] = secants[shows & finite]
        faint = faint[shows | ~finite]
    return still | dict(zip(moving, shapes, strict=True))


# From which points of a grid a search begins: the best of those that say different things.
#
# Where a guide stands beyond the end of a short span, or where a force acts on a stiff one, several points of a grid do
# the same to the readings. A search from each of them ends at the same place, and those that say something else never
# get their turn. One of them is enough: if they do not all ask for the same numbers, one by which a machine could have
# them.

SAME_PREDICTION = 0.5  # chi2 between two predictions, below which they say the same


def best_of_grid(bench: Workbench, fit: Fit, grid: ShapeGrid, most: int) -> list[int]:
    """At most so many points of a grid by what they promise in the linear range, best first, no two alike.

    A number that a machine has on one side of null only promises nothing on the other.
    """
    # gram matrix (m, m) of whitened columns (m, N) and their products (m,) with the residual of a fit, of both
    # what the fit's own numbers do not take up
    columns = bench.metric.whiten(grid.columns)
    own = fit.columns.reshape(len(fit.free), columns.shape[1])
    half = inverse_roots((own @ own.T)[None])[0]
    onto = columns @ own.T @ (half @ half.T)
    gram, pull = columns @ columns.T - onto @ (own @ columns.T), columns @ fit.residual - onto @ (own @ fit.residual)
    free, slots = list(grid.free), [bench.forward.slots[p] for p in grid.free]
    # Gauss-Newton steps (points, k) of the effect's parameters, and one sigma of each
    grams, pulls = gram[grid.choices[:, :, None], grid.choices[:, None, :]], pull[grid.choices]
    halves = inverse_roots(grams)
    inverses = halves @ halves.swapaxes(-1, -2)
    steps = np.einsum("pkl,pl->pk", inverses, pulls)
    low, high = (side[free] - fit.vector[free] for side in bench.forward.sides)
    for k in np.flatnonzero(np.any((steps < low) | (steps > high), axis=1)):
        steps[k] = bounded_step(grams[k], pulls[k], low, high)
    sigma = np.sqrt(np.maximum(np.diagonal(inverses, axis1=1, axis2=2), 0.0))
    changes = np.zeros((len(steps), len(gram)))  # at every point, as a sum of the grid's columns
    np.add.at(changes, (np.arange(len(steps))[:, None], grid.choices), steps)
    gains = 2.0 * changes @ pull - np.sum((changes @ gram) * changes, axis=1)
    found: list[int] = []
    for k in np.argsort(-gains, kind="stable").tolist():
        apart = changes[found] - changes[k]
        alike = np.flatnonzero(np.einsum("ki,ij,kj->k", apart, gram, apart) < SAME_PREDICTION)
        same = int(alike[0]) if len(alike) else None
        if same is None and len(found) < most:
            found.append(k)
        elif same is not None:  # of two that say the same the one that a machine could have
            possible = (is_possible(slots, fit.vector[free] + steps[j], sigma[j]) for j in (found[same], k))
            if not next(possible) and next(possible):
                found[same] = k
    return found


# Where on the belt every run starts: one free number per run, the same for the belt and both pulleys.
#
# What comes round with the belt or a pulley is the same in every run, but for where it begins. Whatever comes round
# with the belt has its own harmonics at every sensor, and pulleys their own waves; a start turns them all. All runs are
# turned until they have one shape in common. That must gain more than the same place at every start does, by what so
# many free numbers cost (trial factor), or runs are taken to start at one place.


HARMONICS = 12  # of the belt's length, at most
#: [m], one sigma of the first harmonic of what comes round; that of others falls with their number
LARGEST_HARMONIC = 1e-3
ASKEW = 10.0  # one sigma of a wobble, in units of its scale
PLACES_A_WAVE = 16  # of the shortest wave, between places that are tried
TRIED = (96, 400)  # fewest and most places that are tried
EVEN = float(np.sqrt(12.0))  # width of an even distribution over its sigma
MOVED = 1e-4  # [m], over which derivatives along a start are taken
WIDER = 2.0  # a start may be off by so many times what the shape in common tells, which is not yet the effect's own
CHANCE = 2.0  # log odds asked for, over the trial factor: noise turned to fit its own shape gains up to 1.6 of that
MOST_LEFT = 2.0  # chi2 a reading beyond candidates and waves: 1 where they hold, 9 where a lack passed for starts
TURNING_ROUNDS = 6  # of turning the runs and asking for their shape
REFERENCES = 3  # runs whose own shape may begin


@dataclass(frozen=True)
class PeriodicWaves:
    """Waves in all runs: gram (R, P, P) and moments (R, P) of whitened pairs of cosine and sine, in units of one sigma,
    with what is left of the readings; rates (R, P/2): by how many radians a metre of start turns a pair.
    """

    gram: np.ndarray
    moments: np.ndarray
    rates: np.ndarray

    def rotations(self, r: int, starts: np.ndarray) -> np.ndarray:
        """Matrices (k, P, P) that turn common numbers into those of a run that starts at ``starts`` (k,)."""
        angle = starts[:, None] * self.rates[r]
        found = np.zeros((len(starts), *self.gram.shape[1:]))
        even, odd = np.arange(0, self.gram.shape[1], 2), np.arange(1, self.gram.shape[1], 2)
        found[:, even, even] = found[:, odd, odd] = np.cos(angle)
        found[:, even, odd], found[:, odd, even] = np.sin(angle), -np.sin(angle)
        return found

    def fit_common(self, starts: np.ndarray, runs: Sequence[int]) -> tuple[np.ndarray, float]:
        """The likeliest common numbers (P,) of some runs that start at ``starts`` (R,), and what they gain [chi2]."""
        turns = {r: self.rotations(r, starts[r : r + 1])[0] for r in runs}
        gram = np.eye(self.gram.shape[1]) + sum(t.T @ self.gram[r] @ t for r, t in turns.items())
        moments = sum(t.T @ self.moments[r] for r, t in turns.items())
        numbers = np.linalg.solve(gram, moments)
        return numbers, float(moments @ numbers)

    def align(self, places: np.ndarray) -> tuple[np.ndarray, float]:
        """Starts and their sigmas (R, 2) that have most in common, those of one run 0, and what they gain [chi2].

        Where a run starts is the best of evenly spaced ``places``, between its neighbours by a parabola.
        """
        runs, none = range(len(self.gram)), np.zeros(len(self.gram))
        alone = [self.fit_common(none, [r])[1] for r in runs]
        best, most = (none, none), -np.inf
        for first in np.argsort(alone)[::-1][:REFERENCES]:
            numbers, gain = self.fit_common(none, [first])
            for _ in range(TURNING_ROUNDS):
                starts = np.zeros(len(runs))
                for r in (r for r in runs if r != first):
                    own = self.rotations(r, places) @ numbers
                    gains = 2.0 * own @ self.moments[r] - np.einsum("ki,ij,kj->k", own, self.gram[r], own)
                    k = int(np.argmax(gains))
                    before, here, after = gains[k - 1], gains[k], gains[(k + 1) % len(gains)]
                    bend = min(before - 2.0 * here + after, -1e-9)
                    starts[r] = places[k] + 0.5 * (before - after) / bend * (places[1] - places[0])
                numbers, gain = self.fit_common(starts, runs)
            if not gain > most:
                continue
            # one sigma of every start, the common numbers being as uncertain
            others, gram, cross, squares = [r for r in runs if r != first], np.eye(len(numbers)), [], []
            for r in runs:
                here, beyond = self.rotations(r, starts[r] + np.array([0.0, MOVED]))
                shape = (beyond - here) @ numbers / MOVED
                gram += here.T @ self.gram[r] @ here
                cross.append(here.T @ self.gram[r] @ shape)
                squares.append(shape @ self.gram[r] @ shape)
            between = np.array(cross)[others]
            normal = np.diag(np.array(squares)[others]) - between @ np.linalg.solve(gram, between.T)
            sigma = np.zeros(len(runs))
            sigma[others] = np.sqrt(np.diagonal(np.linalg.pinv(normal, hermitian=True)))
            best, most = (starts, sigma), gain
        return np.stack(best, axis=1), most


def find_starts(bench: Workbench, linearisation: Linearisation) -> Campaign | None:
    """The campaign with where on the belt its runs start; None where that is stated, or one place does as well.

    What comes round is sought in the residual of the linearised fit, beside what all other candidates could do. Noise
    is as stated (repeats that start elsewhere on the belt differ by more), or larger where all that may be there leaves
    more.
    """
    samples, runs = bench.samples, bench.samples.runs
    round_ones = any(c.comes_round for c in bench.forward.classes)
    if not round_ones or len(runs) < 2 or any(run.start is not None for run in runs):
        return None
    metric = metric_of(bench.fitted, Levels(), bench.shapes, bench.shared)
    waves, rates = _waves_of(bench, linearisation)
    rows = np.concatenate([waves, (samples.y - linearisation.fit.values)[None]])
    others = [linearisation.slopes[p] for p, s in enumerate(bench.forward.slots) if not s.effect.comes_round]
    known = np.concatenate([bench.shapes, bench.shared, np.reshape(others, (-1, *samples.y.shape))])
    grams, moments, left, count = [], [], 0.0, 0
    for r in range(len(runs)):
        # whitened, without what the known ones span
        filled = (np.where(np.isfinite(x), x, 0.0) for x in (rows[:, r], known[:, r]))
        white, beside = (
            np.einsum("snm,ksm->ksn", metric.roots[metric.which[r]], x).reshape(len(x), -1) for x in filled
        )
        size, taken = np.linalg.svd(beside, full_matrices=False)[1:]
        taken = taken[size > 1e-6 * size.max(initial=1e-300)]
        white = white - (white @ taken.T) @ taken
        grams.append(white[:-1] @ white[:-1].T)
        moments.append(white[:-1] @ white[-1])
        rest = white[-1] @ white[-1] - moments[-1] @ np.linalg.solve(grams[-1] + np.eye(len(grams[-1])), moments[-1])
        left, count = left + rest, count + int(np.isfinite(samples.y[r]).sum()) - len(taken) - len(grams[-1])
    noise = max(1.0, left / max(count, 1))  # chi2 a reading that neither waves nor other candidates take up
    if noise > MOST_LEFT:
        return None

    turning = PeriodicWaves(np.array(grams) / noise, np.array(moments) / noise, rates)
    length, shortest = float(np.max(samples.cases.rig.belt_length)), 2.0 * np.pi / float(rates.max())
    places = int(np.clip(np.ceil(PLACES_A_WAVE * length / shortest), *TRIED))
    same = turning.fit_common(np.zeros(len(runs)), range(len(runs)))[1]
    starts, gain = turning.align(length * np.arange(places) / places)
    if 0.5 * (gain - same) <= CHANCE * (len(runs) - 1) * np.log(places):
        return None
    u = np.clip(WIDER * starts[:, 1], length / places / EVEN, length / EVEN) * (starts[:, 1] > 0.0)
    found = {run.name: (float(s), float(off)) for run, s, off in zip(runs, starts[:, 0] % length, u, strict=True)}
    stated = {run.name: (run.start, run.start_u) for run in bench.campaign.runs} | found
    turned = [replace(r, start=stated[r.name][0], start_u=stated[r.name][1]) for r in bench.campaign.runs]
    return replace(bench.campaign, runs=tuple(turned))


def _waves_of(bench: Workbench, linearisation: Linearisation) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of cosine and sine (P, R, S, n) of one sigma: the harmonics of the belt's length at each lateral sensor,
    zero where the yaw is applied, and the wobble of either pulley where that is a candidate; and the rates (R, P/2) at
    which a start turns each pair [rad/m]."""
    samples, rig = bench.samples, bench.samples.cases.rig
    lateral = [k for k, s in enumerate(samples.signals) if s.kind == "lateral"]
    length, direction = float(np.max(rig.belt_length)), np.asarray(samples.cases.settings.direction)
    many = np.arange(1, HARMONICS + 1)
    turn = 2.0 * np.pi * direction[:, None] * np.column_stack([samples.travel, samples.yaw_at]) / length
    waves = np.zeros((len(lateral), HARMONICS, 2, *samples.y.shape))
    for part, wave in enumerate((np.cos, np.sin)):
        shape = wave(many[:, None, None] * turn) * (LARGEST_HARMONIC / many)[:, None, None]
        for k, s in enumerate(lateral):
            waves[k, :, part, :, s] = shape[..., :-1] - shape[..., -1:]
    pairs, rates = (
        [waves.reshape(-1, *samples.y.shape)],
        [np.outer(direction, np.tile(many, len(lateral)) * 2.0 * np.pi / length)],
    )
    wobble = {bench.forward.slots[p].name: linearisation.slopes[p] for p in bench.forward.index("wobble")}
    for end, radius in (("", rig.tail_radius), ("_head", rig.head_radius)) if wobble else ():
        pairs.append(ASKEW * np.stack([wobble[f"beta_cos{end}"], wobble[f"beta_sin{end}"]]))
        rates.append(np.full((len(samples.runs), 1), 1.0 / np.max(radius)))
    return np.concatenate(pairs), np.concatenate(rates, axis=1)


# Readings of campaigns in which nothing is missing, and how much more than expected chance gains of them.
#
# Readings are simulated with nuisances, and with noise at levels that the readings leave possible; they are judged at
# those believed in, as the readings themselves are. So how far off belief may be is in the draws.


BATCH = 100  # campaigns drawn at a time: 250 of a long record take 0.8 GB more
SINGLE = np.float32  # of what is drawn: rounded, it is another draw a hair's breadth aside


def chance_inflation(bench: Workbench, linearisation: Linearisation, count: int, seed: int) -> float:
    """Mean chi2 that candidates gain by chance, over their degrees of freedom; at least 1, more where noise levels are
    uncertain.

    linearisation: about the fit with nothing missing; count: of simulated campaigns.
    """
    errors, rng = bench.samples.y - linearisation.fit.values, np.random.default_rng(seed)
    columns = [bench.metric.whiten(linearisation.shapes_of(bench, c.id)) for c in bench.forward.classes]
    halves = [inverse_roots((c @ c.T)[None])[0] for c in columns]
    total = np.zeros(len(columns))
    for start in range(0, count, BATCH):
        white = bench.metric.whiten(draw_noise(bench, errors, min(BATCH, count - start), rng))
        total += [np.sum((white @ c.T @ half) ** 2) for c, half in zip(columns, halves, strict=True)]
    ranks = [np.count_nonzero(np.any(half, axis=0)) for half in halves]
    found = [gain / count / rank for gain, rank in zip(total, ranks, strict=True) if rank]
    return max(1.0, float(np.mean(found))) if found else 1.0


def draw_noise(bench: Workbench, errors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draws (count, R, S, n) in single precision of everything that may differ when nothing is missing, at levels that
    the readings leave possible; errors (R, S, n): what the current model leaves of these.
    """
    samples, signals = bench.samples, bench.samples.signals
    levels, smooth = bench.finder.draw(errors, count, rng)
    white = np.array([s.white for s in signals]) / np.sqrt(samples.per_bin)[:, None]
    found = rng.standard_normal((count, *samples.y.shape), SINGLE)
    found *= (white * levels[:, None, :, 0]).astype(SINGLE)[..., None]
    stated = np.array([max(s.wander_length, 1e-6) for s in signals])
    apart, of = np.unique(np.diff(samples.travel, axis=1), axis=0, return_inverse=True)
    steps, of = (apart.T[:, :, None, None] / (levels[..., 2] * stated).T).astype(SINGLE), of.reshape(-1)
    size = (levels[..., 1] * np.array([s.wander_sd for s in signals])).astype(SINGLE)
    if not smooth.all():
        rough = rough_wander(steps[..., ~smooth], of, size[~smooth].T, rng)
        found[~smooth] += rough.transpose(3, 1, 2, 0)
    if smooth.any():
        # of unit size, by recursion of its value and its slope, which at one place are independent
        x = MATERN_ROOT * steps[..., smooth][:, of].transpose(3, 1, 2, 0)
        fade = np.exp(-x)
        value = np.stack([fade * (1.0 + x), fade * x])  # of both before, the value's share of what comes
        slope = np.stack([-fade * x, fade * (1.0 - x)])
        own = np.sqrt(np.maximum(1.0 - np.sum(value**2, axis=0), 0.0))
        common = -np.sum(value * slope, axis=0) / np.where(own > 0.0, own, np.inf)
        rest = np.sqrt(np.maximum(1.0 - np.sum(slope**2, axis=0) - common**2, 0.0))
        now = rng.standard_normal((2, *x.shape[:-1]), x.dtype)
        sloped = [now[0]]
        for k in range(x.shape[-1]):
            fresh = rng.standard_normal(now.shape, x.dtype)
            after = np.sum(value[..., k] * now, axis=0) + own[..., k] * fresh[0]
            turned = np.sum(slope[..., k] * now, axis=0) + common[..., k] * fresh[0] + rest[..., k] * fresh[1]
            now = np.stack([after, turned])
            sloped.append(after)
        found[smooth] += size[smooth][:, None, :, None] * np.stack(sloped, axis=-1)
    own = bench.shapes.astype(SINGLE).swapaxes(0, 1)  # nuisances of every run, and those that all runs share
    runs = rng.standard_normal((len(own), count, own.shape[1]), SINGLE) @ own.reshape(*own.shape[:2], -1)
    shared = bench.shared.astype(SINGLE).reshape(len(bench.shared), -1)
    nuisances = (rng.standard_normal((count, len(shared)), SINGLE) @ shared).reshape(found.shape)
    return found + (nuisances + runs.swapaxes(0, 1).reshape(found.shape))


def rough_wander(steps: np.ndarray, of: np.ndarray, size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Wander (n, R, S, B) of ``size`` (S, B) and exponential correlation at ``steps`` (n - 1, U, S, B) in units of its
    length; of (R,): which of the U every run has. What is worked on together lies together.
    """
    keep = np.exp(-steps)
    fresh = np.sqrt(1.0 - keep**2)
    if steps.shape[1] > 1:
        keep, fresh = keep[:, of], fresh[:, of]
    n, _, signals, count = steps.shape
    drawn = rng.standard_normal((count, len(of), signals, n + 1), steps.dtype)
    found = np.ascontiguousarray(drawn.transpose(3, 1, 2, 0))
    for k in range(n):
        found[k + 1] *= fresh[k]
        found[k + 1] += keep[k] * found[k]
    found *= size
    return found
