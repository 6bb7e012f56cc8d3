"""How runs were really set, within what the campaign leaves open: tension, yaw, and the belt's length (Gauss-Newton).

Predictions are taken where the runs most likely stood, and carried back to what is stated along the derivatives there.
Errors then enter linearly to a higher order: on wide belts the second order of the settings alone is seen, and after a
dozen turns that of the length, in the short waves of an edge.
"""

from dataclasses import replace

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.noise.metric import Metric, length_sigma
from belt_sim.diagnosis.readings.additive_effects import columns
from belt_sim.diagnosis.readings.forward import NUISANCES, Forward
from belt_sim.diagnosis.readings.samples import Samples

ROUNDS = 2
FURTHEST = 2.5  # sigma: further off, what the model lacks is taken for a setting
SEEN = 0.1  # whitened length, below which the second order does not matter


def expand_at_likely_settings(
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
    length = length_sigma(campaign, float(np.max(forward.samples.cases.rig.belt_length)))
    before = forward.values(vector[None])[0]
    expanded, values = forward, before
    others, by_length = (shared[:-1], shared[-1]) if length > 0.0 else (shared, np.zeros_like(before))
    for _ in range(ROUNDS):
        free = _shapes_that_go_round(expanded, vector)
        longer = _longer(metric, np.concatenate([others, by_length[None]]), free, fitted.y - values)
        off = _most_likely(metric, shapes, fitted.y - values - longer * by_length)
        tension, yaw = sigma[:, None] * off
        there = forward.set_to(tension, yaw, length * longer)
        slopes = _slopes(there, vector, np.array([*sigma, length]))
        by_length = slopes[2]
        expanded = there.minus(np.einsum("kr,krsn->rsn", off, slopes[:2]) + longer * by_length)
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


def _longer(metric: Metric, shared: np.ndarray, free: np.ndarray, errors: np.ndarray) -> float:
    """The belt's length in sigmas after errors (R, S, n) and the prior, whatever sizes the shapes ``free`` (k, R, S, n)
    have; shared (m, R, S, n): its own shape the last.
    """
    own = replace(metric, shared=(metric.shared[0][:0], np.zeros(0)))
    white = np.concatenate([own.whiten(shared), own.whiten(errors)[None]])
    taken = np.linalg.qr(own.whiten(free).T)[0]
    white -= (white @ taken) @ taken.T
    found = np.linalg.solve(white[:-1] @ white[:-1].T + np.eye(len(shared)), white[:-1] @ white[-1])
    return float(np.clip(found[-1], -FURTHEST, FURTHEST))


def _shapes_that_go_round(forward: Forward, vector: np.ndarray) -> np.ndarray:
    """Shapes (k, R, S, n) of the linear effects that are there, whose numbers are fitted to the length as it is."""
    acting = forward.effects_at(vector, [c.id for c in forward.classes])
    there = [c for c in forward.classes if c.is_additive() and np.any(vector[forward.index(c.id)])]
    found = [columns(forward.samples, c, acting)[: len(forward.index(c.id))] for c in there]
    return np.concatenate([np.zeros((0, *forward.samples.y.shape)), *found])


def _slopes(forward: Forward, vector: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """What one sigma of tension, of yaw and of the belt's length do (3, R, S, n) where the runs are set."""
    wanted = [forward.size - len(NUISANCES) + NUISANCES.index(n) for n in ("tension", "yaw", "belt_length")]
    directions = np.eye(forward.size)[wanted]
    slopes = forward.values_and_slopes(np.repeat(vector[None], len(wanted), axis=0), directions)[1]
    slopes[0] /= 1.0 + forward.tension[:, None, None]
    return sigma[:, None, None, None] * slopes
