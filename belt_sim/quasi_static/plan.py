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
    rows: list[tuple[bool, list[tuple[float, np.ndarray, float]]]] = []

    def march(start: float, end: float, done: float) -> None:
        count = max(math.ceil((end - start) / options.sample - 1e-9), 0)
        places = start + (end - start) * (np.arange(count * steps) + 1.0) / max(count * steps, 1)
        commands = [(float(s), yaw.angles(float(s), done), float(done >= 0.0)) for s in places]
        rows.extend((start >= 0.0, commands[k * steps : (k + 1) * steps]) for k in range(count))

    def stand(at: float, done: float) -> None:
        for row in range(_TURNING + 2):
            commands = []
            for k in range(steps):
                part = smoothstep((row * steps + k + 1) / (_TURNING * steps))
                share = 1.0 if done >= 0.0 else part if at >= 0.0 else 0.0
                commands.append((at, yaw.angles_during_step(at, done, part), share))
            rows.append((False, commands))

    done, here = -math.inf, -options.run_in
    rows.extend((False, [(here, yaw.angles(here, done), 0.0)] * steps) for _ in range(_RESTING))
    for stop in sorted({s for s in yaw.stops(travel) if s > 0.0} | {0.0}):
        march(here, stop, done)
        if stop == 0.0:
            rows.append((True, [(0.0, yaw.angles(0.0, done), 0.0)] * steps))
        if stop > 0.0 or changes or 0.0 in yaw.stops(travel):
            stand(stop, done)
            done = stop
        here = stop
    march(here, travel + 0.5 * options.sample, done)  # a row stands for its middle
    recorded = np.array([r for r, _ in rows])
    parts = [np.array([[c[k] for c in commands] for _, commands in rows]) for k in range(3)]
    return TravelPlan(Command(*parts), recorded)
