"""The quasi-static belt on JAX against MuJoCo's run in time, in batches, and what it refuses."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import paper_case

import belt_sim as bs
from belt_sim.case import Schedule
from belt_sim.effects.load import load_effects
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.jax_setup import in_float64
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import run_native
from belt_sim.space.quasi_static import prepare_case, run_case, simulate_batch
from studies.paper.case import ROPE_EXAMPLE, TEST_RIG

COARSE = Options(dx=0.04, dt=1.5e-3, run_in=0.3, settle=0.2, acceleration=3.0, steps=2)
FINER = replace(COARSE, dt=1e-3, settle=0.3, acceleration=2.0)  # for native, where loads move the belt by 20 um alone
TRAVEL = 0.6  # [m]
LOADS = [
    {"id": "idler_skew", "force": 60.0, "place": 0.3},
    {"id": "side_drag", "moment": 5.0, "place": 0.7},
    {"id": "machine_tilt", "angle": 0.5},
    {"id": "off_centre_load", "moment": 0.1},
    {"id": "cant", "gamma": 3e-5, "gamma_head": -2e-5},
]
YAWED, LOADED = 1e-4, 1e-5  # [m], what y reaches at least
OFF_THE_LAW = 0.03  # of the largest y: stations 40 mm apart
PARITY = 0.01  # of the largest y: the run in time is as far from itself at half its speed


def test_a_batch_is_beside_mujoco_and_each_case_by_itself():
    """One is yawed, one is straight, and one is not yawed but has all loads at once."""
    yawed, slack = paper_case(60.0, rig=ROPE_EXAMPLE), paper_case(20.0, 0.0, ROPE_EXAMPLE)
    straight = replace(yawed, settings=replace(yawed.settings, yaw=Schedule.step(0.0)))
    cases, effects = [yawed, straight, slack], [[], [], load_effects(LOADS)]
    parts = [SpaceModel(options=COARSE).parts(case, acting) for case, acting in zip(cases, effects, strict=True)]
    found, still, loaded = simulate_batch(cases, travel=TRAVEL, options=COARSE, parts=parts)
    native = run_native(slack, travel=TRAVEL, options=FINER, parts=parts[2])
    law = march_case(yawed, analytic_model("strip"), travel=TRAVEL)
    for seen, other, least, near in ((found, law, YAWED, OFF_THE_LAW), (loaded, native, LOADED, PARITY)):
        y = np.array([np.interp(other.travel, seen.travel, line) for line in seen.y])
        assert np.abs(other.y).max() > least
        assert np.abs(y - other.y).max() < near * np.abs(other.y).max()
    assert np.abs(still.y).max() < 1e-7
    assert np.abs(found.extra["tension"] / float(yawed.settings.tension) - 1.0).max() < 0.02


def test_what_it_cannot_do_is_said_in_a_line():
    with pytest.raises(CannotRepresent, match=r"model\.contact = mujoco: engine=quasi_static cannot do this"):
        bs.simulate(model={"name": "mujoco_flex", "contact": "mujoco"}, engine="quasi_static", travel=1.0)


def test_engines_are_those_of_belts_in_three_dimensions():
    with pytest.raises(InputError, match="engine"):
        bs.simulate(model="strip", engine="quasi_static", travel=1.0)
    with pytest.raises(InputError, match="engine"):
        bs.simulate(model="mujoco_flex", engine="cuda", travel=1.0)


@pytest.mark.long
@pytest.mark.parametrize(("tension", "friction"), [(7.0, math.inf), (40.0, math.inf), (40.0, 0.15)])
def test_the_full_rig_is_beside_mujoco(tension, friction):
    case, options = paper_case(tension, rig=TEST_RIG), Options(friction=friction)
    found = simulate_batch([case], travel=10.0, options=options)[0]
    native = run_native(case, travel=10.0, options=options)
    y = np.array([np.interp(native.travel, found.travel, line) for line in found.y])
    assert math.isfinite(y.sum())
    assert np.abs(y - native.y).max() < PARITY * np.abs(native.y).max()


@pytest.mark.long
@in_float64
def test_the_derivative_by_the_yaw_is_that_of_differences():
    """Forwards through all steps of a sticking belt; landings take place where they did."""
    ready = prepare_case(paper_case(60.0, rig=ROPE_EXAMPLE), travel=0.6, options=COARSE)
    commands = jax.tree.map(jnp.asarray, ready.commands)

    def last(scale):
        yawed = commands._replace(yaw=commands.yaw * scale)
        return run_case(ready.belt, ready.state, yawed)[1][-1, 0]

    _, slope = jax.jvp(last, (jnp.array(1.0),), (jnp.array(1.0),))
    above, below = (last(jnp.array(1.0 + d)) for d in (0.01, -0.01))
    assert float(slope) == pytest.approx(float(above - below) / 0.02, rel=1e-2)


@pytest.mark.long
@in_float64
def test_the_derivative_by_a_taper_is_that_of_differences():
    """Of the tail pulley, about one that is slightly conical already."""
    ready = prepare_case(paper_case(60.0, rig=ROPE_EXAMPLE), travel=0.6, options=COARSE)
    belt, state, commands = jax.tree.map(jnp.asarray, (ready.belt, ready.state, ready.commands))

    @jax.jit
    def last(taper):
        conical = replace(belt, surfaces=belt.surfaces._replace(taper=jnp.stack([jnp.array(0.0), taper])))
        return run_case(conical, state, commands)[1][-1, 0]

    _, slope = jax.jvp(last, (jnp.array(2e-4),), (jnp.array(1.0),))
    above, below = (last(jnp.array(2e-4 + d)) for d in (2e-5, -2e-5))
    assert float(slope) == pytest.approx(float(above - below) / 4e-5, rel=1e-2)


@pytest.mark.long
@in_float64
def test_the_derivative_by_the_tension_is_that_of_differences():
    """With the belt's length and masses, which follow the tension that it is laid at."""
    at = [prepare_case(paper_case(t, rig=ROPE_EXAMPLE), travel=0.6, options=COARSE) for t in (59.4, 60.0, 60.6)]
    below, middle, above = ((r.belt, r.state) for r in at)

    def last(change):
        def moved(low, here, high):
            if not (np.issubdtype(here.dtype, np.floating) and np.isfinite(here).all()):
                return jnp.asarray(here)  # stations' numbers, and a friction without end
            return here + change * 0.5 * (high - low)

        belt, state = jax.tree.map(moved, below, middle, above)
        return run_case(belt, state, jax.tree.map(jnp.asarray, at[1].commands))[1][-1, 0]

    _, slope = jax.jvp(last, (jnp.array(0.0),), (jnp.array(1.0),))
    whole = [run_case(*jax.tree.map(jnp.asarray, (r.belt, r.state, r.commands)))[1][-1, 0] for r in at]
    assert float(slope) == pytest.approx(float(whole[2] - whole[0]) / 2.0, rel=2e-2)
