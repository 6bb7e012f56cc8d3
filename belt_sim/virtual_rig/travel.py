"""The belt on its way round: the two run-up points against travel, the wraps as a history.

Classical Runge-Kutta of fourth order by the method of steps; the delayed values come from cubic Hermite
interpolation of the computed past. States are y and the contact angle alpha = theta - theta_p at the run-ups
of the tail and of the head pulley: dy/ds = -alpha, dalpha/ds = -kappa. On the tail theta_p is +yaw at the
run-up and -yaw at the run-off, on the head -yaw and +yaw, whichever way the belt runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from belt_sim.virtual_rig.fault import Fault, overrides
from belt_sim.virtual_rig.line import Line
from belt_sim.virtual_rig.span import Span

#: Steps in one wrapped arc: 1 nm of the 10 mm that the test rig moves in 60 m.
STEPS_A_WRAP = 4
#: The step that carries a yaw step begins this far [m] after the one that ends before it.
_BEFORE = 1e-7
_ANGLE = np.array([[0.0], [1.0]])  # picks the angle out of a pair (y, angle)
_ROWS = ("run_up", "run_off")
_SHARES = (1.0, 0.5, 0.0)  # of the tension decay; the span's response is a parabola through these


@dataclass(frozen=True)
class Journey:
    """The computed past: nodes (n,) [m]; state and slope (n, 4, batch): y, alpha tail, y, alpha head.

    spans: the one that runs to the tail and the one that runs to the head pulley.
    """

    line: Line
    nodes: np.ndarray
    state: np.ndarray
    slope: np.ndarray
    tail_yaw: np.ndarray
    spans: tuple[Span, Span]

    def at(self, s: np.ndarray, first: int = 0, last: int = 4) -> np.ndarray:
        """Rows first:last of the state at travel s, shape (..., batch) -> (rows, ..., batch); 0 before travel 0."""
        k = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        rows = np.arange(first, last).reshape(-1, *(1,) * s.ndim)
        lanes = np.arange(s.shape[-1])
        h = self.nodes[k + 1] - self.nodes[k]
        ends = [a[j, rows, lanes] for j in (k, k + 1) for a in (self.state, self.slope)]
        return np.where(s < 0, 0.0, _blend((s - self.nodes[k]) / h, h, *ends))


def march(line: Line, faults: Sequence[Fault], reach: float) -> Journey:
    """Run a batch of lines over ``reach`` metres of travel."""
    nodes, batch = _nodes(line, reach), len(line.stress)
    past = Journey(
        line=line,
        nodes=nodes,
        state=np.zeros((len(nodes), 4, batch)),
        slope=np.zeros((len(nodes), 4, batch)),
        tail_yaw=np.zeros((len(nodes), batch)),
        spans=(line.span(), line.span(to_tail=False)),
    )
    road = _Road(past, faults)
    y = np.zeros((4, batch))
    for k in range(len(nodes) - 1):
        y = road.step(k, y)
    road.store(len(nodes) - 1, y, k)
    return past


class _Road:
    """The equations of motion with their history so far."""

    def __init__(self, past: Journey, faults: Sequence[Fault]) -> None:
        self.past, self.line, self.nodes = past, past.line, past.nodes
        self.yaws, self.turns, self.slides = (
            [f for f in faults if overrides(f, hook)] for hook in ("yaw", "turn", "slide")
        )
        line, nothing = past.line, np.zeros((2, past.state.shape[2]))
        self.here = nothing, nothing  # what leaves the pulleys at the node at hand
        self.cap = line.friction * line.force * line.width / (2 * line.bending)
        self.capped = bool(np.isfinite(self.cap).any())
        self.soft = 1 + line.cover * line.bending
        self.yields = bool(np.any(line.compliance))
        self.decays = bool(np.any(line.decay))
        self.slacker = [
            [line.span(1 - line.decay * (1 - share), to_tail=to_tail) for share in _SHARES if self.decays]
            for to_tail in (True, False)
        ]

    def step(self, k: int, y: np.ndarray) -> np.ndarray:
        """One Runge-Kutta step from node k."""
        s, h = self.nodes[k], self.nodes[k + 1] - self.nodes[k]
        y, k1 = self.store(k, y, k)
        half, whole = self.delayed(k, 0.5), self.delayed(k, 1.0)
        k2 = self.rates(s + h / 2, k, y + h / 2 * k1, half)[1]
        k3 = self.rates(s + h / 2, k, y + h / 2 * k2, half)[1]
        k4 = self.rates(s + h, k, y + h * k3, whole)[1]
        self.here = whole
        return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def store(self, node: int, y: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Keep state and slope at a node, under the commands of step k."""
        y, slope, yaw = self.rates(self.nodes[node], k, y, self.here)
        self.past.state[node], self.past.slope[node], self.past.tail_yaw[node] = y, slope, yaw
        return y, slope

    def delayed(self, k: int, share: float) -> tuple[np.ndarray, np.ndarray]:
        """What leaves the tail and the head pulley: (y, alpha) one wrapped arc ago, each shape (2, batch)."""
        s = self.nodes[k] + share * (self.nodes[k + 1] - self.nodes[k])
        tail = self.past.at(s - self.line.wrap_tail, 0, 2)
        head = self.past.at(s - self.line.wrap_head, 2, 4)
        tail[0] += self.line.wrap_shift(s)
        return tail, head

    def rates(self, s, k, y, past):
        """State (after slip), its rate of change per metre of travel, and the tail pulley's yaw."""
        line, (tail_off, head_off) = self.line, past
        to_tail, to_head = self._responses(s)
        beta, beta_head = self._yaws(s, k)
        if self.yields:
            beta = self._yielding(beta, beta_head, y, past, to_tail, to_head)
        off_head, off_tail = head_off + _ANGLE * beta_head, tail_off - _ANGLE * beta
        kappa_tail, y = self._run_up(to_tail, off_head, y, 0, beta)
        kappa_head, y = self._run_up(to_head, off_tail, y, 2, -beta_head)
        kappa = np.stack([kappa_tail, kappa_head])
        turn = sum((f.turn(s, line, y[::2], kappa) for f in self.turns), kappa * self.soft)
        drift = y[1::2]
        for fault in self.slides:
            drift = drift * fault.slide(s, line)
        return y, -np.stack([drift[0], turn[0], drift[1], turn[1]]), beta

    def _yaws(self, s: float, k: int):
        line = self.line
        turned = (self.nodes[k] + self.nodes[k + 1]) / 2 > line.yaw_at
        beta = line.yaw * turned + line.offset_tail + line.sag_yaw
        return sum((e.yaw(s, line) for e in self.yaws), beta), line.yaw_head * turned + line.offset_head

    def _run_up(self, response, off, y, i, surface):
        """Curvature at a run-up; where friction cannot hold the moment, the belt turns until it can."""
        kappa = _dot(response.run_up, off, (y[i], surface + y[i + 1]))
        if not self.capped:
            return kappa, y
        held = np.clip(kappa, -self.cap, self.cap)
        y = y.copy()
        y[i + 1] += (held - kappa) / response.run_up[3]
        return held, y

    def _yielding(self, beta, beta_head, y, past, to_tail, to_head):
        """What the span moments leave of the yaw on a compliant tail bearing: beta - C (M_up + M_off)."""
        tail_off, head_off = past
        still = _dot(to_tail.run_up, head_off + _ANGLE * beta_head, y[:2])
        still = still + _dot(to_head.run_off, tail_off, y[2:] - _ANGLE * beta_head)
        give = self.line.compliance * self.line.bending
        return (beta - give * still) / (1 + give * (to_tail.run_up[3] - to_head.run_off[1]))

    def _responses(self, s: float) -> tuple[Span, Span]:
        """Of the span that runs to the tail and the one that runs to the head pulley."""
        if not self.decays:
            return self.past.spans
        left = np.exp(-s / self.line.decay_length)
        weights = (left * (2 * left - 1), 4 * left * (1 - left), (1 - left) * (1 - 2 * left))
        blended = [
            replace(tight, **{n: sum(w * getattr(r, n) for w, r in zip(weights, rows, strict=True)) for n in _ROWS})
            for tight, rows in zip(self.past.spans, self.slacker, strict=True)
        ]
        return blended[0], blended[1]


def _dot(row, off, up):
    return row[0] * off[0] + row[1] * off[1] + row[2] * up[0] + row[3] * up[1]


def _blend(t, h, left, left_slope, right, right_slope):
    """Cubic Hermite interpolation at the share t of an interval h, from values and slopes at its ends."""
    up = t * t * (3 - 2 * t)
    return left + up * (right - left) + h * t * (1 - t) * ((1 - t) * left_slope - t * right_slope)


def _nodes(line: Line, reach: float) -> np.ndarray:
    """Nodes of the march: even, but with every yaw step between two nodes a hair apart."""
    longest = min(line.wrap_tail.min(), line.wrap_head.min()) / STEPS_A_WRAP
    steps = [float(s) for s in np.unique(line.yaw_at) if 0 < s < reach]
    edges = [0.0, *(e for s in steps for e in (s - _BEFORE, s)), reach]
    parts = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / longest - 1e-9))), endpoint=False) for a, b in pairwise(edges)
    ]
    return np.append(np.concatenate(parts), reach)
