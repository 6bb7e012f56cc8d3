"""A run of the scene that MuJoCo's contacts carry (``rolling_contact``), read like any 3D run."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, Observer
from belt_sim.errors import CannotRepresent, InputError, SimulationError
from belt_sim.io import write_text
from belt_sim.scene_parts import SceneParts
from belt_sim.space.machine import HEAD_SPIN, HEAD_YAW, STATION_JOINTS, TAIL_SLIDE, TAIL_YAW, SceneLayout
from belt_sim.space.mesh import node_name
from belt_sim.space.mujoco_interface import compile_model, mjcf, refuse_divergence, silence_expected_warnings
from belt_sim.space.options import Options
from belt_sim.space.pulleys import laid_poses
from belt_sim.space.rolling_contact import CASE, build_contact, case_words, rim_radius, story
from belt_sim.space.run import Recorder, RunState, YawPlan, notify_observers
from belt_sim.space.wrap import HEAD, TAIL, BeltOnPulley, SlipState, WrapArrays
from belt_sim.units import DEGREE

#: an MjSpec, or the path of an MJCF
Edited: TypeAlias = mujoco.MjSpec | str | Path


@contextmanager
def _one_line(edited: Edited) -> Iterator[None]:
    """Make one line of what MuJoCo says of a scene that it cannot read or compile."""
    try:
        yield
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError(
            "model.scene", _shown(edited), "", f"give an MJCF that belt-sim scene wrote ({reason})"
        ) from error


def _shown(edited: Edited | None) -> str:
    """The file that a scene comes from."""
    return str(edited) if isinstance(edited, str | Path) else ""


def _refuse_other_case(spec: mujoco.MjSpec, scene: SceneLayout, shown: str) -> np.ndarray:
    """The yaw [rad] at which an edited scene has its head and its tail pulley.

    Raises InputError for the first setting in which the case differs from the one that the scene was made of; yaw may.
    """
    texts = [text.data for text in spec.texts if text.name == CASE]
    if not texts:
        raise InputError("model.scene", shown, "", f'it has no text "{CASE}"; edit a scene that belt-sim scene wrote')
    made = dict(entry.split(" = ") for entry in texts[0].split("; "))
    for name, value in case_words(scene).items():
        if name not in ("yaw", "yaw_head") and value != made.get(name):
            there = made.get(name, "nothing")
            raise InputError(
                name, value, "", f"the scene was made with {there}: give that, or write a scene with {value}"
            )
    return np.array([float(made["yaw_head"]), float(made["yaw"])]) * DEGREE


_ACTUATORS = ("speed", "tension", "tail_yaw", "head_yaw")
_JOINTS = ("head-yaw", "head-spin", "tail-slide", "tail-yaw", "tail-spin")  # in the order of machine.HEAD_YAW ...


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
        the case's own, which was made of the same case."""
        if parts.sets_in or parts.head.taper or parts.tail.taper:
            raise CannotRepresent(
                "model.contact = mujoco: taper, yaw_offset, cant and lean would act before travel 0 already; "
                "write them with belt-sim scene, or use model.contact=held"
            )
        spec, scene = build_contact(case, belt, options, parts)
        mounted = np.array([float(case.settings.yaw_head.last()), float(case.settings.yaw.last())])
        if edited is not None:
            with _one_line(edited):
                spec = edited if isinstance(edited, mujoco.MjSpec) else mujoco.MjSpec.from_file(str(edited))
            mounted = _refuse_other_case(spec, scene, _shown(edited))
        with _one_line(edited or spec):
            model = compile_model(spec)
        if scene_path is not None:
            write_text(scene_path, mjcf(spec, story(scene)))
        return ContactRun(scene, model, mounted, _shown(edited))

    def __init__(self, scene: SceneLayout, model: mujoco.MjModel, mounted: np.ndarray, shown: str = "") -> None:
        """The belt laid round the pulleys, at its speed, ``scene.early`` before travel 0.

        mounted [rad]: yaw of head and tail pulley where their sliders are at 0; shown: the scene's file in messages.
        Raises InputError for a model that lacks the case's joints, nodes, actuators or key frame.
        """
        self.scene, self.model, self.data = scene, model, mujoco.MjData(model)
        n, m = scene.mesh.stations, scene.mesh.lines
        nodes = [f"{node_name(i, j)}-{axis}" for i in range(n) for j in range(m) for axis in "xyz"]
        kinds, number = mujoco.mjtObj, lambda kind, name: mujoco.mj_name2id(model, kind, name)
        wanted = [("joint", kinds.mjOBJ_JOINT, name) for name in (*_JOINTS, *nodes)]
        wanted += [("actuator", kinds.mjOBJ_ACTUATOR, name) for name in _ACTUATORS]
        wanted.append(("key frame", kinds.mjOBJ_KEY, "running"))
        for what, kind, name in wanted:
            if number(kind, name) < 0:
                remedy = "edit a scene that belt-sim scene made with the same settings, and leave its names"
                raise InputError("model.scene", f"{shown} has no {what} {name}".strip(), "", remedy)
        joints = np.array([number(kinds.mjOBJ_JOINT, name) for name in (*_JOINTS, *nodes)])
        self._places, self._rates = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        settings, options = scene.case.settings, scene.options
        self.rim = float(np.sign(float(settings.direction))) * rim_radius(scene)  # [m], signed
        # steps are made while the belt runs, within yaw_time: friction of contacts creeps at rest
        self.plan = YawPlan.from_settings(settings, step_over=options.yaw_time * options.run_speed)
        self.mounted = mounted
        mujoco.mj_resetDataKeyframe(model, self.data, model.key("running").id)
        self.data.qpos[self._places[[HEAD_YAW, TAIL_YAW]]] = self.plan.angles(-scene.early, -math.inf)
        # what holds a station is MuJoCo's contact: the wraps say only which lie there
        wraps = WrapArrays(*np.zeros((2, 2), int), *[np.zeros(0)] * 5)
        pulleys = BeltOnPulley(wraps, None, laid_poses(scene))  # type: ignore[arg-type]
        motion = [np.zeros(STATION_JOINTS), np.zeros(STATION_JOINTS), np.zeros((n, m, 3)), np.zeros((n, m, 3))]
        self.state = RunState(*motion, pulleys, SlipState.none(m, n), -scene.early)

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
                    read = (
                        self.data.qpos[self._places],
                        self.data.qvel[self._rates],
                    )  # wherever an edited scene has them
                    state.joints[:], state.joint_rates[:] = (values[:STATION_JOINTS] for values in read)
                    for values, slides in zip(read, (state.slides, state.slide_rates), strict=True):
                        slides[:] = values[STATION_JOINTS:].reshape(slides.shape)
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
        data.actuator("head_yaw").ctrl, data.actuator("tail_yaw").ctrl = (state.yaw - self.mounted) / DEGREE
        mujoco.mj_step(self.model, data)
        state.time, state.speed = data.time, data.qvel[self._rates[HEAD_SPIN]] * self.rim
        state.travel = data.qpos[self._places[HEAD_SPIN]] * self.rim - self.scene.early
        refuse_divergence(data)

    def _find_wraps(self) -> None:
        """Find what is read seldom: where the pulleys are, and which stations lie on them."""
        state, mesh = self.state, self.scene.mesh
        tail_x = float(self.scene.case.rig.centre_distance) + float(state.joints[TAIL_SLIDE])
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
