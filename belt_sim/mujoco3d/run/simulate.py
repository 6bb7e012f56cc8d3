"""A run in three dimensions: case in, curves out."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError, RunFailed
from belt_sim.files import write_text
from belt_sim.frame import Observer, SceneObserver
from belt_sim.mujoco3d.machine.scene import Scene, build
from belt_sim.mujoco3d.mesh.belt import BeltModel
from belt_sim.mujoco3d.mesh.chain import Chain
from belt_sim.mujoco3d.mesh.grid import Grid
from belt_sim.mujoco3d.mesh.membrane import Membrane
from belt_sim.mujoco3d.mujoco_4 import Solver, compiled, mjcf
from belt_sim.mujoco3d.options import BELTS, CONTACTS, Options, is_limp
from belt_sim.mujoco3d.rolling_contact.scene import build_contact
from belt_sim.mujoco3d.rolling_contact.simulate import Edited, run_contact
from belt_sim.mujoco3d.run.engine import Engine, command
from belt_sim.mujoco3d.run.fitted import fitted, for_contact
from belt_sim.mujoco3d.run.record import Recorder
from belt_sim.mujoco3d.run.stages import Stage, stages
from belt_sim.mujoco3d.state import State
from belt_sim.mujoco3d.wrap.contact import shape_pulleys
from belt_sim.scene_parts import SceneParts

BELT_MODELS: dict[str, Callable[[], BeltModel]] = {"rope": Chain, "grid": Grid, "flex": Membrane}


def simulate(
    case: Case,
    *,
    belt: str = "flex",
    travel: float,
    options: Options | None = None,
    parts: SceneParts | None = None,
    scene_path: Path | None = None,
    observers: Sequence[Observer] = (),
    control: bool = False,
    contact: str = CONTACTS[0],
    edited: Edited | None = None,
) -> Curves:
    """Run ``case`` over ``travel`` [m] of belt and return its curves; y = 0 at travel 0.

    belt: "rope", "grid" or "flex"; parts: what stands in the scene, None = as the case has it; scene_path: where to
    write the MJCF; control: subtract a run without yaw; contact: one of CONTACTS; edited: with "mujoco", the scene that
    is run instead of the case's own.
    Raises RunFailed, with the curves so far in its ``curves``, when the run diverges, and CannotRepresent for a limp
    belt with finite friction: the friction law takes the place of the last station on a pulley for its own.
    """
    if belt not in BELTS:
        raise InputError("belt", belt, "", f"choose one of {', '.join(BELTS)}")
    options = options or Options()
    parts = parts or SceneParts.undisturbed(case, options.friction)
    held = contact == CONTACTS[0]
    if held and math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"options.friction = {parts.friction:g}: a limp belt sticks here; leave it out")
    options = fitted(options if held else for_contact(options), case, belt)

    def run(case: Case, path: Path | None = None, observers: Sequence[Observer] = ()) -> Curves:
        if held:
            return Run.begin(case, belt, options, parts, path).go(travel, observers)
        return run_contact(case, BELT_MODELS[belt](), travel, options, parts, path, observers, edited)

    curves = run(case, scene_path, observers)
    if not control:
        return curves
    aligned = replace(case.settings, yaw=Schedule.step(0.0), yaw_head=Schedule.step(0.0))
    zero = run(replace(case, settings=aligned))
    drift = np.array([np.interp(curves.travel, zero.travel, y) for y in zero.y])
    names = {f"control_{k + 1}": y for k, y in enumerate(drift)}
    return replace(curves, y=curves.y - drift, extra=(curves.extra or {}) | names)


def contact_scene(case: Case, belt: str, options: Options) -> mujoco.MjSpec:
    """The specification of a case's scene that MuJoCo's contacts carry."""
    options = fitted(for_contact(options), case, belt)
    return build_contact(case, BELT_MODELS[belt](), options, SceneParts.undisturbed(case, options.friction))[0]


@dataclass
class Run:
    """One run under way."""

    scene: Scene
    engine: Engine
    state: State

    @staticmethod
    def begin(
        case: Case, belt: str, options: Options, parts: SceneParts | None = None, scene_path: Path | None = None
    ) -> "Run":
        """Build the scene (and write its MJCF) with the belt laid round the pulleys; options: fitted to the case."""
        spec, scene = build(case, BELT_MODELS[belt](), options, parts or SceneParts.undisturbed(case, options.friction))
        model = compiled(spec)
        if scene_path is not None:
            write_text(scene_path, mjcf(spec))
        engine = Engine.of(scene, Solver(model, scene.mesh.rest.shape), is_limp(belt, options))
        return Run(scene, engine, engine.lay())

    def stages(self, travel: float) -> list[Stage]:
        """What it consists of, in order."""
        return stages(self.scene, self.engine.pulleys.load, travel)

    def go(self, travel: float, observers: Iterable[Observer] = ()) -> Curves:
        """All stages up to ``travel`` [m]."""
        recorder = Recorder(self.scene, tuple(observers))
        for observer in recorder.observers:
            observer.start(self.scene.case, travel)
            if isinstance(observer, SceneObserver):
                observer.show(self.engine.solver.model, self.engine.solver.data)
        try:
            for stage in self.stages(travel):
                self.through(stage, recorder)
        except RunFailed as failure:
            failure.curves = recorder.curves()
            raise
        finally:
            for observer in recorder.observers:
                observer.finish(recorder.curves())
        return recorder.curves()

    def through(self, stage: Stage, recorder: Recorder) -> None:
        """All steps of a stage."""
        scene, state = self.scene, self.state
        for drive in stage.drives(state):
            command(state, drive, scene.options.dt)
            if stage.recorded and recorder.start is None and state.travel >= 0.0:
                recorder.begin(state)
                shape_pulleys(state, scene.parts)
            self.engine.step(state, drive)
            if stage.recorded:
                recorder.step(state)
            elif math.isfinite(stage.frame):
                recorder.watch(state, stage.frame)
