"""Which stations lie on a pulley, who waits while both belts slide, and where a limp belt leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.mujoco3d import wrap as contact
from belt_sim.mujoco3d.engine import place_run_off_stations
from belt_sim.mujoco3d.mesh import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import HEAD, TAIL, Pose, Wrap
from belt_sim.mujoco3d.wrap import anchor_station
from belt_sim.scene_parts import PulleySurface

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


def mesh_of(rest):
    mass = np.full(2, 0.1)
    return Mesh(rest=rest, laid=rest, line_stiffness=mass, line_y=np.array([0.05, -0.05]), mass=mass, chord=CHORD)


def laid(extra=0.0):
    """A mesh, its wrap held from half a chord before the belt meets the pulley to half a chord behind, its pose."""
    places, s = stations(extra)
    wrap, pose = Wrap.empty(PulleySurface(radius=R), 0.0, N, 2), Pose(np.zeros(3), np.eye(3), extra / R)
    held = np.flatnonzero((s > -0.5 * CHORD) & (s < ARC + 0.5 * CHORD))
    wrap.first, wrap.last = int(held[0]), int(held[-1])
    wrap.renumber()
    for k in held:
        anchor_station(wrap, pose, k, places[k])
    wrap.angle[held[-1]] = wrap.angle[held[-2]] + CHORD / R  # this one may stand in the straight part
    wrap.tangent[:] = 0.0, np.pi
    return mesh_of(places), wrap, pose


def running(mesh, wrap, pose):
    return SimpleNamespace(
        wraps=(wrap,), poses=(pose,), slides=np.zeros_like(mesh.rest), slip=np.zeros(2), waiting_pulley=-1, speed=0.0
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_stations_land_where_the_belt_comes_in_and_go_where_it_leaves(sign):
    begun = 0.4 * CHORD
    mesh, wrap, pose = laid(begun)
    state, first, last = running(mesh, wrap, pose), [], []
    for travel in begun + sign * np.arange(0.0, 5.0, 0.1) * CHORD:
        places, s = stations(travel)
        state.slides[:] = places - mesh.rest
        pose.spin = travel / R
        contact.update_contact(mesh, state, np.zeros_like(mesh.rest), STEP, np.inf, None)
        first.append(s[wrap.first] / CHORD)
        last.append((s[wrap.last] - ARC) / CHORD)
    for places in (first, last):  # in chords from where the belt meets the pulley
        assert np.abs(places).max() < 0.65
    assert wrap.tangent == pytest.approx([0.0, np.pi], abs=SMALL)


def test_the_places_where_a_belt_meets_a_pulley_are_found_from_its_spans():
    mesh, wrap, pose = laid()
    state = running(mesh, wrap, pose)
    wrap.tangent[:] = 0.02, np.pi + 0.02
    errors = []
    for _ in range(200):
        contact._update_tangents(mesh, state.slides, wrap, pose, 0.05)
        errors.append(np.abs(wrap.tangent - [0.0, np.pi]))
    assert np.all(np.diff(errors, axis=0) <= 1e-12)
    np.testing.assert_allclose(errors[-1], 0.0, atol=1e-5)


class Sliding(SimpleNamespace):
    """As much of a wrap as sliding asks for."""

    def components(self, pose, vectors):
        return vectors


def test_belts_that_slide_on_both_pulleys_take_turns(monkeypatch):
    """On one pulley only it slides on in every step; how far counts for its own pulley."""
    asked = []

    def slipped(wrap, holding, friction, tangent):
        asked.append(wrap.name)
        return 1.0 if wrap.name == "head" else 10.0

    for name, fake in (
        ("slide_anchors", slipped),
        ("_update_tangents", lambda *a: None),
        ("_change_end", lambda *a: None),
    ):
        monkeypatch.setattr(contact, name, fake)
    head, tail = (Sliding(name=n, stations=np.arange(4), surface=SimpleNamespace(radius=R)) for n in ("head", "tail"))
    state = SimpleNamespace(
        wraps=(head, tail), poses=(None, None), slides=None, slip=np.zeros(2), waiting_pulley=-1, speed=0.5
    )
    mesh, pull = mesh_of(np.zeros((4, 2, 3))), np.zeros((4, 2, 3))

    def step(head_slides, tail_slides):
        asked.clear()
        head.sliding, tail.sliding = (np.full((4, 2), x) for x in (head_slides, tail_slides))
        contact.update_contact(mesh, state, pull, STEP, 0.2, "some")
        return set(asked)

    assert step(True, False) == step(False, True) == step(False, False) == {"head", "tail"}
    assert state.slip.tolist() == [3.0, 30.0]
    turns = [step(True, True) for _ in range(4)]
    assert turns[0] != turns[1]
    assert turns == [turns[0], turns[1]] * 2
    assert set.union(*turns) == {"head", "tail"}
    assert all(len(t) == 1 for t in turns)
    names = {"head": HEAD, "tail": TAIL}
    assert names[next(iter(turns[-1]))] != state.waiting_pulley
    assert state.slip.tolist() == [5.0, 50.0]


def test_a_belt_presses_less_the_faster_it_runs(monkeypatch):
    """T/R less rho v^2/R of a metre: at v^2 = T / (mass per length) nothing presses any more."""
    seen = []
    monkeypatch.setattr(contact, "slide_anchors", lambda wrap, holding, *a: seen.append(holding.copy()) or 0.0)
    mesh, wrap, pose = laid()
    tension = 2000.0  # [N] of a line of nodes
    state = running(mesh, wrap, pose)
    turned = wrap.angle[wrap.stations]
    inwards = -tension * CHORD / R * np.stack([np.sin(turned), 0.0 * turned, np.cos(turned)], axis=-1)
    pull = np.zeros_like(mesh.rest)
    pull[wrap.stations] = inwards
    for state.speed in (0.0, np.sqrt(tension / (mesh.mass[0] / CHORD))):
        contact.update_contact(mesh, state, pull, STEP, 0.2, "some")
    np.testing.assert_allclose(seen[0][..., 0], tension * CHORD / R, rtol=1e-12)
    np.testing.assert_allclose(seen[1][..., 0], 0.0, atol=1e-9)
    assert np.abs(seen[0][..., 1:]).max() < 1e-9


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("part", [0.3, -0.3])
def test_a_limp_belt_leaves_on_the_line_from_the_tangent_point(sign, part):
    """Its lines lean by one angle on the pulley, by another in the span; the kink is at the tangent point, though
    the last station held is before or behind it."""
    on, off, turn = 1e-3, -4e-3, 5e-3
    axes = PulleySurface(radius=R).axes(turn)
    k, end = (30 + int(ARC / CHORD), ARC) if sign > 0 else (30, 0.0)
    rest, s = stations(end + sign * part * CHORD - (k - 30) * CHORD)
    ahead = sign * (s - end)  # of the tangent point, along the travel; part of a chord at station k
    lean = np.where((ahead > 0.0) & (np.arange(N) != k), off, on) * ahead
    places = rest.copy()
    places[..., 1] += lean[:, None]
    places, mesh = places @ axes.T, mesh_of(rest)
    wrap, pose = Wrap.empty(PulleySurface(radius=R), 0.0, N, 2), Pose(np.zeros(3), axes, 0.3)
    wrap.first, wrap.last = (k - 20, k) if sign > 0 else (k, k + 20)
    wrap.renumber()
    slides = places - rest
    springs = Springs(slides.copy(), np.zeros_like(slides))
    state = SimpleNamespace(
        wraps=(wrap,), poses=(pose,), slides=slides.copy(), run_off_stations=[k - sign], kink_slope=[None]
    )
    place_run_off_stations(mesh, state, springs, sign)
    moved = (springs.rest - slides) @ axes
    assert not moved[np.arange(N) != k].any()
    np.testing.assert_allclose(state.kink_slope[0], -on, rtol=1e-6)  # counted against the travel
    line = lean[k + sign] * part / (1.0 + part)  # from the tangent point to the first free station
    np.testing.assert_allclose(moved[k, :, 1], line - lean[k], atol=NEAR * abs(off - on) * CHORD)
    np.testing.assert_allclose(moved[k][:, [0, 2]], 0.0, atol=1e-15)
    np.testing.assert_array_equal(state.slides, springs.rest)  # it has just become the last one
    assert state.run_off_stations == [k]
    before = state.slides.copy()
    place_run_off_stations(mesh, state, springs, sign)
    np.testing.assert_array_equal(state.slides, before)  # it is the last one still
