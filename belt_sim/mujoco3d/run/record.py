"""Collects readings of a run into curves, and hands frames to whoever watches."""

import math
from dataclasses import dataclass, field

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import RunFailed
from belt_sim.frame import Frame, Observer
from belt_sim.mujoco3d.machine.pulleys import Machine
from belt_sim.mujoco3d.machine.yaw import Clock
from belt_sim.mujoco3d.options import Options
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
from belt_sim.mujoco3d.wrap.contact import Contact
from belt_sim.mujoco3d.wrap.hold import TAIL

#: lateral slip [m] and share of sliding nodes on the head and the tail pulley, x of the tail pulley [m], steps made
EXTRA = ("slip_head", "slip_tail", "sliding_head", "sliding_tail", "tail_x", "steps")
_READINGS_PER_SAMPLE = 5  # a landing shakes the belt once per station; the curve is the mean over a sample
_RUNAWAY = 3.0  # belt widths: a belt that has run further sideways has left its pulleys


@dataclass
class Recorder:
    """Reads the belt every few steps; a row of the curves is the mean reading over options.sample of travel."""

    case: Case
    contact: Contact
    machine: Machine
    options: Options
    observers: tuple[Observer, ...]
    rows: list[np.ndarray] = field(default_factory=list)
    window: list[np.ndarray] = field(default_factory=list)
    start: np.ndarray | None = None
    steps: int = 0
    next_reading: float = 0.0
    next_row: float = 0.0
    next_frame: float = -math.inf

    def begin(self, clock: Clock) -> None:
        """Travel 0 has been reached: y counts from here."""
        self.start = self._read(0.0)
        self.rows.append(self._row(self.start, 0.0))
        self.next_row = self.options.sample
        self._frame(clock, self.start)

    def watch(self, clock: Clock, every: float) -> None:
        """Called after every step while the pulleys move apart: a frame after every so many metres of travel."""
        if self.observers and clock.travel >= self.next_frame:
            self._frame(clock, self._read(clock.travel))
            self.next_frame = clock.travel + every

    def step(self, clock: Clock) -> None:
        """Called after every step."""
        self.steps += 1
        if clock.travel < self.next_reading or self.start is None:
            return
        self.next_reading = clock.travel + self.options.sample / _READINGS_PER_SAMPLE
        now = self._read(clock.travel)
        self.window.append(now)
        if clock.travel >= self.next_row:
            self.next_row += self.options.sample
            mean = np.mean(self.window, axis=0)
            self.window.clear()
            self.rows.append(self._row(mean, mean[-1]))
        if clock.travel >= self.next_frame:
            self._frame(clock, now)

    def _read(self, travel: float) -> np.ndarray:
        tail_x = float(self.machine.poses[TAIL].centre[0])
        now = reading(self.case, self.contact, tail_x)
        slip = self.contact.friction.slip
        if not np.all(np.isfinite(now)):
            raise RunFailed(f"positions are not finite at travel {travel:.2f} m: halve options.dt")
        if np.abs(now[POINTS]).max() > _RUNAWAY * float(self.case.belt.width):
            where = int(np.argmax(np.abs(now[POINTS]))) + 1
            raise RunFailed(
                f"y at point {where} = {now[where - 1]:.3f} m at travel {travel:.2f} m: the belt has run off its "
                "pulleys; turn the yaw back earlier or shorten travel"
            )
        sliding = [np.mean(wrap.sliding) for wrap in self.contact.wraps]
        return np.concatenate([now, slip, sliding, [tail_x, self.steps, travel]])

    def _row(self, mean: np.ndarray, travel: float) -> np.ndarray:
        row = mean.copy()
        row[POINTS] -= 0.0 if self.start is None else self.start[POINTS]
        row[-1] = travel
        return row

    def _frame(self, clock: Clock, now: np.ndarray) -> None:
        self.next_frame = clock.travel + self.options.frame
        if not self.observers:
            return
        left, right = edges(self.case, self.contact)
        tail = self.machine.poses[TAIL]
        r_head, r_tail = self.contact.scene.loop.radius_head, self.contact.scene.loop.radius_tail
        x = float(tail.centre[0])
        places = ((x, r_tail), (x, -r_tail), (0.0, -r_head), (0.0, r_head))
        points = np.array([[px, y, pz] for (px, pz), y in zip(places, now[POINTS], strict=True)])
        names = ("entry_moment_upper", "entry_moment_lower", "edge_stress_upper", "edge_stress_lower", "tilt_upper",
                 "tilt_lower", "sag_upper", "sag_lower", "tension", *EXTRA)  # fmt: skip
        scalars = dict(zip(names, map(float, now[MOMENTS.start : -1]), strict=True))
        frame = Frame(
            travel=clock.travel, time=clock.time, left=left, right=right, points=points,
            yaw_tail=float(self.machine.yaw[1]), yaw_head=float(self.machine.yaw[0]), tail_x=x, scalars=scalars,
        )  # fmt: skip
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
