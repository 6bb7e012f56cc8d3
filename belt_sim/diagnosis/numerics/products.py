"""Products of columns that are fitted together, on the scale of the noise, and their inverses."""

import numpy as np

FAINT = 1e-2  # a column this small, in sigma, cannot be seen in these readings
DEPENDENT = 1e-12  # of the largest eigenvalue of columns of unit length: those below are sums of the others
SMALL = 1e-6  # of the largest direction of several rows; what is smaller is not in these readings


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


def basis(rows: np.ndarray) -> np.ndarray:
    """Orthonormal rows that span ``rows`` (k, ...) flattened, by the small Gram matrix."""
    if not len(rows):
        return rows.reshape(0, rows.shape[-1])
    rows = rows.reshape(len(rows), -1)
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[size[:, 0] > SMALL] / size[size[:, 0] > SMALL]
    if not len(rows):
        return rows
    values, vectors = np.linalg.eigh(rows @ rows.T)
    keep = values > SMALL * values[-1]
    return (vectors[:, keep] / np.sqrt(values[keep])).T @ rows


def apart(rows: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Rows (k, N) without what lies along orthonormal ``inside``."""
    inside = inside.astype(rows.dtype)
    return rows - (rows @ inside.T) @ inside if len(inside) else rows
