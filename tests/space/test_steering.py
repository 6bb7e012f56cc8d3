"""The steering environment: batched, differentiable, steered by its action; the controller of a notebook."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from belt_sim.io import ROOT
from belt_sim.mjx import Ranges, SteeringEnvironment
from belt_sim.settings import make_case
from belt_sim.space import Options

RIG = {"centre_distance": 1.2, "head_radius": 0.3, "tail_radius": 0.3}


@pytest.mark.long
def test_belts_differ_by_what_is_drawn_and_go_where_they_are_steered():
    with jax.enable_x64(True):
        cases = [make_case(rig=RIG, tension=tension, yaw=0.0) for tension in (30.0, 50.0)]
        options = Options(dx=0.07, dt=4e-3, run_in=0.3, settle=0.2, acceleration=3.0)
        env = SteeringEnvironment(cases, options=options, ranges=Ranges(yaw_offset=5e-5, taper=1e-5), most_yaw=2e-4)
        keys = jax.random.split(jax.random.PRNGKey(0), 4)
        state, run = jax.jit(jax.vmap(env.reset))(keys), jax.jit(jax.vmap(env.step))
        assert state.obs.shape == (4, env.observation_size)
        assert len(np.unique(state.info["model"].belt.surfaces.yaw_offset[:, 1])) == 4
        ends = []
        for turn in (-1.0, 1.0):
            now = state
            for _ in range(10):
                now = run(now, jnp.full((4, 1), turn))
            assert not now.done.any()
            assert np.isfinite(now.obs).all()
            ends.append(now.metrics["y1"])
        assert (np.sign(ends[1]) == np.sign(ends[1][0])).all()  # the yaw outweighs what is drawn
        assert (np.sign(ends[0]) == -np.sign(ends[1])).all()
        value = jax.jit(jax.grad(lambda turn: env.step(env.reset(keys[0]), turn).metrics["y1"]))
        slope = value(jnp.array(0.5))
        assert np.sign(slope) == np.sign(ends[1][0])


@pytest.mark.long
def test_the_controller_of_the_notebook_turns_the_tail_against_y():
    """Of two equal belts the steered one moves less."""
    notebook = json.loads((ROOT / "examples" / "batch_on_mjx.ipynb").read_text(encoding="utf-8"))
    code = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    names: dict = {}
    exec("\n".join([code[0], code[1].split("\n\n\ny = ")[0]]), names)  # its imports and its function
    steered = names["steered"]
    y = steered(np.array([0.0, 2e-3]), np.array([0.04, 0.04]), 900)
    assert y.shape == (2, 900)
    assert 0.0 < np.abs(y[1, -1]) < np.abs(y[0, -1])
