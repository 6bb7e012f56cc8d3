"""Joint refits: effect parameters against whitened readings, many sets of effects at once (Levenberg-Marquardt, steps
as long as the derivatives were found to reach).

A step costs one prediction a set. Where chi2 comes out otherwise than the derivatives had it, they learn what the step
has shown (Broyden's secant update); they are taken anew where a step by learned ones fails, and where a refit ends. In
the linear range a refit is one projection and one prediction that confirms it. Numbers that a machine has on one side
of null only (a roller pushes back, a cover gives way) stay on that side.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpocon, dpotrf, dpotrs

from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.noise import Metric

# Products of columns that are fitted together, on the scale of the noise, and their inverses.

UNSEEN = 1e-2  # a column this small, in sigma, cannot be seen in these readings
DEPENDENT = 1e-12  # of the largest eigenvalue of columns of unit length: those below are sums of the others
MADE_UP = 1e-12  # beside 1, what is left of the square of a derivative that others make up
SMALL = 1e-6  # of the largest direction of several rows; what is smaller is not in these readings


def inverse_roots(gram: np.ndarray) -> np.ndarray:
    """Halves (U, k, k) of inverses over the columns that can be seen and told apart, which are their products with
    their transposes: a column of one is a sum of columns of unit length at a right angle to the others, or zero.
    """
    if not gram.shape[-1]:
        return np.zeros(gram.shape)
    size = np.sqrt(np.maximum(np.diagonal(gram, axis1=1, axis2=2), 0.0))
    scale = np.where(size > UNSEEN, 1.0 / np.maximum(size, UNSEEN), 0.0)
    values, vectors = np.linalg.eigh(gram * scale[:, :, None] * scale[:, None, :])
    kept = values > DEPENDENT * np.maximum(values[:, -1:], 1e-300)
    roots = np.sqrt(np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0))
    return scale[:, :, None] * vectors * roots[:, None, :]


def covariance_root(columns: np.ndarray) -> np.ndarray:
    """Root W (k, k) of the covariance W W^T of numbers with whitened derivatives ``columns`` (k, N), best-known
    direction first; a direction that no reading shows counts as nearly unbounded (1 / sqrt(MADE_UP)), never as known.

    A sum g of numbers has the variance |g W|^2, which keeps its digits where the numbers alone are unbounded.
    """
    if not len(columns):
        return np.zeros((0, 0))
    size = np.maximum(np.linalg.norm(columns, axis=1), 1e-30)
    alike = np.linalg.qr((columns / size[:, None]).T, mode="r")
    _, values, vectors = np.linalg.svd(alike, full_matrices=True)
    seen = np.zeros(len(size))
    seen[: len(values)] = values
    return vectors.T / np.sqrt(seen**2 + MADE_UP) / size[:, None]


def covariance_of(columns: np.ndarray) -> np.ndarray:
    """Covariance (k, k) of numbers with whitened derivatives ``columns`` (k, N), large along what no reading shows."""
    root = covariance_root(columns)
    return root @ root.T


def basis(rows: np.ndarray) -> np.ndarray:
    """Orthonormal rows that span ``rows`` (k, ...) flattened, by the small Gram matrix."""
    rows = rows.reshape(len(rows), int(np.prod(rows.shape[1:])))
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[size[:, 0] > SMALL] / size[size[:, 0] > SMALL]
    if not len(rows):
        return rows
    values, vectors = np.linalg.eigh(rows @ rows.T)
    keep = values > SMALL * values[-1]
    return (vectors[:, keep] / np.sqrt(values[keep])).T @ rows


# The best step of a fit where numbers have to stay on their sides.

WELL_CONDITIONED = 1e-6  # of the largest direction of a system: with more of all, any way to solve it is as exact
NEGLIGIBLE = 1e-10  # the same, what is as good as none
LEAST_GAIN = 1e-6  # chi2, which letting go of a held number has to be worth


def bounded_step(system: np.ndarray, along: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The step (k,) between ``low`` and ``high`` (k,) that is best by the quadratic of ``system`` and ``along``.

    Numbers that a free step takes beyond their sides are held there, and let go again where the others then pull them
    back: of two that are known only together, the corner where both end may lie far from their valley.
    """
    step, held = np.zeros(len(along)), np.zeros(len(along), dtype=bool)
    while not held.all():
        step[~held] = _solve_free(system, along, step, held)
        beyond = ~held & ((step < low) | (step > high))
        if not beyond.any():
            break
        step = np.where(beyond, np.clip(step, low, high), step)
        held |= beyond
    for _ in range(2 * np.count_nonzero(held)):
        pull = along - system @ step
        back = held & (low < high) & np.where(step <= low, pull > 0.0, pull < 0.0)
        gains = np.where(back, pull**2 / np.maximum(np.diag(system), 1e-30), 0.0)
        if not np.max(gains) > LEAST_GAIN:
            break
        held[np.argmax(gains)] = False
        while not held.all():  # to the best of what is not held, holding what comes to a side on the way
            move = np.zeros(len(step))
            move[~held] = _solve_free(system, along, step, held) - step[~held]
            side = np.where(move > 0.0, high, low)
            share = np.full(len(step), np.inf)
            np.divide(side - step, move, out=share, where=move != 0.0)
            far = min(float(np.min(share)), 1.0)
            step += far * move
            ends = (share <= far) & (far < 1.0)
            if not ends.any():
                break
            step[ends], held[ends] = side[ends], True
    return step


def _solve_free(system: np.ndarray, along: np.ndarray, step: np.ndarray, held: np.ndarray) -> np.ndarray:
    """The shortest solution of a symmetric system for numbers that are not ``held``, the others where they are, without
    the directions that it has next to nothing of."""
    if held.any():
        free, right = system[np.ix_(~held, ~held)], along[~held] - system[np.ix_(~held, held)] @ step[held]
    else:
        free, right = system, along
    root, failed = dpotrf(free)
    if not failed and dpocon(root, np.abs(free).sum(axis=0).max())[0] > WELL_CONDITIONED:
        return dpotrs(root, right)[0]
    return np.linalg.lstsq(free, right, rcond=NEGLIGIBLE)[0]


# A joint fit, and refits under way.

MAX_ROUNDS = 24
TOLERANCE = 0.02  # in chi2; thresholds are about 10
POOR, GOOD = 0.25, 0.75  # share of the predicted gain: below, steps become shorter; above, they may grow
SHORTER_STEP = (0.1, 0.5)  # times as long a step as one that failed
FAILURES_IN_A_ROW = 2  # failures in a row until derivatives that were learned are taken anew
LEAST_DAMPING = 1e-9  # damping, in units of the information
NEAR_LONGEST = 1.2  # how near a step comes to its longest
UNMOVED_READING = 1e-3  # a parameter that moves no reading by this many sigma at its scale is not there


@dataclass(frozen=True)
class Fit:
    """A set of effects fitted jointly, or a point from which a refit of them may begin.

    ids; free: positions in vector that are fitted; vector: the best point; chi2: of the whitened residual, inf where it
    is not known yet; slopes (k, R, S, n): derivatives of the predictions along free; columns (k, N): the same whitened;
    residual (N,): whitened; values (R, S, n): predictions; exact: all derivatives
    were taken where they hold; settled: nothing more is gained; steps: how many led here. For a refit that goes on from
    here, due (k,): derivatives that it has to take first; radius: its longest step, in sigmas.
    """

    ids: tuple[str, ...]
    free: list[int]
    vector: np.ndarray
    chi2: float = np.inf
    columns: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    slopes: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))
    residual: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: np.ndarray = field(default_factory=lambda: np.empty(0))
    exact: bool = True
    settled: bool = False
    steps: int = 0
    due: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool))
    radius: float = np.inf

    @property
    def is_converged(self) -> bool:
        """Whether this is the best point, with derivatives that hold there."""
        return self.settled and self.exact

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (k, k) of the free parameters, in units of their scales; large along what no reading shows."""
        return covariance_of(self.columns)

    @cached_property
    def sensitivity(self) -> np.ndarray:
        """How far a unit of each free parameter (k,) moves the readings, in sigmas."""
        return np.linalg.norm(self.columns, axis=1)

    @cached_property
    def gram(self) -> np.ndarray:
        """Products (k, k) of the whitened columns."""
        return self.columns @ self.columns.T


Sides = tuple[np.ndarray, np.ndarray]


def step_bounds(fit: Fit, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
    """How far each free number (k,) may go down and up from where the fit stands, to the ``sides`` a machine has."""
    low, high = (side[fit.free] - fit.vector[fit.free] for side in sides)
    return low, high


class Refit:
    """A refit under way.

    fit: the best point so far; due (k,): derivatives that have to be taken there; radius: longest step, in sigmas;
    settled: nothing more is gained; steps: proposals that were taken; failures: proposals that failed since the last.
    """

    def __init__(self, start: Fit, metric: Metric, sides: Sides) -> None:
        """All derivatives are due where ``start`` has none, or has ended with learned ones."""
        none = len(start.slopes) != len(start.free) or (start.settled and not start.exact)
        if not none and len(start.columns) != len(start.free):
            start = replace(start, columns=metric.whiten(start.slopes))
        self.fit, self.metric, self.sides, self.radius = start, metric, sides, start.radius
        self.due = start.due if len(start.due) and not none else np.full(len(start.free), none)
        self.settled, self.steps, self.failures = False, 0, 0
        self._proposed: tuple[Fit, dict[float, np.ndarray]] = start, {}

    @property
    def is_ready(self) -> bool:
        """Whether the best point and all derivatives there are known, so that a step can be proposed."""
        return bool(np.isfinite(self.fit.chi2)) and not self.due.any()

    def take_derivatives(self, values: np.ndarray, slopes: np.ndarray) -> None:
        """Derivatives that are due at the point where the fit stands; at its start the residual too."""
        begins, due = not np.isfinite(self.fit.chi2), self.due
        if begins:
            residual, chi2 = self._misfit(values)
            if not (np.isfinite(values).all() and np.isfinite(chi2)):  # whitening takes nan for a missing reading
                self.settled = True
                return
            self.fit = replace(self.fit, residual=residual, values=values, chi2=chi2)
        known = np.isfinite(slopes).all(axis=(1, 2, 3), keepdims=True)  # where the belt runs away: no direction
        slopes = np.where(known, slopes, 0.0)
        columns = self.metric.whiten(slopes)
        if not due.all():
            new_slopes, new_columns = slopes, columns
            slopes, columns = self.fit.slopes.copy(), self.fit.columns.copy()
            slopes[due], columns[due] = new_slopes, new_columns
        exact = bool(due.all()) or (self.fit.exact and not begins)
        self.fit, self.due = replace(self.fit, slopes=slopes, columns=columns, exact=exact), np.zeros_like(due)
        self.settled = not len(due) or (not begins and self.predicted_gain() < self._negligible_gain())

    def accept_or_reject(self, proposal: np.ndarray, values: np.ndarray) -> None:
        """Take a proposal if it lowers chi2; otherwise a shorter step comes next."""
        fit, (residual, chi2) = self.fit, self._misfit(values)
        step = (proposal - fit.vector)[fit.free]
        linear = fit.residual - step @ fit.columns
        predicted, length = fit.chi2 - float(linear @ linear), float(np.linalg.norm(step * fit.sensitivity))
        there = np.isfinite(values).all()  # whitening takes nan for a reading that is missing
        if not there or not chi2 <= fit.chi2:
            # the next step is as long as it is to the bottom of the parabola through both ends, at last with
            # derivatives that hold
            along = float(step @ (fit.columns @ fit.residual))
            bottom = along / (chi2 - fit.chi2 + 2.0 * along) if there else 0.0
            self.failures += 1
            self.radius = length * float(np.clip(bottom, *SHORTER_STEP))
            if fit.exact:
                self.settled = predicted < 0.5 * TOLERANCE
            elif self.failures >= FAILURES_IN_A_ROW or predicted < self._negligible_gain():
                self.due = np.ones_like(self.due)
            return
        gain = fit.chi2 - chi2
        if abs(predicted - gain) > TOLERANCE:
            # Broyden's update: derivatives change along the step so that they have what it did
            columns, slopes = fit.columns, fit.slopes
            weights = step * np.sum(columns**2, axis=1)
            if (size := float(weights @ step)) > 0.0:
                share = weights / size
                columns = columns + share[:, None] * (linear - residual)
                moved = values - fit.values - np.tensordot(step, slopes, axes=1)
                slopes = slopes + share[:, None, None, None] * moved
            self.fit = replace(fit, columns=columns, slopes=slopes, exact=False)
            if gain < POOR * predicted:
                self.radius = 0.5 * length
        if gain > GOOD * predicted:
            self.radius = max(self.radius, 2.0 * length)
        self.fit = replace(self.fit, vector=proposal, chi2=chi2, residual=residual, values=values)
        self.failures, self.steps = 0, self.steps + 1
        if gain > TOLERANCE:
            self.due = self.fit.sensitivity < UNMOVED_READING  # what moved nothing may do so now
        if not self.due.any():
            negligible = self._negligible_gain()
            self.settled = self.predicted_gain() < (TOLERANCE if gain > negligible else negligible)

    def _misfit(self, values: np.ndarray) -> tuple[np.ndarray, float]:
        """Whitened residual (N,) of predictions (R, S, n), and its chi2."""
        with np.errstate(over="ignore", invalid="ignore"):  # a start, or a step too far, may lie anywhere
            residual = self.metric.whiten(self.metric.samples.y - values)
            return residual, float(residual @ residual)

    def _negligible_gain(self) -> float:
        """A gain of chi2 that is not worth a step: far from any good fit, a share of what is amiss."""
        return TOLERANCE + 1e-3 * max(self.fit.chi2 - len(self.fit.residual), 0.0)

    def propose(self, radius: float | None = None) -> np.ndarray:
        """The next point (size,): the end of the Gauss-Newton step, damped as far as is needed to keep it within
        ``radius``, by default the refit's own."""
        fit, radius = self.fit, self.radius if radius is None else radius
        if self._proposed[0] is not fit:
            self._proposed = fit, {}
        known = self._proposed[1]
        if radius in known:
            return known[radius]
        sizes = fit.sensitivity
        seen = sizes > UNMOVED_READING
        unit = 1.0 / np.where(seen, sizes, 1.0)  # with columns as they are, a long one hides that short ones are there
        normal, along = fit.gram * np.outer(unit, unit), unit * (fit.columns @ fit.residual)
        space = [side / unit for side in step_bounds(fit, self.sides)]
        low, high, middle, damping = np.log(LEAST_DAMPING), -np.log(LEAST_DAMPING), 0.0, LEAST_DAMPING
        while True:  # bisection of the logarithm of the damping
            damped = normal + (damping + 1e-12) * np.eye(len(unit))
            step = np.where(seen, unit * bounded_step(damped, along, *space), 0.0)
            length = np.linalg.norm(step * sizes)
            if damping != LEAST_DAMPING:
                low, high = (middle, high) if length > radius else (low, middle)
            too_short = length < radius / NEAR_LONGEST and high < -np.log(LEAST_DAMPING)
            if high - low < 0.05 or not (length > NEAR_LONGEST * radius or too_short):
                break
            middle = 0.5 * (low + high)
            damping = np.exp(middle)
        vector = fit.vector.copy()
        vector[fit.free] += step
        known[radius] = vector
        return vector

    def predicted_gain(self, radius: float | None = None) -> float:
        """chi2 that the next step should take away; ``radius``: as in ``propose``."""
        fit = self.fit
        step = (self.propose(radius) - fit.vector)[fit.free]
        return fit.chi2 - float(np.sum((fit.residual - step @ fit.columns) ** 2))


#: those refits, of all that are under way, that are not worth another round
EarlyStopping = Callable[[Sequence[Refit]], Iterable[Refit]]


def fit_sets(
    forward: Forward,
    metric: Metric,
    starts: Sequence[Fit],
    find_hopeless: EarlyStopping | None = None,
    sides: Sides | None = None,
) -> list[Fit]:
    """Refine every start; all sets advance together, so that a round costs one batch of predictions.

    find_hopeless: those refits, after every round, that are not worth another; with it, all that ends keeps the
    derivatives that it has. sides: lowest and highest value of every number, by default what its effect is declared
    with.
    """
    refits = [Refit(start, metric, forward.sides if sides is None else sides) for start in starts]
    still, every = np.zeros((1, forward.size)), np.eye(forward.size)
    for _ in range(MAX_ROUNDS):
        active = [refit for refit in refits if not refit.settled]
        if not active:
            break
        # the next point of every refit, and the derivatives that are due there, all in one batch; a step is proposed
        # where the best point and all derivatives there are known
        points = [r.propose() if r.is_ready else r.fit.vector for r in active]
        along = [every[np.array(r.fit.free)[r.due]] if r.due.any() else still for r in active]
        counts = [len(rows) for rows in along]
        values, slopes = forward.values_and_slopes(np.repeat(points, counts, axis=0), np.concatenate(along))
        ends = np.cumsum(counts)[:-1]
        for r, point, own, rows in zip(active, points, np.split(values, ends), np.split(slopes, ends), strict=True):
            if r.is_ready:
                r.accept_or_reject(point, own[0])
            else:
                r.take_derivatives(own[0], rows[: int(r.due.sum())])
        for refit in find_hopeless(refits) if find_hopeless else ():
            refit.settled = True
        for refit in active if find_hopeless is None else ():
            if refit.settled and not refit.fit.exact:  # it ended with learned derivatives: all are due there
                refit.due, refit.settled = np.ones_like(refit.due), False
    return [replace(r.fit, settled=r.settled, steps=r.steps, due=r.due, radius=r.radius) for r in refits]
