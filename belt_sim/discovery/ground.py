"""Ground: inner products of whitened shapes and readings, with the nuisances and the chosen effects taken out.

Runs are whitened one by one, so that shapes of single runs can be weighted and summed at will; what runs share (the
belt's stiffness, and the effects that are chosen already) is taken out by projection.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import Metric

CHOSEN = 1e-8  # prior precision of a chosen effect's parameters, in whitened units


@dataclass(frozen=True)
class Ground:
    """metric: of single runs; residual (R, m): whitened; shared (c, R, m): shapes that all runs share; inverse (c, c):
    of their Gram matrix and prior.
    """

    metric: Metric
    residual: np.ndarray
    shared: np.ndarray
    inverse: np.ndarray

    @cached_property
    def gram(self) -> np.ndarray:
        """Products (c, c) of what runs share, with its prior."""
        return np.linalg.pinv(self.inverse, hermitian=True)

    def white(self, shapes: np.ndarray) -> np.ndarray:
        """Shapes or readings (k, R, S, n) -> (k, R, m)."""
        runs = len(self.residual)
        return self.metric.whiten(shapes).reshape(len(shapes), runs, -1)

    def onto_shared(self, rows: np.ndarray) -> np.ndarray:
        """Products (k, R, c) of whitened rows (k, R, m) with what runs share, run by run."""
        return (rows.swapaxes(0, 1) @ self.shared.transpose(1, 2, 0)).swapaxes(0, 1)

    @cached_property
    def shared_residual(self) -> np.ndarray:
        """Products (c,) of what runs share with the residual."""
        return np.einsum("crm,rm->c", self.shared, self.residual)

    def left(self, residual: np.ndarray | None = None) -> float:
        """chi2 of the residual with what runs share taken out."""
        residual = self.residual if residual is None else residual
        along = np.einsum("crm,rm->c", self.shared, residual)
        return float(np.sum(residual**2) - along @ self.inverse @ along)


def ground_of(bench: Workbench, fit: Fit) -> Ground:
    """The ground on which an unknown is sought beside ``fit``."""
    metric = replace(bench, shared=np.zeros_like(bench.shared)).metric_at(bench.levels)
    runs = len(bench.samples.runs)
    m = len(bench.shared)
    shapes = np.concatenate([bench.shared, fit.slopes]) if len(fit.free) else bench.shared
    shared = metric.whiten(shapes).reshape(len(shapes), runs, -1)
    size = np.sqrt(np.sum(shared**2, axis=(1, 2)))
    size[m:] = np.maximum(size[m:], 1e-12)
    scale = np.concatenate([np.ones(m), 1.0 / size[m:]])
    shared = shared * scale[:, None, None]
    prior = np.concatenate([np.ones(m), np.full(len(shapes) - m, CHOSEN)])
    gram = np.einsum("crm,drm->cd", shared, shared) + np.diag(prior)
    residual = metric.whiten(bench.fitted.y - fit.values).reshape(runs, -1)
    return Ground(metric, residual, shared, np.linalg.pinv(gram, hermitian=True))
