"""Held-out error: whole conditions (a tension, a sign of yaw) are left out, the rest is refitted, they are predicted.

Refits are one Gauss-Newton step from the joint fit, which is exact for effects that enter linearly.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.workbench import Workbench

RIDGE = 1e-6  # of the information, so that an effect seen in the left-out runs alone stays at its joint value


@dataclass(frozen=True)
class HeldOut:
    """chi2: -2 log of the density that the refits predicted for the left-out readings, up to a constant (without
    free parameters the squared length of the whitened error); rms [m]: of the lateral signals.
    """

    chi2: float
    rms: float
    by_condition: dict[str, float]


def conditions(bench: Workbench) -> dict[str, np.ndarray]:
    """Name -> which runs (R,) it leaves out: every tension, every sign of yaw, and the runs marked hold_out."""
    runs = bench.samples.runs
    fitted = np.array([r.use == "fit" for r in runs])
    tension = np.array([r.tension for r in runs])
    sign = np.array([np.sign(r.yaw) for r in runs])
    found = {f"{t / 1e6:g} N/mm2": (tension == t) & fitted for t in np.unique(tension)}
    found |= {f"yaw {'+' if s > 0 else '-' if s < 0 else '0'}": (sign == s) & fitted for s in np.unique(sign)}
    kept = {n: m for n, m in found.items() if m.any() and not m[fitted].all()}
    if not fitted.all():
        kept["hold_out"] = ~fitted
    return kept or {"all": fitted}


def held_out(bench: Workbench, fit: Fit) -> HeldOut:
    """Prediction error of ``fit`` on each condition when that condition is left out."""
    runs = len(bench.samples.runs)
    blocks = fit.residual.reshape(runs, -1)
    columns = fit.columns.reshape(len(fit.free), runs, blocks.shape[1])
    lateral = np.array([s.kind == "lateral" for s in bench.samples.signals])
    chi2, squares, count, by = 0.0, 0.0, 0, {}
    for name, out in conditions(bench).items():
        step = (
            _refit(np.concatenate(list(columns[:, ~out].swapaxes(0, 1)), axis=-1), blocks[~out].ravel())
            if fit.free
            else np.empty(0)
        )
        left = blocks[out] - np.einsum("k,krm->rm", step, columns[:, out])
        chi2 += _surprise(left.ravel(), columns[:, out], columns[:, ~out])
        predicted = fit.values[out] + np.einsum("k,krsn->rsn", step, fit.slopes[:, out])
        errors = (bench.samples.y[out] - predicted)[:, lateral]
        errors = errors[np.isfinite(errors)]
        by[name] = float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")
        squares, count = squares + float(np.sum(errors**2)), count + errors.size
    return HeldOut(chi2, float(np.sqrt(squares / max(count, 1))), by)


def _surprise(left: np.ndarray, columns: np.ndarray, rest: np.ndarray) -> float:
    """-2 log predictive density of whitened errors ``left`` (m,) when parameters with shapes ``columns`` (k, runs,
    samples) are known only from ``rest`` (the same of the other runs): r^T (I + J^T C J)^-1 r + log det(I + J^T C J).
    """
    if not len(columns):
        return float(left @ left)
    columns, inside = columns.reshape(len(columns), -1), rest.reshape(len(rest), -1)
    information = inside @ inside.T
    scale = 1.0 / np.sqrt(np.diag(information) + np.sum(columns**2, axis=1) + 1e-12)
    information = information * np.outer(scale, scale) + RIDGE * np.eye(len(scale))
    seen = columns * scale[:, None]
    total = information + seen @ seen.T
    along = seen @ left
    explained = along @ np.linalg.solve(total, along)
    return float(left @ left - explained + np.linalg.slogdet(total)[1] - np.linalg.slogdet(information)[1])


def _refit(columns: np.ndarray, residual: np.ndarray) -> np.ndarray:
    normal = columns @ columns.T
    return np.linalg.lstsq(normal + RIDGE * np.diag(np.diag(normal) + 1e-9), columns @ residual, rcond=1e-10)[0]
