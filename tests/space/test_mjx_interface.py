"""What belt_sim.space.mjx assumes of MuJoCo MJX 3.17, one by one: a version that differs fails here first."""

from functools import reduce

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from mujoco import mjx
from mujoco.mjx._src import scan
from paper_cases import paper_case

from belt_sim.jax_setup import LEAST_EFFORT, in_float64, known_options
from belt_sim.scene_parts import SceneParts
from belt_sim.space import mjx as mjx_interface
from belt_sim.space.mjx import MULTIBODY, plain_model, prepare_cases, to_mjx
from belt_sim.space.options import Options, fit_options
from belt_sim.space.scene import STATION_JOINTS, build_scene
from studies.paper.case import ROPE_EXAMPLE

COARSE = Options(dx=0.04, dt=1.5e-3, run_in=0.3, settle=0.2)
ROUNDING = 1e-12  # relative, of float64
COMPUTE = jax.jit(
    lambda m, d: reduce(lambda d, stage: stage(m, d), MULTIBODY, d), compiler_options=known_options(LEAST_EFFORT)
)


def scene(tension=40.0):
    case = paper_case(tension, rig=ROPE_EXAMPLE)
    return build_scene(case, "flex", fit_options(COARSE, case, "flex"), SceneParts.from_case(case, np.inf))


@pytest.fixture(scope="module")
def compiled():
    spec, _ = scene()
    return plain_model(spec, COARSE.dt)


@pytest.fixture(scope="module")
def moving(compiled):
    """MJX's model, and the same state in MuJoCo and on MJX: nodes and pulleys off their places and under way."""
    rng = np.random.default_rng(1)
    data = mujoco.MjData(compiled)
    data.qpos[:] = 1e-3 * rng.normal(size=compiled.nq)
    data.qvel[:] = rng.normal(size=compiled.nv)
    mujoco.mj_forward(compiled, data)

    @in_float64
    def there():
        m, d = to_mjx(compiled, data.qpos)
        return m, COMPUTE(m, d.replace(qvel=jnp.array(data.qvel)))

    return data, *there()


def test_mjx_still_refuses_the_flex_and_the_discrete_integrator():
    spec, _ = scene()
    with pytest.raises(NotImplementedError):
        mjx.put_model(spec.compile(), impl="jax")


def test_places_inertia_and_bias_forces_are_those_of_mujoco(compiled, moving):
    data, _, d = moving
    np.testing.assert_allclose(d.xpos, data.xpos, rtol=0, atol=1e-12)
    np.testing.assert_allclose(d.qfrc_bias, data.qfrc_bias, rtol=ROUNDING, atol=1e-9)
    np.testing.assert_allclose(d.qfrc_passive, data.qfrc_passive, rtol=ROUNDING, atol=1e-9)
    assert np.asarray(d.xpos).dtype == np.float64


@in_float64
def test_the_mass_matrix_times_ones_is_the_masses_of_the_nodes(compiled, moving):
    _, m, d = moving
    masses = np.asarray(mjx.mul_m(m, d, jnp.ones(m.nv)))[STATION_JOINTS:].reshape(-1, 3)
    first = compiled.nbody - len(masses)
    np.testing.assert_allclose(masses, np.repeat(compiled.body_mass[first:, None], 3, axis=1), rtol=1e-9)


@in_float64
def test_an_advance_is_euler_with_the_accelerations_that_are_given(moving):
    _, m, d = moving
    qacc = jnp.arange(m.nv, dtype=float)
    after = mjx.euler(m, d.replace(qacc=qacc))
    np.testing.assert_allclose(after.qvel, d.qvel + COARSE.dt * qacc, rtol=ROUNDING)
    np.testing.assert_allclose(after.qpos, d.qpos + COARSE.dt * after.qvel, rtol=ROUNDING)
    assert float(after.time - d.time) == pytest.approx(COARSE.dt)


@in_float64
def test_joint_springs_of_the_model_may_change_from_step_to_step(moving):
    _, m, d = moving
    stiff = jnp.zeros(m.njnt).at[-1].set(100.0)
    held = m.replace(jnt_stiffness=stiff, qpos_spring=d.qpos.at[-1].add(0.5))
    force = COMPUTE(held, d).qfrc_passive - d.qfrc_passive
    assert float(force[-1]) == pytest.approx(50.0)
    assert np.abs(force[:-1]).max() == 0.0


def test_get_data_gives_mujoco_the_same_state(compiled, moving):
    _, _, d = moving
    np.testing.assert_array_equal(mjx.get_data(compiled, d).qpos, np.asarray(d.qpos))


def test_one_compiled_scene_serves_every_case_of_its_mesh():
    """Numbers put into another case's model are those of a model of its own, but for what MJX's step does not use."""
    other, alone = (
        paper_case(20.0, rig=ROPE_EXAMPLE),
        prepare_cases([paper_case(20.0, rig=ROPE_EXAMPLE)], options=COARSE)[0],
    )
    _, shared = prepare_cases([paper_case(40.0, rig=ROPE_EXAMPLE), other], options=COARSE)
    unused = {"geom", "site", "cam", "light", "stat", "dof_M0", "body_subtreemass", "invweight0"}
    assert jax.tree.structure(shared.model) == jax.tree.structure(alone.model)  # so they share what is compiled
    mine, own = (jax.tree_util.tree_leaves_with_path(r.model.mjx) for r in (shared, alone))
    for (path, value), (_, wanted) in zip(mine, own, strict=True):
        if not any(name in jax.tree_util.keystr(path) for name in unused):
            np.testing.assert_allclose(value, wanted, rtol=1e-9, atol=1e-12, err_msg=jax.tree_util.keystr(path))
    np.testing.assert_array_equal(shared.data.mjx.qpos, alone.data.mjx.qpos)


def test_mjx_still_asks_for_all_coordinates_once_a_body(compiled, monkeypatch):
    """When this fails, MJX no longer needs the memory of belt_sim.space.mjx._once_a_model: take it out."""
    asked = []

    def counted(m):
        asked.append(m)
        return np.asarray(compiled.jnt_bodyid)

    monkeypatch.setattr(scan, mjx_interface.SLOW_TEXT, counted)
    m, d = to_mjx(compiled, compiled.qpos0)
    jax.make_jaxpr(mjx.kinematics)(m, d)
    assert len(asked) >= compiled.nbody
