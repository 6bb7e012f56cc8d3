"""Runs of the scene that contacts carry: sliders set against travel, readings and frames as of every 3D run."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np

from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import Curves
from belt_sim.errors import InputError, RunFailed
from belt_sim.files import write_text
from belt_sim.frame import Observer, SceneObserver
from belt_sim.mujoco3d.machine.scene import HEAD_SPIN, STATION_JOINTS, TAIL_SLIDE, Scene
from belt_sim.mujoco3d.machine.yaw import YawPlan
from belt_sim.mujoco3d.mesh.belt import BeltModel
from belt_sim.mujoco3d.mujoco_4 import compiled, mjcf
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.rolling_contact.scene import ACTUATORS, STORY, build_contact
from belt_sim.mujoco3d.run.record import Recorder
from belt_sim.mujoco3d.state import HEAD, TAIL, Pose, State, Wrap
from belt_sim.scene_parts import SceneParts
from belt_sim.si import DEGREE

#: an MjSpec, or the path of an MJCF
Edited: TypeAlias = mujoco.MjSpec | str | Path


def run_contact(
    case: Case,
    belt: BeltModel,
    travel: float,
    options: Options,
    parts: SceneParts,
    scene_path: Path | None = None,
    observers: Sequence[Observer] = (),
    edited: Edited | None = None,
) -> Curves:
    """Curves over ``travel`` [m] of a belt on colliding pulleys; options: fitted to the case.

    edited: the scene that is run instead of the case's own; it has the joints, nodes and actuators of that.
    """
    spec, scene = build_contact(case, belt, options, parts)
    if edited is not None:
        spec = specification(edited)
    model = compiled(spec)
    if scene_path is not None:
        write_text(scene_path, mjcf(spec, STORY))
    return ContactRun(scene, model).go(travel, observers)


def specification(edited: Edited) -> mujoco.MjSpec:
    """A scene that has been edited; raises InputError for a file that is no MJCF."""
    if isinstance(edited, mujoco.MjSpec):
        return edited
    try:
        return mujoco.MjSpec.from_file(str(edited))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError("model.scene", edited, "", f"give an MJCF that belt-sim scene wrote ({reason})") from error


class ContactRun:
    """A scene under way in plain MuJoCo; ``state`` is what the readings of a 3D run are taken from."""

    def __init__(self, scene: Scene, model: mujoco.MjModel) -> None:
        """Raises InputError for a model that does not have the case's joints, nodes and actuators."""
        self.scene, self.model, self.data = scene, model, mujoco.MjData(model)
        n, m = scene.mesh.stations, scene.mesh.across
        lacking = [name for name in ACTUATORS if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) < 0]
        wanted = STATION_JOINTS + 3 * n * m
        if lacking or model.nq != wanted:
            what = f"no actuator {lacking[0]}" if lacking else f"{model.nq} coordinates, not {wanted}"
            raise InputError("model.scene", what, "", "edit a scene that belt-sim scene made with the same settings")
        self.sliders = {name: model.actuator(name).id for name in ACTUATORS}
        self.sign = float(np.sign(float(scene.case.settings.direction)))
        self.radius = float(scene.case.rig.head_radius)
        self.plan = _while_running(scene.case.settings, scene.options.pace, scene.options.yaw_time)
        self.state = self._laid()

    def _laid(self) -> State:
        """The belt laid round the pulleys, at its speed, ``scene.early`` before travel 0."""
        mujoco.mj_resetDataKeyframe(self.model, self.data, self.model.key("running").id)
        mesh, parts, qpos, qvel = self.scene.mesh, self.scene.parts, self.data.qpos, self.data.qvel
        n, m = mesh.stations, mesh.across
        wraps = Wrap.empty(parts.head, 0.0, n, m), Wrap.empty(parts.tail, 0.0, n, m)
        poses = Pose(np.zeros(3), np.eye(3), 0.0), Pose(np.zeros(3), np.eye(3), 0.0)
        return State(
            joints=qpos[:STATION_JOINTS], joint_rates=qvel[:STATION_JOINTS],
            slides=qpos[STATION_JOINTS:].reshape(n, m, 3), slide_rates=qvel[STATION_JOINTS:].reshape(n, m, 3),
            poses=poses, wraps=wraps, loads=np.zeros((2, 3)), yaw=np.zeros(2), given_way=np.zeros(2), slip=np.zeros(2),
            led=[], kink_slope=np.zeros((2, m)), met=[], turned=np.zeros(2), aside=np.zeros(2),
            travel=-self.scene.early,
        )  # fmt: skip

    def go(self, travel: float, observers: Sequence[Observer] = ()) -> Curves:
        """Run in, then ``travel`` [m]; a yaw step is made while the belt runs, within options.yaw_time."""
        scene, recorder = self.scene, Recorder(self.scene, tuple(observers))
        for observer in recorder.observers:
            observer.start(scene.case, travel)
            if isinstance(observer, SceneObserver):
                observer.show(self.model, self.data)
        try:
            while self.state.travel < travel + 0.5 * scene.options.sample:
                self.step()
                if recorder.start is None and self.state.travel >= 0.0:
                    recorder.begin(self.place())
                if recorder.due(self.state.travel):
                    self.place()
                recorder.step(self.state)
        except RunFailed as failure:
            failure.curves = _without_slip(recorder.curves())
            raise
        finally:
            for observer in recorder.observers:
                observer.finish(recorder.curves())
        return _without_slip(recorder.curves())

    def step(self) -> None:
        """One step of MuJoCo with the sliders where the case wants them at this travel."""
        state, data = self.state, self.data
        state.yaw = self.plan.angles(state.travel, -math.inf)
        data.ctrl[self.sliders["head_yaw"]], data.ctrl[self.sliders["tail_yaw"]] = state.yaw / DEGREE
        mujoco.mj_step(self.model, data)
        state.time = data.time
        state.speed = self.sign * data.qvel[HEAD_SPIN] * self.radius
        state.travel = self.sign * data.qpos[HEAD_SPIN] * self.radius - self.scene.early
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos[-1]):
            raise RunFailed(f"the belt's acceleration grew without bound at {data.time:.3f} s: halve options.dt")

    def place(self) -> State:
        """The state with what is read seldom: where the pulleys are, and which stations lie on them."""
        state, mesh = self.state, self.scene.mesh
        tail_x = float(self.scene.case.rig.centre_distance) + float(self.data.qpos[TAIL_SLIDE])
        state.poses[TAIL].centre[0] = tail_x
        x = (mesh.rest + state.slides).mean(axis=1)[:, 0]
        for wrap, on in ((state.wraps[HEAD], x <= 0.0), (state.wraps[TAIL], x >= tail_x)):
            at = np.flatnonzero(on)
            wrap.first, wrap.last = _ends(at, mesh.stations)
            wrap.renumber()
        if state.wraps[TAIL].first < state.wraps[HEAD].last:  # the upper span runs from head to tail
            state.wraps[TAIL].first += mesh.stations
            state.wraps[TAIL].last += mesh.stations
        return state


def _without_slip(curves: Curves) -> Curves:
    """The curves without what is measured of held nodes alone."""
    return replace(
        curves, extra={k: v for k, v in (curves.extra or {}).items() if not k.startswith(("slip", "sliding"))}
    )


def _ends(stations: np.ndarray, n: int) -> tuple[int, int]:
    """First and last of consecutive station numbers, modulo n: first in 0..n-1, last above it."""
    gap = int(np.argmax(np.diff(stations, append=stations[0] + n)))
    first = int(stations[(gap + 1) % len(stations)])
    return first, first + len(stations) - 1


def _while_running(settings: Settings, pace: float, yaw_time: float) -> YawPlan:
    """Yaw steps spread over ``yaw_time`` [s] of running at ``pace`` [m/s]: friction of contacts creeps at rest."""

    def spread(schedule: Schedule) -> Schedule:
        over = np.asarray(schedule.over, float)
        return replace(schedule, over=np.where(over > 0.0, over, yaw_time * pace))

    return YawPlan.of(replace(settings, yaw=spread(settings.yaw), yaw_head=spread(settings.yaw_head)))
