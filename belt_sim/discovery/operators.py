"""Operators: what an input at a place does to the whitened readings, cell by cell."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.discovery.channels import CHANNELS
from belt_sim.discovery.ground import Ground
from belt_sim.discovery.responses import TILT, Responses, Y
from belt_sim.effects.base import Effect
from belt_sim.effects.pipeline import true_travel
from belt_sim.jax_setup import in_float64


@dataclass(frozen=True, kw_only=True)
class Operators:
    """rows: channel, or signal of a sensor -> (J, R, m), whitened answers to an input of height 1 in each cell."""

    rows: dict[str, np.ndarray]
    grid: np.ndarray
    true: np.ndarray  # (R, n + 1) true travel of every sample, and where sensors read zero

    def columns(self, channel: str, inputs: np.ndarray) -> np.ndarray:
        """Whitened columns (F, R, m) of inputs (F, R, J) at a channel."""
        op = self.rows[channel]
        return np.matmul(single(inputs).swapaxes(0, 1), op.swapaxes(0, 1)).swapaxes(0, 1)


def single(x: np.ndarray) -> np.ndarray:
    """Numbers in single precision; those too small for all its digits are 0: a few of them, as there are in what fades
    away, make a matrix product take seven times as long.
    """
    found = x.astype(np.float32)
    found[np.abs(found) < np.finfo(np.float32).tiny] = 0.0
    return found


def operators(bench: Workbench, ground: Ground, answers: Responses, effects: Sequence[Effect]) -> Operators:
    """Operators of all channels of the march and of every lateral sensor."""
    samples = bench.samples
    shown = np.concatenate([samples.travel, samples.yaw_at[:, None]], axis=1)
    true = np.asarray(in_float64(true_travel)(effects, samples.cases, shown.T)).T if effects else shown
    names = [*CHANNELS, *(s.name for s in samples.signals if s.kind == "lateral")]
    rows = {n: _run_by_run(ground.white(shapes(bench, answers, true, n))) for n in names}
    return Operators(rows=rows, grid=answers.grid, true=true)


def _run_by_run(rows: np.ndarray) -> np.ndarray:
    """Rows (J, R, m) in single precision, those of a run side by side in memory, as they are multiplied."""
    return single(np.ascontiguousarray(rows.swapaxes(0, 1))).swapaxes(0, 1)


def shapes(bench: Workbench, answers: Responses, true: np.ndarray, channel: str) -> np.ndarray:
    """What an input of height 1 in each cell of a channel or sensor adds to the readings, (J, R, S, n), in single
    precision."""
    if channel in CHANNELS:
        return _channel(bench, answers, true, CHANNELS.index(channel))
    return _sensor(bench, answers, true, [s.name for s in bench.samples.signals].index(channel))


def kept_row(at: str, direction: float) -> int:
    """Row of Responses.curves that a signal at a place shows."""
    if at in ("upper_mid_span", "lower_mid_span"):
        return TILT + (0 if (at == "upper_mid_span") == (direction > 0) else 1)
    points = (1, 3, 2, 4) if direction > 0 else (2, 4, 1, 3)
    return Y + points.index(int(at[-1]))


def _channel(bench: Workbench, answers: Responses, true: np.ndarray, channel: int) -> np.ndarray:
    samples = bench.samples
    runs, signals, n = samples.y.shape
    found = np.zeros((len(answers.grid), runs, signals, n), np.float32)
    for r, run in enumerate(samples.runs):
        for s, signal in enumerate(samples.signals):
            row = answers.pulses[r, channel, kept_row(signal.at, run.direction)]
            read = answers.at(row.astype(np.float32), true[r])
            found[:, r, s] = (read[:-1] - (read[-1] if signal.kind == "lateral" else 0.0)).T
    return found


def _sensor(bench: Workbench, answers: Responses, true: np.ndarray, signal: int) -> np.ndarray:
    samples = bench.samples
    runs, signals, n = samples.y.shape
    grid = answers.grid
    found = np.zeros((len(grid), runs, signals, n), np.float32)
    for r in range(runs):
        hats = np.maximum(0.0, 1.0 - np.abs(true[r][:, None] - grid[None]) / (grid[1] - grid[0]))
        found[:, r, signal] = (hats[:-1] - hats[-1]).T
    return found


def relative_turn(per_end: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """What a relative change of what bends the spans adds to kappa at the run-ups (tail, head), (R, 2, J) [1/m].

    per_end (R, 3): the same per unit of a span's boundary values; rows (R, 8, J): y and angle of the curves.
    """
    y, angle = rows[:, :4], rows[:, 4:8]
    found = []
    for up, off in ((0, 3), (1, 2)):
        ends = np.stack([y[:, up] - y[:, off], angle[:, off], angle[:, up]], axis=1)
        found.append(np.einsum("rk,rkj->rj", per_end, ends))
    return np.stack(found, axis=1)
