"""The 3D belt on MJX: beside the native engine, in batches, its dynamics, its gradients, and what it refuses."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from paper_cases import paper_case

import belt_sim as bs
from belt_sim.case import Schedule
from belt_sim.effects.pulley import LiftOff, Taper
from belt_sim.effects.span import Camber, MachineTilt
from belt_sim.effects.yaw import Cant, YawCompliance
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.jax_setup import LEAST_EFFORT, in_float64, known_options
from belt_sim.mjx import READING, command, diverged, march, plan, prepare, scene, simulate_batch, stack_cases, step
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.native import run_native
from belt_sim.space.options import string_speed
from belt_sim.space.scene import TAIL_SLIDE, TAIL_YAW
from studies.paper.case import ROPE_EXAMPLE

COARSE = Options(dx=0.04, dt=1.5e-3, run_in=0.3, settle=0.2, acceleration=3.0)
TRAVEL = 0.4
SIX_EFFECTS = 0.03  # of the largest y: 1.8 % were measured, at 40 mm between stations and 1.5 ms
RUN = jax.jit(step, compiler_options=known_options(LEAST_EFFORT))  # one compilation for all loops below
SHOWN = 0.01  # of y_1 in the last frame within the curves: 0.15 % were measured, between two rows
PARITY = 0.01  # of the largest y: native itself moves by as much when its step is halved


def beside(found, native, begin=0.05):
    """By how much y is off native, in the largest y of native."""
    at = found.travel[(found.travel > begin) & (found.travel < native.travel[-1])]
    y, wanted = (np.array([np.interp(at, c.travel, line) for line in c.y]) for c in (found, native))
    return np.abs(y - wanted).max() / np.abs(wanted).max()


class Watcher:
    """Keeps what it is shown."""

    def __init__(self):
        self.frames, self.curves = [], None

    def start(self, case, travel):
        self.case = case

    def frame(self, frame):
        self.frames.append(frame)

    def finish(self, curves):
        self.curves = curves


def test_a_batch_is_beside_native_and_each_case_by_itself():
    """One is watched, one is straight, one runs off its pulleys and stops no other."""
    yawed, travel = paper_case(60.0, rig=ROPE_EXAMPLE), 0.3
    turns = Schedule.step(0.0), Schedule.ramp(0.5, 0.0, 0.1)
    straight, far = (replace(yawed, settings=replace(yawed.settings, yaw=turn)) for turn in turns)
    watcher, options = Watcher(), replace(COARSE, run_in=0.1, settle=0.1, yaw_time=0.1)
    cases = [yawed, straight, far]
    found, still, lost = simulate_batch(cases, travel=travel, options=options, chunk=3, observers=[[watcher]])
    assert beside(found, run_native(yawed, travel=travel, options=options)) < PARITY
    assert found.extra["tension"][-1] == pytest.approx(60e6, rel=0.05)
    assert np.abs(still.y).max() < 1e-7
    assert isinstance(lost, SimulationError)
    assert "ran off" in str(lost)
    assert len(lost.curves.travel) < len(found.travel)
    assert len(watcher.frames) > 3
    assert watcher.frames[-1].travel == pytest.approx(travel, abs=0.03)  # the last instant is there
    last = [frame for frame in watcher.frames if frame.travel <= found.travel[-1]][-1]
    assert last.points[0, 1] == pytest.approx(np.interp(last.travel, found.travel, found.y[0]), rel=SHOWN)
    np.testing.assert_array_equal(watcher.curves.travel, found.travel)


@pytest.mark.long
def test_a_grid_with_effects_is_beside_native():
    """Pulley shapes, camber, guide, bending layer, leaning machine and compliance, all in one scene."""
    case = paper_case(60.0, rig=ROPE_EXAMPLE)
    several = [
        Taper(kappa_t=1e-3),
        Cant(gamma=5e-4),
        YawCompliance(c_m=1e-5),
        MachineTilt(angle=0.3),
        Camber(kappa_c=2e-4),
        LiftOff(strength=1.0),
    ]
    parts = SpaceModel(belt="grid", options=COARSE).parts(case, several)
    found = simulate_batch([case], belt="grid", travel=TRAVEL, options=COARSE, parts=[parts])[0]
    assert not isinstance(found, SimulationError)
    native = run_native(case, belt="grid", travel=TRAVEL, options=COARSE, parts=parts)
    plain = run_native(case, belt="grid", travel=TRAVEL, options=COARSE)
    assert np.abs(native.y - plain.y).max() > 5.0 * PARITY * np.abs(native.y).max()  # the effects do something
    assert beside(found, native) < SIX_EFFECTS


@in_float64
def test_a_plucked_span_swings_like_a_string():
    """1 mm of its first mode; the implicit step damps it, and a finer one less."""
    options = replace(COARSE, dt=1e-3)
    case = paper_case(40.0, rig=ROPE_EXAMPLE)
    ready = prepare([case], options=options)[0]
    mesh = ready.scene.mesh
    x, high = mesh.laid[..., 0], mesh.laid[..., 2] > 0.0
    length = float(case.rig.span_length)
    pluck = np.where(high & (x > 0.0) & (x < length), 1e-3 * np.sin(np.pi * np.clip(x, 0.0, length) / length), 0.0)
    qpos = np.array(ready.data.mjx.qpos)
    qpos[-pluck.size * 3 :].reshape(*pluck.shape, 3)[..., 2] += pluck
    data = ready.data._replace(mjx=ready.data.mjx.replace(qpos=jnp.array(qpos)))
    rows = plan(ready, 0.1)
    still = jax.tree.map(lambda c: jnp.asarray(c[0]), rows)._replace(drag=jnp.zeros(2))

    sags = []
    for _ in range(250):
        data = RUN(ready.model, data, still)
        sags.append(float(data.reading[READING["sag"]][0]))
    sag = np.array(sags)
    sag = sag - sag[125:].mean()
    down = np.flatnonzero((sag[:-1] > 0.0) & (sag[1:] <= 0.0))
    frequency = 1.0 / (np.diff(down).mean() * options.dt)
    assert len(down) >= 3
    assert frequency == pytest.approx(string_speed(case) / (2.0 * length), rel=0.02)
    assert np.abs(sag[-62:]).max() < 0.9 * np.abs(sag[:62]).max()


@in_float64
def test_the_belt_starts_and_stops_as_commanded():
    """A controller's own loop: the belt runs 0.1 s at 1 m/s and stops; the tail pulley's rim follows it."""
    ready = prepare([paper_case(60.0, rig=ROPE_EXAMPLE)], options=COARSE)[0]
    yaw, data, spins = jnp.zeros(2), ready.data, []
    for k in range(150):
        speed = jnp.array(min(k / 50, 1.0) if k < 100 else max(1.0 - (k - 100) / 25, 0.0))
        data = RUN(ready.model, data, command(ready.model, data, speed, yaw, acceleration=jnp.inf))
        spins.append(float(data.pulleys.pose.spin[1]))
    radius = float(ready.case.rig.tail_radius)
    turned = radius * (spins[-1] - spins[0])
    assert turned == pytest.approx(float(data.travel - ready.data.travel), rel=0.02)
    assert abs(spins[-1] - spins[-2]) * radius < 0.05 * COARSE.dt  # it stands: a twentieth of 1 m/s
    assert np.isfinite(np.asarray(data.reading)).all()


@pytest.mark.long
@in_float64
def test_the_gradient_through_time_is_that_of_differences():
    """y of point 1 by the yaw after 0.06 m, forwards and backwards; landings stay where they are."""
    ready = prepare([paper_case(60.0, rig=ROPE_EXAMPLE)], options=replace(COARSE, run_in=0.1, yaw_time=0.05))[0]
    rows = jax.tree.map(jnp.asarray, plan(ready, 0.03))

    def last(scale):
        return march(ready.model, ready.data, rows._replace(yaw=scale * rows.yaw))[0].reading[0]

    value, slope = jax.jit(lambda s: jax.jvp(last, (s,), (1.0,)))(1.0)
    above, below = (jax.jit(last)(s) for s in (1.01, 0.99))
    assert float(value) != 0.0
    assert float(slope) == pytest.approx(float(above - below) / 0.02, rel=1e-4)


@pytest.mark.long
@in_float64
def test_gradients_backwards_keep_the_beginning_of_pieces_alone():
    """20 steps in pieces of 5 while the yaw sets in: 7 MB, where all steps kept are 47 MB."""
    ready = prepare([paper_case(60.0, 1e-3, ROPE_EXAMPLE)], options=replace(COARSE, run_in=0.1, yaw_time=0.05))[0]
    rows = jax.tree.map(jnp.asarray, plan(ready, 0.03))
    begin = int(np.argmax(np.asarray(rows.yaw[:, 1]) > 0.0))
    before, turning = (jax.tree.map(lambda c, s=s: c[s], rows) for s in (slice(begin), slice(begin, begin + 20)))
    brief = known_options(LEAST_EFFORT)
    data = jax.jit(lambda: march(ready.model, ready.data, before)[0], compiler_options=brief)()

    def moment(scale):
        read = march(ready.model, data, turning._replace(yaw=scale * turning.yaw), piece=5)[1]
        return read[-1, READING["moment"]][0]

    run = jax.jit(jax.grad(moment)).lower(1.0).compile(compiler_options=brief)
    above, below = (jax.jit(moment, compiler_options=brief)(s) for s in (1.01, 0.99))
    assert abs(float(above - below)) > 1e-3
    assert float(run(1.0)) == pytest.approx(float(above - below) / 0.02, rel=1e-3)
    assert run.memory_analysis().temp_size_in_bytes < 12e6


@in_float64
def test_a_jump_of_speed_and_yaw_is_made_at_the_rates_of_the_command():
    """The belt runs on; a yaw of 3 degrees at once folds it, which ``diverged`` says."""
    ready = prepare([paper_case(60.0, rig=ROPE_EXAMPLE)], options=COARSE)[0]
    speed, yaw, data, dt = jnp.array(0.4), jnp.array([0.0, 0.001]), ready.data, COARSE.dt
    for k in range(1, 120):
        data = RUN(ready.model, data, command(ready.model, data, speed, yaw))
        assert float(data.reading[READING["speed"]]) == pytest.approx(min(3.0 * dt * k, 0.4))
        assert float(data.mjx.qpos[TAIL_YAW]) == pytest.approx(min(0.02 * dt * k, 0.001))
    assert not diverged(ready.model, data)
    for _ in range(100):
        at_once = command(ready.model, data, speed, 50.0 * yaw, acceleration=jnp.inf, turning=jnp.inf)
        data = RUN(ready.model, data, at_once)
    assert diverged(ready.model, data)


@pytest.mark.long
@in_float64
def test_users_add_actuators_and_sensors_to_the_scene():
    """A motor on the tail's slide takes a tenth off the tension; a sensor says where the slide is."""
    case = paper_case(60.0, rig=ROPE_EXAMPLE)
    spec = scene(case, options=COARSE)
    motor = spec.add_actuator(name="tension", target="tail-slide", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.gainprm[0] = 1.0
    kind = mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtObj.mjOBJ_JOINT
    spec.add_sensor(name="slide", type=kind[0], objtype=kind[1], objname="tail-slide")
    ready = prepare([case], options=COARSE, spec=spec)[0]
    less = -0.2 * float(case.tension_force)
    data = ready.data._replace(mjx=ready.data.mjx.replace(ctrl=jnp.array([less])))
    run, still = jax.jit(step), jnp.array(0.0)
    for _ in range(150):
        data = run(ready.model, data, command(ready.model, data, still, jnp.zeros(2), drag=15.0))
    assert float(data.reading[READING["tension"]]) == pytest.approx(0.9 * float(case.settings.tension), rel=0.02)
    assert float(data.mjx.sensordata[0]) == pytest.approx(float(data.mjx.qpos[TAIL_SLIDE]), abs=1e-12)


def test_data_of_any_case_are_shown_with_the_belt():
    """The renderer's vertices are the nodes of that case, whose stress-free belt is another than the shared one's."""
    ready = prepare([paper_case(t, rig=ROPE_EXAMPLE) for t in (40.0, 60.0)], options=COARSE)
    for one in ready:
        shown = one.to_mujoco(one.data)
        nodes = one.scene.mesh.laid.reshape(-1, 3)
        assert one.drawable.nflex == 1
        np.testing.assert_allclose(shown.flexvert_xpos, nodes, rtol=0.0, atol=1e-12)
        assert shown.body("tail-pulley").xpos[0] == pytest.approx(float(one.data.pulleys.pose.centre[1, 0]), abs=1e-12)
    moved = ready[1].data.mjx.replace(qpos=ready[1].data.mjx.qpos.at[-2].add(0.01))
    assert ready[1].to_mujoco(moved).flexvert_xpos[-1, 1] - nodes[-1, 1] == pytest.approx(0.01)


@pytest.mark.long
def test_a_belt_with_friction_is_beside_native():
    case, options = paper_case(60.0, rig=ROPE_EXAMPLE), replace(COARSE, friction=0.1)
    sticking = run_native(case, travel=TRAVEL, options=COARSE)
    native = run_native(case, travel=TRAVEL, options=options)
    found = simulate_batch([case], travel=TRAVEL, options=options)[0]
    assert np.abs(native.y - sticking.y).max() > 5.0 * PARITY * np.abs(native.y).max()  # it slides
    assert beside(found, native) < PARITY


def test_cases_share_what_is_alike():
    ready = prepare([paper_case(t, rig=ROPE_EXAMPLE) for t in (40.0, 60.0)], options=COARSE)
    model, axes = stack_cases([r.model for r in ready])
    assert axes.belt.load == 0
    assert axes.belt.area is None
    assert np.shape(model.belt.load) == (2,)


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("mujoco_rope", "rope"),
        ({"name": "mujoco_grid", "bonds": ["longitudinal", "transverse"]}, "bending stiffness"),
        ({"name": "mujoco_flex", "contact": "mujoco"}, "contact"),
    ],
)
def test_what_it_cannot_do_is_said_in_a_line(model, words):
    with pytest.raises(CannotRepresent, match=words) as refusal:
        bs.simulate(model=model, engine="mjx", travel=1.0, rig="rope_example")
    assert "engine=native" in str(refusal.value)


def test_a_batch_has_one_mesh():
    with pytest.raises(InputError, match="one mesh"):
        simulate_batch([paper_case(40.0), paper_case(40.0, rig=ROPE_EXAMPLE)], travel=0.1, options=COARSE)


@pytest.mark.long
@pytest.mark.parametrize(("tension", "dt"), [(7.0, 5e-4), (20.0, 5e-4), (40.0, 1e-3)])
def test_the_short_rig_is_beside_native_over_two_metres(tension, dt):
    case, options = paper_case(tension, rig=ROPE_EXAMPLE), Options(dt=dt)
    found = simulate_batch([case], travel=2.0, options=options)[0]
    assert beside(found, run_native(case, travel=2.0, options=options)) < PARITY
