"""A state is all that a run goes on from, its loads add up, and one place holds the nodes."""

from copy import deepcopy
from dataclasses import replace
from itertools import chain, islice

import numpy as np
import pytest

from belt_sim.scene_parts import GuideRoller, Push, SceneParts
from belt_sim.space import Options
from belt_sim.space.native import SpaceRun
from belt_sim.space.options import BONDS, fit_options
from belt_sim.space.run_stages import apply_command

AS_WELL = 1e-12  # [m]: MuJoCo's warm start is not part of the state
STEPS = 300
QUICK = Options(dx=0.04, dt=2e-3, run_in=0.2, settle=0.02, acceleration=3.0)


def begun(case, belt, options, **parts):
    options = fit_options(options, case, belt)
    return SpaceRun.begin(case, belt, options, replace(SceneParts.from_case(case, options.friction), **parts))


@pytest.mark.parametrize(
    ("belt", "changed"),
    [("flex", {"friction": 0.15}), ("flex", {"tensioning": "koller"}), ("grid", {"bonds": BONDS[:2]}), ("rope", {})],
    ids=["slipping", "koller", "limp grid", "rope"],
)
def test_a_run_goes_on_from_its_state_alone(short_rig, belt, changed):
    """In the middle of a march another engine, fresh from the scene, takes the state over and makes the same steps."""
    one, other = (begun(short_rig, belt, replace(QUICK, **changed)) for _ in range(2))
    commands = chain.from_iterable(stage.commands(one.state) for stage in one.stages(0.5))
    for k, command in enumerate(islice(commands, STEPS + 20)):
        if k == STEPS:
            other.state = deepcopy(one.state)
        for run in (one, other)[: 1 + (k >= STEPS)]:
            apply_command(run.state, command, run.scene.options.dt)
            run.engine.step(run.state, command)
    np.testing.assert_allclose(other.state.slides, one.state.slides, rtol=0.0, atol=AS_WELL)
    np.testing.assert_allclose(other.state.slip.total, one.state.slip.total, rtol=0.0, atol=AS_WELL)
    assert other.state.pulleys.wrap.first[0] == one.state.pulleys.wrap.first[0]


def first_command(run, **changed):
    return next(iter(run.stages(0.1)[0].commands(run.state)))._replace(**changed)


def test_loads_add_up(short_rig):
    """The forces on the nodes are those without a push, and the share of the push that acts."""
    runs = [begun(short_rig, "flex", QUICK, pushes=p) for p in ((), (Push(span="upper", x=1.0, across=1.0),))]
    forces = [run.engine.hold(run.state, first_command(run, share=0.5))[1].forces for run in runs]
    np.testing.assert_allclose((forces[1] - forces[0]).sum(axis=(0, 1)), [0.0, 0.5, 0.0], atol=1e-9)


def test_pulleys_and_guides_hold_what_is_theirs_and_nothing_else_is_held(short_rig):
    guide = GuideRoller(span="upper", x=1.0, gap=-1e-3, side=1.0, stiffness=1e6)
    run = begun(short_rig, "flex", QUICK, edge_guides=(guide,))
    _, springs = run.engine.hold(run.state, first_command(run))
    on = np.zeros(run.scene.mesh.stations, bool)
    for pulley in (0, 1):
        on[run.state.held_stations(pulley)] = True
    assert np.all(springs.stiffness[on] == run.scene.options.hold_stiffness)
    pressed = np.flatnonzero(springs.stiffness[~on].any(axis=(1, 2)))
    assert 1 <= len(pressed) <= 2
    assert np.all(springs.stiffness[~on][:, :, [0, 2]] == 0.0)
    assert np.all(springs.rest[~on][pressed, :, 1] < springs.nodes[~on][pressed, :, 1])
