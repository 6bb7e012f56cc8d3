"""A run of the scene that MuJoCo's contacts carry (``rolling_contact``), read like any 3D run."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, Observer
from belt_sim.errors import InputError, SimulationError
from belt_sim.files import write_text
from belt_sim.scene_parts import SceneParts
from belt_sim.si import DEGREE
from belt_sim.space.machine import HEAD_SPIN, STATION_JOINTS, TAIL_SLIDE, SceneLayout
from belt_sim.space.mujoco_interface import compile_model, mjcf, refuse_divergence, silence_expected_warnings
from belt_sim.space.options import Options
from belt_sim.space.pulleys import laid_poses
from belt_sim.space.rolling_contact import STORY, build_contact
from belt_sim.space.run import Recorder, RunState, YawPlan, notify_observers
from belt_sim.space.wrap import HEAD, TAIL, BeltOnPulley, SlipState, WrapArrays

#: an MjSpec, or the path of an MJCF
Edited: TypeAlias = mujoco.MjSpec | str | Path


def _load_specification(edited: Edited) -> mujoco.MjSpec:
    """A scene that has been edited; raises InputError for a file that is no MJCF."""
    if isinstance(edited, mujoco.MjSpec):
        return edited
    try:
        return mujoco.MjSpec.from_file(str(edited))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError("model.scene", edited, "", f"give an MJCF that belt-sim scene wrote ({reason})") from error


_ACTUATORS = ("speed", "tension", "tail_yaw", "head_yaw")


class ContactRun:
    """A scene under way in plain MuJoCo; ``state`` is what the readings of a 3D run are taken from."""

    @staticmethod
    def begin(
        case: Case,
        belt: str,
        options: Options,
        parts: SceneParts,
        scene_path: Path | None = None,
        edited: Edited | None = None,
    ) -> "ContactRun":
        """Build the scene (and write its MJCF); options: fitted to the case; edited: the scene that is run instead of
        the case's own, with the joints, nodes and actuators of that."""
        spec, scene = build_contact(case, belt, options, parts)
        if edited is not None:
            spec = _load_specification(edited)
        model = compile_model(spec)
        if scene_path is not None:
            write_text(scene_path, mjcf(spec, STORY))
        return ContactRun(scene, model)

    def __init__(self, scene: SceneLayout, model: mujoco.MjModel) -> None:
        """The belt laid round the pulleys, at its speed, ``scene.early`` before travel 0.

        Raises InputError for a model that does not have the case's joints, nodes and actuators.
        """
        self.scene, self.model, self.data = scene, model, mujoco.MjData(model)
        n, m = scene.mesh.stations, scene.mesh.lines
        lacking = [name for name in _ACTUATORS if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) < 0]
        wanted = STATION_JOINTS + 3 * n * m
        if lacking or model.nq != wanted:
            what = f"no actuator {lacking[0]}" if lacking else f"{model.nq} coordinates, not {wanted}"
            raise InputError("model.scene", what, "", "edit a scene that belt-sim scene made with the same settings")
        settings, options = scene.case.settings, scene.options
        self.rim = float(np.sign(float(settings.direction))) * float(scene.case.rig.head_radius)  # [m], signed
        # steps are made while the belt runs, within yaw_time: friction of contacts creeps at rest
        self.plan = YawPlan.from_settings(settings, step_over=options.yaw_time * options.run_speed)
        mujoco.mj_resetDataKeyframe(model, self.data, model.key("running").id)
        joints, rates = self.data.qpos[:STATION_JOINTS], self.data.qvel[:STATION_JOINTS]
        slides, slide_rates = (v[STATION_JOINTS:].reshape(n, m, 3) for v in (self.data.qpos, self.data.qvel))
        # what holds a station is MuJoCo's contact: the wraps say only which lie there
        wraps = WrapArrays(*np.zeros((2, 2), int), *[np.zeros(0)] * 5)
        pulleys = BeltOnPulley(wraps, None, laid_poses(scene))  # type: ignore[arg-type]
        slip = SlipState.none(m, n)
        self.state = RunState(joints, rates, slides, slide_rates, pulleys, slip, -scene.early)

    def go(self, travel: float, observers: Sequence[Observer] = ()) -> Curves:
        """Run in, then ``travel`` [m]."""
        recorder, state = Recorder(self.scene, tuple(observers)), self.state

        def curves() -> Curves:
            """The curves without what is measured of held nodes alone."""
            found = recorder.curves()
            extra = {k: v for k, v in (found.extra or {}).items() if not k.startswith(("slip", "sliding"))}
            return replace(found, extra=extra)

        watched = notify_observers(recorder.observers, self.scene.case, travel, curves, self.model, self.data)
        with watched, silence_expected_warnings():
            while state.travel < travel + 0.5 * self.scene.options.sample:
                self._step()
                if recorder.is_due(state.travel):
                    self._find_wraps()
                    if not recorder.rows:
                        recorder.begin(state)
                recorder.step(state)
            self._find_wraps()
            recorder.end(state)
        return curves()

    def _step(self) -> None:
        """One step of MuJoCo with the sliders where the case wants them at this travel."""
        state, data = self.state, self.data
        state.yaw = self.plan.angles(state.travel, -math.inf)
        data.actuator("head_yaw").ctrl, data.actuator("tail_yaw").ctrl = state.yaw / DEGREE
        mujoco.mj_step(self.model, data)
        state.time, state.speed = data.time, data.qvel[HEAD_SPIN] * self.rim
        state.travel = data.qpos[HEAD_SPIN] * self.rim - self.scene.early
        refuse_divergence(data)

    def _find_wraps(self) -> None:
        """Find what is read seldom: where the pulleys are, and which stations lie on them."""
        state, mesh = self.state, self.scene.mesh
        tail_x = float(self.scene.case.rig.centre_distance) + float(self.data.qpos[TAIL_SLIDE])
        state.pulleys.pose.centre[TAIL, 0] = tail_x
        x = (mesh.rest + state.slides).mean(axis=1)[:, 0]
        ends = [_wrap_ends(np.flatnonzero(on), mesh.stations) for on in (x <= 0.0, x >= tail_x)]
        later = mesh.stations if ends[TAIL][0] < ends[HEAD][1] else 0  # the upper span runs from head to tail
        for which, (first, last) in enumerate(ends):
            state.pulleys.wrap.first[which] = first + later * which
            state.pulleys.wrap.last[which] = last + later * which


def _wrap_ends(stations: np.ndarray, n: int) -> tuple[int, int]:
    """First and last of consecutive station numbers, modulo n: first in 0..n-1, last above it.

    Raises SimulationError where there is none.
    """
    if not len(stations):
        raise SimulationError(
            "no node lies on a pulley: the belt has run off; turn the yaw back earlier or raise the tension"
        )
    gap = int(np.argmax(np.diff(stations, append=stations[0] + n)))
    first = int(stations[(gap + 1) % len(stations)])
    return first, first + len(stations) - 1
