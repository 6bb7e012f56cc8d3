"""How runs were really set, within what the campaign leaves open: tension, yaw, and the belt's length (Gauss-Newton).

Predictions are taken where the runs most likely stood, and carried back to what is stated along the derivatives there.
Errors then enter linearly to a higher order: on wide belts the second order of the settings alone is seen, and after a
dozen turns that of the length, in the short waves of an edge.
"""

from dataclasses import replace

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.forward import NUISANCES, Forward
from belt_sim.diagnosis.metric import Metric, length_sigma
from belt_sim.diagnosis.samples import Samples

ROUNDS = 2
FURTHEST = 2.5  # sigma: further off, what the model lacks is taken for a setting
SEEN = 0.1  # whitened length, below which the second order does not matter


def settled(
    campaign: Campaign,
    fitted: Samples,
    forward: Forward,
    metric: Metric,
    shapes: np.ndarray,
    shared: np.ndarray,
    vector: np.ndarray,
) -> Forward:
    """``forward`` expanded where its runs were most likely set, at ``vector``; itself where that changes nothing."""
    sigma = np.array([campaign.settings.tension_rel, campaign.settings.yaw_u])
    length = length_sigma(campaign)
    before = forward.values(vector[None])[0]
    expanded, values = forward, before
    for _ in range(ROUNDS):
        longer = _longer(metric, shared, fitted.y - values) if length > 0.0 else 0.0
        off = _most_likely(metric, shapes, fitted.y - values - longer * shared[-1])
        tension, yaw = sigma[:, None] * off
        there = forward.set_to(tension, yaw, length * longer)
        slopes = _slopes(there, vector, np.array([*sigma, length]))
        expanded = there.less(np.einsum("kr,krsn->rsn", off, slopes[:2]) + longer * slopes[2])
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


def _longer(metric: Metric, shared: np.ndarray, errors: np.ndarray) -> float:
    """The belt's length in sigmas after errors (R, S, n) and the prior; shared (m, R, S, n): its shape the last."""
    own = replace(metric, shared=(metric.shared[0][:0], np.zeros(0)))
    columns, residual = own.whiten(shared), own.whiten(errors)
    found = np.linalg.solve(columns @ columns.T + np.eye(len(columns)), columns @ residual)
    return float(np.clip(found[-1], -FURTHEST, FURTHEST))


def _slopes(forward: Forward, vector: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """What one sigma of tension, of yaw and of the belt's length do (3, R, S, n) where the runs are set."""
    wanted = [forward.size - len(NUISANCES) + NUISANCES.index(n) for n in ("tension", "yaw", "belt_length")]
    directions = np.eye(forward.size)[wanted]
    slopes = forward.lanes(np.repeat(vector[None], len(wanted), axis=0), directions)[1]
    slopes[0] /= 1.0 + forward.tension[:, None, None]
    return sigma[:, None, None, None] * slopes
