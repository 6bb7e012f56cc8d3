"""Stations land at their distance, sink onto the circle without losing length, and leave the span on one line."""

import numpy as np
import pytest

from belt_sim.mujoco3d.loop import lift
from belt_sim.mujoco3d.state import Pose, Wrap
from belt_sim.mujoco3d.wrap import FIRST, LAST, is_caught, is_released, land_station, sink_ends
from belt_sim.scene_parts import PulleySurface

R, CHORD = 0.17, 0.025  # [m]
CIRCLE = 0.5 * CHORD / np.sin(0.5 * CHORD / R)  # of the stations
ROUNDING = 1e-12  # [m], of coordinates below 1 m
STRAIGHT = 5e-6  # [m]: the path is followed by angles one step old; on a circle the station would sink by 460 um


def wrapped(stations=12, **surface):
    """A wrap of stations on the circle, the last of them half a chord behind the tangent at the top."""
    wrap = Wrap.empty(PulleySurface(radius=R, **surface), CIRCLE - R, stations, 2)
    wrap.first, wrap.last = 1, stations - 2
    wrap.renumber()
    k = np.arange(stations)
    wrap.y[:] = [0.058, -0.058]
    wrap.angle[:] = ((k - (stations - 2) - 0.5) * CHORD / R)[:, None]
    wrap.r[:] = wrap.radius_at(wrap.y)
    wrap.tangent[:] = wrap.angle[1, 0] + 0.5 * CHORD / R, 0.0
    return wrap, Pose(np.zeros(3), np.eye(3), 0.0)


def chords(wrap, pose):
    return np.linalg.norm(np.diff(wrap.place(pose), axis=0), axis=2)


@pytest.mark.parametrize("surface", [{}, {"taper": 1e-3}, {"crown": 0.05}])
def test_landing_keeps_chord_and_mean_height(surface):
    wrap, pose = wrapped(**surface)
    beside = wrap.place(pose)[0]
    nodes = beside + np.array([-0.0242, 1e-5, -0.0062]) + [[0.0, 0.0, 2e-6], [0.0, 0.0, -2e-6]]
    length = np.linalg.norm(nodes - beside, axis=1)
    assert land_station(wrap, pose, FIRST, nodes, beside, CHORD) == 0
    placed = wrap.place(pose)
    assert wrap.first == 0
    assert np.linalg.norm(placed[0] - placed[1], axis=1) == pytest.approx(length, abs=ROUNDING)
    above = np.diff(wrap.r[0] - wrap.radius_at(wrap.y[0]))
    assert above == pytest.approx(0.0, abs=ROUNDING)
    assert np.linalg.norm(placed[0] - nodes, axis=1).max() < 1e-4


def test_path_is_smooth_and_ends_on_the_circle():
    depth = np.linspace(-0.5, 6.0, 6501) * CHORD
    height = lift(depth, CHORD, R)
    slope = np.gradient(height, depth)
    assert np.abs(np.diff(slope)).max() < 3e-3 * CHORD / R
    assert height[depth > 4.5 * CHORD] == pytest.approx(0.0, abs=ROUNDING)
    line = (R + height[depth <= 0.5 * CHORD]) * np.cos(depth[depth <= 0.5 * CHORD] / R)
    assert line == pytest.approx(R, abs=ROUNDING)


@pytest.mark.parametrize("end", [FIRST, LAST])
def test_turning_pulley_keeps_lengths_and_lets_the_span_end_on_one_line(end):
    """The outermost station comes in (or goes out) along the tangent at the top while the pulley turns by a chord."""
    wrap, pose = wrapped()
    lengths, heights = chords(wrap, pose), []
    tangent = wrap.tangent[(end + 1) // 2]
    station = {FIRST: wrap.first, LAST: wrap.last}[end]
    start = tangent - end * 0.5 * CHORD / R - wrap.angle[station, 0]
    pose.spin = start
    for _ in range(8):  # from the circle onto the path
        sink_ends(wrap, pose, end, CHORD, 0.0)
    for step in np.linspace(0.0, 1.0, 41):
        pose.spin = start + end * step * CHORD / R
        sink_ends(wrap, pose, end, CHORD, 0.0)
        r, angle = wrap.r[station, 0], wrap.angle[station, 0] + pose.spin
        heights.append(r * np.cos(angle - tangent))
        assert chords(wrap, pose) == pytest.approx(lengths, abs=ROUNDING)
    assert np.ptp(heights) < STRAIGHT
    assert is_released(wrap, pose, end, CHORD) is False
    pose.spin += end * 0.05 * CHORD / R
    assert is_released(wrap, pose, end, CHORD) is True


def test_a_station_is_caught_half_a_chord_before_the_tangent():
    wrap, pose = wrapped()
    far, near = (
        np.array([[R * np.sin(a), y, R * np.cos(a)] for y in (0.058, -0.058)])
        for a in (wrap.tangent[0] - 0.6 * CHORD / R, wrap.tangent[0] - 0.4 * CHORD / R)
    )
    assert not is_caught(wrap, pose, FIRST, far, CHORD)
    assert is_caught(wrap, pose, FIRST, near, CHORD)
