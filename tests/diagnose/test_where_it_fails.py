"""The sentences that say where a model fails."""

from dataclasses import replace
from statistics import NormalDist
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from linear_bench import REPEATS, WHITE, linear_bench

from belt_sim.campaign import SignalSheet
from belt_sim.diagnosis.errors import ErrorMap, locate_failure, run_errors

OF_THREE = NormalDist().inv_cdf(1.0 - 0.025 / 3)  # sigmas that none of three normal errors exceeds, with 95 %


def errors_at(*cells: tuple[float, float], sign: float = 1.0, signal: SignalSheet = WHITE) -> ErrorMap:
    """A run of one signal and travel window a cell (tension [N/mm2], ratio), whose rms error is ``ratio``
    millimetres."""
    ratio = np.array([r for _, r in cells])[:, None, None]
    runs = [SimpleNamespace(name=f"r{t:g}", tension=1e6 * t, yaw=1e-3 * sign) for t, _ in cells]
    samples: Any = SimpleNamespace(runs=runs, signals=[signal])
    return ErrorMap(samples, np.array([20.0, 30.0]), 1e-3 * ratio, sign * ratio)


def crossing(low: float, high: float, before: float, after: float, k: float) -> float:
    """Where a power law through (low, before) and (high, after) equals k."""
    exponent = np.log(after / before) / np.log(high / low)
    return low * (k / before) ** (1 / exponent)


@pytest.mark.parametrize(("count", "k"), [(1, 1.96), (3, OF_THREE), (10, 2.81), (100, 3.48)])
def test_many_cells_need_more_than_one(count, k):
    """The largest of so many normal errors is beyond k sigma once in twenty campaigns."""
    for ratio, said in ((k - 0.01, "Nowhere beyond the uncertainty"), (k + 0.01, "Worst in y1")):
        where = locate_failure(errors_at((7, ratio), *[(7, 0.1)] * (count - 1)), "Model strip")
        assert where.sentence.startswith(said)


def test_a_model_has_the_late_rate_of_a_record_where_that_was_read():
    """A shorter record is filled up with its last travel, where nothing was read."""
    bench = linear_bench(REPEATS)
    travel, y = bench.samples.travel.copy(), bench.samples.travel[:, None] ** 2
    travel[0, 20:], y[0, :, 20:] = travel[0, 19], np.nan
    shorter = replace(bench, samples=replace(bench.samples, travel=travel, y=y))
    for run in run_errors(shorter, y, travel[:, None] ** 2):
        assert run.modelled_rate == run.measured_rate


def test_a_model_that_fails_where_the_belt_is_slack():
    where = locate_failure(errors_at((7, 12.0), (14, 6.0), (28, 1.0)), "Model strip")
    at = crossing(14, 28, 6.0, 1.0, OF_THREE)
    assert where.boundary == pytest.approx(at * 1e6)
    assert where.boundary_sentence.startswith(f"Model strip is off below {at:.3g} N/mm2: rely on it above only")
    assert "measured at 7 to 28 N/mm2" in where.boundary_sentence


def test_a_model_that_fails_where_the_belt_is_tight():
    where = locate_failure(errors_at((7, 1.0), (14, 1.0), (28, 6.0)), "Model strip")
    at = crossing(14, 28, 1.0, 6.0, OF_THREE)
    assert where.boundary == pytest.approx(at * 1e6)
    assert where.boundary_sentence.startswith(f"Model strip is off above {at:.3g} N/mm2: rely on it below only")


@pytest.mark.parametrize(
    ("ratios", "faulty", "words"),
    [
        ((12.0, 6.0, 1.0), True, "off beyond the uncertainty at 7, 14 N/mm2; what was found acts at every tension."),
        ((1.0, 1.0, 6.0), True, "off beyond the uncertainty at 28 N/mm2; what was found acts at every tension."),
        ((5.0, 5.0, 5.0), False, "off at every tension measured (7 to 28 N/mm2)."),
        ((1.0, 5.0, 1.0), False, "off at 14 N/mm2."),
    ],
    ids=["a fault of slack belts", "a fault of tight belts", "everywhere", "one between good ones"],
)
def test_no_boundary_where_no_tension_parts_good_from_bad(ratios, faulty, words):
    where = locate_failure(errors_at(*zip((7, 14, 28), ratios, strict=True)), "Model strip", faulty=faulty)
    assert (where.boundary, where.boundary_sentence) == (None, f"Model strip is {words}")


def test_the_worst_cell_of_a_tension_decides():
    where = locate_failure(errors_at((7, 0.1), (7, 8.0), (28, 0.1), sign=-1.0), "Model strip")
    assert where.boundary is not None
    assert "y1 of run r7 (7 N/mm2, yaw < 0, 20-30 m): off by 8 mm, 8 times" in where.sentence


def test_tilt_is_told_in_milliradians():
    found = errors_at((7, 8.0), signal=replace(WHITE, name="tilt", at="tilt_upper", kind="tilt"))
    assert "off by 8 mrad" in locate_failure(found, "Model strip").sentence


def test_within_the_uncertainty_nothing_is_called_bad():
    where = locate_failure(errors_at((7, 1.2), (28, 1.2)), "Model strip")
    assert where.sentence.startswith("Nowhere beyond the uncertainty")
    assert where.boundary is None
    assert where.boundary_sentence.startswith("Cell by cell within the uncertainty of the comparison at every tension")
