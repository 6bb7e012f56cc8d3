"""One step of a run: pulleys, springs, forces, MuJoCo, contact."""

import math
from dataclasses import dataclass

import numpy as np

from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.loads.camber import Camber
from belt_sim.mujoco3d.loads.guides import Guides
from belt_sim.mujoco3d.loads.load import Load
from belt_sim.mujoco3d.loads.pull import loads_on_pulleys, pull_on_nodes
from belt_sim.mujoco3d.loads.pushes import Pushes
from belt_sim.mujoco3d.loads.spread import Spread
from belt_sim.mujoco3d.loads.sway import Sway
from belt_sim.mujoco3d.loads.torsion import Torsion
from belt_sim.mujoco3d.machine.drive import Drive
from belt_sim.mujoco3d.machine.pulleys import Pulleys
from belt_sim.mujoco3d.machine.scene import Scene
from belt_sim.mujoco3d.mesh.belt import drag
from belt_sim.mujoco3d.mujoco_4 import Solver, Springs
from belt_sim.mujoco3d.state import State
from belt_sim.mujoco3d.wrap.contact import follow, laid_wraps, settle
from belt_sim.mujoco3d.wrap.layer import Layer, displaced
from belt_sim.mujoco3d.wrap.release import lead_off, lead_on, run_off
from belt_sim.mujoco3d.wrap.tangent import Tangent


@dataclass(frozen=True)
class Engine:
    """What acts on a state. tangent: None for a belt that only sticks; camber: None for a straight one;
    limp: it has no bending stiffness in its spans; layer: None for a belt that leaves its pulleys like a thread."""

    scene: Scene
    solver: Solver
    pulleys: Pulleys
    loads: tuple[Load, ...]
    guides: Guides
    tangent: Tangent | None
    camber: Camber | None
    limp: bool
    layer: Layer | None

    @staticmethod
    def of(scene: Scene, solver: Solver, limp: bool) -> "Engine":
        """For a compiled scene."""
        mesh, options = scene.mesh, scene.options
        pulleys = Pulleys.of(scene, solver)
        loads: list[Load] = []
        if mesh.across > 1:
            loads.append(Torsion.of(scene.case.belt, mesh))
        parts = scene.parts
        if parts.pushes:
            loads.append(Pushes(parts.pushes, mesh))
        if parts.lean or parts.roll:
            loads.append(Spread(parts.lean * parts.gravity, parts.roll, mesh))
        if limp:
            loads.append(Sway(mesh, int(pulleys.sign), options.damping * mesh.mass, options.dt))
        slides = math.isfinite(parts.friction) or options.tensioning == "koller"
        return Engine(
            scene=scene,
            solver=solver,
            pulleys=pulleys,
            loads=tuple(loads),
            guides=Guides(parts.edge_guides, mesh),
            tangent=Tangent.of(mesh, scene.loop, solver, options.dt) if slides else None,
            camber=Camber.of(mesh, solver) if parts.camber is not None else None,
            limp=limp,
            layer=Layer.of(scene.case, mesh, parts.lift_off, options.dt) if parts.lift_off else None,
        )

    def lay(self) -> State:
        """The belt laid round the pulleys, at rest."""
        scene, poses = self.scene, self.pulleys.laid()
        mesh = scene.mesh
        slides = mesh.laid - mesh.rest
        radii = scene.parts.head.radius, scene.parts.tail.radius
        wraps = laid_wraps(mesh, scene.loop, slides, poses, radii)
        pull = pull_on_nodes(mesh, self.solver, slides, scene.parts.gravity)
        joints = self.pulleys.joints(poses)
        return State(
            joints=joints,
            joint_rates=np.zeros_like(joints),
            slides=slides,
            slide_rates=np.zeros_like(slides),
            poses=poses,
            wraps=wraps,
            loads=loads_on_pulleys(mesh, slides, pull, wraps, poses),
            yaw=np.zeros(2),
            given_way=np.zeros(2),
            slip=np.zeros(2),
            led=[run_off(wrap, int(self.pulleys.sign)) for wrap in wraps],
            kink_slope=np.zeros((2, mesh.across)),
            met=[run_off(wrap, -int(self.pulleys.sign)) for wrap in wraps],
            turned=np.zeros(2),
            aside=np.zeros(2),
            travel=-scene.early,
        )

    def step(self, state: State, drive: Drive) -> None:
        """One step of the state, whose travel, speed, time and yaw are those of its end already (``command``)."""
        scene, solver = self.scene, self.solver
        joint_forces = self.pulleys.advance(state, drive, scene.options.dt)
        follow(state, scene.mesh.chord)
        springs = self._springs(state)
        forces = np.zeros_like(state.slides)
        for load in self.loads:
            forces += load.forces(state, springs)
        if self.camber is not None:
            solver.set_rest_lengths(self.camber.lengths(state.share))
        solver.damp(drag(scene.mesh, *drive.drag))
        solver.step(state, springs, forces, joint_forces)
        if solver.diverged:
            raise RunFailed(f"the belt's acceleration grew without bound at {state.time:.3f} s: halve options.dt")
        self.pulleys.read(state)
        for wrap in state.wraps:
            state.slides[wrap.stations] = springs.rest[wrap.stations]
        pull = pull_on_nodes(scene.mesh, solver, state.slides, scene.parts.gravity)
        state.loads = loads_on_pulleys(scene.mesh, state.slides, pull, state.wraps, state.poses)
        settle(scene.mesh, state, pull, scene.options.dt, drive.friction, self.tangent)
        if self.layer is not None:
            self.layer.follow(state)

    def _springs(self, state: State) -> Springs:
        """All that holds nodes in the coming step: anchors on the pulleys, and guides beside the spans."""
        mesh, springs = self.scene.mesh, Springs.none(state.slides.shape)
        for wrap, pose in zip(state.wraps, state.poses, strict=True):
            springs.rest[wrap.stations] = wrap.place(pose) - mesh.rest[wrap.stations]
            if self.layer is not None:
                springs.rest[wrap.stations] += displaced(wrap, pose, mesh)
            springs.stiffness[wrap.stations] = self.scene.options.hold_stiffness
        if self.limp:
            lead_on(mesh, state, springs, int(self.pulleys.sign))
            lead_off(mesh, state, springs, int(self.pulleys.sign))
        self.guides.press(state, springs)
        return springs


def command(state: State, drive: Drive, dt: float) -> None:
    """What the machine is told counts from the beginning of the step."""
    state.time += dt
    state.travel, state.speed, state.yaw, state.share = drive.travel, drive.speed, drive.yaw, drive.share
