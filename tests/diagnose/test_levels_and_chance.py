"""Noise levels that repeats leave possible, and what chance draws from them, against normal laws written down."""

import numpy as np
from linear_bench import REPEATS, WHITE

from belt_sim.diagnosis.linearisation import rough_wander
from belt_sim.diagnosis.noise import WINDOW

DRAWS = 4000
SIGMAS = 4.5
NORMAL = 0.1  # of a width: the law of a logarithm is not quite normal, and the grid ends at 2.6 sigma


def scattered(factor=1.0, runs=REPEATS, count=40):
    """Repeats that differ exactly as much as white noise of ``factor`` times the stated size would on the average, in
    what is fast and in the rest.
    """
    difference = np.random.default_rng(8).standard_normal(count)
    difference -= difference.mean()
    parabolas = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, WINDOW), 3))[0]
    fast = np.zeros(count)
    whole = count // WINDOW * WINDOW
    fast[:whole] = (difference[:whole].reshape(-1, WINDOW) @ (np.eye(WINDOW) - parabolas @ parabolas.T)).ravel()
    freedom = whole // WINDOW * (WINDOW - 3)
    parts = ((fast, freedom), (difference - fast, count - 1 - freedom))
    difference = sum(part * np.sqrt(2.0 * many / np.sum(part**2)) for part, many in parts)
    return factor * WHITE.white * np.stack([difference, 0.0 * difference])[:, None]


def test_wander_of_runs_that_were_read_elsewhere_is_that_of_their_own_travel():
    """The recursion, place by place, of what is drawn record by record."""
    apart, of = np.array([[0.5, 1.0, 0.1], [2.0, 0.0, 0.3]]), np.array([1, 0, 1])
    length, size = np.array([[1.0, 3.0], [2.0, 0.7]]), np.array([[1.0, 0.2], [0.5, 4.0]])  # (B, S)
    steps = apart.T[:, :, None, None] / length.T
    found = rough_wander(steps, of, size.T, np.random.default_rng(5))
    told = np.random.default_rng(5).standard_normal((2, 3, 2, 4))
    for b, r, s in np.ndindex(2, 3, 2):
        keep = np.exp(-apart[of[r]] / length[b, s])
        for k in range(3):
            told[b, r, s, k + 1] = keep[k] * told[b, r, s, k] + np.sqrt(1.0 - keep[k] ** 2) * told[b, r, s, k + 1]
        np.testing.assert_allclose(found[:, r, s, b], size[b, s] * told[b, r, s], rtol=1e-12)
