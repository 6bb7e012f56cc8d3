"""A scan for waves of any length: from one in a record to two samples and a bit, uniform in wavenumber.

At every wavelength cosine and sine of every signal and run are whitened to two orthonormal directions. What the
residual has along them is summed over runs as a wave that keeps its phase from run to run (odd or even in yaw, at any
tension or of a slack belt), and as one that has its own phase in every run.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.structures import noise_size, parities, rows_of, slackness

MOST = 128  # wavelengths
STEP = 0.75  # of the wavenumber, over that of one wave in the longest record
SHORTEST = 2.2  # samples a wave
CHUNK = 16  # wavelengths whitened at once
EACH_ITS_PHASE = "wave with its own phase in every run"


def wavelengths(bench: Workbench) -> np.ndarray:
    """Wavelengths [m], longest first."""
    travel = bench.samples.travel
    spacing = float(np.median(np.concatenate([np.diff(t)[np.diff(t) > 0] for t in travel])))
    low, high = 1.0 / bench.samples.end, 1.0 / (SHORTEST * spacing)
    if high <= low:
        return np.empty(0)
    return 1.0 / np.arange(low, high, max(STEP * low, (high - low) / MOST))


@dataclass(frozen=True)
class Waves:
    """The scan of a campaign; what waves are at its noise is worked out once for all residuals."""

    bench: Workbench

    def gains(self, residuals: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, int]]:
        """How much of whitened residuals (B, N) lies along waves: family -> gains (B, K), and its degrees of
        freedom; in the precision of the residuals.
        """
        runs, signals = self.bench.samples.y.shape[:2]
        weights = _weights(self.bench)
        together = np.array([w / np.linalg.norm(w) for w in weights.values()], residuals.dtype).reshape(-1, runs)
        blocks = residuals.reshape(len(residuals), runs, -1).swapaxes(0, 1)
        coherent, each = [], []
        for directions in self._directions if residuals.dtype == np.float64 else self._in_single:
            along = np.matmul(blocks, directions.swapaxes(-1, -2)).reshape(runs, len(residuals), -1, 2 * signals)
            kept = (together @ along.reshape(runs, -1)).reshape(len(together), *along.shape[1:])
            coherent.append(np.einsum("wbkd,wbkd->wbk", kept, kept))
            each.append(np.einsum("rbkd,rbkd->bk", along, along))
        dof = dict.fromkeys(weights, 2 * signals) | {EACH_ITS_PHASE: 2 * signals * runs}
        if not each:
            return {}, dof
        by_family = dict(zip(weights, np.concatenate(coherent, axis=2), strict=True))
        return by_family | {EACH_ITS_PHASE: np.concatenate(each, axis=1)}, dof

    @cached_property
    def _directions(self) -> list[np.ndarray]:
        return list(_directions(self.bench))

    @cached_property
    def _in_single(self) -> list[np.ndarray]:
        return [d.astype(np.float32) for d in self._directions]


def wave_shapes(bench: Workbench, name: str, length: float) -> np.ndarray:
    """Shapes (k, R, S, n) of the wave of one family, ``length`` [m] long."""
    samples = bench.samples
    phase = 2 * np.pi * samples.travel / length
    waves = np.stack([np.cos(phase), np.sin(phase)])
    weights = _weights(bench)
    each = [weights[name]] if name in weights else list(np.eye(len(samples.runs)))
    rows = np.concatenate([rows_of(samples.y.shape, waves * w[:, None]) for w in each])
    return rows * noise_size(samples)


def _weights(bench: Workbench) -> dict[str, np.ndarray]:
    samples = bench.samples
    slack = slackness(samples)
    found = {f"wave, {parity}": weight for parity, weight in parities(samples).items()}
    if np.ptp(slack) > 0.0:
        found |= {f"wave of a slack belt, {parity}": w * slack for parity, w in parities(samples).items()}
    return found


def _directions(bench: Workbench) -> Iterator[np.ndarray]:
    """Orthonormal pairs (R, K * S * 2, m) for some wavelengths at a time; m readings of a run, whitened."""
    samples = bench.samples
    runs, signals, _ = samples.y.shape
    lengths = wavelengths(bench)
    for first in range(0, len(lengths), CHUNK):
        part = lengths[first : first + CHUNK]
        phase = 2 * np.pi * samples.travel / part[:, None, None]
        rows = rows_of(samples.y.shape, np.stack([np.cos(phase), np.sin(phase)], axis=1).reshape(-1, *phase.shape[1:]))
        rows = np.where(np.isfinite(bench.fitted.y), rows * noise_size(samples), 0.0)
        white = bench.metric.whiten(rows).reshape(len(part), 2, signals, runs, -1)
        white = white.transpose(3, 0, 2, 1, 4)  # (R, K, S, 2, m)
        gram = white @ white.swapaxes(-1, -2)
        size, vectors = np.linalg.eigh(gram)
        seen = size > 1e-6 * max(float(size.max()), 1e-300)
        root = (
            vectors * np.where(seen, 1.0 / np.sqrt(np.where(seen, size, 1.0)), 0.0)[..., None, :]
        ) @ vectors.swapaxes(-1, -2)
        yield (root @ white).reshape(runs, len(part) * signals * 2, -1)
