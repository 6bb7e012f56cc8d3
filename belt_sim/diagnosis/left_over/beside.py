"""Which effects of a set stay when the rest of the residual is modelled as something unknown.

The unknown enters as free columns: what a discovery found its input to be, or else a smooth curve of its own in every
run and signal, with the waves in which the open-set test saw something. An effect stays when it is needed beside them:
its gain over the set without it beats its threshold by far (what is unknown was in nobody's mind when thresholds were
made), and its numbers are plausible. Everything is linear about the fit of the whole set.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.diagnosis.fits.candidate import is_plausible
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.openset import OpenSet, apart, basis
from belt_sim.diagnosis.left_over.structures import noise_size, rows_of, structures
from belt_sim.diagnosis.left_over.waves import wave_shapes

BENT = 0.3  # of what an effect does, by which its derivatives may miss that
DECISIVE = 3.0  # times its threshold that an effect has to gain beside something unknown
HIDDEN = 2e-3  # share of what a number does, below which the readings do not tell it beside the unknown


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
    shapes, bent, without = _shapes(bench, fit)
    target = apart(without[None], unknown)[0]
    seen = {i: _seen(bench, fit, i, rows, unknown, i in bent) for i, rows in shapes.items()}
    ids = fit.ids
    while ids:
        chi2, numbers = _solved(seen, ids, target)
        gains = {i: _solved(seen, _without(ids, i), target)[0] - chi2 for i in ids}
        needed = tuple(i for i in ids if gains[i] > DECISIVE * threshold(i))
        if needed != ids:  # all at once: of several that stand in for each other none is known to be there
            ids = needed
            continue
        reduced = _reduced(bench, fit, {i: None if i in bent else numbers[i] for i in ids}, unknown)
        rest = target - sum((numbers[i] @ seen[i].rows for i in ids), np.zeros(len(target)))
        reduced = replace(reduced, chi2=chi2, residual=rest)
        return reduced if is_plausible(bench.forward, reduced) else None
    return None


def _shapes(bench: Workbench, fit: Fit) -> tuple[dict[str, np.ndarray], set[str], np.ndarray]:
    """Whitened shapes (k, N) of every effect; which are bent; the residual (N,) without any of them.

    Derivatives along its parameters; where these do not add up to what the effect does (a roller that pushes from some
    play on), it is bent, and its shape what it does.
    """
    null, places = bench.forward.null(), {i: bench.forward.index(i) for i in fit.ids}
    points = np.repeat(fit.vector[None], len(places), axis=0)
    for point, positions in zip(points, places.values(), strict=True):
        point[positions] = null[positions]
    does = bench.metric.whiten(fit.values - bench.forward.values(points))
    shapes, bent, without = {}, set[str](), fit.residual
    for own, name in zip(does, fit.ids, strict=True):
        rows = _rows(bench, fit, name)
        by_slopes = (fit.vector - null)[[fit.free[k] for k in rows]] @ fit.columns[rows]
        if np.linalg.norm(by_slopes - own) > BENT * np.linalg.norm(own):
            bent.add(name)
        shapes[name] = own[None] if name in bent else fit.columns[rows]
        without = without + (own if name in bent else by_slopes)
    return shapes, bent, without


@dataclass(frozen=True)
class _Seen:
    """What is seen of an effect beside an unknown: rows (k, N); their sizes (k,) without it; numbers as fitted (k,)."""

    rows: np.ndarray
    size: np.ndarray
    fitted: np.ndarray


def _seen(bench: Workbench, fit: Fit, name: str, rows: np.ndarray, unknown: np.ndarray, bent: bool) -> _Seen:
    own = [fit.free[k] for k in _rows(bench, fit, name)]
    fitted = np.ones(1) if bent else (fit.vector - bench.forward.null())[own]
    return _Seen(apart(rows, unknown), np.maximum(np.linalg.norm(rows, axis=1), 1e-12), fitted)


def _solved(seen: dict[str, _Seen], ids: Sequence[str], target: np.ndarray):
    """chi2 and numbers of the effects ``ids`` alone.

    Where the unknown does what their numbers do, these are left as they were fitted: free, they would be anything, and
    what they predict of the readings with them.
    """
    if not ids:
        return float(target @ target), {}
    size, numbers = (np.concatenate([getattr(seen[i], n) for i in ids]) for n in ("size", "fitted"))
    rows = np.concatenate([seen[i].rows for i in ids]) / size[:, None]
    values, vectors = np.linalg.eigh(rows @ rows.T)
    told = vectors[:, values > HIDDEN]
    step = told @ ((told.T @ (rows @ (target - (numbers * size) @ rows))) / values[values > HIDDEN])
    rest = target - (numbers * size + step) @ rows
    ends = np.cumsum([len(seen[i].size) for i in ids])[:-1]
    return float(rest @ rest), dict(zip(ids, np.split(numbers + step / size, ends), strict=True))


def _reduced(bench: Workbench, fit: Fit, numbers: dict[str, np.ndarray | None], unknown: np.ndarray) -> Fit:
    """``fit`` with the effects of ``numbers`` alone, which are in units beyond null; None: as they were fitted."""
    vector, rows = bench.forward.null(), []
    for name, sizes in numbers.items():
        own = _rows(bench, fit, name)
        where = [fit.free[k] for k in own]
        vector[where] = fit.vector[where] if sizes is None else vector[where] + sizes
        rows += own
    free = [fit.free[k] for k in rows]
    return replace(
        fit, ids=tuple(numbers), free=free, vector=vector, columns=apart(fit.columns[rows], unknown),
        slopes=fit.slopes[rows], values=bench.forward.values(vector[None])[0],
    )  # fmt: skip


def _rows(bench: Workbench, fit: Fit, name: str) -> list[int]:
    places = set(bench.forward.index(name))
    return [k for k, position in enumerate(fit.free) if position in places]


def _without(ids: Sequence[str], name: str) -> tuple[str, ...]:
    return tuple(i for i in ids if i != name)
