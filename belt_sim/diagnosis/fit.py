"""Joint refits: effect parameters against whitened readings, many sets of effects at once (Levenberg-Marquardt)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.metric import Metric

MAX_ROUNDS = 12
TOLERANCE = 0.02  # in chi2; thresholds are about 10
FAINT = 1e-3  # a parameter that moves no reading by this many sigma at its scale is not there


@dataclass
class Fit:
    """A set of effects fitted jointly.

    ids; free: positions in vector that were fitted; vector: the best point; chi2: of the whitened residual;
    columns (k, N): whitened derivatives along free; slopes (k, R, S, n): the same as predicted; residual (N,):
    whitened; values (R, S, n): predictions.
    """

    ids: tuple[str, ...]
    free: list[int]
    vector: np.ndarray
    chi2: float = np.inf
    columns: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    slopes: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))
    residual: np.ndarray = field(default_factory=lambda: np.empty(0))
    values: np.ndarray = field(default_factory=lambda: np.empty(0))
    damping: float = 1e-3
    done: bool = False

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (k, k) of the free parameters, in units of their scales."""
        return np.linalg.pinv(self.columns @ self.columns.T, hermitian=True)


def fit_sets(forward: Forward, metric: Metric, starts: Sequence[Fit], y: np.ndarray | None = None) -> list[Fit]:
    """Refine every start; all sets advance together, so that a round costs one batch of predictions."""
    target = metric.samples.y if y is None else y
    fits = [replace(f, vector=np.array(f.vector)) for f in starts]
    fresh = [f for f in fits if not np.isfinite(f.chi2)]
    if fresh:
        _advance(forward, metric, fresh, [f.vector for f in fresh], target)
    for _ in range(MAX_ROUNDS):
        active = [f for f in fits if not f.done]
        if not active:
            break
        _advance(forward, metric, active, [_proposal(f) for f in active], target)
    return fits


def _advance(forward, metric, fits, proposals, target) -> None:
    """Evaluate proposals and keep those that are better."""
    counts = [max(1, len(f.free)) for f in fits]
    points = np.concatenate([np.repeat(p[None], c, axis=0) for p, c in zip(proposals, counts, strict=True)])
    along = np.concatenate([_directions(f, forward.size) for f in fits])
    values, slopes = forward.lanes(points, along)
    start = 0
    for fit, proposal, count in zip(fits, proposals, counts, strict=True):
        rows = slice(start, start + count)
        start += count
        _judge(fit, proposal, metric, values[rows][0], slopes[rows][: len(fit.free)], target)


def _directions(fit: Fit, size: int) -> np.ndarray:
    rows = np.zeros((max(1, len(fit.free)), size))
    for k, position in enumerate(fit.free):
        rows[k, position] = 1.0
    return rows


def _judge(fit: Fit, proposal, metric, values, slopes, target) -> None:
    """Take a proposal if it lowers chi2; otherwise damp more."""
    residual = metric.whiten(target - values)
    chi2 = float(residual @ residual)
    if not np.isfinite(values).all() or chi2 > fit.chi2:  # whitening takes nan for a reading that is missing
        fit.damping *= 8.0
        fit.done = fit.damping > 1e6 or not np.isfinite(fit.chi2)
        return
    gained = fit.chi2 - chi2
    fit.vector, fit.chi2, fit.residual, fit.values, fit.slopes = proposal, chi2, residual, values, slopes
    fit.columns = metric.whiten(slopes) if len(fit.free) else np.empty((0, len(residual)))
    fit.damping = max(fit.damping / 6.0, 1e-9)
    fit.done = not fit.free or gained < TOLERANCE + 1e-3 * max(chi2 - len(residual), 0.0)


def _proposal(fit: Fit) -> np.ndarray:
    """The damped Gauss-Newton step."""
    normal = fit.columns @ fit.columns.T
    diagonal = np.diag(normal).copy()
    diagonal = np.where(diagonal > FAINT**2, diagonal, np.inf)
    system = normal + np.diag(fit.damping * np.where(np.isfinite(diagonal), diagonal, 1.0) + 1e-12)
    step = np.linalg.lstsq(system, fit.columns @ fit.residual, rcond=1e-10)[0]
    vector = fit.vector.copy()
    vector[fit.free] += np.where(np.isfinite(diagonal), step, 0.0)
    return vector
