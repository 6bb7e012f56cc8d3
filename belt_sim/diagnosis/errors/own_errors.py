"""Errors once every run's own zero, gain and settings, and the belt's stiffness, are what they most likely are.

A sensor's zero or a tension one sigma off moves a whole record by more than most effects do, and no effect can take
that away: in plain rms a right effect may even make it larger. So what is told of an error before and after is what
the readings do not ascribe to these, each within its stated uncertainty (the mean of its posterior, run by run); and
the noise floor is what a perfect model would leave of it.
"""

from collections.abc import Sequence

import numpy as np

from belt_sim.diagnosis.errors.run_errors import overall_errors
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import HeldOut
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import metric_of
from belt_sim.results.errors import Change, Errors, OwnChange


class OwnErrors:
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

    def less(self, errors: np.ndarray, runs: np.ndarray) -> np.ndarray:
        """Errors (r, S, n) of some runs (R,) without what their nuisances most likely make of them."""
        size = np.einsum("rksn,rsn->rk", self.taken[runs], np.where(np.isfinite(errors), errors, 0.0))
        return errors - np.einsum("rk,krsn->rsn", size, self.shapes[:, runs])

    @property
    def floor(self) -> float:
        """rms of the lateral errors of a perfect model [m]."""
        samples, levels = self.bench.samples, self.bench.levels
        variance = np.zeros(samples.y.shape)
        for s, signal in enumerate(samples.signals):
            white, wander, _ = levels.of(s)
            variance[:, s] = (wander * signal.wander_sd) ** 2
            variance[:, s] += ((white * signal.white) ** 2 / samples.per_bin)[:, None]
        variance -= np.einsum("krsn,rkl,lrsn->rsn", self.shapes, self.posterior, self.shapes)
        march = 0.0 if self.bench.march is None else self.bench.march.error**2
        return _rms(np.sqrt(np.maximum(variance, 0.0) + march)[self.there])

    def rms(self, held: HeldOut, names: Sequence[str]) -> float:
        """Of the lateral errors of the held-out conditions ``names`` [m]."""
        parts = [held.conditions[n] for n in names]
        return _rms(np.concatenate([self.less(c.left, c.out)[self.there[c.out]] for c in parts]))


def errors_of(bench: Workbench, base: Fit, base_held: HeldOut, fit: Fit, held: HeldOut) -> Errors:
    """The fall of the error from ``base`` to ``fit``, on ``bench``, over the conditions that hold-out can test."""
    over_all = overall_errors(bench, base.values, fit.values)
    assert over_all is not None  # a diagnosis has a lateral signal
    own, tested = OwnErrors(bench), held.tested
    return Errors(
        noise_floor=over_all.noise_floor,
        fit=over_all.fit,
        held_out=Change(before=base_held.over(tested), after=held.over(tested)),
        by_condition={n: Change(before=base_held.by_condition[n], after=rms) for n, rms in held.by_condition.items()},
        untestable=held.untestable,
        own=OwnChange(before=own.rms(base_held, tested), after=own.rms(held, tested), floor=own.floor),
    )


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2))) if x.size else float("nan")
