"""The error of a model against a campaign, run by run and over all, beside what the uncertainties alone make it; and
where it fails, by tension, yaw sign, travel window and signal.

ASME V&V 20: E = model - measurement; u_val from noise, zero, gain, settings, stiffness and the march's step; |E| <= k
u_val means that the comparison cannot say more. k = 2 for one cell; a statement about many cells takes the k that all
of them together exceed by chance in one comparison of twenty.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from belt_sim.campaign.types import Kind
from belt_sim.curves import LATE_SHARE
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import Condition, held_out, lateral_rms
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import metric_of, zero_sigmas
from belt_sim.diagnosis.readings.samples import zero_is_read
from belt_sim.results.errors import UNITS, Change, Errors, Features, OwnChange, RunError, Where, Worst
from belt_sim.results.words import KILO
from belt_sim.units import MM, N_PER_MM2

K = 2.0
WINDOWS = 6


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One tension, yaw sign, signal and travel window: rms of E over rms of u_val (ratio), and which run it came from;
    signed: the ratio with the sign of the mean error.
    """

    run: str
    signal: str
    tension: float
    sign: int
    window: tuple[float, float]
    ratio: float
    signed: float
    rms: float


def family_k(count: int) -> float:
    """k such that none of ``count`` independent normal errors exceeds k sigma, with probability 95 %."""
    return float(-ndtri(0.025 / max(count, 1)))


def validation_uncertainty(bench: Workbench) -> np.ndarray:
    """u_val, one sigma, of every sample, shape (R, S, n) [m or rad]."""
    samples, noise = bench.samples, _noise_variance(bench)
    shapes = np.sum(bench.shapes**2, axis=0)
    for s, signal in enumerate(samples.signals):  # a zero that is read off the record is as uncertain as a reading
        read = zero_is_read(samples, signal)
        shapes[read, s] += (noise[:, s] - zero_sigmas(samples, signal) ** 2)[read, None]
    return np.sqrt(noise[..., None] + np.maximum(shapes, 0.0) + np.sum(bench.shared**2, axis=0) + bench.march_error**2)


def _noise_variance(bench: Workbench) -> np.ndarray:
    """Variance of the noise in every run and signal (R, S), white and wander."""
    samples, levels = bench.samples, bench.levels
    white = np.asarray(levels.white) * [s.white for s in samples.signals]
    wander = np.asarray(levels.wander) * [s.wander_sd for s in samples.signals]
    return white**2 / samples.per_bin[:, None] + wander**2


def cells(bench: Workbench, values: np.ndarray) -> list[Cell]:
    """The map's cells for predictions ``values`` (R, S, n)."""
    samples, u_val = bench.samples, validation_uncertainty(bench)
    edges = window_edges(bench)
    found = []
    for r, run in enumerate(samples.runs):
        for s, signal in enumerate(samples.signals):
            error = values[r, s] - samples.y[r, s]
            for low, high in pairwise(edges):
                inside = (samples.travel[r] >= low) & (samples.travel[r] <= high) & np.isfinite(error)
                if not inside.any():
                    continue
                rms = float(np.sqrt(np.mean(error[inside] ** 2)))
                floor = float(np.sqrt(np.mean(u_val[r, s][inside] ** 2)))
                found.append(
                    Cell(
                        run=run.name,
                        signal=signal.name,
                        tension=run.tension / N_PER_MM2,
                        sign=int(np.sign(run.yaw)),
                        window=(float(low), float(high)),
                        ratio=rms / floor,
                        signed=float(np.copysign(rms / floor, np.mean(error[inside]))),
                        rms=rms,
                    )
                )
    return found


def window_edges(bench: Workbench) -> np.ndarray:
    """Edges of the travel windows [m]."""
    return np.linspace(0.0, bench.samples.end, WINDOWS + 1)


def worst_sentence(c: Cell, count: int, kinds: Mapping[str, Kind]) -> str:
    """The worst of ``count`` cells in a sentence."""
    sign = {1: "> 0", -1: "< 0", 0: "= 0"}[c.sign]
    where = f"{c.signal} of run {c.run} ({c.tension:g} N/mm2, yaw {sign}, {c.window[0]:.0f}-{c.window[1]:.0f} m)"
    if c.ratio <= family_k(count):
        return f"Nowhere beyond the uncertainty of the comparison; closest in {where}: E = {c.ratio:.1f} u_val."
    size = f"{KILO * c.rms:.2g} {UNITS[kinds[c.signal]]}"
    return f"Worst in {where}: off by {size}, {c.ratio:.0f} times the measurement uncertainty."


def boundary(found: list[Cell]) -> tuple[float | None, str]:
    """The tension at which the model stops being adequate [N/mm2], where there is one, and a sentence."""
    tensions = sorted({c.tension for c in found})
    worst = np.array([max(c.ratio for c in found if c.tension == t) for t in tensions])
    k = family_k(len(found))
    good = worst <= k
    span = f"{tensions[0]:g} to {tensions[-1]:g} N/mm2"
    if good.all():
        return None, f"Cell by cell within the uncertainty of the comparison at every tension measured ({span})."
    if not good.any():
        return None, f"Inadequate at every tension measured ({span})."
    flips = np.flatnonzero(np.diff(good.astype(int)))
    if len(flips) > 1:
        bad = ", ".join(f"{t:g}" for t, fits in zip(tensions, good, strict=True) if not fits)
        return None, f"Inadequate at {bad} N/mm2."
    n = int(flips[0])
    part = (np.log(k) - np.log(worst[n])) / (np.log(worst[n + 1]) - np.log(worst[n]))
    at = float(np.exp(np.log(tensions[n]) + part * np.log(tensions[n + 1] / tensions[n])))
    limit = f"|E| <= {k:.1f} u_val; measured at {span}"
    if good[-1]:
        return at, f"Adequate above {at:.3g} N/mm2 ({limit})."
    return at, f"Inadequate above {at:.3g} N/mm2; below it the error does not exceed the uncertainty ({limit})."


def locate_failure(bench: Workbench, values: np.ndarray) -> Where:
    """The worst cell, the boundary in tension, and both in a sentence, for predictions ``values`` (R, S, n)."""
    found = cells(bench, values)
    worst, (at, words) = max(found, key=lambda c: c.ratio), boundary(found)
    return Where(
        worst=Worst(run=worst.run, signal=worst.signal, travel=worst.window, ratio=worst.ratio),
        sentence=worst_sentence(worst, len(found), {s.name: s.kind for s in bench.samples.signals}),
        boundary=None if at is None else at * N_PER_MM2,
        boundary_sentence=words,
    )


# Errors of every run, and over all.

FIRST = 0.1 * MM  # and 0.1 mrad of a tilt
LEAST = 5  # samples


def features(travel: np.ndarray, y: np.ndarray) -> Features:
    """Features of one record [m or rad] against travel [m], both (n,).

    Overshoot is the largest distance beyond the line that the late record lies on, in the direction of motion.
    """
    keep = np.isfinite(y)
    travel, y = travel[keep], y[keep]
    if len(y) < LEAST:
        return Features()
    late = travel >= travel[-1] - LATE_SHARE * (travel[-1] - travel[0])
    slope, start = np.polyfit(travel[late], y[late], 1)
    beyond = (y - (start + slope * travel)) * np.sign(y[-1] if y[-1] != 0 else 1.0)
    moved = np.flatnonzero(np.abs(y) >= FIRST)
    return Features(
        late_rate=float(slope),
        first_move=float(travel[moved[0]]) if len(moved) else None,
        overshoot=float(max(beyond.max(), 0.0)),
    )


WORSE = 1.5  # a run counts as worse only beyond this many times its floor


def run_errors(bench: Workbench, before: np.ndarray, after: np.ndarray) -> tuple[RunError, ...]:
    """Every run and signal that was measured; before and after (R, S, n) are predictions."""
    floor = validation_uncertainty(bench)
    rows = []
    for r, run in enumerate(bench.samples.runs):
        for s, signal in enumerate(bench.samples.signals):
            y, travel = bench.samples.y[r, s], bench.samples.travel[r]
            if not np.isfinite(y).any():
                continue
            first, then = (_rms(y - values[r, s]) for values in (before, after))
            least = _rms(np.where(np.isfinite(y), floor[r, s], np.nan))
            rows.append(
                RunError(
                    run=run.name,
                    signal=signal.name,
                    kind=signal.kind,
                    tension=run.tension,
                    yaw=run.yaw,
                    use=run.use,
                    before=first,
                    after=then,
                    floor=least,
                    worse=bool(then > first and then > WORSE * least),
                    measured=features(travel, y),
                    modelled=features(travel, after[r, s]),
                )
            )
    return tuple(rows)


def overall_errors(bench: Workbench, before: np.ndarray, after: np.ndarray) -> Errors | None:
    """rms of the lateral signals before and after, over fitted and hold-out runs, and the noise floor.

    None when there is no lateral signal.
    """
    samples = bench.samples
    there = np.isfinite(samples.y) & np.array([s.kind == "lateral" for s in samples.signals])[None, :, None]
    if not there.any():
        return None
    fitted = np.array([r.use == "fit" for r in samples.runs])[:, None, None]

    def change(kept: np.ndarray) -> Change | None:
        first, then = (_rms((samples.y - values)[kept]) for values in (before, after))
        return Change(before=first, after=then) if kept.any() else None

    floor = _rms(validation_uncertainty(bench)[there])
    return Errors(noise_floor=floor, fit=change(there & fitted), held_out=change(there & ~fitted))


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(x**2))) if x.size else float("nan")


# Errors once every run's own zero, gain and settings, and the belt's stiffness, are what they most likely are.
#
# A sensor's zero or a tension one sigma off moves a whole record by more than most effects do, and no effect can take
# that away: in plain rms a right effect may even make it larger. So what is told of an error before and after is what
# the readings do not ascribe to these, each within its stated uncertainty (the mean of its posterior, run by run); and
# the noise floor is what a perfect model would leave of it.


class ErrorsWithoutNuisances:
    """Nuisances of every run of a workbench, and what remains beside them.

    shapes (K, R, S, n): in units of one sigma; posterior (R, K, K): their covariance after readings; taken
    (R, K, S, n): how much of each a reading stands for.
    """

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench
        samples, metric = bench.samples, bench.metric
        if any(r.use != "fit" for r in samples.runs):  # the metric is blind to runs that were held out
            metric = metric_of(samples, bench.levels, bench.shapes, bench.shared)
        self.shapes = np.concatenate([bench.shapes, bench.shared])
        columns = metric.noise_white(self.shapes).swapaxes(0, 1)  # (R, K, S * n)
        self.posterior = np.linalg.inv(columns @ columns.swapaxes(1, 2) + np.eye(len(self.shapes)))
        runs, signals, n = samples.y.shape
        onto = (self.posterior @ columns).reshape(runs, -1, signals, 1, n)
        self.taken = np.matmul(onto, metric.roots[:, None])[..., 0, :]
        lateral = np.array([s.kind == "lateral" for s in samples.signals])
        self.there = np.isfinite(samples.y) & lateral[None, :, None]

    def remove_nuisances(self, errors: np.ndarray, runs: np.ndarray) -> np.ndarray:
        """Errors (r, S, n) of some runs (R,) without what their nuisances most likely make of them."""
        size = np.einsum("rksn,rsn->rk", self.taken[runs], np.where(np.isfinite(errors), errors, 0.0))
        return errors - np.einsum("rk,krsn->rsn", size, self.shapes[:, runs])

    @property
    def floor(self) -> float:
        """rms of the lateral errors of a perfect model [m]."""
        known = np.einsum("krsn,rkl,lrsn->rsn", self.shapes, self.posterior, self.shapes)
        variance = _noise_variance(self.bench)[..., None] - known
        return _rms(np.sqrt(np.maximum(variance, 0.0) + self.bench.march_error**2)[self.there])

    def rms(self, left_out: Iterable[Condition]) -> float:
        """Of the lateral errors of held-out conditions [m]."""
        return _rms(np.concatenate([self.remove_nuisances(c.errors, c.out)[self.there[c.out]] for c in left_out]))


def errors_of(base_bench: Workbench, base: Fit, bench: Workbench, fit: Fit) -> Errors:
    """The fall of the error from ``base`` to ``fit``, each on its workbench, over conditions that hold-out can test."""
    over_all = overall_errors(bench, base.values, fit.values)
    assert over_all is not None  # a diagnosis has a lateral signal
    own, without, left_out = ErrorsWithoutNuisances(bench), held_out(base_bench, base), held_out(bench, fit)
    untestable = tuple(name for name, c in left_out.items() if not c.testable)
    tested = [name for name in left_out if name not in untestable] or list(left_out)
    before, after = ([held[name] for name in tested] for held in (without, left_out))
    return replace(
        over_all,
        held_out=Change(before=lateral_rms(before), after=lateral_rms(after)),
        by_condition={
            name: Change(before=lateral_rms([without[name]]), after=lateral_rms([c])) for name, c in left_out.items()
        },
        untestable=untestable,
        own=OwnChange(before=own.rms(before), after=own.rms(after), floor=own.floor),
    )
