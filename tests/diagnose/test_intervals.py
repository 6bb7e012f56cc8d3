"""Intervals by likelihood, where a number enters in a curved way: against what can be worked out by hand."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.plausibility import covariance_of, profile_intervals
from belt_sim.effects.base import Parameter
from belt_sim.results.estimates import COVERAGE_95, Estimate

WIDE = (-1e6, 1e6)


class Curved:
    """Two readings of two numbers: bend(a) + b and b, each with noise of one."""

    id = "curved"
    parameters = {
        "a": Parameter(unit="1", meaning="", plausible=WIDE, scale=1.0),
        "b": Parameter(unit="1", meaning="", plausible=WIDE, scale=1.0),
    }


@dataclass
class Bench:
    """A workbench of those readings."""

    bend: object
    plausible: tuple[float, float] = WIDE

    @property
    def fitted(self):
        return SimpleNamespace(y=self.forward.values(np.zeros((1, 2)))[0])

    @property
    def forward(self):
        cls = type("Curved", (Curved,), {"parameters": dict(Curved.parameters)})
        cls.parameters["a"] = replace(cls.parameters["a"], plausible=self.plausible)
        slots = [Slot(cls, n) for n in ("a", "b")]
        return SimpleNamespace(slots=slots, values=self.values)

    def values(self, vector):
        return np.stack([self.bend(vector[:, 0]) + vector[:, 1], vector[:, 1]], axis=1)[:, None, None, :]

    @property
    def metric(self):
        return SimpleNamespace(chi2=lambda rest: np.sum(rest**2, axis=(1, 2, 3)))

    def start(self, ids, vector, free):
        return Fit(ids=tuple(ids), free=list(free), vector=np.array(vector))

    def fit(self, starts):
        """The other number as it has to be: b for a held a; a for a held b by search."""
        return [self._best(f) for f in starts]

    def _best(self, f):
        points = np.repeat(f.vector[None], 200_001, axis=0)
        points[:, f.free[0]] = np.linspace(-10.0, 10.0, len(points))
        chi2 = self.metric.chi2(self.fitted.y - self.values(points))
        return replace(f, vector=points[np.argmin(chi2)], chi2=float(chi2.min()))


def interval_of(bend, slope, plausible=WIDE):
    bench = Bench(bend, plausible)
    columns = np.array([[slope, 0.0], [1.0, 1.0]])
    fit = Fit(ids=("curved",), free=[0, 1], vector=np.zeros(2), chi2=0.0, columns=columns)
    u = np.sqrt(np.diag(covariance_of(columns)))
    found = {"curved": {n: Estimate(0.0, float(u[k]), "1", True) for k, n in enumerate("ab")}}
    return profile_intervals(bench, fit, found)["curved"]


def test_a_straight_number_keeps_its_even_interval():
    found = interval_of(lambda a: 3.0 * a, 3.0)
    assert found["a"].interval is found["b"].interval is None


def test_a_curved_number_reaches_further_where_readings_change_less():
    found = interval_of(lambda a: 4.0 * (np.exp(a) - 1.0), 4.0)["a"]
    low, high = (np.log(1.0 + side * COVERAGE_95 * np.sqrt(2.0) / 4.0) for side in (-1.0, 1.0))
    assert found.interval_95 == pytest.approx((low, high), rel=0.07)
    assert -low > 1.5 * high


def test_an_interval_that_readings_leave_open_ends_where_machines_do():
    found = interval_of(lambda a: 2.0 * np.tanh(a) + 6.0 * np.minimum(a, 0.0), 2.0, plausible=(-9.0, 9.0))["a"]
    assert found.interval_95[1] == pytest.approx(9.0)
    assert -0.6 < found.interval_95[0] < -0.2


def test_a_number_of_which_readings_exclude_nothing_is_not_told():
    assert "a" not in interval_of(lambda a: np.tanh(a), 1.0, plausible=(-0.5, 9.0))


def test_two_numbers_that_do_the_same_are_not_known():
    alike = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0 + 1e-9]])
    assert np.sqrt(covariance_of(alike)[0, 0]) > 1e3
    faint = np.array([[1e-5, 0.0], [0.0, 1e5]])
    assert np.sqrt(np.diag(covariance_of(faint))) == pytest.approx([1e5, 1e-5])
