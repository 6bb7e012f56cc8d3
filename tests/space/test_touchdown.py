"""Stations land at their distance, sink onto the circle without losing length, and leave the span on one line."""

from functools import partial
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from pulley_bench import both, empty_wrap, on_jax, places, pose, surface

from belt_sim.space.scene import lift
from belt_sim.space.wrap import (
    FIRST,
    LAST,
    OUTWARDS,
    BeltOnPulley,
    land_station,
    radius_at,
    release_stations,
    sink_ends,
)

R, CHORD = 0.17, 0.025  # [m]
CIRCLE = 0.5 * CHORD / np.sin(0.5 * CHORD / R)  # of the stations
ROUNDING = 1e-12  # [m], of coordinates below 1 m
STRAIGHT = 5e-6  # [m]: the path is followed by angles one step old; on a circle the station would sink by 460 um


pytestmark = pytest.mark.usefixtures("float64")
BELT = SimpleNamespace(chord=CHORD, shape=SimpleNamespace(zone=6))
LAND = jax.jit(partial(land_station, BELT, end=FIRST))


def wrapped(stations=12, **shape):
    """A wrap of stations on the circle, the last of them half a chord behind the tangent at the top."""
    cylinder, wrap = surface(R, CHORD, CIRCLE - R, **shape), empty_wrap(1, stations - 2, stations)
    wrap.y[:] = [[0.058], [-0.058]]
    wrap.angle[:] = (np.arange(stations) - (stations - 2) - 0.5) * CHORD / R
    wrap.r[:] = radius_at(cylinder, 1.0, wrap.y)
    wrap.tangent[:] = wrap.angle[0, 1] + 0.5 * CHORD / R, 0.0
    return wrap, cylinder, pose()


def landed_at(pulley, nodes):
    """The wrap with the station that comes next, in a step without a movement."""
    still = {"before": nodes, "nodes": nodes, "moved": 0.0, "shaped": 1.0}
    return LAND(pulley, pulley.pose, **still)


def chords(wrap, at):
    return np.linalg.norm(np.diff(places(wrap, at)), axis=1)


@pytest.mark.parametrize("shape", [{}, {"taper": 1e-3}, {"crown": 0.05}])
def test_landing_keeps_chord_and_mean_height(shape):
    wrap, cylinder, at = wrapped(**shape)
    wrap.tangent[FIRST] -= 1.2 * CHORD / R  # so that the next station is close enough
    beside, nodes = places(wrap, at)[..., 0], np.zeros((2, 3, 12))
    there = beside + np.array([-0.0242, 1e-5, -0.0062]) + [[0.0, 0.0, 2e-6], [0.0, 0.0, -2e-6]]
    nodes[..., 0], nodes[..., 1] = there, beside
    pulley = on_jax(BeltOnPulley(wrap, cylinder, at))
    landed = landed_at(pulley, nodes)
    placed = places(landed, at)
    assert landed.first == 0
    length = np.linalg.norm(there - beside, axis=1)
    assert np.linalg.norm(placed[..., 0] - placed[..., 1], axis=1) == pytest.approx(length, abs=ROUNDING)
    above = np.diff(landed.r[:, 0] - radius_at(cylinder, 1.0, landed.y[:, 0]))
    assert above == pytest.approx(0.0, abs=ROUNDING)
    assert np.linalg.norm(placed[..., 0] - there, axis=1).max() < 1e-4


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
    wrap, cylinder, at = wrapped()
    lengths, heights, outward = chords(wrap, at), [], OUTWARDS[end]
    tangent, station = wrap.tangent[end], (wrap.first, wrap.last)[end]
    start = tangent - outward * 0.5 * CHORD / R - wrap.angle[0, station]
    sink = jax.jit(partial(sink_ends, BELT, end=end))

    def sunk(spin):
        there = pose(spin=spin)
        return sink(on_jax(BeltOnPulley(wrap, cylinder, there)), 0.0, shaped=1.0), there

    for _ in range(8):  # from the circle onto the path
        wrap, at = sunk(start)
    for share in np.linspace(0.0, 1.0, 41):
        wrap, at = sunk(start + outward * share * CHORD / R)
        r, angle = wrap.r[0, station], wrap.angle[0, station] + at.spin
        heights.append(r * np.cos(angle - tangent))
        assert chords(wrap, at) == pytest.approx(lengths, abs=ROUNDING)
    assert np.ptp(heights) < STRAIGHT
    turned = pose(spin=at.spin + outward * 0.05 * CHORD / R)
    one, other = BeltOnPulley(wrap, cylinder, at), BeltOnPulley(wrap, cylinder, turned)
    assert (jax.jit(partial(release_stations, BELT))(both(one, other)).wrap.outer(end) - station).tolist() == [
        0,
        -outward,
    ]


def test_a_station_is_caught_half_a_chord_before_the_tangent():
    wrap, cylinder, at = wrapped()
    nodes = np.zeros((2, 3, 12))
    for chords_before, caught in ((0.6, False), (0.4, True)):
        a = wrap.tangent[0] - chords_before * CHORD / R
        nodes[..., 0] = [[R * np.sin(a), y, R * np.cos(a)] for y in (0.058, -0.058)]
        landed = landed_at(on_jax(BeltOnPulley(wrap, cylinder, at)), nodes)
        assert landed.first == wrap.first - caught
