"""Which effects of a set stay when the rest of the residual is modelled as something unknown.

The unknown enters as free columns: what a discovery found its input to be, or else a smooth curve of its own in every
run and signal, with the waves in which the open-set test saw something. An effect stays when it is needed beside them:
its gain over the set without it beats its threshold by far (what is unknown was in nobody's mind when thresholds were
made), and its numbers are plausible. Everything is linear about the fit of the whole set.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.candidate import is_plausible
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.openset import OpenSet, apart, basis
from belt_sim.diagnosis.structures import noise_size, rows_of, structures
from belt_sim.diagnosis.waves import wave_shapes
from belt_sim.diagnosis.workbench import Workbench

DECISIVE = 3.0  # times its threshold that an effect has to gain beside something unknown


def unknown_columns(bench: Workbench, test: OpenSet) -> np.ndarray:
    """Shapes (k, R, S, n) of an unknown that may be anything smooth, and of waves and orders that the test saw."""
    known = structures(bench)
    rows = [shapes for n, shapes in known.items() if n.startswith("run ") or n in test.failed]
    rows += [wave_shapes(bench, n, test.wavelength[n]) for n in test.failed if n in test.wavelength]
    runs, _, n = bench.samples.y.shape
    begins = rows_of(bench.samples.y.shape, np.repeat(np.eye(runs)[:, :, None], n, axis=2))  # and wherever it begins
    return np.concatenate([*rows, begins * noise_size(bench.samples)])


def members_that_stay(bench: Workbench, fit: Fit, columns: np.ndarray, threshold: Callable[[str], float]) -> Fit | None:
    """``fit`` with those of its effects that are needed beside unknown ``columns`` (k, R, S, n), refitted beside them.

    threshold: id -> gain that chance reaches. None when no effect stays.
    """
    unknown = basis(bench.metric.whiten(columns)) if len(columns) else np.empty((0, len(fit.residual)))
    null = bench.forward.null()
    away = fit.vector[fit.free] - null[fit.free]
    target = apart((fit.residual + away @ fit.columns)[None], unknown)[0]
    seen = apart(fit.columns, unknown)
    ids = fit.ids
    while ids:
        chi2, numbers = _solved(bench, fit, ids, seen, target)
        gains = {i: _solved(bench, fit, _without(ids, i), seen, target)[0] - chi2 for i in ids}
        needed = tuple(i for i in ids if gains[i] > DECISIVE * threshold(i))
        if needed != ids:  # all at once: of several that stand in for each other none is known to be there
            ids = needed
            continue
        rows = _rows(bench, fit, ids)
        vector = null.copy()
        vector[np.array(fit.free)[rows]] = null[np.array(fit.free)[rows]] + numbers
        reduced = replace(
            fit, ids=ids, free=[fit.free[k] for k in rows], vector=vector, chi2=chi2, columns=seen[rows],
            slopes=fit.slopes[rows], residual=target - numbers @ seen[rows],
            values=bench.forward.values(vector[None])[0],
        )  # fmt: skip
        return reduced if is_plausible(bench.forward, reduced) else None
    return None


def _solved(bench: Workbench, fit: Fit, ids: Sequence[str], seen: np.ndarray, target: np.ndarray):
    """chi2 and numbers of the effects ``ids`` alone."""
    rows = _rows(bench, fit, ids)
    if not rows:
        return float(target @ target), np.empty(0)
    size = np.maximum(np.linalg.norm(seen[rows], axis=1), 1e-12)
    numbers = np.linalg.lstsq((seen[rows] / size[:, None]).T, target, rcond=1e-8)[0] / size
    rest = target - numbers @ seen[rows]
    return float(rest @ rest), numbers


def _rows(bench: Workbench, fit: Fit, ids: Sequence[str]) -> list[int]:
    places = {k for i in ids for k in bench.forward.index(i)}
    return [k for k, position in enumerate(fit.free) if position in places]


def _without(ids: Sequence[str], name: str) -> tuple[str, ...]:
    return tuple(i for i in ids if i != name)
