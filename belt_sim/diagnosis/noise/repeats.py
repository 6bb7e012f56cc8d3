"""Which runs say of noise what no model has a say in: differences of repeats, or single runs beside all candidates."""

import numpy as np

from belt_sim.campaign import Run
from belt_sim.diagnosis.noise.contrasts import Contrast, contrast
from belt_sim.diagnosis.readings.samples import Samples


def repeated_groups(samples: Samples) -> list[tuple[int, ...]]:
    """Indices of runs with the same settings, group by group, where there are two or more."""
    found: dict[tuple, list[int]] = {}
    for k, run in enumerate(samples.runs):
        found.setdefault(_settings_of(run), []).append(k)
    return [tuple(runs) for runs in found.values() if len(runs) > 1]


def _settings_of(run: Run) -> tuple:
    return run.tension, run.yaw, run.yaw_head, run.speed, run.direction, run.yaw_at


def differences(samples: Samples, shapes: np.ndarray, group: tuple[int, ...]) -> list[Contrast]:
    """Every run of a group against the mean of those before it (Helmert), for every signal; runs sampled at other
    travels than the first are left out.
    """
    first = samples.travel[group[0]]
    alike = [r for r in group if np.allclose(samples.travel[r], first)]
    found = []
    for k in range(1, len(alike)):
        weights = np.array([-1.0 / k] * k + [1.0]) / np.sqrt(1.0 + 1.0 / k)
        runs = tuple(alike[: k + 1])
        made = [contrast(samples, shapes, runs, tuple(weights), s) for s in range(len(samples.signals))]
        found += [c for c in made if c is not None]
    return found


def single_runs(samples: Samples, columns: np.ndarray) -> list[Contrast]:
    """Every run and signal, beside what columns (k, R, S, n) could do to it."""
    made = [
        contrast(samples, columns, (r,), (1.0,), s)
        for r in range(len(samples.runs))
        for s in range(len(samples.signals))
    ]
    return [c for c in made if c is not None]
