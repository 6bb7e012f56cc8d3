"""Collects readings of a run into curves, and hands frames to whoever watches."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from belt_sim.curves import Curves
from belt_sim.errors import RunFailed
from belt_sim.frame import Frame, Observer
from belt_sim.mujoco3d.constants import RUNAWAY
from belt_sim.mujoco3d.machine.scene import Scene
from belt_sim.mujoco3d.run.measure import (
    ANGLES,
    EDGES,
    MOMENTS,
    POINTS,
    READING_SIZE,
    SAGS,
    TENSION,
    TILTS,
    edges,
    reading,
)
from belt_sim.mujoco3d.state import TAIL, State

#: lateral slip [m] and share of sliding nodes on the head and the tail pulley, x of the tail pulley [m], steps made,
#: speed of the belt [m/s]
EXTRA = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "tail_x", "steps", "belt_speed")
#: of a frame, in the order of a reading after its angles
_SCALARS = ("entry_moment_upper", "entry_moment_lower", "edge_stress_upper", "edge_stress_lower", "tilt_upper",
            "tilt_lower", "sag_upper", "sag_lower", "tension")  # fmt: skip
_READINGS_PER_SAMPLE = 5  # a landing shakes the belt once per station; the curve is the mean over a sample


@dataclass
class Recorder:
    """Reads the belt every few steps; a row of the curves is the mean reading over options.sample of travel."""

    scene: Scene
    observers: tuple[Observer, ...]
    rows: list[np.ndarray] = field(default_factory=list)
    window: list[np.ndarray] = field(default_factory=list)
    start: np.ndarray | None = None
    steps: int = 0
    next_reading: float = 0.0
    next_row: float = 0.0
    next_frame: float = -math.inf

    def begin(self, state: State) -> None:
        """Travel 0 has been reached: y counts from here."""
        self.start = self._read(state, 0.0)
        self.rows.append(self._row(self.start, 0.0))
        self.next_row = self.scene.options.sample
        self._frame(state, self.start, self.scene.options.frame)

    def watch(self, state: State, every: float) -> None:
        """Called after every step of a stage before the run-in: a frame after every so many metres of travel."""
        if self.observers and state.travel >= self.next_frame:
            self._frame(state, self._read(state, state.travel), every)

    def due(self, travel: float) -> bool:
        """Whether ``step`` will read the belt at this travel [m]."""
        return self.start is not None and travel >= self.next_reading

    def step(self, state: State) -> None:
        """Called after every step of the run-in and the run."""
        self.steps += 1
        if not self.due(state.travel):
            return
        options = self.scene.options
        self.next_reading = state.travel + options.sample / _READINGS_PER_SAMPLE
        read = self._read(state, state.travel)
        self.window.append(read)
        if state.travel >= self.next_row:
            self.next_row += options.sample
            mean = np.mean(self.window, axis=0)
            self.window.clear()
            self.rows.append(self._row(mean, mean[-1]))
        if state.travel >= self.next_frame:
            self._frame(state, read, options.frame)

    def _read(self, state: State, travel: float) -> np.ndarray:
        read, case = reading(self.scene, state), self.scene.case
        if not np.all(np.isfinite(read)):
            raise RunFailed(f"positions are not finite at travel {travel:.2f} m: halve options.dt")
        if np.abs(read[POINTS]).max() > RUNAWAY * float(case.belt.width):
            where = int(np.argmax(np.abs(read[POINTS]))) + 1
            raise RunFailed(
                f"y at point {where} = {read[where - 1]:.3f} m at travel {travel:.2f} m: the belt has run off its "
                "pulleys; turn the yaw back earlier or shorten travel"
            )
        sliding = [np.mean(wrap.sliding) for wrap in state.wraps]
        tail_x = float(state.poses[TAIL].centre[0])
        return np.concatenate([read, state.slip, sliding, [tail_x, self.steps, state.speed, travel]])

    def _row(self, mean: np.ndarray, travel: float) -> np.ndarray:
        row = mean.copy()
        row[POINTS] -= 0.0 if self.start is None else self.start[POINTS]
        row[-1] = travel
        return row

    def _frame(self, state: State, read: np.ndarray, every: float) -> None:
        self.next_frame = state.travel + every
        if not self.observers:
            return
        extra = dict(zip(EXTRA, map(float, read[READING_SIZE:-1]), strict=True))
        x = float(state.poses[TAIL].centre[0])
        frame = frame_of(self.scene, read, state.slides, state.travel, state.time, state.yaw, x, extra)
        for observer in self.observers:
            observer.frame(frame)

    def curves(self) -> Curves:
        """Curves of what has been run so far."""
        table = np.array(self.rows).T if self.rows else np.empty((READING_SIZE + len(EXTRA) + 1, 0))
        return Curves(
            travel=table[-1],
            y=table[POINTS],
            angle=table[ANGLES],
            moment=table[MOMENTS],
            edge_stress=table[EDGES],
            tilt=table[TILTS],
            sag=table[SAGS].mean(axis=1) if self.rows else np.zeros(2),
            extra={"tension": table[TENSION], **dict(zip(EXTRA, table[READING_SIZE:-1], strict=True))},
        )


def frame_of(
    scene: Scene,
    read: np.ndarray,
    slides: np.ndarray,
    travel: float,
    time: float,
    yaw: np.ndarray,
    tail_x: float,
    extra: Mapping[str, float],
) -> Frame:
    """A frame of a belt with its nodes at ``slides`` [m], shape (n, m, 3), and the reading ``read`` (measure.py).

    yaw [rad], shape (2,): head, tail; extra: more scalars, by name.
    """
    left, right = edges(scene, slides)
    r_head, r_tail = scene.loop.radius_head, scene.loop.radius_tail
    places = ((tail_x, r_tail), (tail_x, -r_tail), (0.0, -r_head), (0.0, r_head))
    points = np.array([[px, y, pz] for (px, pz), y in zip(places, read[POINTS], strict=True)])
    scalars = dict(zip(_SCALARS, map(float, read[MOMENTS.start : READING_SIZE]), strict=True))
    return Frame(
        travel=travel, time=time, left=left, right=right, points=points, yaw_tail=float(yaw[1]),
        yaw_head=float(yaw[0]), tail_x=tail_x, scalars={**scalars, **extra},
    )  # fmt: skip
