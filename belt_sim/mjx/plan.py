"""What the machine is told in a run, step by step: the stages of the native engine."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from belt_sim.mjx.model import Command
from belt_sim.mujoco3d.machine.drive import Drive
from belt_sim.mujoco3d.machine.scene import Scene
from belt_sim.mujoco3d.run.stages import stages


@dataclass
class _Clock:
    """What a stage asks of a state: travel [m], speed [m/s], time [s]."""

    travel: float
    speed: float = 0.0
    time: float = 0.0


@dataclass(frozen=True)
class Plan:
    """Commands of all steps, leading axis (steps,); begin: the first step whose end has travel 0 or more."""

    commands: Command
    begin: int


def plan_of(scene: Scene, travel: float) -> Plan:
    """Of a run over ``travel`` [m]."""
    rows = [(d.travel, d.speed, d.acceleration, d.yaw, d.share, d.drag) for d in _drives(scene, travel)]
    commands = Command(*(np.array([row[k] for row in rows], float) for k in range(6)))
    return Plan(commands, int(np.argmax(commands.travel >= 0.0)))


def _drives(scene: Scene, travel: float) -> Iterator[Drive]:
    clock, dt = _Clock(-scene.early), scene.options.dt
    for stage in stages(scene, 0.0, travel):
        for drive in stage.drives(clock):  # type: ignore[arg-type]
            clock.time, clock.travel, clock.speed = clock.time + dt, drive.travel, drive.speed
            yield drive
