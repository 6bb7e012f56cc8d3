"""Products of columns that are fitted together, on the scale of the noise, and their inverses."""

import numpy as np

FAINT = 1e-2  # a column this small, in sigma, cannot be seen in these readings
DEPENDENT = 1e-12  # of the largest eigenvalue of columns of unit length: those below are sums of the others


def inverse(gram: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverses (U, k, k) over the columns that can be seen and told apart, and how many those are (U,)."""
    half, rank = halves(gram)
    return half @ half.swapaxes(-1, -2), rank


def halves(gram: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same inverses as products of such halves (U, k, k) and their transposes: a column of one is a sum of columns
    that is of unit length and at a right angle to the others, or zero.
    """
    if not gram.shape[-1]:
        return np.zeros(gram.shape), np.zeros(len(gram), dtype=int)
    size = np.sqrt(np.maximum(np.diagonal(gram, axis1=1, axis2=2), 0.0))
    scale = np.where(size > FAINT, 1.0 / np.maximum(size, FAINT), 0.0)
    values, vectors = np.linalg.eigh(gram * scale[:, :, None] * scale[:, None, :])
    kept = values > DEPENDENT * np.maximum(values[:, -1:], 1e-300)
    roots = np.sqrt(np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0))
    return scale[:, :, None] * vectors * roots[:, None, :], kept.sum(axis=1)
