"""Joint refits: effect parameters against whitened readings, many sets of effects at once (Levenberg-Marquardt, steps
as long as the derivatives were found to reach).

A step costs one prediction a set. Where chi2 comes out otherwise than the derivatives had it, they learn what the step
has shown (Broyden's secant update); they are taken anew where a step by learned ones fails, and where a refit ends. In
the linear range a refit is one projection and one prediction that confirms it. Numbers that a machine has on one side
of null only (a roller pushes back, a cover gives way) stay on that side.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.diagnosis.linear_algebra import bounded_step
from belt_sim.diagnosis.noise.metric import Metric
from belt_sim.diagnosis.readings.forward import Forward

MAX_ROUNDS = 24
TOLERANCE = 0.02  # in chi2; thresholds are about 10
POOR, GOOD = 0.25, 0.75  # share of the foreseen gain: below, steps become shorter; above, they may grow
SHORTER = (0.1, 0.5)  # times as long a step as one that failed
PATIENCE = 2  # failures in a row until derivatives that were learned are taken anew
LEAST = 1e-9  # damping, in units of the information
CLOSE = 1.2  # how near a step comes to its longest
FAINT = 1e-3  # a parameter that moves no reading by this many sigma at its scale is not there


@dataclass
class Fit:
    """A set of effects fitted jointly.

    ids; free: positions in vector that were fitted; vector: the best point; chi2: of the whitened residual;
    columns (k, N): whitened derivatives along free; slopes (k, R, S, n): the same as predicted; residual (N,):
    whitened; values (R, S, n): predictions; due (k,): derivatives that have to be taken where the fit stands; exact:
    all were taken where they hold; radius: longest step, in sigmas; settled: nothing more is gained; failed: proposals
    since the last step; taken: steps.
    """

    ids: tuple[str, ...]
    free: list[int]
    vector: np.ndarray
    chi2: float = np.inf
    columns: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    slopes: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))
    residual: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: np.ndarray = field(default_factory=lambda: np.empty(0))
    due: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool))
    exact: bool = True
    radius: float = np.inf
    settled: bool = False
    failed: int = 0
    taken: int = 0

    @property
    def is_converged(self) -> bool:
        """Whether this is the best point, with derivatives that hold there."""
        return self.settled and self.exact

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (k, k) of the free parameters, in units of their scales."""
        return np.linalg.pinv(self.columns @ self.columns.T, hermitian=True)


Race = Callable[[Sequence[Fit]], None]
Sides = tuple[np.ndarray, np.ndarray]


def fit_sets(
    forward: Forward,
    metric: Metric,
    starts: Sequence[Fit],
    race: Race | None = None,
    sides: Sides | None = None,
) -> list[Fit]:
    """Refine every start; all sets advance together, so that a round costs one batch of predictions.

    race: settles, after every round, what is not worth another; what it settles keeps the derivatives that it has, and
    so does all that ends. sides: lowest and highest value of every number, by default what its effect is declared with.
    """
    sides = forward.sides if sides is None else sides
    fits = [_resume(f) for f in starts]
    for _ in range(MAX_ROUNDS):
        active = [f for f in fits if not f.settled]
        if not active:
            break
        _advance(forward, metric, active, sides)
        if race is not None:
            race(fits)
            continue
        for fit in fits:  # derivatives are due where a fit has ended with learned ones
            if fit.settled and not fit.exact:
                fit.due, fit.settled = np.ones(len(fit.free), dtype=bool), False
    return fits


def _resume(start: Fit) -> Fit:
    """A fit that goes on from where ``start`` stands; all derivatives are due where it has none."""
    none = len(start.slopes) != len(start.free) or (start.settled and not start.exact)
    due = np.full(len(start.free), none) if none or not len(start.due) else start.due.copy()
    return replace(start, vector=np.array(start.vector), due=due, settled=False, failed=0, taken=0)


def _advance(forward, metric, fits: list[Fit], sides: Sides) -> None:
    """The derivatives that are due, one prediction for every fit that has them all."""
    begin = [bool(f.due.any()) or not np.isfinite(f.chi2) for f in fits]
    points = [f.vector if b else _proposal(f, sides) for f, b in zip(fits, begin, strict=True)]
    still, every = np.zeros((1, forward.size)), np.eye(forward.size)
    along = [every[np.array(f.free)[f.due]] if f.due.any() else still for f in fits]
    at = np.concatenate([np.repeat(p[None], len(d), axis=0) for p, d in zip(points, along, strict=True)])
    values, slopes = forward.values_and_slopes(at, np.concatenate(along))
    start = 0
    for fit, b, point, rows in zip(fits, begin, points, along, strict=True):
        here = slice(start, start + len(rows))
        start += len(rows)
        if b:
            _take_derivatives(fit, metric, values[here][0], slopes[here][: int(fit.due.sum())], sides)
        else:
            _accept_or_reject(fit, point, metric, values[here][0], sides)


def _take_derivatives(fit: Fit, metric, values, slopes, sides) -> None:
    """Derivatives that are due at the point where the fit stands; at its start the residual too."""
    begins = not np.isfinite(fit.chi2)
    if begins:
        residual, chi2 = _misfit(metric, values)
        if not (np.isfinite(values).all() and np.isfinite(chi2)):  # whitening takes nan for a reading that is missing
            fit.settled = True
            return
        fit.residual, fit.values, fit.chi2 = residual, values, chi2
    known = np.isfinite(slopes).all(axis=(1, 2, 3), keepdims=True)  # a hair further on the belt runs away: no direction
    slopes, due, k = np.where(known, slopes, 0.0), fit.due, len(fit.free)
    fit.exact = bool(due.all()) or (fit.exact and not begins)
    if due.all():
        fit.slopes, fit.columns = slopes, metric.whiten(slopes) if k else np.empty((0, len(fit.residual)))
    elif due.any():
        fit.slopes, fit.columns = fit.slopes.copy(), fit.columns.copy()
        fit.slopes[due], fit.columns[due] = slopes, metric.whiten(slopes)
    fit.due = np.zeros(k, dtype=bool)
    fit.settled = not k or (not begins and predicted_gain(fit, sides) < _negligible_gain(fit))


def _accept_or_reject(fit: Fit, proposal, metric, values, sides) -> None:
    """Take a proposal if it lowers chi2; otherwise a shorter step comes next, at last with derivatives that hold."""
    residual, chi2 = _misfit(metric, values)
    step = (proposal - fit.vector)[fit.free]
    foreseen = fit.residual - step @ fit.columns
    foretold, length = fit.chi2 - float(foreseen @ foreseen), float(np.linalg.norm(step * _sizes(fit)))
    there = np.isfinite(values).all()  # whitening takes nan for a reading that is missing
    if not there or not chi2 <= fit.chi2:
        along = float(step @ (fit.columns @ fit.residual))
        _shorten_step(fit, foretold, length, along / (chi2 - fit.chi2 + 2.0 * along) if there else 0.0)
        return
    gained = fit.chi2 - chi2
    if abs(foretold - gained) > TOLERANCE:
        _broyden_update(fit, step, foreseen - residual, values - fit.values)
        if gained < POOR * foretold:
            fit.radius = 0.5 * length
    if gained > GOOD * foretold:
        fit.radius = max(fit.radius, 2.0 * length)
    fit.vector, fit.chi2, fit.residual, fit.values = proposal, chi2, residual, values
    fit.failed, fit.taken = 0, fit.taken + 1
    if gained > TOLERANCE:
        fit.due = _sizes(fit) < FAINT  # what moved nothing may do so now
    if not fit.due.any():
        negligible = _negligible_gain(fit)
        fit.settled = predicted_gain(fit, sides) < (TOLERANCE if gained > negligible else negligible)


def _misfit(metric, values: np.ndarray) -> tuple[np.ndarray, float]:
    """Whitened residual (N,) of predictions (R, S, n), and its chi2."""
    with np.errstate(over="ignore", invalid="ignore"):  # a start, or a step too far, may lie anywhere
        residual = metric.whiten(metric.samples.y - values)
        return residual, float(residual @ residual)


def _shorten_step(fit: Fit, foretold: float, length: float, bottom: float) -> None:
    """A step of a ``length`` that should have gained something ended higher: the next is as long as it is to the
    ``bottom`` of the parabola through both ends.
    """
    fit.failed += 1
    fit.radius = length * float(np.clip(bottom, *SHORTER))
    if fit.exact:
        fit.settled = foretold < 0.5 * TOLERANCE
    elif fit.failed >= PATIENCE or foretold < _negligible_gain(fit):
        fit.due = np.ones(len(fit.free), dtype=bool)


def _broyden_update(fit: Fit, step: np.ndarray, more: np.ndarray, moved: np.ndarray) -> None:
    """Derivatives change along a ``step`` (k,) so that they have what it did: ``moved`` (R, S, n) in predictions,
    whitened ``more`` (N,) than they had.
    """
    weights = step * np.sum(fit.columns**2, axis=1)
    size = float(weights @ step)
    if size > 0.0:
        share = weights / size
        fit.columns = fit.columns + share[:, None] * more
        fit.slopes = fit.slopes + share[:, None, None, None] * (moved - np.tensordot(step, fit.slopes, axes=1))
    fit.exact = False


def _negligible_gain(fit: Fit) -> float:
    """A gain of chi2 that is not worth a step: far from any good fit, a share of what is amiss."""
    return TOLERANCE + 1e-3 * max(fit.chi2 - len(fit.residual), 0.0)


def predicted_gain(fit: Fit, sides) -> float:
    """chi2 that the next step should take away."""
    step = (_proposal(fit, sides) - fit.vector)[fit.free]
    return fit.chi2 - float(np.sum((fit.residual - step @ fit.columns) ** 2))


def _proposal(fit: Fit, sides) -> np.ndarray:
    """The Gauss-Newton step, damped as far as is needed to keep it within the radius."""
    sizes = _sizes(fit)
    seen = sizes > FAINT
    unit = 1.0 / np.where(seen, sizes, 1.0)  # with columns as they are, a long one hides that short ones are there
    normal, along = (fit.columns @ fit.columns.T) * np.outer(unit, unit), unit * (fit.columns @ fit.residual)
    space = [side / unit for side in step_bounds(fit, sides)]

    def solve_damped(damping: float) -> np.ndarray:
        return np.where(seen, unit * bounded_step(normal + (damping + 1e-12) * np.eye(len(unit)), along, *space), 0.0)

    step, low, high = solve_damped(LEAST), np.log(LEAST), -np.log(LEAST)
    length = np.linalg.norm(step * sizes)
    while length > CLOSE * fit.radius or (length < fit.radius / CLOSE and high < -np.log(LEAST)):
        middle = 0.5 * (low + high)
        step = solve_damped(np.exp(middle))
        length = np.linalg.norm(step * sizes)
        low, high = (middle, high) if length > fit.radius else (low, middle)
        if high - low < 0.05:
            break
    vector = fit.vector.copy()
    vector[fit.free] += step
    return vector


def _sizes(fit: Fit) -> np.ndarray:
    """What each parameter moves the readings by (k,), in sigmas a unit."""
    return np.linalg.norm(fit.columns, axis=1)


def step_bounds(fit: Fit, sides: Sides) -> tuple[np.ndarray, np.ndarray]:
    """How far each free number (k,) may go down and up from where the fit stands, to the ``sides`` a machine has."""
    low, high = (side[fit.free] - fit.vector[fit.free] for side in sides)
    return low, high
