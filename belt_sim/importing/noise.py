"""How large the noise is: white, wander and its length, and the error of zero, read off the runs themselves.

White noise is what scatters from sample to sample. Wander is what two runs at the same settings differ by, beside a
straight line (settings and zero). Without repeats it is what a smooth curve leaves of a run: a lower bound, since
neither a belt's own movement nor the drift of a fault must count, and a fault acts at zero yaw as well.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from belt_sim.campaign import Run
from belt_sim.campaign.quality.record import resolution, scatter, scatter_of_wander

FEWEST = 20  # samples from which anything is read
KNOTS = 0.5  # of a span: spacing of the knots of the smooth curve
LEAST_WHITE = 0.3  # of the scatter from sample to sample, which wander cannot explain alone
FAINT = 0.1  # of the white noise, below which a wander is none
DEFAULT_LENGTH = 3.0  # [m], where nothing tells
LENGTHS = np.exp(np.linspace(np.log(0.3), np.log(20.0), 40))  # [m]


@dataclass(frozen=True, kw_only=True)
class NoiseRead:
    """What was read off one signal: white, wander, zero [SI], wander length [m], each with where it comes from.

    by_run: white noise [SI] of every run that has the signal.
    """

    white: float
    wander: float
    length: float
    zero: float
    white_from: str
    wander_from: str
    zero_from: str
    by_run: dict[str, float]


class Trace(NamedTuple):
    """Noise of one signal along the travel [m], shape (n,)."""

    travel: np.ndarray
    values: np.ndarray


def noise_of(signal: str, runs: list[Run], span: float) -> NoiseRead:
    """Noise of one signal from all runs that have it; span [m]."""
    own = [r for r in runs if signal in r.signals and np.isfinite(r.signals[signal]).sum() >= 3]
    there = {r.name: r.signals[signal][np.isfinite(r.signals[signal])] for r in own}
    # by the median second difference, by their rms where most are rounded away
    by_run = {name: scatter(y) or float(np.sqrt(np.mean(np.diff(y, 2) ** 2) / 6.0)) for name, y in there.items()}
    white = float(np.median([*by_run.values()])) if own else 0.0
    told = f"the scatter from sample to sample in {len(own)} run{'s' if len(own) != 1 else ''}"
    pairs = _pairs(own, signal)
    traces = [_detrend(t) for t in pairs if len(t.travel) >= FEWEST]
    source = f"{len(traces)} pair{'s' if len(traces) != 1 else ''} of repeats"
    if not traces:
        traces = [_smooth_residual(r, signal, span) for r in own]
        traces = [t for t in traces if len(t.travel) >= FEWEST]
        source = "what a smooth curve leaves of single runs: a lower bound; repeat a run to know better"
    wander, length, white = _levels(traces, white)
    steps = map(resolution, there.values())
    white = max(white, min((s for s in steps if s > 0.0), default=0.0) / float(np.sqrt(12.0)), 1e-9)
    wander = wander if wander > FAINT * white else 0.0
    zero, zero_from = _zero(pairs, white, wander)
    return NoiseRead(
        white=white,
        wander=wander,
        length=length,
        zero=zero,
        white_from=told,
        wander_from=source,
        zero_from=zero_from,
        by_run=by_run,
    )


def _trace(run: Run, signal: str) -> Trace:
    there = np.isfinite(run.signals[signal]) & (run.travel >= run.yaw_at)
    return Trace(run.travel[there], run.signals[signal][there])


def _pairs(runs: list[Run], signal: str) -> list[Trace]:
    """Differences of repeats from their first run over the square root of 2: each run has half of their variance."""
    traces = {r.name: _trace(r, signal) for r in runs}
    found = []
    for run in runs:
        a, b = traces[run.name], traces.get(run.repeat_of or "")
        if b is None or not len(b.travel):
            continue
        rows = np.isin(np.round(a.travel, 6), np.round(b.travel, 6))
        if rows.sum() < 0.5 * len(a.travel):
            rows = (a.travel >= b.travel[0]) & (a.travel <= b.travel[-1])
        if not rows.any():
            continue
        difference = a.values[rows] - np.interp(a.travel[rows], b.travel, b.values)
        found.append(Trace(a.travel[rows], difference / np.sqrt(2.0)))
    return found


def _detrend(trace: Trace) -> Trace:
    """The trace beside a straight line: an error of zero and of yaw are no wander."""
    line = np.polynomial.Polynomial.fit(trace.travel, trace.values, 1)
    return Trace(trace.travel, trace.values - line(trace.travel))


def _smooth_residual(run: Run, signal: str, span: float) -> Trace:
    trace = _trace(run, signal)
    if len(trace.travel) < FEWEST:
        return trace
    low, high = trace.travel[0], trace.travel[-1]
    count = int(np.clip((high - low) / (KNOTS * span), 2, len(trace.travel) // 4))
    knots = np.concatenate([[low] * 3, np.linspace(low, high, count + 1), [high] * 3])
    basis = BSpline.design_matrix(trace.travel, knots, 3).toarray()
    fitted = np.linalg.lstsq(basis, trace.values, rcond=None)[0]
    return Trace(trace.travel, trace.values - basis @ fitted)


def _levels(traces: list[Trace], white: float) -> tuple[float, float, float]:
    """(wander sd, wander length, white) of correlated noise exp(-d/length) and white noise, by the structure function.

    Half the mean squared difference over a lag d is white^2 + sd^2 (1 - exp(-d/length)).
    """
    lags, halves, weights = _structure(traces)
    if len(lags) < 4:
        return 0.0, DEFAULT_LENGTH, white
    root = np.sqrt(weights) / np.maximum(halves, 1e-30)
    best = (np.inf, 0.0, DEFAULT_LENGTH)
    for length in LENGTHS[lags[-1] >= LENGTHS]:
        shape = np.stack([np.ones_like(lags), 1.0 - np.exp(-lags / length)])
        found = np.maximum(np.linalg.lstsq((shape * root).T, halves * root, rcond=None)[0], 0.0)
        cost = float(np.sum(((found @ shape - halves) * root) ** 2))
        if cost < best[0]:
            best = (cost, float(np.sqrt(found[1])), float(length))
    _, sd, length = best
    without_wander = white**2 - scatter_of_wander(sd, length, lags[0]) ** 2
    return sd, float(f"{length:.2g}"), float(np.sqrt(max(without_wander, (LEAST_WHITE * white) ** 2)))


def _structure(traces: list[Trace]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lags [m], half the mean squared differences over them, and from how many independent stretches these are."""
    spacing = [float(np.median(np.diff(t.travel))) for t in traces if len(t.travel) > 2]
    if not spacing:
        return np.empty(0), np.empty(0), np.empty(0)
    step, longest = float(np.median(spacing)), max(float(np.ptp(t.travel)) for t in traces)
    counts = np.unique(np.round(np.geomspace(1, max(longest / (4.0 * step), 1), 24)).astype(int))
    lags, halves, weights = [], [], []
    for count in counts:
        squares = np.concatenate([(t.values[count:] - t.values[:-count]) ** 2 for t in traces if len(t.values) > count])
        if len(squares) > 4:
            lags.append(count * step)
            halves.append(0.5 * float(np.mean(squares)))
            weights.append(min(len(squares) / count, 1e3))
    return np.array(lags), np.array(halves), np.array(weights)


def _zero(pairs: list[Trace], white: float, wander: float) -> tuple[float, str]:
    """One sigma of where y = 0 is: how far repeats lie apart, or what noise makes of it."""
    apart = []
    for pair in pairs:
        first = pair.values[pair.travel <= pair.travel[0] + 0.1 * np.ptp(pair.travel)]
        if len(first) >= 3:
            apart.append(float(np.mean(first)))
    least = float(np.hypot(0.5 * white, wander))
    if len(apart) > 1:
        return max(float(np.sqrt(np.mean(np.square(apart)))), least), f"where {len(apart)} repeats begin"
    return least, "the noise of the first readings"
