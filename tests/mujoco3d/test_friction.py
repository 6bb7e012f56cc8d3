"""Sliding obeys Coulomb's law; the wrap's stiffness is the strip's; a slipping belt knows its coefficient."""

import numpy as np
import pytest

from belt_sim.mujoco3d import Options, simulate
from belt_sim.mujoco3d.engine import SpaceRun
from belt_sim.mujoco3d.friction import slip_increments
from belt_sim.mujoco3d.options import fit_options

LEFT_OVER = 2e-3  # of the largest limit; the solver stops at 1e-3
ALIKE = 0.01  # of y: half the step; 0.5 ms against 1 ms differ by 0.5 %
STRETCH = 0.005  # the tension adds F / EA, and the laid links are longer by as much
HARDLY = 0.1  # [N], of links that carry 1800 N: the width is laid 0.03 um off


@pytest.fixture(scope="module")
def begun(short_rig):
    options = fit_options(Options(friction=0.3), short_rig, "flex")
    return SpaceRun.begin(short_rig, "flex", options)


@pytest.mark.parametrize("nodes", [1, 2, 7, 40])
def test_sliding_nodes_are_held_with_their_limit_against_their_increment_and_others_with_less(nodes):
    rng = np.random.default_rng(nodes)
    for _ in range(10):
        root = rng.normal(size=(2 * nodes, 2 * nodes))
        stiffness = 1e8 * root @ root.T + 1e4 * np.eye(2 * nodes)
        force, limit = 100.0 * rng.normal(size=(nodes, 2)), 150.0 * rng.uniform(size=nodes)
        slip = slip_increments(force, limit, stiffness, np.zeros((nodes, 2)))
        after = force + (stiffness @ slip.ravel()).reshape(-1, 2)
        size = np.hypot(*slip.T)
        moves = size > 0.0
        tolerance = LEFT_OVER * limit.max()
        against = -limit[moves, None] * slip[moves] / size[moves, None]
        assert after[moves] == pytest.approx(against, abs=tolerance)
        assert np.all(np.hypot(*after[~moves].T) <= limit[~moves] + tolerance)


def test_no_node_slides_below_its_limit():
    assert not slip_increments(np.full((3, 2), 1.0), np.full(3, 1.5), 1e8 * np.eye(6), np.full((3, 2), 1e-9)).any()


def test_wrap_is_stiff_like_a_strip(begun, short_rig):
    """A wrap shifted sideways as a whole bends nothing in itself; a link stretches like a plate strip."""
    tangent, count = begun.engine.tangent, 9
    whole = tangent.wrap(0, count)
    assert whole == pytest.approx(whole.T, abs=1e-6 * np.abs(whole).max())
    assert np.linalg.eigvalsh(whole).min() > 0.0
    inner = slice(4, -4)  # beside the ends
    sideways, along = np.tile([1.0, 0.0], 2 * count), np.tile([0.0, 1.0], 2 * count)
    for rigid in (sideways, along):
        assert np.abs(whole @ rigid)[inner].max() < 1e-3 * np.abs(whole).max()
    belt, chord = short_rig.belt, begun.scene.mesh.chord
    along_along = tangent.block[0, 2, 1::2, 1::2]  # what pulls at the next station when one moves along
    at_fixed_width = belt.youngs_modulus * belt.area / (1.0 - belt.poisson_ratio**2)
    assert -along_along.sum() * chord == pytest.approx(at_fixed_width, rel=STRETCH)


def test_laid_belt_pulls_at_its_free_nodes_with_its_weight_only(begun):
    state, scene = begun.state, begun.scene
    pull = begun.engine.solver.elastic_forces(state.slides)
    free = np.ones(scene.mesh.stations, bool)
    for wrap in state.wraps:
        free[np.arange(wrap.first - 2, wrap.last + 3) % scene.mesh.stations] = False
    weight = scene.mesh.mass * scene.parts.gravity
    assert pull[free][..., 2] == pytest.approx(np.broadcast_to(weight, pull[free][..., 2].shape), abs=HARDLY)
    assert np.abs(pull[free][..., :2]).max() < HARDLY


def at(curves, travel, point):
    return float(np.interp(travel, curves.travel, curves.y[point]))


def test_less_friction_starts_faster_whatever_the_step(short_rig):
    def run(friction, dt):
        options = Options(run_in=0.4, settle=0.3, acceleration=3.0, friction=friction, dt=dt, dx=0.04)
        return at(simulate(short_rig, travel=0.45, options=options), 0.4, 0)

    sticking, rough, smooth, finer = run(np.inf, 1e-3), run(0.3, 1e-3), run(0.1, 1e-3), run(0.1, 5e-4)
    assert smooth < 1.05 * rough < 1.05**2 * sticking < 0.0
    assert finer == pytest.approx(smooth, rel=ALIKE)
