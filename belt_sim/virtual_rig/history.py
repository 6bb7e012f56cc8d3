"""What the march has been through: states at its nodes, what acted there, and everything that is read off them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.line import Line
from belt_sim.virtual_rig.load import Load
from belt_sim.virtual_rig.span import Sections, Span


@dataclass(frozen=True)
class DelayHistory:
    """The computed past: nodes (n,) [m]; state and slope (n, 4, batch): y, alpha tail, y, alpha head.

    tail_yaw, head_yaw: (n, batch) as they really are; bent: curvature at the run-ups, (n, 2, batch); gone: how far
    friction has let the belt go where it leaves, (y, alpha) of the tail, then of the head pulley, (n, 4, batch); spans:
    the one that runs to the tail and the one that runs to the head pulley; faults: by which the belt creeps on the
    wraps; initial: with which it did not begin straight; applied_loads: the loads on the spans.
    """

    line: Line
    nodes: np.ndarray
    state: np.ndarray
    slope: np.ndarray
    tail_yaw: np.ndarray
    head_yaw: np.ndarray
    bent: np.ndarray
    gone: np.ndarray
    spans: tuple[Span, Span]
    faults: tuple[Fault, ...] = ()
    initial: tuple[Fault, ...] = ()
    applied_loads: list["AppliedLoad"] = field(default_factory=list)
    changed_spans: tuple[list["SpanTable"], list["SpanTable"]] = ((), ())

    def at(self, s: np.ndarray, first: int = 0, last: int = 4) -> np.ndarray:
        """Rows first:last of the state at travel s, shape (..., batch) -> (rows, ..., batch)."""
        k = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        rows = np.arange(first, last).reshape(-1, *(1,) * s.ndim)
        lanes = np.arange(s.shape[-1])
        h = self.nodes[k + 1] - self.nodes[k]
        ends = [a[j, rows, lanes] for j in (k, k + 1) for a in (self.state, self.slope)]
        since = _blend((s - self.nodes[k]) / h, h, *ends)
        return np.where(s < 0, sum((f.initial_state(s, self.line)[first:last] for f in self.initial), 0.0), since)

    def interpolate(self, rows: np.ndarray, s: np.ndarray) -> np.ndarray:
        """What was kept at the nodes, shape (nodes, batch), linear between them at travel s (n, batch); 0 up to 0."""
        lanes = range(s.shape[1])
        values = [np.interp(s[:, b], self.nodes, rows[:, b], left=0.0) for b in lanes]
        return np.where(s > 0, np.stack(values, axis=1), 0.0)

    def wrap_exit(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``wrap_exit_without_slip`` once friction has let the belt go there, for travels (n, batch) that the march has
        been to.
        """
        tail, head = self.wrap_exit_without_slip(s)
        if not self.gone.any():
            return tail, head
        gone = np.stack([self.interpolate(self.gone[:, k], s) for k in range(4)])
        return tail + gone[:2], head + gone[2:]

    def landing_curvature(self, s) -> np.ndarray:
        """Curvature [1/m] with which what leaves the tail and the head pulley at travel s has landed, (2, batch)."""
        line = self.line
        back = (np.broadcast_to(s - wrap, line.stress.shape)[None] for wrap in (line.wrap_tail, line.wrap_head))
        return np.stack([self.interpolate(self.bent[:, k], there)[0] for k, there in enumerate(back)])

    def wrap_exit_without_slip(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(y, alpha) of what leaves the tail and the head pulley at travel s, each shape (2, ..., batch)."""
        tail = self.at(s - self.line.wrap_tail, 0, 2)
        head = self.at(s - self.line.wrap_head, 2, 4)
        tail[0] += self.line.wrap_shift(s)
        for fault in self.faults:
            slid = fault.creep(s, self.line, np.stack([tail[1], head[1]]))
            tail[0] += slid[0]
            head[0] += slid[1]
        return tail, head


class SpanTable:
    """What a fault adds to the response of one of the two spans, against the fault's ``span_state``."""

    def __init__(self, fault: Fault, line: Line, to_tail: bool) -> None:
        upper = (line.direction > 0) == to_tail
        nominal = line.varied_span(Sections(), to_tail=to_tail)
        found = [line.varied_span(fault.sections(x, line, upper), to_tail=to_tail) for x in fault.span_states]
        self.fault, self.line, self.to_tail, self.states = fault, line, to_tail, np.array(fault.span_states)
        self.added = {n: np.stack([getattr(f, n) - getattr(nominal, n) for f in found]) for n in _RESPONSES}

    def added_at(self, s, ends, names: Sequence[str] = ("run_up", "run_off")) -> dict[str, np.ndarray]:
        """Name of a row of ``Span`` -> what is added to it at travel s (..., batch), shape (4, ..., batch)."""
        rows = np.arange(4).reshape(-1, *(1,) * max(np.ndim(s), 1))
        state = self.fault.span_state(s, self.line, self.to_tail, ends)
        state = np.broadcast_to(state, np.broadcast_shapes(np.shape(s), self.line.stress.shape))
        lanes = np.arange(state.shape[-1])
        if len(self.states) == 1:
            return {n: self.added[n][np.zeros(state.shape, int), rows, lanes] for n in names}
        k = np.clip(np.searchsorted(self.states, state, side="right") - 1, 0, len(self.states) - 2)
        t = np.clip((state - self.states[k]) / (self.states[k + 1] - self.states[k]), 0.0, 1.0)
        return {n: (1 - t) * self.added[n][k, rows, lanes] + t * self.added[n][k + 1, rows, lanes] for n in names}


_RESPONSES = ("run_up", "run_off", "tilt")


@dataclass
class AppliedLoad:
    """A load of a fault: on the span that runs to the tail (lane by lane)?, what it remembers, now and (n, batch)."""

    fault: Fault
    load: Load
    to_tail: np.ndarray
    now: np.ndarray
    kept: np.ndarray

    def acts(self, s, line: Line, off, up, kept):
        """How much of the load acts at travel s, and what it remembers then; off, up: (y, theta) at its span's ends."""
        return self.fault.push(s, line, self.load, dot(self.load.row, off, up), kept)


def dot(row, off, up):
    return row[0] * off[0] + row[1] * off[1] + row[2] * up[0] + row[3] * up[1]


def _blend(t, h, left, left_slope, right, right_slope):
    """Cubic Hermite interpolation at the share t of an interval h, from values and slopes at its ends."""
    up = t * t * (3 - 2 * t)
    return left + up * (right - left) + h * t * (1 - t) * ((1 - t) * left_slope - t * right_slope)
