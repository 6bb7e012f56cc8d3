"""The error of a model against a campaign, run by run and over all, beside what the uncertainties alone make it."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from belt_sim import si
from belt_sim.curves import LATE_SHARE
from belt_sim.diagnosis.errors.failure_map import validation_uncertainty
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import Condition, held_out, lateral_rms
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import metric_of
from belt_sim.results.errors import Change, Errors, Features, OwnChange, RunError

FIRST = 0.1 * si.MM  # and 0.1 mrad of a tilt
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
        samples, levels = self.bench.samples, self.bench.levels
        variance = np.zeros(samples.y.shape)
        for s, signal in enumerate(samples.signals):
            white, wander, _ = levels.of_signal(s)
            variance[:, s] = (wander * signal.wander_sd) ** 2
            variance[:, s] += ((white * signal.white) ** 2 / samples.per_bin)[:, None]
        variance -= np.einsum("krsn,rkl,lrsn->rsn", self.shapes, self.posterior, self.shapes)
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
