"""A run in three dimensions: case in, curves out."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError, RunFailed
from belt_sim.frame import Observer
from belt_sim.mujoco3d.belt import BeltModel, drag
from belt_sim.mujoco3d.camber import Camber
from belt_sim.mujoco3d.chain import Chain
from belt_sim.mujoco3d.contact import Contact
from belt_sim.mujoco3d.friction import Friction
from belt_sim.mujoco3d.grid import Grid
from belt_sim.mujoco3d.guide import Guides
from belt_sim.mujoco3d.hold import TAIL
from belt_sim.mujoco3d.limp import Limp, is_limp
from belt_sim.mujoco3d.machine import Machine
from belt_sim.mujoco3d.membrane import Membrane
from belt_sim.mujoco3d.options import BELTS, Options
from belt_sim.mujoco3d.record import Recorder
from belt_sim.mujoco3d.scene import Scene, build, undisturbed
from belt_sim.mujoco3d.stage import Clock
from belt_sim.mujoco3d.tangent import Tangent
from belt_sim.mujoco3d.tensioning import FRICTION, Apart
from belt_sim.mujoco3d.torsion import Torsion
from belt_sim.mujoco3d.written import write_scene
from belt_sim.scene_parts import SceneParts

_BELTS: dict[str, Callable[[], BeltModel]] = {"rope": Chain, "grid": Grid, "flex": Membrane}
_FASTEST = 2.0  # [m/s]
_SLOWNESS = 35.0  # landings shake the spans; at a 35th of the string speed sag and tension stay within 1 %
_COURANT = 0.5
_LIMP_DRAG = 2.0  # times string speed / span length: a third of critical for the lowest sway of a limp span
_FRAMES = 40  # while the pulleys move apart
_REST_DRAG = 15.0  # [1/s], about critical for the lowest sway of a span


def simulate(
    case: Case,
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    scene_path: Path | None = None,
    parts: SceneParts | None = None,
    observers: Sequence[Observer] = (),
    control: bool = False,
) -> Curves:
    """Run ``case`` over ``travel`` [m] of belt and return its curves; y = 0 at travel 0.

    belt: "rope", "grid" or "flex"; scene_path: where to write the MJCF; parts: what stands in the scene, None = as the
    case has it; control: subtract a run without yaw.
    Raises RunFailed, with the curves so far in its ``curves``, when the run diverges, and CannotRepresent for a limp
    belt with finite friction: the friction law takes the place of the last station on a pulley for its own.
    """
    if belt not in BELTS:
        raise InputError("belt", belt, "", f"choose one of {', '.join(BELTS)}")
    options = options or Options()
    parts = parts or undisturbed(case, options)
    if math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"options.friction = {parts.friction:g}: a limp belt sticks here; leave it out")
    options = fitted(options, case, belt)
    curves = Run.begin(case, belt, options, observers, parts, scene_path).go(travel)
    if not control:
        return curves
    aligned = replace(case.settings, yaw=Schedule.step(0.0), yaw_head=Schedule.step(0.0))
    zero = Run.begin(replace(case, settings=aligned), belt, options, (), parts, None).go(travel)
    drift = np.array([np.interp(curves.travel, zero.travel, y) for y in zero.y])
    names = {f"control_{k + 1}": y for k, y in enumerate(drift)}
    return replace(curves, y=curves.y - drift, extra=(curves.extra or {}) | names)


def fitted(options: Options, case: Case, belt: str) -> Options:
    """Options for this case: the automatic belt speed filled in, and the step of belts made of springs bounded.

    Belt speed: a 35th of the string speed c = sqrt(sigma / rho), at most 2 m/s. Springs (tendons) lend MuJoCo's
    metric no stiffness across their direction, so that the step stays below dx / c; limp spans get a drag that calms
    them between landings.
    Raises InputError when a link on a pulley would turn further in a step than its strain can bear.
    """
    string_speed = math.sqrt(float(case.settings.tension) / float(case.belt.density))
    speed = options.belt_speed or min(_FASTEST, string_speed / _SLOWNESS)
    dt = options.dt if belt == "flex" else min(options.dt, _COURANT * options.dx / string_speed)
    radius = min(float(case.rig.head_radius), float(case.rig.tail_radius))
    longest = radius / speed * math.sqrt(2.0 * float(case.settings.tension) / float(case.belt.youngs_modulus))
    if belt != "rope" and dt > longest:
        raise InputError(
            "options.dt", dt, "s", f"give at most {longest:.1e} at {speed:.2f} m/s, or a slower belt_speed"
        )
    damping = options.damping
    if is_limp(belt, options):
        damping = max(damping, _LIMP_DRAG * string_speed / float(case.rig.span_length))
    return replace(options, belt_speed=speed, dt=dt, damping=damping)


class Run:
    """One run under way: the scene, the pulleys, the belt on them, and what is recorded."""

    def __init__(self, scene: Scene, data: mujoco.MjData, machine: Machine, contact: Contact, recorder: Recorder):
        self.scene, self.data, self.machine, self.contact, self.recorder = scene, data, machine, contact, recorder
        self.torsion = Torsion.of(machine.case, contact, data)
        self.camber, self.guides = Camber.of(scene), Guides(tuple(scene.parts.edge_guides), contact)
        self.sign = float(np.sign(float(machine.case.settings.direction)))
        self.limp: Limp | None = None

    @staticmethod
    def begin(case, belt: str, options: Options, observers, parts: SceneParts, scene_path: Path | None) -> "Run":
        """Build the scene (and write its MJCF) with the belt laid round the pulleys."""
        spec, scene = build(case, _BELTS[belt](), options, parts)
        if scene_path is not None:
            write_scene(spec, scene_path)
        data = mujoco.MjData(scene.model)
        mujoco.mj_resetDataKeyframe(scene.model, data, 0)
        machine = Machine.begin(case, scene, options)
        machine.slide_speed = 0.0 if options.tensioning == "length" else None
        machine.put(data)
        slides = math.isfinite(parts.friction) or options.tensioning == "koller"
        friction = Friction(parts.friction, Tangent.of(scene) if slides else None)
        contact = Contact.begin(scene, data, machine.poses, friction, options.hold_stiffness)
        run = Run(scene, data, machine, contact, Recorder(case, contact, machine, options, tuple(observers)))
        if is_limp(belt, options):
            run.limp = Limp.of(contact, data, int(run.sign), options.damping)
        return run

    def go(self, travel: float) -> Curves:
        """Rest, run-in, run."""
        recorder = self.recorder
        for observer in recorder.observers:
            observer.start(self.machine.case, travel)
        warn = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(_ignore)
        try:
            if self.scene.apart is not None:
                self._move_apart(self.scene.apart)
            else:
                self._rest()
            self._march(travel)
        except RunFailed as failure:
            failure.curves = recorder.curves()  # type: ignore[attr-defined]
            raise
        finally:
            mujoco.set_mju_user_warning(warn)
            for observer in recorder.observers:
                observer.finish(recorder.curves())
        return recorder.curves()

    def _rest(self) -> None:
        """Let the spans hang to rest and the tail pulley find its place, before the belt runs."""
        model, options = self.scene.model, self.recorder.options
        model.dof_damping[self.scene.base :] = drag(self.scene.mesh, _REST_DRAG, _REST_DRAG)
        steps = math.ceil(options.settle / model.opt.timestep)
        for k in range(steps):
            self.contact.slips = 2 * k > steps
            self._step(self.machine.poses[0].spin, 0.0, 0.0)
        model.dof_damping[self.scene.base :] = drag(self.scene.mesh, 0.0, options.damping)

    def _move_apart(self, apart: Apart) -> None:
        """Koller's procedure: the slack belt is driven slowly while the tail pulley moves out, until its load is there.

        Meanwhile the belt slides on the pulleys: if it stuck, the stretch of its wraps would stay what it was when the
        belt was slack, and stations would leave the pulleys with a jerk.
        """
        options, machine, contact, given = self.recorder.options, self.machine, self.contact, self.contact.friction
        contact.friction = replace(given, friction=min(given.friction, FRICTION), slip=np.zeros(2))
        machine.slide_speed = 0.0
        self._rest()
        start = -options.run_in - apart.travel
        slowly = replace(options, belt_speed=min(apart.speed, options.belt_speed))
        clock = Clock(options=slowly, stops=[-options.run_in], end=0.0, travel=start, time=self.data.time)
        while clock.moving:
            before, here = clock.speed, apart.at(clock.travel - start)
            clock.advance(options.dt)
            reached = -contact.loads[TAIL][0] >= machine.load or clock.travel >= -options.run_in
            if machine.slide_speed is None or reached:
                machine.slide_speed, machine.lead = None, 0.0
            else:
                machine.slide_speed, machine.lead = (apart.at(clock.travel - start) - here) / options.dt
            self._step(self.sign * clock.travel / self.scene.parts.head.radius, clock.speed,
                       (clock.speed - before) / options.dt)  # fmt: skip
            self.recorder.watch(clock, apart.travel / _FRAMES)
        self._rest()
        contact.friction = given
        for wrap in contact.wraps:
            wrap.way[:] = 0.0

    def _march(self, travel: float) -> None:
        options, machine = self.recorder.options, self.machine
        clock = Clock(
            options=options, stops=machine.stops(travel), end=travel + 0.5 * options.sample, travel=-options.run_in,
            time=self.data.time,
        )  # fmt: skip
        while not clock.finished:
            before = clock.speed
            clock.advance(options.dt)
            if self.recorder.start is None and clock.travel >= 0.0:
                self.recorder.begin(clock)
                self.contact.shape_pulleys()
            machine.command(clock)
            spin = self.sign * clock.travel / self.scene.parts.head.radius
            self._step(spin, clock.speed, (clock.speed - before) / options.dt)
            self.recorder.step(clock)

    def _step(self, head_spin: float, speed: float, acceleration: float) -> None:
        model, data, contact, machine = self.scene.model, self.data, self.contact, self.machine
        machine.before(data, contact.loads, head_spin, speed, acceleration, model.opt.timestep)
        contact.follow(machine.poses)
        if self.limp is not None:
            self.limp.lead_off(machine.poses)
            self.limp.spare(speed, model.opt.timestep)
        self.guides.apply()
        if self.camber is not None:
            self.camber.act(machine.share)
        self.torsion.apply(contact, machine.poses, max(-0.5 * contact.loads[TAIL][0], 0.0))
        mujoco.mj_step(model, data)
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos[-1]):
            raise RunFailed(f"the belt's acceleration grew without bound at {data.time:.3f} s: halve options.dt")
        machine.read(data)
        contact.settle(machine.poses, speed)


def _ignore(message: str) -> None:
    """MuJoCo warns that its preliminary iterative solve has not converged; the exact Newton step follows it."""
