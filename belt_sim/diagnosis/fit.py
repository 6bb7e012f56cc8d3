"""Joint refits: effect parameters against whitened readings, many sets of effects at once (Levenberg-Marquardt).

A step costs one prediction a set. Derivatives are taken anew only where chi2 came out otherwise than the old ones had
it; in the linear range a refit is one projection and one prediction that confirms it. Numbers that a machine has on one
side of null only (a roller pushes back, a cover gives way) stay on that side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.metric import Metric

MAX_ROUNDS = 24
TOLERANCE = 0.02  # in chi2; thresholds are about 10
DAMPED = 1e-3  # the least damping, in units of the information, after a step that failed
FAINT = 1e-3  # a parameter that moves no reading by this many sigma at its scale is not there


@dataclass
class Fit:
    """A set of effects fitted jointly.

    ids; free: positions in vector that were fitted; vector: the best point; chi2: of the whitened residual;
    columns (k, N): whitened derivatives along free; slopes (k, R, S, n): the same as predicted; residual (N,):
    whitened; values (R, S, n): predictions; stale: the derivatives no longer hold; settled: nothing more is gained.
    """

    ids: tuple[str, ...]
    free: list[int]
    vector: np.ndarray
    chi2: float = np.inf
    columns: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    slopes: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))
    residual: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: np.ndarray = field(default_factory=lambda: np.empty(0))
    damping: float = 1e-6
    stale: bool = False
    settled: bool = False

    @property
    def done(self) -> bool:
        """Whether this is the best point, with derivatives that hold there."""
        return self.settled and not self.stale

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (k, k) of the free parameters, in units of their scales."""
        return np.linalg.pinv(self.columns @ self.columns.T, hermitian=True)


def fit_sets(forward: Forward, metric: Metric, starts: Sequence[Fit], y: np.ndarray | None = None) -> list[Fit]:
    """Refine every start; all sets advance together, so that a round costs one batch of predictions."""
    target = metric.samples.y if y is None else y
    fits = [replace(f, vector=np.array(f.vector), stale=f.stale or not np.isfinite(f.chi2)) for f in starts]
    for _ in range(MAX_ROUNDS):
        active = [f for f in fits if not f.done]
        if not active:
            break
        _advance(forward, metric, active, target)
    return fits


def _advance(forward, metric, fits: list[Fit], target) -> None:
    """One prediction for every fit whose derivatives hold, new derivatives for the others."""
    points = [f.vector if f.stale else _proposal(f, forward.sides) for f in fits]
    along = [_directions(f, forward.size) for f in fits]
    at = np.concatenate([np.repeat(p[None], len(d), axis=0) for p, d in zip(points, along, strict=True)])
    values, slopes = forward.lanes(at, np.concatenate(along))
    start = 0
    for fit, point, rows in zip(fits, points, along, strict=True):
        here = slice(start, start + len(rows))
        start += len(rows)
        if fit.stale:
            _take(fit, metric, values[here][0], slopes[here][: len(fit.free)], target)
        else:
            _judge(fit, point, metric, values[here][0], target, forward.sides)


def _directions(fit: Fit, size: int) -> np.ndarray:
    """Along every free parameter where derivatives are due, otherwise one row of zeros."""
    if not (fit.stale and fit.free):
        return np.zeros((1, size))
    return np.eye(size)[fit.free]


def _take(fit: Fit, metric, values, slopes, target) -> None:
    """Derivatives at the point where the fit stands; at its start the residual too."""
    fit.stale = False
    if not np.isfinite(fit.chi2):
        if not np.isfinite(values).all():  # whitening takes nan for a reading that is missing
            fit.settled = True
            return
        fit.residual, fit.values = metric.whiten(target - values), values
        fit.chi2 = float(fit.residual @ fit.residual)
    known = np.isfinite(slopes).all(axis=(1, 2, 3), keepdims=True)  # a hair further on the belt runs away: no direction
    fit.slopes = slopes = np.where(known, slopes, 0.0)
    fit.columns = metric.whiten(slopes) if fit.free else np.empty((0, len(fit.residual)))
    fit.settled = fit.settled or not fit.free


def _judge(fit: Fit, proposal, metric, values, target, sides) -> None:
    """Take a proposal if it lowers chi2; otherwise damp more, with derivatives that hold where the fit stands."""
    with np.errstate(over="ignore", invalid="ignore"):  # a step too far may end anywhere
        residual = metric.whiten(target - values)
        chi2 = float(residual @ residual)
    if not np.isfinite(values).all() or not chi2 <= fit.chi2:  # whitening takes nan for a reading that is missing
        fit.damping = max(8.0 * fit.damping, DAMPED)
        fit.settled = fit.damping > 1e6
        return
    foreseen = fit.residual - (proposal - fit.vector)[fit.free] @ fit.columns
    gained, amiss = fit.chi2 - chi2, abs(chi2 - float(foreseen @ foreseen))
    fit.vector, fit.chi2, fit.residual, fit.values = proposal, chi2, residual, values
    fit.damping = max(fit.damping / 6.0, 1e-9)
    dumb = np.any(np.linalg.norm(fit.columns, axis=1) < FAINT)  # what moved nothing may do so now
    fit.stale = amiss > TOLERANCE or bool(dumb and gained > TOLERANCE)
    fit.settled = gained < TOLERANCE + 1e-3 * max(chi2 - len(residual), 0.0)
    if not (fit.stale or fit.settled):
        fit.settled = _to_gain(fit, sides) < TOLERANCE


def _to_gain(fit: Fit, sides) -> float:
    """chi2 that an undamped step would still take away in the linear range."""
    along = fit.columns @ fit.residual
    step = _inside(fit, fit.columns @ fit.columns.T, along, sides)
    return float(2.0 * step @ along - np.sum((step @ fit.columns) ** 2))


def _proposal(fit: Fit, sides) -> np.ndarray:
    """The damped Gauss-Newton step."""
    normal = fit.columns @ fit.columns.T
    diagonal = np.diag(normal).copy()
    diagonal = np.where(diagonal > FAINT**2, diagonal, np.inf)
    system = normal + np.diag(fit.damping * np.where(np.isfinite(diagonal), diagonal, 1.0) + 1e-12)
    step = _inside(fit, system, fit.columns @ fit.residual, sides)
    vector = fit.vector.copy()
    vector[fit.free] += np.where(np.isfinite(diagonal), step, 0.0)
    return vector


def _inside(fit: Fit, system: np.ndarray, along: np.ndarray, sides: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """The step (k,) that solves ``system`` step = ``along``; numbers that it takes beyond ``sides`` end there."""
    low, high = (side[fit.free] - fit.vector[fit.free] for side in sides)
    step, held = np.zeros(len(along)), np.zeros(len(along), dtype=bool)
    for _ in range(len(along)):
        rest = along[~held] - system[np.ix_(~held, held)] @ step[held]
        step[~held] = np.linalg.lstsq(system[np.ix_(~held, ~held)], rest, rcond=1e-10)[0]
        beyond = ~held & ((step < low) | (step > high))
        if not beyond.any():
            break
        step = np.where(beyond, np.clip(step, low, high), step)
        held |= beyond
    return step
