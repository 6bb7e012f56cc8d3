"""The state of a step, and the commands of a run: rest, run-in, and a stop for every yaw step."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from belt_sim.case import Settings
from belt_sim.mujoco3d.options import Options
from belt_sim.mujoco3d.rope import RopeKinks
from belt_sim.mujoco3d.run_stages import Command, YawPlan, smoothstep
from belt_sim.mujoco3d.wrap import PoseArrays, WrapArrays
from belt_sim.pytrees import Numbers as Array
from belt_sim.quasi_static.friction import SlipState


class TravelState(NamedTuple):
    """nodes [m], (m, 3, n); wraps, pose: of head and tail; tension [N]: mean of the spans; travel [m]; correction [m]:
    by how much the step's last Newton iteration moved a node at most; slip: None if it sticks; kinks: of a limp belt;
    turned [rad], (2,): yaw by which the pulleys give way, None if they do not; layer: as in layer.py, or None."""

    nodes: Array
    wraps: WrapArrays
    pose: PoseArrays
    tension: Array
    travel: Array
    correction: Array
    slip: SlipState | None = None
    kinks: RopeKinks | None = None
    compliance_yaw: Array | None = None
    layer: Array | None = None


_RESTING = 4  # rows at rest in which the spans find their places
_TURNING = 4  # rows in which a yaw step is made, and two more after it
_LONGEST = 0.7  # chords in a step: no more than one station lands in it at either end


@dataclass(frozen=True)
class TravelPlan:
    """Rows of k steps. commands: arrays of shape (rows, k, ...); recorded: rows that stand in the curves, with one at
    rest at travel 0 before the yaw, shape (rows,)."""

    commands: Command
    recorded: np.ndarray


def plan_run(settings: Settings, options: Options, travel: float, changes: bool) -> TravelPlan:
    """Of a run over ``travel`` [m]; changes: something besides the yaw sets in at 0."""
    yaw = YawPlan.from_settings(settings)
    steps = max(options.steps, math.ceil(options.sample / (_LONGEST * options.dx)))
    commands: list[Command] = []
    recorded: list[bool] = []

    def march(start: float, end: float, done: float) -> None:
        rows = max(math.ceil((end - start) / options.sample - 1e-9), 0)
        places = start + (end - start) * (np.arange(rows * steps) + 1.0) / max(rows * steps, 1)
        commands.extend(Command(s, yaw.angles(s, done), float(done >= 0.0)) for s in places.tolist())
        recorded.extend([start >= 0.0] * rows)

    def rest(at: float, rows: int, counts: bool) -> None:
        commands.extend([Command(at, yaw.angles(at, -math.inf), 0.0)] * (steps * rows))
        recorded.extend([counts] * rows)

    def turn(at: float, done: float) -> None:
        for k in range((_TURNING + 2) * steps):
            part = smoothstep((k + 1) / (_TURNING * steps))
            share = 1.0 if done >= 0.0 else part if at >= 0.0 else 0.0
            commands.append(Command(at, yaw.angles_during_step(at, done, part), share))
        recorded.extend([False] * (_TURNING + 2))

    done, here = -math.inf, -options.run_in
    rest(here, _RESTING, counts=False)
    for stop in sorted({s for s in yaw.stops(travel) if s > 0.0} | {0.0}):
        march(here, stop, done)
        if stop == 0.0:
            rest(0.0, 1, counts=True)
        if stop > 0.0 or changes or 0.0 in yaw.stops(travel):
            turn(stop, done)
            done = stop
        here = stop
    march(here, travel + 0.5 * options.sample, done)  # a row stands for its middle
    columns = (np.array(column, float) for column in zip(*(c[:3] for c in commands), strict=True))
    return TravelPlan(Command(*(c.reshape(len(recorded), steps, *c.shape[1:]) for c in columns)), np.array(recorded))
