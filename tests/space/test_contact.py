"""Which stations lie on a pulley, who waits while both belts slide, and where a limp belt leaves."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from pulley_bench import bare_belt, both, empty_wrap, on_jax, pose, surface

from belt_sim.space import chain
from belt_sim.space import wrap as wrap_module
from belt_sim.space.chain import run_off_line
from belt_sim.space.elastic import SlidingStiffness
from belt_sim.space.run import Command
from belt_sim.space.wrap import (
    HEAD,
    TAIL,
    BeltOnPulley,
    SlipState,
    axes_of,
    carry_wraps,
    cylinder_coordinates,
    slide_wrap,
    update_tangents,
)

R, CHORD, N = 0.17, 0.01, 120
ARC = np.pi * R  # of the belt that lies on a pulley whose spans are level
STEP = 1e-3  # [s]
NEAR = 0.01  # of kink x chord: the tangent point is found from a circle
SMALL = 0.02  # [rad], how well a direction is known from stations on both sides of a landing

pytestmark = pytest.mark.usefixtures("float64")


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
BELT = bare_belt([CYLINDER] * 2, CHORD, N)


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


@pytest.mark.parametrize("sign", [1, -1])
def test_stations_land_where_the_belt_comes_in_and_go_where_it_leaves(sign):
    begun, carry = 0.4 * CHORD, jax.jit(carry_wraps)
    _, wrap, at = laid(begun)
    pulleys, first, last = BeltOnPulley(both(wrap, wrap), BELT.surfaces, both(at, at)), [], []
    for travel in begun + sign * np.arange(0.0, 5.0, 0.1) * CHORD:
        nodes, s = nodes_at(travel)
        pulleys = pulleys._replace(pose=both(*[pose(spin=travel / R)] * 2))
        pulleys = carry(BELT, pulleys, (pulleys.pose, nodes), nodes, 0.0, 1.0, 0.0, STEP)
        first.append(s[int(pulleys.wrap.first[HEAD])] / CHORD)
        last.append((s[int(pulleys.wrap.last[HEAD])] - ARC) / CHORD)
    for places in (first, last):  # in chords from where the belt meets the pulley
        assert np.abs(places).max() < 0.65
    assert np.asarray(pulleys.wrap.tangent[HEAD]) == pytest.approx([0.0, np.pi], abs=SMALL)


def test_the_places_where_a_belt_meets_a_pulley_are_found_from_its_spans():
    nodes, wrap, at = laid()
    wrap.tangent[:] = 0.02, np.pi + 0.02
    errors, update = [], jax.jit(update_tangents)
    for _ in range(200):
        wrap = update(wrap, at, nodes, 0.05)
        errors.append(np.abs(np.asarray(wrap.tangent) - [0.0, np.pi]))
    assert np.all(np.diff(errors, axis=0) <= 1e-12)
    np.testing.assert_allclose(errors[-1], 0.0, atol=1e-5)


def test_belts_that_slide_on_both_pulleys_take_turns(monkeypatch):
    """On one pulley only it slides on in every step; how far counts for its own pulley."""

    def slipped(belt, pull, friction, speed, shaped, pulley, own):
        return pulley.wrap, own._replace(total=own.total + jnp.where(pulley.pose.centre[0] > 0.0, 10.0, 1.0))

    monkeypatch.setattr(wrap_module, "slide_wrap", slipped)
    monkeypatch.setattr(wrap_module, "carry_wraps", lambda belt, pulleys, *others: pulleys)
    monkeypatch.setattr(chain, "reading", lambda *given: jnp.zeros(18))
    nodes, wrap, at = laid()
    there = at._replace(centre=np.array([1.0, 0.0, 0.0]))
    none = np.zeros((2, 4, 4))
    belt = bare_belt([CYLINDER] * 2, CHORD, N, sliding_stiffness=SlidingStiffness(*[none] * 4))
    pulleys = BeltOnPulley(both(wrap, wrap), belt.surfaces, both(at, there))
    slip, waiting = on_jax(SlipState.none(2, N)), -1
    runs = Command(travel=0.0, yaw=np.zeros(2), share=0.0, speed=0.5, friction=0.2)

    def step(*slides):
        nonlocal slip, waiting
        before, slip = slip.total, slip._replace(sliding=jnp.array(slides, float))
        given = (slip, waiting), (at, nodes), nodes, 0.0 * nodes, 0.0, 1.0, runs, STEP
        _, slip, waiting, _, _ = chain.finish_step(belt, on_jax(pulleys), *given)
        return {which for which in (HEAD, TAIL) if slip.total[which] > before[which]}

    assert step(True, False) == step(False, True) == step(False, False) == {HEAD, TAIL}
    assert slip.total.tolist() == [3.0, 30.0]
    turns = [step(True, True) for _ in range(4)]
    assert turns[0] != turns[1]
    assert turns == [turns[0], turns[1]] * 2
    assert set.union(*turns) == {HEAD, TAIL}
    assert all(len(t) == 1 for t in turns)
    assert next(iter(turns[-1])) != waiting
    assert slip.total.tolist() == [5.0, 50.0]


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
    belt = bare_belt([CYLINDER] * 2, CHORD, N, sliding_stiffness=sliding)
    pulley, slip = BeltOnPulley(wrap, CYLINDER, at), jax.tree.map(lambda of: of[0], SlipState.none(2, N))
    fast, slide = np.sqrt(tension / (belt.mass[0] / CHORD)), jax.jit(slide_wrap)
    for share in (0.0, 0.5, 0.999):
        limit = aside / (tension * CHORD / R * (1.0 - share**2))  # the friction at which it just holds
        for near, slides in ((1.001, False), (0.9, True)):
            _, found = slide(belt, pull, near * limit, share * fast, 1.0, pulley, slip)
            assert (found.total != 0.0) == slides


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
    move, slope = run_off_line(on_jax(wrap), at, sign, nodes[..., k + sign], nodes[..., k + 8 * sign], CHORD)
    np.testing.assert_allclose(slope, -on, rtol=1e-6)  # counted against the travel
    line = lean[k + sign] * part / (1.0 + part)  # from the tangent point to the first free station
    np.testing.assert_allclose(move, line - lean[k], atol=NEAR * abs(off - on) * CHORD)
