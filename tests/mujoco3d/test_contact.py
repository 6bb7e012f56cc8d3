"""Which stations lie on a pulley, who waits while both belts slide, and where a limp belt leaves."""

from types import SimpleNamespace

import numpy as np
import pytest
from pulley_bench import empty_wrap, pose, surface

from belt_sim.mujoco3d import contact
from belt_sim.mujoco3d.friction import SlidingStiffness
from belt_sim.mujoco3d.rope import run_off_line
from belt_sim.mujoco3d.state import RunState
from belt_sim.mujoco3d.wrap import HEAD, TAIL, axes_of, cylinder_coordinates, update_tangents

R, CHORD, N = 0.17, 0.01, 120
ARC = np.pi * R  # of the belt that lies on a pulley whose spans are level
STEP = 1e-3  # [s]
NEAR = 0.01  # of kink x chord: the tangent point is found from a circle
SMALL = 0.02  # [rad], how well a direction is known from stations on both sides of a landing


def stations(travel):
    """Places [m] of a belt that comes along the top, goes round at +x and runs back below, shape (N, 2, 3), and how
    far each station is behind the place where it meets the pulley."""
    s = (np.arange(N) - 30) * CHORD + travel
    turn = np.clip(s, 0.0, ARC) / R
    before, behind = np.minimum(s, 0.0), np.maximum(s - ARC, 0.0)
    x, z = R * np.sin(turn) + before - behind, R * np.cos(turn)
    lines = [np.stack([x, np.full(N, y), z], axis=-1) for y in (0.05, -0.05)]
    return np.stack(lines, axis=1), s


CYLINDER = surface(R, CHORD)
BELT = SimpleNamespace(chord=CHORD, mass=np.full(2, 0.1), sliding_stiffness=None, each_surface=[CYLINDER])


def nodes_at(travel):
    """Nodes (2, 3, N) [m], and how far each station is behind the place where the belt meets the pulley."""
    places, s = stations(travel)
    return np.moveaxis(places, 0, -1), s


def laid(extra=0.0):
    """Nodes, their wrap held from half a chord before the belt meets the pulley to half a chord behind, its pose."""
    (nodes, s), at = nodes_at(extra), pose(spin=extra / R)
    held = np.flatnonzero((s > -0.5 * CHORD) & (s < ARC + 0.5 * CHORD))
    wrap = empty_wrap(int(held[0]), int(held[-1]), N)
    wrap.r[:, held], wrap.y[:, held], wrap.angle[:, held] = cylinder_coordinates(nodes[:, :, held], at)
    wrap.angle[:, held[-1]] = wrap.angle[:, held[-2]] + CHORD / R  # this one may stand in the straight part
    wrap.tangent[:] = 0.0, np.pi
    return nodes, wrap, at


def running(wraps, poses, speed=0.0):
    still = np.zeros((N, 2, 3))
    return RunState(
        joints=np.zeros(5), joint_rates=np.zeros(5), slides=still, slide_rates=still, poses=poses, wraps=wraps,
        layers=[np.zeros((2, 2, 2)) for _ in wraps], slip_increments=[np.zeros((2, 2, N)) for _ in wraps], travel=0.0,
        shaped=1.0, speed=speed,
    )  # fmt: skip


@pytest.mark.parametrize("sign", [1, -1])
def test_stations_land_where_the_belt_comes_in_and_go_where_it_leaves(sign):
    begun = 0.4 * CHORD
    _, wrap, at = laid(begun)
    state, first, last = running([wrap], [at]), [], []
    for travel in begun + sign * np.arange(0.0, 5.0, 0.1) * CHORD:
        nodes, s = nodes_at(travel)
        state.poses = [pose(spin=travel / R)]
        contact.update_contact(BELT, state, nodes, np.zeros_like(nodes), STEP, np.inf)
        first.append(s[state.wraps[0].first] / CHORD)
        last.append((s[state.wraps[0].last] - ARC) / CHORD)
    for places in (first, last):  # in chords from where the belt meets the pulley
        assert np.abs(places).max() < 0.65
    assert state.wraps[0].tangent == pytest.approx([0.0, np.pi], abs=SMALL)


def test_the_places_where_a_belt_meets_a_pulley_are_found_from_its_spans():
    nodes, wrap, at = laid()
    wrap.tangent[:] = 0.02, np.pi + 0.02
    errors = []
    for _ in range(200):
        wrap = update_tangents(wrap, at, nodes, 0.05)
        errors.append(np.abs(wrap.tangent - [0.0, np.pi]))
    assert np.all(np.diff(errors, axis=0) <= 1e-12)
    np.testing.assert_allclose(errors[-1], 0.0, atol=1e-5)


def test_belts_that_slide_on_both_pulleys_take_turns(monkeypatch):
    """On one pulley only it slides on in every step; how far counts for its own pulley."""
    asked = []

    def slipped(belt, state, which, *others):
        asked.append(which)
        return (1.0, 10.0)[which]

    monkeypatch.setattr(contact, "slide_wrap", slipped)
    monkeypatch.setattr(contact, "change_end", lambda belt, pulley, *others: pulley.wrap)
    nodes, wrap, at = laid()
    state = running([wrap, wrap], [at, at], speed=0.5)

    def step(head_slides, tail_slides):
        asked.clear()
        for which, slides in ((HEAD, head_slides), (TAIL, tail_slides)):
            state.slip_increments[which][:] = float(slides)
        belt = SimpleNamespace(**vars(BELT) | {"sliding_stiffness": "some", "each_surface": [CYLINDER] * 2})
        contact.update_contact(belt, state, nodes, 0.0 * nodes, STEP, 0.2)
        return set(asked)

    assert step(True, False) == step(False, True) == step(False, False) == {HEAD, TAIL}
    assert state.slip.tolist() == [3.0, 30.0]
    turns = [step(True, True) for _ in range(4)]
    assert turns[0] != turns[1]
    assert turns == [turns[0], turns[1]] * 2
    assert set.union(*turns) == {HEAD, TAIL}
    assert all(len(t) == 1 for t in turns)
    assert next(iter(turns[-1])) != state.waiting_pulley
    assert state.slip.tolist() == [5.0, 50.0]


def test_a_belt_presses_less_the_faster_it_runs():
    """T/R less rho v^2/R of a metre: at v^2 = T / (mass per length) nothing presses, so that a small force slides."""
    tension, aside, rigid = 2000.0, 1e-3, 1e8  # [N] of a line of nodes, [N], [N/m]
    nodes, wrap, at = laid()
    held = np.arange(wrap.first, wrap.last + 1)
    turned, pull = wrap.angle[:, held], np.zeros_like(nodes)
    pull[:, 0, held], pull[:, 2, held] = -tension * CHORD / R * np.array([np.sin(turned), np.cos(turned)])
    pull[:, 1, held] = aside
    own, none = rigid * np.stack([np.eye(4)] * 2), np.zeros((2, 4, 4))
    sliding = SlidingStiffness(own, after=none, relief_first=none, relief_last=none)
    belt = SimpleNamespace(**vars(BELT) | {"sliding_stiffness": sliding})
    fast = np.sqrt(tension / (BELT.mass[0] / CHORD))
    for share in (0.0, 0.5, 0.999):
        limit = aside / (tension * CHORD / R * (1.0 - share**2))  # the friction at which it just holds
        for near, slides in ((1.001, False), (0.9, True)):
            state = running([wrap], [at], speed=share * fast)
            moved = contact.slide_wrap(belt, state, 0, pull, near * limit)
            assert (moved != 0.0) == slides


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("part", [0.3, -0.3])
def test_a_limp_belt_leaves_on_the_line_from_the_tangent_point(sign, part):
    """Its lines lean by one angle on the pulley, by another in the span; the kink is at the tangent point, though
    the last station held is before or behind it."""
    on, off, turn = 1e-3, -4e-3, 5e-3
    at = pose(axes_of(CYLINDER, turn, 0.0, 0.0), 0.3)
    k, end = (30 + int(ARC / CHORD), ARC) if sign > 0 else (30, 0.0)
    rest, s = stations(end + sign * part * CHORD - (k - 30) * CHORD)
    ahead = sign * (s - end)  # of the tangent point, along the travel; part of a chord at station k
    lean = np.where((ahead > 0.0) & (np.arange(N) != k), off, on) * ahead
    places = rest.copy()
    places[..., 1] += lean[:, None]
    nodes = np.moveaxis(places @ at.axes.T, 0, -1)
    wrap = empty_wrap(*((k - 20, k) if sign > 0 else (k, k + 20)), N)
    wrap.r[:], wrap.y[:], wrap.angle[:] = cylinder_coordinates(nodes, at)
    move, slope = run_off_line(wrap, at, sign, nodes[..., k + sign], nodes[..., k + 8 * sign], CHORD)
    np.testing.assert_allclose(slope, -on, rtol=1e-6)  # counted against the travel
    line = lean[k + sign] * part / (1.0 + part)  # from the tangent point to the first free station
    np.testing.assert_allclose(move, line - lean[k], atol=NEAR * abs(off - on) * CHORD)
