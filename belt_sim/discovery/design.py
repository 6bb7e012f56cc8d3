"""Design matrices: what an input at a place does to the whitened readings; and what is taken out beside it.

Runs are whitened one by one, so that columns of single runs can be weighted and summed at will. Parameters that runs
share (the belt's stiffness, and the effects that are chosen already) are taken out by projection.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import Metric
from belt_sim.discovery.impulse_responses import CHANNELS, TILT, ImpulseResponses, Y
from belt_sim.effects.base import Effect
from belt_sim.effects.law import ROLLS, Place
from belt_sim.jax_setup import in_float64
from belt_sim.line.hooks import true_travel

HIDDEN = 2e-3  # share of a column that must be left beside what is chosen
CHOSEN = 1e-8  # prior precision of a chosen effect's parameters, in whitened units


@dataclass(frozen=True)
class ResidualProjector:
    """Inner products beside the parameters that runs share.

    metric: of single runs; residual (R, m): whitened; shared (c, R, m): whitened columns of the shared parameters;
    inverse (c, c): of their Gram matrix and prior.
    """

    metric: Metric
    residual: np.ndarray
    shared: np.ndarray
    inverse: np.ndarray

    @cached_property
    def gram(self) -> np.ndarray:
        """Gram matrix (c, c) of the shared columns, with its prior."""
        return np.linalg.pinv(self.inverse, hermitian=True)

    def whiten(self, shapes: np.ndarray) -> np.ndarray:
        """Shapes or readings (k, R, S, n) -> (k, R, m)."""
        runs = len(self.residual)
        return self.metric.whiten(shapes).reshape(len(shapes), runs, -1)

    def shared_products(self, rows: np.ndarray) -> np.ndarray:
        """Products (k, R, c) of whitened rows (k, R, m) with the shared columns, run by run."""
        return (rows.swapaxes(0, 1) @ self.shared.transpose(1, 2, 0)).swapaxes(0, 1)

    @cached_property
    def shared_residual(self) -> np.ndarray:
        """Products (c,) of the shared columns with the residual."""
        return np.einsum("crm,rm->c", self.shared, self.residual)

    def chi2(self, residual: np.ndarray | None = None) -> float:
        """chi2 of the residual with the shared parameters fitted."""
        residual = self.residual if residual is None else residual
        along = np.einsum("crm,rm->c", self.shared, residual)
        return float(np.sum(residual**2) - along @ self.inverse @ along)

    def gram_of(self, rows: np.ndarray) -> np.ndarray:
        """Gram matrix (k, k) of whitened rows (k, R, m) with the shared columns taken out."""
        onto = self.shared_products(rows).sum(axis=1)
        return np.einsum("krm,lrm->kl", rows, rows) - onto @ self.inverse @ onto.T

    def fit_sizes(self, columns: np.ndarray) -> tuple[float, np.ndarray]:
        """chi2 explained and sizes (k,) of whitened columns (k, R, m)."""
        flat = columns.reshape(len(columns), -1)
        onto, own = flat @ self.shared.reshape(len(self.shared), -1).T, flat @ flat.T
        left = own - onto @ self.inverse @ onto.T
        pull = flat @ self.residual.ravel() - onto @ self.inverse @ self.shared_residual
        scale = 1.0 / np.sqrt(np.maximum(np.diag(own), 1e-300))
        if not np.isfinite(left).all() or np.any(np.diag(left) * scale**2 < HIDDEN):
            return 0.0, np.zeros(len(pull))
        inverse = np.linalg.pinv(left * np.outer(scale, scale), rcond=1e-6, hermitian=True)
        sizes = scale * (inverse @ (pull * scale))
        return float(pull @ sizes), sizes


def residual_projector(bench: Workbench, fit: Fit) -> ResidualProjector:
    """The projector for a search of what is missing beside ``fit``."""
    metric = replace(bench, shared=np.zeros_like(bench.shared)).metric_at(bench.levels)
    runs = len(bench.samples.runs)
    shapes = np.concatenate([bench.shared, fit.slopes]) if len(fit.free) else bench.shared
    shared = metric.whiten(shapes).reshape(len(shapes), runs, -1)
    chosen = np.arange(len(shapes)) >= len(bench.shared)
    size = np.maximum(np.sqrt(np.sum(shared**2, axis=(1, 2))), 1e-12)
    shared = shared * np.where(chosen, 1.0 / size, 1.0)[:, None, None]
    prior = np.where(chosen, CHOSEN, 1.0)
    gram = np.einsum("crm,drm->cd", shared, shared) + np.diag(prior)
    residual = metric.whiten(bench.fitted.y - fit.values).reshape(runs, -1)
    return ResidualProjector(metric, residual, shared, np.linalg.pinv(gram, hermitian=True))


@dataclass(frozen=True, kw_only=True)
class DesignMatrices:
    """rows: channel, or signal of a sensor -> (J, R, m), whitened responses to an input of height 1 in each cell; grid
    (J,): the cells' travels [m]."""

    rows: dict[str, np.ndarray]
    grid: np.ndarray

    def columns(self, channel: str, inputs: np.ndarray) -> np.ndarray:
        """Whitened columns (F, R, m) of inputs (F, R, J) at a channel."""
        op = self.rows[channel]
        return np.matmul(single_precision(inputs).swapaxes(0, 1), op.swapaxes(0, 1)).swapaxes(0, 1)

    def place_columns(self, place: Place, inputs: Sequence[np.ndarray]) -> np.ndarray:
        """Whitened columns (F, R, m) of inputs (F, R, J), one array a part of the place."""
        columns = [self.columns(channel, one) for (channel, _), one in zip(place.parts, inputs, strict=True)]
        return columns[0] if len(columns) == 1 else np.sum(columns, axis=0)


def single_precision(x: np.ndarray) -> np.ndarray:
    """Numbers in single precision; those too small for all its digits are 0: a few of them, as there are in what fades
    away, make a matrix product take seven times as long.
    """
    found = x.astype(np.float32)
    found[np.abs(found) < np.finfo(np.float32).tiny] = 0.0
    return found


def design_matrices(
    bench: Workbench, projector: ResidualProjector, responses: ImpulseResponses, effects: Sequence[Effect]
) -> DesignMatrices:
    """Design matrices of all channels of the march, of every lateral sensor and of the roll that tilt sensors show."""
    samples = bench.samples
    shown = np.concatenate([samples.travel, samples.yaw_at[:, None]], axis=1)
    true = np.asarray(in_float64(true_travel)(effects, samples.cases, shown.T)).T if effects else shown
    names = [*CHANNELS, *(s.name for s in samples.signals if s.kind == "lateral")]
    names += ROLLS if any(s.kind == "tilt" for s in samples.signals) else ()
    rows = {}
    for name in names:
        white = projector.whiten(_responses_at(bench, responses, true, name)).swapaxes(0, 1)
        rows[name] = single_precision(np.ascontiguousarray(white)).swapaxes(0, 1)  # of a run side by side in memory
    return DesignMatrices(rows=rows, grid=responses.grid)


def _responses_at(bench: Workbench, responses: ImpulseResponses, true: np.ndarray, name: str) -> np.ndarray:
    """What an input of height 1 in each cell of a channel, a sensor or a roll adds to the readings, (J, R, S, n), in
    single precision."""
    samples, grid = bench.samples, responses.grid
    found = np.zeros((len(grid), *samples.y.shape), np.float32)
    for r, run in enumerate(samples.runs):
        for s, signal in enumerate(samples.signals):
            row = curve_row(signal.at, run.direction)
            if name in CHANNELS:
                pulse = responses.pulses[r, CHANNELS.index(name), row].astype(np.float32)
                read = responses.cell_responses(pulse, true[r])
            elif signal.name == name or (name in ROLLS and row == TILT + ROLLS.index(name)):  # it shows it itself
                read = np.maximum(0.0, 1.0 - np.abs(true[r][:, None] - grid[None]) / (grid[1] - grid[0]))
            else:
                continue
            found[:, r, s] = (read[:-1] - (read[-1] if signal.kind == "lateral" else 0.0)).T
    return found


def curve_row(at: str, direction: float) -> int:
    """Row of ImpulseResponses.curves that a signal at a place shows."""
    if at in ("upper_mid_span", "lower_mid_span"):
        return TILT + (0 if (at == "upper_mid_span") == (direction > 0) else 1)
    points = (1, 3, 2, 4) if direction > 0 else (2, 4, 1, 3)
    return Y + points.index(int(at[-1]))


def span_ends(rows: np.ndarray) -> np.ndarray:
    """Boundary values (R, 6, J) of the spans that run up the tail and the head pulley, by ``ImpulseResponses.curves``
    (R, 8 or more, J): y at run-up less y at run-off, angle at run-off and at run-up."""
    y, angle = rows[:, :4], rows[:, 4:8]
    found = [(y[:, up] - y[:, off], angle[:, off], angle[:, up]) for up, off in ((0, 3), (1, 2))]
    return np.stack([*found[0], *found[1]], axis=1)
