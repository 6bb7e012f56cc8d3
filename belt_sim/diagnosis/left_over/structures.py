"""Shapes that a residual has no reason to follow when nothing is missing, as named families.

Smooth ones (travel x parity in yaw x tension, each signal on its own or all alike), the pulley's and the belt's
periods, and every run on its own. Waves of any length are scanned in waves.py.
"""

import numpy as np

from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.samples import Samples

DEGREES = 5


def structures(bench: Workbench) -> dict[str, np.ndarray]:
    """Name -> shapes (k, R, S, n) [m or rad], one noise level large."""
    samples = bench.samples
    smooth = _smooth(samples.travel / samples.end)
    found = {}
    for parity, weight in parities(samples).items():
        by_tension = [smooth * (weight * f)[:, None] for f in (np.ones(len(weight)), slackness(samples))]
        found[f"smooth, {parity}"] = np.concatenate([rows_of(samples.y.shape, c) for c in by_tension])
        for words, curves in zip(("at any tension", "of a slack belt"), by_tension, strict=True):
            found[f"smooth, {parity}, all signals alike, {words}"] = _alike(samples.y.shape, curves)
    order = np.linspace(-1.0, 1.0, len(samples.runs))
    if len(order) > 2:
        found["smooth, growing from run to run"] = rows_of(samples.y.shape, smooth * order[:, None])
    found |= {f"order {n}": rows for n, rows in _orders(bench).items()}
    for r, run in enumerate(samples.runs):
        only = np.zeros(len(samples.runs))
        only[r] = 1.0
        found[f"run {run.name}"] = rows_of(samples.y.shape, smooth * only[:, None])
    return {n: rows * noise_size(samples) for n, rows in found.items()}


def parities(samples: Samples) -> dict[str, np.ndarray]:
    """Weights (R,) of runs: odd and even in yaw; without any yaw only even."""
    sign = np.array([np.sign(r.yaw) for r in samples.runs])
    return ({"odd in yaw": sign} if np.any(sign) else {}) | {"even in yaw": np.ones(len(sign))}


def slackness(samples: Samples) -> np.ndarray:
    """(tension / least tension)^-2 of every run, (R,)."""
    stress = np.array([r.tension for r in samples.runs])
    return (stress / stress.min()) ** -2.0


def noise_size(samples: Samples) -> np.ndarray:
    """What a signal's errors are large, shape (S, 1) [m or rad]."""
    return np.array([max(s.white, s.wander_sd, 1e-9) for s in samples.signals])[:, None]


def rows_of(shape: tuple[int, ...], curves: np.ndarray) -> np.ndarray:
    """Curves (k, R, n) placed in every signal on its own: (k * S, R, S, n)."""
    runs, signals, n = shape
    rows = np.zeros((len(curves), signals, runs, signals, n))
    for s in range(signals):
        rows[:, s, :, s] = curves
    return rows.reshape(-1, runs, signals, n)


def _alike(shape: tuple[int, ...], curves: np.ndarray) -> np.ndarray:
    """Curves (k, R, n) placed in all signals at once: (k, R, S, n)."""
    return np.repeat(curves[:, :, None, :], shape[1], axis=2)


def _smooth(x: np.ndarray) -> np.ndarray:
    """Legendre shapes of degrees 1..DEGREES on a run, (DEGREES, R, n); a constant is a zero error, not structure."""
    return np.stack([np.polynomial.legendre.Legendre.basis(d)(2 * x - 1) for d in range(1, DEGREES + 1)])


def _orders(bench: Workbench) -> dict[str, np.ndarray]:
    samples, rig = bench.samples, bench.samples.cases.rig
    periods = {"pulley turn": 2 * np.pi * float(rig.tail_radius), "belt revolution": float(rig.belt_length)}
    found = {}
    for name, period in periods.items():
        spacing = np.median(np.diff(samples.travel[0]))
        if samples.end < 2 * period or period < 2.5 * spacing:
            continue
        phase = 2 * np.pi * samples.travel / period
        waves = np.stack([np.cos(phase), np.sin(phase)])
        found[name] = np.concatenate([rows_of(samples.y.shape, waves * w[:, None]) for w in parities(samples).values()])
    return found
