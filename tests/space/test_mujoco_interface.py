"""What mujoco_interface assumes of MuJoCo 4.0, one by one: a version that differs fails here first."""

import warnings
from contextlib import nullcontext

import mujoco
import numpy as np
import pytest
from strip_bench import strip

from belt_sim.errors import SimulationError
from belt_sim.space import mujoco_interface
from belt_sim.space.mujoco_interface import mjcf, silence_expected_warnings

STIFF = 1e13  # [N/m], as of landed nodes
AT_ITS_PLACE = 1e-9  # [m], of a node that stiff springs hold; iterating leaves micrometres
BELTS = ["flex", "grid"]


def held(belt="flex", **options):
    """A strip of 0.5 m under tension, its ends held by stiff springs, one of them moved by 10 um, pushed sideways."""
    bench = strip(belt, 0.5, tension=40.0, dt=1e-3, both_ends=True, **options)
    bench.rest[-1, :, 0] += 1e-5
    bench.stiffness[[0, -1]] = STIFF
    bench.pulls[10, :, 2] = 5.0
    return bench


def off_its_place(bench):
    bench.settle(5)
    return np.abs(bench.motion.slides[[0, -1]] - bench.rest[[0, -1]]).max()


@pytest.mark.parametrize("belt", BELTS)
def test_one_exact_step_holds_a_node_at_its_place(belt):
    bench = held(belt)
    assert off_its_place(bench) < AT_ITS_PLACE
    assert bench.solver.data.solver_niter[0] == 1


def test_without_its_equality_mujoco_iterates_and_misses():
    bench = held()
    bench.solver.data.eq_active[:] = 0
    assert off_its_place(bench) > 1e3 * AT_ITS_PLACE


@pytest.mark.parametrize("belt", BELTS)
def test_the_preliminary_solve_does_not_matter(belt):
    few, many = held(belt), held(belt)
    many.solver.model.opt.iterations = 100
    np.testing.assert_allclose(few.settle(5), many.settle(5), rtol=1e-6, atol=1e-12)


def test_the_equality_holds_the_first_joint_where_it_is_put():
    bench = held()
    bench.motion.joints[0] = 0.01
    bench.settle(5)
    assert bench.motion.joints[0] == pytest.approx(0.01, abs=1e-12)


@pytest.mark.parametrize("belt", BELTS)
def test_elastic_forces_are_those_of_the_belt_alone_where_it_is(belt):
    bench = strip(belt, 0.5, tension=40.0)
    bench.settle(1)  # leaves stiff springs, speeds and forces of another instant behind
    forces = bench.solver.elastic_forces(bench.mesh.laid - bench.mesh.rest)
    assert forces[0, :, 0].sum() == pytest.approx(float(bench.case.tension_force), rel=1e-3)
    assert forces[-1, :, 0].sum() == pytest.approx(-float(bench.case.tension_force), rel=1e-3)
    assert np.abs(forces[1:-1, :, 0].sum(axis=1)).max() < 1e-6 * float(bench.case.tension_force)


def folded():
    """A stress-free strip bent upwards at a station by 0.5 rad: the places of its nodes."""
    bench = strip("flex", 0.5)
    slides, x = np.zeros(bench.mesh.rest.shape), bench.mesh.rest[:, :, 0]
    beyond = np.maximum(x - x[10], 0.0)
    slides[..., 0], slides[..., 2] = beyond * (np.cos(0.5) - 1.0), beyond * np.sin(0.5)
    return bench.solver.elastic_forces(slides)


def test_a_membrane_folds_at_no_cost(monkeypatch):
    assert np.abs(folded()).max() < 1e-3  # [N]
    monkeypatch.setattr("belt_sim.space.scene.STRETCH_ONLY", 3)  # and bending
    assert np.abs(folded()).max() > 1.0


def test_a_specification_warns_of_a_flex_without_equalities_and_we_do_not(monkeypatch):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        held()
    monkeypatch.setattr(mujoco_interface, "_TIED_TO_NOTHING", "something else")
    with pytest.warns(UserWarning, match=r"flex .* is not rigid"):
        held()


def test_the_preliminary_solve_is_warned_of_in_the_expected_words_only(monkeypatch):
    told = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        held().settle(2)
    monkeypatch.setattr(mujoco_interface, "silence_expected_warnings", nullcontext)
    mujoco.set_mju_user_warning(told.append)
    try:
        held().settle(2)
    finally:
        mujoco.set_mju_user_warning(None)
    assert told
    assert all(mujoco_interface._PRELIMINARY.search(text) for text in told)


@pytest.mark.parametrize("belt", BELTS)
def test_other_warnings_are_passed_on_and_a_run_without_bounds_is_seen(belt):
    bench = held(belt)
    bench.settle(2)
    bench.motion.slide_rates[5] = 1e12
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        with pytest.raises(SimulationError, match="without bound"):
            bench.settle(1)
    assert any("MuJoCo: Nan, Inf or huge value in QACC" in str(w.message) for w in told)
    assert bench.solver.data.time == pytest.approx(3e-3)  # it has not started anew by itself


def test_the_handler_of_warnings_is_as_it_was_whatever_happens():
    told = []
    mujoco.set_mju_user_warning(told.append)
    try:
        ours = mujoco.get_mju_user_warning()
        bench = held()
        bench.motion.slide_rates[5] = 1e12
        with pytest.raises(SimulationError):
            bench.settle(1)
        assert mujoco.get_mju_user_warning() is ours
        with pytest.raises(RuntimeError), silence_expected_warnings():
            raise RuntimeError
        assert mujoco.get_mju_user_warning() is ours
    finally:
        mujoco.set_mju_user_warning(None)
    assert any("QVEL" in text or "QACC" in text for text in told)
    assert not any(mujoco_interface._PRELIMINARY.search(text) for text in told)


@pytest.mark.parametrize("belt", BELTS)
def test_nodes_are_the_last_joints_and_their_ties_are_known(belt):
    bench = strip(belt, 0.5)
    solver, mesh = bench.solver, bench.mesh
    assert solver.base == 1
    ends = mesh.rest.reshape(-1, 3)[solver.tied_nodes()]
    model = solver.model
    lengths = model.flexedge_length0 if model.nflexedge else model.tendon_lengthspring[:, 0]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), lengths, rtol=1e-12)


def test_mujoco_writes_six_digits_and_we_write_all():
    spec = mujoco.MjSpec()
    place = [1.0 / 3.0, 0.0, 10.0 + 1.0 / 7.0]
    body = spec.worldbody.add_body(name="node", pos=place, mass=1.0, inertia=[1.0] * 3, explicitinertial=True)
    body.ipos = [0.0, 0.0, 0.0]  # without it the inertia is not written
    body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE)
    spec.compile()
    written, full = (mujoco.MjModel.from_xml_string(text).body_pos[1] for text in (spec.to_xml(), mjcf(spec)))
    assert np.abs(written - place).max() > 1e-8
    np.testing.assert_array_equal(full, place)
