"""Products of columns that are fitted together, on the scale of the noise, and their inverses."""

import numpy as np
from scipy.linalg.lapack import dpocon, dpotrf, dpotrs

FAINT = 1e-2  # a column this small, in sigma, cannot be seen in these readings
DEPENDENT = 1e-12  # of the largest eigenvalue of columns of unit length: those below are sums of the others
ALIKE = 1e-12  # beside 1, what is left of the square of a derivative that others make up
SMALL = 1e-6  # of the largest direction of several rows; what is smaller is not in these readings


def inverse_roots(gram: np.ndarray) -> np.ndarray:
    """Halves (U, k, k) of inverses over the columns that can be seen and told apart, which are their products with
    their transposes: a column of one is a sum of columns of unit length at a right angle to the others, or zero.
    """
    if not gram.shape[-1]:
        return np.zeros(gram.shape)
    size = np.sqrt(np.maximum(np.diagonal(gram, axis1=1, axis2=2), 0.0))
    scale = np.where(size > FAINT, 1.0 / np.maximum(size, FAINT), 0.0)
    values, vectors = np.linalg.eigh(gram * scale[:, :, None] * scale[:, None, :])
    kept = values > DEPENDENT * np.maximum(values[:, -1:], 1e-300)
    roots = np.sqrt(np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0))
    return scale[:, :, None] * vectors * roots[:, None, :]


def covariance_root(columns: np.ndarray) -> np.ndarray:
    """Root W (k, k) of the covariance W W^T of numbers with whitened derivatives ``columns`` (k, N), best-known
    direction first; a direction that no reading shows counts as nearly unbounded (1 / sqrt(ALIKE)), never as known.

    A sum g of numbers has the variance |g W|^2, which keeps its digits where the numbers alone are unbounded.
    """
    if not len(columns):
        return np.zeros((0, 0))
    size = np.maximum(np.linalg.norm(columns, axis=1), 1e-30)
    alike = np.linalg.qr((columns / size[:, None]).T, mode="r")
    _, values, vectors = np.linalg.svd(alike, full_matrices=True)
    seen = np.zeros(len(size))
    seen[: len(values)] = values
    return vectors.T / np.sqrt(seen**2 + ALIKE) / size[:, None]


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
