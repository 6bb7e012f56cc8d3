"""How each run was really set: tension and yaw within what the campaign leaves open (Gauss-Newton).

Predictions are taken where the runs most likely stood, and carried back to the stated settings along the derivatives
there. Setting errors then enter linearly to a higher order: on wide belts the second order alone is seen.
"""

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.forward import NUISANCES, Forward
from belt_sim.diagnosis.metric import Metric
from belt_sim.diagnosis.samples import Samples

ROUNDS = 2
FURTHEST = 2.5  # sigma: further off, what the model lacks is taken for a setting
SEEN = 0.1  # whitened length, below which the second order does not matter


def settled(
    campaign: Campaign, fitted: Samples, forward: Forward, metric: Metric, shapes: np.ndarray, vector: np.ndarray
) -> Forward:
    """``forward`` expanded where its runs were most likely set, at ``vector``; itself where that changes nothing."""
    sigma = np.array([campaign.settings.tension_rel, campaign.settings.yaw_u])
    before = forward.values(vector[None])[0]
    expanded, values = forward, before
    for _ in range(ROUNDS):
        off = _most_likely(metric, shapes, fitted.y - values)
        there = forward.set_to(*(sigma[:, None] * off))
        expanded = there.less(np.einsum("kr,krsn->rsn", off, _slopes(there, vector, sigma)))
        values = expanded.values(vector[None])[0]
    if not np.isfinite(values).all() or np.linalg.norm(metric.noise_white(values - before)) < SEEN:
        return forward
    return expanded


def _most_likely(metric: Metric, shapes: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Tension and yaw (2, R) in sigmas after errors (R, S, n) and the prior; shapes (K, R, S, n): all nuisances."""
    columns, residual = metric.noise_white(shapes).swapaxes(0, 1), metric.noise_white(errors)
    normal = columns @ columns.swapaxes(1, 2) + np.eye(len(shapes))
    found = np.linalg.solve(normal, columns @ residual[..., None])[..., 0]
    return np.clip(found[:, :2].T, -FURTHEST, FURTHEST)


def _slopes(forward: Forward, vector: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """What one sigma of tension and of yaw do (2, R, S, n) where the runs are set."""
    end = forward.size - len(NUISANCES)
    directions = np.eye(forward.size)[end + 1 : end + 3]
    slopes = forward.lanes(np.repeat(vector[None], 2, axis=0), directions)[1]
    slopes[0] /= 1.0 + forward.tension[:, None, None]
    return sigma[:, None, None, None] * slopes
