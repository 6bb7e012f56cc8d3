"""Readings of campaigns in which nothing is missing, and how much more than expected chance gains of them.

Readings are simulated with nuisances, and with noise at levels that the readings leave possible; they are judged at
those believed in, as the readings themselves are. So how far off belief may be is in the draws.
"""

import numpy as np

from belt_sim.diagnosis.fits.linearisation import Linearisation
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import inverse_roots
from belt_sim.diagnosis.noise.metric import SMOOTH

BATCH = 100  # campaigns drawn at a time: 250 of a long record take 0.8 GB more
SINGLE = np.float32  # of what is drawn: rounded, it is another draw a hair's breadth aside


def chance_inflation(bench: Workbench, linearisation: Linearisation, count: int, seed: int) -> float:
    """Mean chi2 that candidates gain by chance, over their degrees of freedom; at least 1, more where noise levels are
    uncertain.

    linearisation: about the fit with nothing missing; count: of simulated campaigns.
    """
    errors, rng = bench.samples.y - linearisation.fit.values, np.random.default_rng(seed)
    columns = [bench.metric.whiten(linearisation.shapes_of(bench, c.id)) for c in bench.forward.classes]
    halves = [inverse_roots((c @ c.T)[None])[0] for c in columns]
    total = np.zeros(len(columns))
    for start in range(0, count, BATCH):
        white = bench.metric.whiten(draw_noise(bench, errors, min(BATCH, count - start), rng))
        total += [np.sum((white @ c.T @ half) ** 2) for c, half in zip(columns, halves, strict=True)]
    ranks = [np.count_nonzero(np.any(half, axis=0)) for half in halves]
    found = [gain / count / rank for gain, rank in zip(total, ranks, strict=True) if rank]
    return max(1.0, float(np.mean(found))) if found else 1.0


def draw_noise(bench: Workbench, errors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draws (count, R, S, n) in single precision of everything that may differ when nothing is missing, at levels that
    the readings leave possible; errors (R, S, n): what the current model leaves of these.
    """
    samples, signals = bench.samples, bench.samples.signals
    levels, smooth = bench.finder.draw(errors, count, rng)
    white = np.array([s.white for s in signals]) / np.sqrt(samples.per_bin)[:, None]
    found = rng.standard_normal((count, *samples.y.shape), SINGLE)
    found *= (white * levels[:, None, :, 0]).astype(SINGLE)[..., None]
    stated = np.array([max(s.wander_length, 1e-6) for s in signals])
    apart, of = np.unique(np.diff(samples.travel, axis=1), axis=0, return_inverse=True)
    steps, of = (apart.T[:, :, None, None] / (levels[..., 2] * stated).T).astype(SINGLE), of.reshape(-1)
    size = (levels[..., 1] * np.array([s.wander_sd for s in signals])).astype(SINGLE)
    if not smooth.all():
        rough = rough_wander(steps[..., ~smooth], of, size[~smooth].T, rng)
        found[~smooth] += rough.transpose(3, 1, 2, 0)
    if smooth.any():
        sloped = smooth_wander(steps[..., smooth][:, of].transpose(3, 1, 2, 0), rng)
        found[smooth] += size[smooth][:, None, :, None] * sloped
    own = bench.shapes.astype(SINGLE).swapaxes(0, 1)  # nuisances of every run, and those that all runs share
    runs = rng.standard_normal((len(own), count, own.shape[1]), SINGLE) @ own.reshape(*own.shape[:2], -1)
    shared = bench.shared.astype(SINGLE).reshape(len(bench.shared), -1)
    nuisances = (rng.standard_normal((count, len(shared)), SINGLE) @ shared).reshape(found.shape)
    return found + (nuisances + runs.swapaxes(0, 1).reshape(found.shape))


def rough_wander(steps: np.ndarray, of: np.ndarray, size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Wander (n, R, S, B) of ``size`` (S, B) and exponential correlation at ``steps`` (n - 1, U, S, B) in units of its
    length; of (R,): which of the U every run has. What is worked on together lies together.
    """
    keep = np.exp(-steps)
    fresh = np.sqrt(1.0 - keep**2)
    if steps.shape[1] > 1:
        keep, fresh = keep[:, of], fresh[:, of]
    n, _, signals, count = steps.shape
    drawn = rng.standard_normal((count, len(of), signals, n + 1), steps.dtype)
    found = np.ascontiguousarray(drawn.transpose(3, 1, 2, 0))
    for k in range(n):
        found[k + 1] *= fresh[k]
        found[k + 1] += keep[k] * found[k]
    found *= size
    return found


def smooth_wander(steps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Smooth wander (..., n) of unit size at ``steps`` (..., n - 1) in units of its length, by recursion of its value
    and its slope, which at one place are independent.
    """
    x = SMOOTH * steps
    fade = np.exp(-x)
    value = np.stack([fade * (1.0 + x), fade * x])  # of both before, the value's share of what comes
    slope = np.stack([-fade * x, fade * (1.0 - x)])
    own = np.sqrt(np.maximum(1.0 - np.sum(value**2, axis=0), 0.0))
    common = -np.sum(value * slope, axis=0) / np.where(own > 0.0, own, np.inf)
    rest = np.sqrt(np.maximum(1.0 - np.sum(slope**2, axis=0) - common**2, 0.0))
    now = rng.standard_normal((2, *steps.shape[:-1]), steps.dtype)
    found = [now[0]]
    for k in range(steps.shape[-1]):
        fresh = rng.standard_normal(now.shape, steps.dtype)
        now = np.stack(
            [
                np.sum(value[..., k] * now, axis=0) + own[..., k] * fresh[0],
                np.sum(slope[..., k] * now, axis=0) + common[..., k] * fresh[0] + rest[..., k] * fresh[1],
            ]
        )
        found.append(now[0])
    return np.stack(found, axis=-1)
