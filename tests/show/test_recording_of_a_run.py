"""A recording of a real 3D run, read back from its file, shows what the run's curves say."""

import numpy as np
import pytest
from paper_cases import YAW, paper_case
from read_back import read_back

from belt_sim.show.geometry import tilt
from belt_sim.show.rerun import RerunObserver
from belt_sim.space import Options
from belt_sim.space.native import run_native
from belt_sim.units import MM
from studies.paper.case import ROPE_EXAMPLE

TRAVEL, EVERY = 0.3, 0.05  # [m]
CENTRE_DISTANCE, WIDTH = 2.0, 0.2  # [m]
#: a row of the curves is the mean over a millimetre of travel
SHORT = Options(dx=0.034, run_in=0.3, settle=0.5, acceleration=2.0, sample=1e-3, frame=EVERY)

SINGLE = 1e-6  # [m] Rerun keeps positions in single precision: half a unit in the last place at 2 m is 1.2e-7 m
#: [m] of travel: a frame is logged at a whole millimetre, and the belt moves up to 1.1 mm a step
NEAR = 2e-3
MIDDLE = 0.06  # [m] from mid-span: cross-sections that tilt alike, within 1 %


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """(what the file says, the curves) of 0.3 m on the short rig."""
    path = tmp_path_factory.mktemp("run") / "belt.rrd"
    case = paper_case(60, -YAW, ROPE_EXAMPLE)
    curves = run_native(case, travel=TRAVEL, options=SHORT, observers=(RerunObserver(path, every=EVERY),))
    return read_back(path, "runs/60_N_mm2/yaw_-0.042_deg/belt"), curves


def rows_near(curves, travel, values):
    """Least and most of the curve's values, shape (k, n), within NEAR of a travel [m]; two arrays (k,)."""
    near = np.abs(curves.travel - travel) <= NEAR
    assert near.any()
    return values[:, near].min(axis=1), values[:, near].max(axis=1)


def frames(logged):
    """(travel [m], left, right, tail x) of each picture; the first is taken at travel 0, before the yaw."""
    strips = logged["machine/true/belt/edges:LineStrips3D:strips"]
    places = logged["machine/true/tail:Transform3D:translation"].values
    for travel, edges, place in zip(strips.travel_mm * MM, strips.values, places, strict=True):
        left, right = (np.asarray(e, float) for e in edges)
        yield travel, left, right, float(np.ravel(place)[0])


def at_axis(edge, x, upper):
    """y [m] where the upper or the lower part of an edge passes x [m]."""
    ahead, above = edge[:, 0] - x, (edge[:, 2] > 0.0) == upper
    (i,) = np.flatnonzero((ahead[:-1] * ahead[1:] <= 0.0) & above[:-1] & (ahead[:-1] != ahead[1:]))
    share = ahead[i] / (ahead[i] - ahead[i + 1])
    return edge[i, 1] + share * (edge[i + 1, 1] - edge[i, 1])


def points(edge, tail_x):
    """y of an edge at points 1-4 [m]."""
    places = ((tail_x, True), (tail_x, False), (0.0, False), (0.0, True))
    return np.array([at_axis(edge, x, upper) for x, upper in places])


def test_points_in_the_series_are_those_of_the_curves(run):
    logged, curves = run
    shown = np.array([np.ravel(logged[f"series/y/y{k + 1}:Scalars:scalars"].values) for k in range(4)]) * MM
    travels = logged["series/y/y1:Scalars:scalars"].travel_mm * MM
    assert len(travels) == 7  # 0, 50 .. 250 mm, and the end
    for travel, moved in zip(travels, (shown - shown[:, :1]).T, strict=True):
        least, most = rows_near(curves, travel, curves.y)
        assert np.all((moved >= least - SINGLE) & (moved <= most + SINGLE)), travel
    assert -shown[0, -1] > 30 * SINGLE  # the yaw has moved point 1


def test_both_edges_pass_the_points_of_the_curves(run):
    logged, curves = run
    first = None
    for travel, left, right, tail_x in frames(logged):
        seen = np.array([points(left, tail_x), points(right, tail_x)])
        np.testing.assert_allclose(seen[0] - seen[1], WIDTH, rtol=1e-4)  # cos(tilt), and 1e-4 of lateral strain
        first = seen if first is None else first
        least, most = rows_near(curves, travel, curves.y)
        middle = (seen - first).mean(axis=0)
        assert np.all((middle >= least - SINGLE) & (middle <= most + SINGLE)), travel


def test_the_edges_tilt_like_the_curves(run):
    logged, curves = run
    largest = np.abs(curves.tilt).max()
    for travel, left, right, _ in frames(logged):
        angles, middle = tilt(left, right), 0.5 * (left + right)
        mid_span = np.abs(middle[:, 0] - 0.5 * CENTRE_DISTANCE) < MIDDLE
        least, most = rows_near(curves, travel, curves.tilt)
        for span, upper in enumerate((True, False)):
            seen = angles[mid_span & ((middle[:, 2] > 0.0) == upper)]
            assert np.ptp(seen) < 0.1 * largest
            assert seen.max() + SINGLE / WIDTH >= least[span], (travel, span)
            assert seen.min() - SINGLE / WIDTH <= most[span], (travel, span)
    assert largest > 1e-3
