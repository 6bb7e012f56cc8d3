"""The pulleys as rigid bodies: spun by the belt, pulled by their load, turned by a moment; no belt is simulated."""

from functools import partial
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from pulley_bench import bare_belt, both, empty_wrap, on_jax, places, surface

from belt_sim.scene_parts import PulleySurface, SceneParts
from belt_sim.space.chain import TailPulley, belt_loads, pose_of
from belt_sim.space.run import Command
from belt_sim.space.scene import HEAD_SPIN, HEAD_YAW, STATION_JOINTS, TAIL_SLIDE, TAIL_SPIN, TAIL_YAW
from belt_sim.space.wrap import (
    HEAD,
    TAIL,
    BeltOnPulley,
    PoseArrays,
    anchor_places,
    axes_of,
    cylinder_coordinates,
    roll_anchors,
)

APART, SPEED, STEP = 2.0, 0.5, 1e-3  # [m], [m/s], [s]
COMPLIANCE = {HEAD: 1e-4, TAIL: 3e-4}  # [rad/(N m)]
PARTS = SceneParts(
    head=PulleySurface(radius=0.25, yaw_compliance=COMPLIANCE[HEAD]),
    tail=PulleySurface(radius=0.12, yaw_compliance=COMPLIANCE[TAIL]),
    gravity=9.81,
)
STANDS = Command(travel=0.0, yaw=np.zeros(2), share=0.0, speed=0.0, acceleration=0.0)


pytestmark = pytest.mark.usefixtures("float64")
POSES = [PoseArrays(np.array([x, 0.0, 0.0]), np.eye(3), 0.0, 0.0) for x in (0.0, APART)]
SURFACES = [surface(p.radius, 0.025, yaw_compliance=p.yaw_compliance) for p in (PARTS.head, PARTS.tail)]


def machine(sign=1, load=0.0, fixed=0.0, **changed):
    tail = TailPulley(mass=20.0, inertia=0.3, slide_drag=400.0, spin_drag=6.0, radius=PARTS.tail.radius, x=APART)
    belt = bare_belt(SURFACES, 0.025, 4, sign=sign, load=load, slide_fixed=fixed)
    tail = tail._replace(**changed)
    return SimpleNamespace(belt=belt, tail=tail, advance=jax.jit(partial(tail.advance, belt)))


def still():
    """Pulleys at rest that the belt does not load."""
    joints, rates = np.zeros((2, STATION_JOINTS))
    return SimpleNamespace(joints=joints, joint_rates=rates, loads=np.zeros((2, 3)), compliance_yaw=np.zeros(2))


def go(pulleys, state, commands, dt=STEP):
    """Steps in which the joints follow their forces, as MuJoCo has them do; the forces of the last one."""
    for command in commands:
        moves = np.stack([state.joints, state.joint_rates])
        driven, foretold, turned = pulleys.advance(moves, state.loads, state.compliance_yaw, command, dt)
        (state.joints, state.joint_rates, forces), state.compliance_yaw = np.array(driven), np.array(turned)
        state.joint_rates[TAIL_SLIDE] += dt * forces[TAIL_SLIDE] / pulleys.tail.mass
        state.joint_rates[TAIL_SPIN] += dt * forces[TAIL_SPIN] / pulleys.tail.inertia
        state.joints += dt * state.joint_rates
        expected = [APART + state.joints[TAIL_SLIDE], state.joints[TAIL_SPIN]]
        np.testing.assert_allclose(foretold, expected, rtol=0.0, atol=1e-12)
    return forces


def steady(count, **more):
    return [STANDS._replace(travel=SPEED * STEP * (k + 1), speed=SPEED, **more) for k in range(count)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("begins", [0.0, 2.0])
def test_a_tail_pulley_that_spins_unlike_the_belt_is_brought_to_the_belts_speed(sign, begins):
    pulleys, state = machine(sign, spin_drag=0.6), still()
    rim = sign * SPEED / PARTS.tail.radius
    state.joint_rates[TAIL_SPIN] = begins * rim
    go(pulleys, state, steady(100))
    ahead = state.joint_rates[TAIL_SPIN] / rim - 1.0
    assert ahead == pytest.approx(
        (begins - 1.0) * np.exp(-0.1 * pulleys.tail.spin_drag / pulleys.tail.inertia), rel=1e-3
    )
    assert state.joint_rates[HEAD_SPIN] == pytest.approx(sign * SPEED / PARTS.head.radius)
    assert state.joints[HEAD_SPIN] == pytest.approx(sign * 0.1 * SPEED / PARTS.head.radius)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tail_pulley_speeds_up_with_the_belt_without_the_belts_help(sign):
    pulleys, state, faster = machine(sign), still(), 3.0
    times = STEP * np.arange(1, 101)
    go(
        pulleys,
        state,
        [STANDS._replace(travel=0.5 * faster * t**2, speed=faster * t, acceleration=faster) for t in times],
    )
    assert state.joint_rates[TAIL_SPIN] == pytest.approx(sign * faster * 0.1 / PARTS.tail.radius, rel=1e-9)


def test_the_belts_moment_about_the_axis_turns_the_tail_pulley():
    pulleys, state = machine(spin_drag=0.0), still()
    state.loads[:] = [[9.0, 9.0, 0.0], [0.0, 0.6, 0.0]]
    go(pulleys, state, steady(100))
    assert state.joint_rates[TAIL_SPIN] == pytest.approx(0.6 / pulleys.tail.inertia * 0.1)


def test_the_load_draws_the_tail_away_from_the_head_and_the_belt_holds_it():
    pulleys, state = machine(load=800.0), still()
    state.loads[TAIL, 0], state.loads[HEAD, 0] = -800.0, 800.0
    go(pulleys, state, steady(10))
    assert state.joints[TAIL_SLIDE] == 0.0
    state.loads[TAIL, 0] = -600.0
    go(pulleys, state, steady(2000))
    assert state.joint_rates[TAIL_SLIDE] == pytest.approx(200.0 / pulleys.tail.slide_drag, rel=1e-6)
    assert state.joints[TAIL_SLIDE] > 0.5


def test_a_fixed_slide_heeds_no_force():
    pulleys, state = machine(load=800.0, fixed=1.0), still()
    go(pulleys, state, steady(100))
    assert state.joints[TAIL_SLIDE] == 0.0


@pytest.mark.parametrize("which", [HEAD, TAIL])
def test_a_pulley_gives_way_in_the_sense_of_the_moment_on_itself(which):
    """A moment about +z turns +y towards -x; about the other axes it does nothing, and the other pulley stands."""
    pulleys, state = machine(), still()
    state.loads[which] = [0.0, 0.0, 2.0]
    yaw = np.array([1e-3, 2e-3])
    commands = steady(500, yaw=yaw)
    go(pulleys, state, commands)
    given = np.zeros(2)
    given[which] = 2.0 * COMPLIANCE[which]
    np.testing.assert_allclose(state.compliance_yaw, given, atol=1e-9)
    np.testing.assert_allclose(state.joints[[HEAD_YAW, TAIL_YAW]], yaw + given, atol=1e-9)
    poses = pose_of(pulleys.belt, commands[-1], np.array([APART, 0.0]), state.compliance_yaw)
    for axes, turned in zip(np.asarray(poses.axes), yaw + given, strict=True):
        np.testing.assert_allclose(axes @ [0.0, 1.0, 0.0], [-np.sin(turned), np.cos(turned), 0.0], atol=1e-9)


def test_the_belt_loads_a_pulley_by_its_pull_and_its_moments_about_axis_and_z():
    """A tight edge at +y, drawn towards -x, turns the pulley about +z; drawn so at its top it spins it backwards."""
    at, pull = np.zeros((2, 2, 3, 4))
    at[..., 1] = [[APART, 0.06, 0.12], [APART, -0.06, 0.12]]
    pull[..., 1] = [[-300.0, 7.0, 5.0], [-100.0, 7.0, 5.0]]
    pull[..., 3] = 1e6  # lies on neither
    wraps = both(empty_wrap(0, 0, 4), empty_wrap(1, 1, 4))
    loads = belt_loads(BeltOnPulley(wraps, both(*SURFACES), both(*POSES)), at, pull)
    np.testing.assert_allclose(loads, [[0.0] * 3, [-400.0, -0.12 * 400.0, 0.06 * 200.0]], atol=1e-12)


def test_a_belt_stays_where_it_is_when_its_pulley_begins_to_be_canted():
    """To second order in the angle; what runs goes with the pulley."""
    canted = surface(0.2, 0.025, cant=1e-3)
    for rests, moved in ((True, 0.0), (False, 2e-4)):
        wrap, at = empty_wrap(0, 2, 3), POSES[TAIL]
        wrap.r[:], wrap.angle[:] = 0.2, [0.0, 0.5 * np.pi, np.pi]
        wrap.y[:] = [[0.3], [-0.3]]
        before = places(wrap, at)
        for share in (0.3, 1.0):
            was, at = at, at._replace(axes=np.asarray(axes_of(canted, 0.0, share, 0.0)))
            if rests:
                wrap = roll_anchors(BeltOnPulley(on_jax(wrap), canted, at), at.axes[2, 1] - was.axes[2, 1])
        assert at.axes[2, 1] == pytest.approx(1e-3, rel=1e-6)
        y = (places(wrap, at) - before)[:, 1]
        np.testing.assert_allclose(y, np.outer([1.0, 1.0], [-moved, 0.0, moved]), atol=5e-7)


def test_circles_of_a_bent_pulley_are_those_of_yawed_ones():
    """A pulley whose axis is an arc of curvature k keeps its radius: the circle at y is turned by -k y about z, and
    lies on the axis, which is k y^2/2 back; places and anchors are each other's inverse."""
    bow, radius, spin = 0.02, 0.17, 0.3
    y, angle = np.meshgrid([-0.1, 0.02, 0.1], np.linspace(-np.pi, np.pi, 9), indexing="ij")
    at = PoseArrays(np.zeros(3), np.eye(3), spin, bow)
    found = np.asarray(anchor_places(radius, y, angle + spin, at.axes[..., None], at.centre[:, None], bow))
    for row, across in zip(found, y[:, 0], strict=True):
        yawed = axes_of(surface(radius, 0.025), -bow * across, 1.0, spin)
        circle = [radius * np.sin(angle[0] + spin), 0.0 * angle[0], radius * np.cos(angle[0] + spin)]
        centre = np.array([0.5 * bow * across**2, across, 0.0])
        np.testing.assert_allclose(row, yawed @ np.array(circle) + centre[:, None], atol=1e-6)
    r, there, turned = cylinder_coordinates(found, at)
    np.testing.assert_allclose(r, radius, atol=1e-8)
    np.testing.assert_allclose(there, y, atol=1e-8)
    np.testing.assert_allclose(np.cos(turned - angle), 1.0, atol=1e-12)
