"""A head and a tail pulley of different size: every wrap is counted where it lies."""

from dataclasses import replace

import numpy as np
import pytest
from virtual_bench import YAW, plan_of

from belt_sim.campaign import Quantity
from belt_sim.virtual_rig.faults import EdgeProfileFault, WeldFault
from belt_sim.virtual_rig.line import RUN_UP
from belt_sim.virtual_rig.march import BeltMarch, TrueErrors, perfect_reading, true_line
from belt_sim.virtual_rig.plan import TEST_RIG, RunSetting

MACHINE = replace(TEST_RIG, head_radius=Quantity(value=0.12), tail_radius=Quantity(value=0.30))


def line_from(direction: float = 1.0, yaw: float = YAW):
    """One run of the flat belt."""
    plan = replace(plan_of(RunSetting(tension=40e6, yaw=yaw, direction=direction)), machine=MACHINE)
    return true_line(plan, "beam_th2", TrueErrors())


def ways(line) -> list[tuple[str, str, np.ndarray]]:
    """Points in the order in which the belt passes them, and the way from each to the next [m]."""
    order = "4123" if line.direction[0] > 0 else "3214"
    after = [line.span_length, line.wrap_tail, line.span_length, line.wrap_head]
    return [(f"point_{a}", f"point_{b}", w) for a, b, w in zip(order, order[1:] + order[0], after, strict=True)]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_point_behind_a_wrap_shows_what_ran_up_one_wrap_before(direction):
    line = line_from(direction)
    history, s = BeltMarch(line, (), 30.0), np.linspace(2.0, 30.0, 57)[:, None]
    for first, then, wrap in ways(line)[1::2]:
        ran_up = perfect_reading(history, (), first, s - wrap)
        assert ran_up.max() > 1e-3  # [m]
        np.testing.assert_allclose(perfect_reading(history, (), then, s), ran_up, atol=1e-15)


def test_steady_travel_keeps_the_slope_of_the_whole_belt():
    """Late, all points drift alike: y_1 - y_4 and y_3 - y_2 are what the spans make of it, the wraps do the rest."""
    line = line_from()
    history, s = BeltMarch(line, (), 500.0), np.array([[500.0]])
    y = {k: perfect_reading(history, (), f"point_{k}", s).item() for k in "1234"}
    w = (y["1"] - perfect_reading(history, (), "point_1", s - 50.0).item()) / 50.0
    assert y["1"] - y["2"] == pytest.approx(w * line.wrap_tail.item(), rel=1e-3)
    assert y["3"] - y["4"] == pytest.approx(w * line.wrap_head.item(), rel=1e-3)
    row = line.span()[0][RUN_UP, :, 0]
    w0, w1 = -row[1] / row[2], -row[3] / row[2]
    assert w == pytest.approx(YAW * (w1 - w0) / line.belt_length.item(), rel=2e-3)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_edge_passes_the_points_in_turn(direction):
    line, profile = line_from(direction), EdgeProfileFault(cos1=2e-4, sin2=1e-4)
    s = np.linspace(0.0, 50.0, 101)[:, None]
    for first, then, way in ways(line):
        shift = profile.edge(then, s + way, line) - profile.edge(first, s, line)
        np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-15)
        assert np.ptp(profile.edge(first, s, line)) > 2e-4


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_weld_bends_the_run_ups_as_it_passes_them(direction):
    """From the middle of the tail-bound span over the tail pulley, and a wrap and a span on over the head pulley."""
    line = line_from(direction, yaw=0.0)
    above = line.span_length.item() / 2
    weld = WeldFault(angle=1e-3, at=above if direction > 0 else 3 * above + line.wrap_tail.item())
    history, s = BeltMarch(line, [weld], 25.0), np.linspace(0.0, 25.0, 2501)[:, None]
    tail, head = ("point_1", "point_3") if direction > 0 else ("point_2", "point_4")
    for place, passes in ((tail, line.span_length / 2), (head, 1.5 * line.span_length + line.wrap_tail)):
        turns = np.abs(np.diff(perfect_reading(history, (), place, s)[:, 0], n=2))
        assert s[1 + np.argmax(turns), 0] == pytest.approx(passes.item(), abs=0.1)
