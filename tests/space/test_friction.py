"""Sliding obeys Coulomb's law; the wrap's stiffness is the strip's; a slipping belt knows its coefficient."""

import jax
import numpy as np
import pytest

from belt_sim.jax_setup import LEAST_EFFORT, in_float64, known_options
from belt_sim.space import Options
from belt_sim.space.native import SpaceRun, instants_of, run_native
from belt_sim.space.options import fit_options
from belt_sim.space.wrap import slip_increments, wrap_chain

LEFT_OVER = 2e-3  # of the largest limit: what friction may contradict Coulomb's law by
PROBE = 1e-6  # [m], a strain of 4e-5 of a link
STIFF = 1e-4  # of the stiffest: a finite difference over 1 um
ALIKE = 0.01  # of y: half the step; 1 ms against 2 ms differ by 0.02 %
FASTER = 1.3  # y at 0.18 m: 1.80 times that of a belt that sticks at friction 0.3, and 1.46 times more at 0.1
STRETCH = 0.005  # the tension adds F / EA, and the laid links are longer by as much
HARDLY = 0.1  # [N], of links that carry 1800 N: the width is laid 0.03 um off
CHAIN = jax.jit(wrap_chain, static_argnums=3)
SOLVE = jax.jit(slip_increments, compiler_options=known_options(LEAST_EFFORT))  # it runs ten times


@pytest.fixture(scope="module")
def begun(short_rig):
    options = fit_options(Options(friction=0.3, dx=0.04), short_rig, "flex")
    return SpaceRun(short_rig, "flex", options)


def assembled(chain):
    """The whole stiffness, (2 m k, 2 m k), of a chain of blocks, station by station."""
    own, beside = (np.asarray(v) for v in chain)
    size, _, count = own.shape
    whole = np.zeros((count, size, count, size))
    for k in range(count):
        whole[k, :, k] = own[..., k]
        if k < count - 1:
            whole[k, :, k + 1], whole[k + 1, :, k] = beside[..., k], beside[..., k].T
    return whole.reshape(count * size, count * size)


def obeys_coulomb(chain, force, limit, slip) -> bool:
    """Whether nodes that slide are held with their limit against their increment, and others with less."""
    count = force.shape[-1]
    moved = assembled(chain) @ np.moveaxis(slip, -1, 0).ravel()
    after = force + np.moveaxis(moved.reshape(count, -1, 2), 0, -1)
    size = np.hypot(slip[:, 0], slip[:, 1])
    against = slip * (limit / np.maximum(size, 1e-300))[:, None]  # 0 where a node rests
    left = np.hypot(*np.moveaxis(after + against, 1, 0))
    return bool(np.all(left <= np.where(size > 0.0, 0.0, limit) + LEFT_OVER * limit.max()))


@pytest.mark.parametrize("count", [1, 2, 7, 20])
@in_float64
def test_sliding_nodes_are_held_with_their_limit_against_their_increment_and_others_with_less(count):
    rng = np.random.default_rng(count)
    for _ in range(10):
        root, cross = rng.normal(size=(4, 4, count)), rng.normal(size=(4, 4, count))
        cross[..., -1] = 0.0
        own = 1e8 * (np.einsum("ijk,ljk->ilk", root, root) + 16.0 * np.eye(4)[..., None])
        chain = own, 1e8 * cross
        force, limit = 100.0 * rng.normal(size=(2, 2, count)), 150.0 * rng.uniform(size=(2, count))
        slip, residual = (np.asarray(v) for v in SOLVE(force, limit, chain, np.zeros_like(force)))
        assert obeys_coulomb(chain, force, limit, slip)
        assert residual <= LEFT_OVER


@in_float64
@pytest.mark.long
def test_a_wrap_that_is_bent_and_pulled_at_its_ends_slides_as_coulomb_says(begun):
    """Limits fall to nothing at the ends; each pull starts from the slip of the one before."""
    count, rng = 15, np.random.default_rng(3)
    chain, guess = CHAIN(begun.belt.sliding_stiffness, 0, count, count), np.zeros((2, 2, count))
    ends = 5.0 * np.minimum(1.0, 4.0 * np.minimum(np.linspace(0, 1, count), np.linspace(1, 0, count)))
    for pull in (1.0, 5.0, 20.0, 60.0):
        limit = np.stack([ends, ends]) * (1.0 + 0.1 * rng.normal(size=(2, count)))
        force = 0.3 * pull * rng.normal(size=(2, 2, count))
        force[:, 0, :4] += pull
        force[:, 1, :4] += np.array([[2.0], [-2.0]]) * pull
        slip, residual = (np.asarray(v) for v in SOLVE(force, limit, chain, guess))
        assert obeys_coulomb(chain, force, limit, slip)
        assert residual <= LEFT_OVER
        guess = slip


@in_float64
def test_no_node_slides_below_its_limit():
    chain = 1e8 * np.eye(2)[..., None] * np.ones(3), np.zeros((2, 2, 3))
    assert not np.any(SOLVE(np.full((1, 2, 3), 1.0), np.full((1, 3), 1.5), chain, np.full((1, 2, 3), 1e-9))[0])


@in_float64
def test_wrap_is_stiff_like_a_strip(begun, short_rig):
    """A wrap shifted sideways as a whole bends nothing in itself; a link stretches like a plate strip."""
    tangent, count = begun.belt.sliding_stiffness, 9
    whole = assembled(CHAIN(tangent, 0, count, count))
    assert whole == pytest.approx(whole.T, abs=1e-6 * np.abs(whole).max())
    assert np.linalg.eigvalsh(whole).min() > 0.0
    inner = slice(4, -4)  # beside the ends
    sideways, along = np.tile([1.0, 0.0], 2 * count), np.tile([0.0, 1.0], 2 * count)
    for rigid in (sideways, along):
        assert np.abs(whole @ rigid)[inner].max() < 1e-3 * np.abs(whole).max()
    belt, chord = short_rig.belt, begun.scene.mesh.chord
    along_along = tangent.after[0, 1::2, 1::2]  # what pulls at the next station when one moves along
    at_fixed_width = belt.youngs_modulus * belt.area / (1.0 - belt.poisson_ratio**2)
    assert -along_along.sum() * chord == pytest.approx(at_fixed_width, rel=STRETCH)


def test_mujoco_holds_a_station_as_stiffly(begun):
    """What the flex itself does to a node of the upper span, and to the next one, when it moves in the belt's plane."""
    scene, solver, tangent = begun.scene, begun.solver, begun.belt.sliding_stiffness
    upper = np.flatnonzero(scene.loop.z > 0.0)
    station = int(upper[np.argmin(np.abs(scene.loop.x[upper] - scene.loop.x.mean()))])
    slides, in_plane = scene.mesh.laid - scene.mesh.rest, (1, 0)
    for column in range(2 * scene.mesh.lines):
        forces = []
        for shift in (PROBE, -PROBE):
            moved = slides.copy()
            moved[station, column // 2, in_plane[column % 2]] += shift
            forces.append(solver.elastic_forces(moved)[[station, station + 1]][:, :, list(in_plane)].reshape(2, -1))
        own, after = (forces[1] - forces[0]) / (2.0 * PROBE)
        scale = STIFF * np.abs(tangent.own).max()
        assert own == pytest.approx(tangent.own[station % 2][:, column], abs=scale)
        assert after == pytest.approx(tangent.after[station % 2][:, column], abs=scale)


def test_laid_belt_pulls_at_its_free_nodes_with_its_weight_only(begun):
    scene, state = begun.scene, begun.lay(instants_of(begun.scene, 0.1)[0][0])
    wrap, pose = begun.laid.pulleys.wrap, begun.laid.pulleys.pose
    assert pose.spin * 0.17 == pytest.approx(-scene.early)  # they have turned by nothing when travel 0 is reached
    pull = begun.solver.elastic_forces(state.slides)
    free = np.ones(scene.mesh.stations, bool)
    for first, last in zip(wrap.first, wrap.last, strict=True):
        free[np.arange(first - 2, last + 3) % scene.mesh.stations] = False
    weight = scene.mesh.mass * scene.parts.gravity
    assert pull[free][..., 2] == pytest.approx(np.broadcast_to(weight, pull[free][..., 2].shape), abs=HARDLY)
    assert np.abs(pull[free][..., :2]).max() < HARDLY


def at(curves, travel, point):
    return float(np.interp(travel, curves.travel, curves.y[point]))


def started(case, friction, dt=2e-3):
    """y of point 1 after 0.18 m."""
    options = Options(run_in=0.1, settle=0.1, acceleration=3.0, yaw_time=0.1, friction=friction, dt=dt, dx=0.04)
    return at(run_native(case, travel=0.2, options=options), 0.18, 0)


def test_less_friction_starts_faster(short_rig):
    sticking, rough, smooth = (started(short_rig, friction) for friction in (np.inf, 0.3, 0.1))
    assert smooth < FASTER * rough < FASTER**2 * sticking < 0.0


@pytest.mark.long
def test_sliding_is_alike_in_half_the_step(short_rig):
    assert started(short_rig, 0.1, 1e-3) == pytest.approx(started(short_rig, 0.1), rel=ALIKE)
