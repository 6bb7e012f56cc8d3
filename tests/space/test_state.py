"""A state is all that a run goes on from, its loads add up, and one place holds the nodes."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from pulley_bench import carrying, stations_on

from belt_sim.scene_parts import GuideRoller, Push, SceneParts
from belt_sim.space import Options
from belt_sim.space.native import SpaceRun, instants_of
from belt_sim.space.options import BONDS, HOLD_STIFFNESS, fit_options

AS_WELL = 1e-12  # [m]: MuJoCo's warm start is not part of the state
STEPS = 150
QUICK = Options(dx=0.04, dt=2e-3, run_in=0.2, settle=0.02, acceleration=3.0)


def begun(case, belt, options, **parts):
    options = fit_options(options, case, belt)
    return SpaceRun(case, belt, options, replace(SceneParts.from_case(case, options.friction), **parts))


@pytest.mark.parametrize(
    ("belt", "changed"),
    [("flex", {"friction": 0.15}), ("grid", {"bonds": BONDS[:2]}), ("rope", {})],
    ids=["slipping", "limp grid", "rope"],
)
def test_a_run_goes_on_from_its_state_alone(short_rig, belt, changed):
    """In the middle of a march another engine, fresh from the scene, takes the state over and makes the same steps."""
    one, other = (begun(short_rig, belt, replace(QUICK, **changed)) for _ in range(2))
    rows, _ = instants_of(one.scene, 0.5)
    one.state = one.lay(rows[0])
    for k in range(STEPS + 20):
        if k == STEPS:
            other.state = deepcopy(one.state)
            other.state.acting = (np.nan,) * 3  # its own model has been told nothing
        for run in (one, other)[: 1 + (k >= STEPS)]:
            run.step(run.state, rows[k], rows[k + 1])
    np.testing.assert_allclose(other.state.slides, one.state.slides, rtol=0.0, atol=AS_WELL)
    np.testing.assert_allclose(other.state.readings[20:22], one.state.readings[20:22], rtol=0.0, atol=AS_WELL)
    assert carrying(other.state).pulleys.wrap.first[0] == carrying(one.state).pulleys.wrap.first[0]


def laid(run, share=0.0):
    """The state before a first step of which ``share`` of the loads acts."""
    row = instants_of(run.scene, 0.1)[0][0]
    row[3] = share
    return run.lay(row)


def test_loads_add_up(short_rig):
    """The forces on the nodes are those without a push, and the share of the push that acts."""
    runs = [begun(short_rig, "flex", QUICK, pushes=p) for p in ((), (Push(span="upper", x=1.0, across=1.0),))]
    forces = [laid(run, share=0.5).given.forces for run in runs]
    np.testing.assert_allclose((forces[1] - forces[0]).sum(axis=(0, 1)), [0.0, 0.5, 0.0], atol=1e-9)


def test_pulleys_and_guides_hold_what_is_theirs_and_nothing_else_is_held(short_rig):
    guide = GuideRoller(span="upper", x=1.0, gap=-1e-3, side=1.0, stiffness=1e6)
    run = begun(short_rig, "flex", QUICK, edge_guides=(guide,))
    state = laid(run)
    springs = state.given
    on = np.zeros(run.scene.mesh.stations, bool)
    for pulley in (0, 1):
        on[stations_on(state, pulley)] = True
    assert np.all(springs.stiffness[on] == HOLD_STIFFNESS)
    pressed = np.flatnonzero(springs.stiffness[~on].any(axis=(1, 2)))
    assert 1 <= len(pressed) <= 2
    assert np.all(springs.stiffness[~on][:, :, [0, 2]] == 0.0)
    assert np.all(springs.rest[~on][pressed, :, 1] < springs.nodes[~on][pressed, :, 1])
