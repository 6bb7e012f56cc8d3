"""The belt on its way round: the two run-up points against travel, the wraps as a history.

Classical Runge-Kutta of fourth order by the method of steps; the delayed values come from cubic Hermite
interpolation of the computed past. States are y and the contact angle alpha = theta - theta_p at the run-ups
of the tail and of the head pulley: dy/ds = -alpha, dalpha/ds = -kappa. On the tail theta_p is +yaw at the
run-up and -yaw at the run-off, on the head -yaw and +yaw, whichever way the belt runs.

Friction lets a run-up go once, at each change of the commanded yaw, as far as the entry moment that is then left
wants (grip.py); and it lets a run-off go all the time, as far as the moment there differs from that of landing.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from belt_sim.virtual_rig.fault import Fault, overrides
from belt_sim.virtual_rig.grip import slip_turn
from belt_sim.virtual_rig.history import AppliedLoad, DelayHistory, SpanTable, dot
from belt_sim.virtual_rig.line import Line
from belt_sim.virtual_rig.span import Span

#: Steps in one wrapped arc: 1 nm of the 10 mm that the test rig moves in 60 m.
STEPS_A_WRAP = 4
#: The step that carries a yaw step begins this far [m] after the one that ends before it.
_BEFORE = 1e-7
_ANGLE = np.array([[0.0], [1.0]])  # picks the angle out of a pair (y, angle)
_ROWS = ("run_up", "run_off")
_SHARES = (0.0, 0.5, 1.0)  # of the way from the least tension to the most; a response is a parabola through these


def march(line: Line, faults: Sequence[Fault], reach: float) -> DelayHistory:
    """Run a batch of lines over ``reach`` metres of travel."""
    nodes, batch = _nodes(line, reach), len(line.stress)
    past = DelayHistory(
        line=line,
        nodes=nodes,
        state=np.zeros((len(nodes), 4, batch)),
        slope=np.zeros((len(nodes), 4, batch)),
        tail_yaw=np.zeros((len(nodes), batch)),
        head_yaw=np.zeros((len(nodes), batch)),
        bent=np.zeros((len(nodes), 2, batch)),
        gone=np.zeros((len(nodes), 4, batch)),
        spans=(line.span(), line.span(to_tail=False)),
        faults=tuple(f for f in faults if overrides(f, "creep")),
        initial=tuple(f for f in faults if overrides(f, "initial_state")),
        applied_loads=[
            AppliedLoad(f, load, (line.direction > 0) == load.upper, np.zeros(batch), np.zeros((len(nodes), batch)))
            for f in faults
            for load in f.loads(line)
        ],
        changed_spans=tuple(
            [SpanTable(f, line, to_tail) for f in faults if overrides(f, "sections")] for to_tail in (True, False)
        ),
    )
    equation = _DelayEquation(past, faults)
    y = sum((f.initial_state(np.zeros(batch), line) for f in past.initial), np.zeros((4, batch)))
    for k in range(len(nodes) - 1):
        y = equation.step(k, y)
    equation.store(len(nodes) - 1, y, k)
    return past


class _DelayEquation:
    """The equations of motion with their history so far."""

    def __init__(self, past: DelayHistory, faults: Sequence[Fault]) -> None:
        self.history, self.line, self.nodes = past, past.line, past.nodes
        hooks = ("yaw", "yaw_head", "turn", "recall", "slide", "tension")
        self.of = {hook: [f for f in faults if overrides(f, hook)] for hook in hooks}
        line = past.line
        self.here = past.wrap_exit_without_slip(
            np.zeros(past.state.shape[2])
        )  # what leaves the pulleys at the node at hand
        self.sticks = ~np.isfinite(line.friction)
        self.slips = not self.sticks.all()
        self.soft = 1 + line.cover * line.bending
        self.yields = bool(np.any(line.compliance))
        swings = [f.swing for f in self.of["tension"]]
        self.least, self.most = (sum((swing[i] for swing in swings), 0 * line.stress) for i in (0, 1))
        self.slacker = [
            [line.span(1 + self.least + (self.most - self.least) * t, to_tail=to_tail) for t in _SHARES if swings]
            for to_tail in (True, False)
        ]

    def step(self, k: int, y: np.ndarray) -> np.ndarray:
        """One Runge-Kutta step from node k."""
        s, h = self.nodes[k], self.nodes[k + 1] - self.nodes[k]
        if self.slips:
            y = self.slip_at_yaw_step(k, y)
        k1 = self.store(k, y, k)
        half, whole = self.delayed_state(k, 0.5), self.delayed_state(k, 1.0)
        k2 = self.rates(s + h / 2, k, y + h / 2 * k1, half)
        k3 = self.rates(s + h / 2, k, y + h / 2 * k2, half)
        k4 = self.rates(s + h, k, y + h * k3, whole)
        self.here = whole
        return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def store(self, node: int, y: np.ndarray, k: int) -> np.ndarray:
        """Keep state, slope and what acts at a node, under the commands of step k; returns the slope."""
        slope = self.rates(self.nodes[node], k, y, self.here, node)
        self.history.state[node], self.history.slope[node] = y, slope
        return slope

    def delayed_state(self, k: int, share: float) -> tuple[np.ndarray, np.ndarray]:
        """What leaves the tail and the head pulley: (y, alpha) one wrapped arc ago, each shape (2, batch)."""
        s = self.nodes[k] + share * (self.nodes[k + 1] - self.nodes[k])
        return self.history.wrap_exit_without_slip(np.broadcast_to(s, self.line.stress.shape))

    def rates(self, s, k, y, past, node=None):
        """Rate of change of the state per metre of travel; at a node, what acts there is kept."""
        line = self.line
        kappa, beta, beta_head = self.curvatures(s, k, y, past, node)
        turn = sum((f.turn(s, line, y[::2], kappa) for f in self.of["turn"]), kappa * self.soft)
        for fault in self.of["recall"]:
            turn = turn + fault.recall(s, self.history)
        drift = y[1::2]
        for fault in self.of["slide"]:
            drift = drift * fault.slide(s, line, y[1::2])
        if node is not None:
            self.history.tail_yaw[node], self.history.head_yaw[node], self.history.bent[node] = beta, beta_head, kappa
        return -np.stack([drift[0], turn[0], drift[1], turn[1]])

    def curvatures(self, s, k, y, past, node=None):
        """Curvature where the belt runs up, shape (2, batch), and the true yaws of the tail and head pulley."""
        beta, beta_head = self._yaws(s, k)
        to_tail, to_head = self._responses(s, _ends(y, past, beta, beta_head))
        if self.yields:
            off = self._pushed(s, _ends(y, past, beta, beta_head), None)[1][1]
            beta = self._yielding(beta, beta_head, y, past, to_tail, to_head, off)
        if self.slips:
            past = self._let_off(s, _ends(y, past, beta, beta_head), past, to_tail, to_head, node)
        ends = _ends(y, past, beta, beta_head)
        kappa = np.stack([dot(to_tail.run_up, *ends[0]), dot(to_head.run_up, *ends[1])])
        return kappa + self._pushed(s, ends, node)[0], beta, beta_head

    def _let_off(self, s, ends, past, to_tail, to_head, node):
        """What leaves the tail and the head pulley once friction has let it go."""
        bent = np.stack([dot(to_head.run_off, *ends[1]), dot(to_tail.run_off, *ends[0])])
        bent = bent + self._pushed(s, ends, None)[1][::-1]
        stiff = -np.stack([to_head.run_off[1], to_tail.run_off[1]])
        turn, aside = slip_turn(bent - self.history.landing_curvature(s), stiff, self.line, self.sticks)
        gone = np.stack([aside, turn], axis=1)
        if node is not None:
            self.history.gone[node] = gone.reshape(4, -1)
        return past[0] + gone[0], past[1] + gone[1]

    def slip_at_yaw_step(self, k: int, y: np.ndarray) -> np.ndarray:
        """The state once the run-ups have let go, in lanes whose yaw is changed at the beginning of step k."""
        line, before = self.line, self.nodes[max(k - 1, 0)]
        middle = (self.nodes[k] + self.nodes[k + 1]) / 2
        changed = (middle > line.yaw_at) & ((k == 0) | ((before + self.nodes[k]) / 2 <= line.yaw_at))
        if not changed.any():
            return y
        kappa = self.curvatures(self.nodes[k], k, y, self.here)[0]
        ends = _ends(y, self.here, *self._yaws(self.nodes[k], k))
        stiff = np.stack([span.run_up[3] for span in self._responses(self.nodes[k], ends)])
        turn, aside = (np.where(changed, x, 0.0) for x in slip_turn(kappa, stiff, line, self.sticks))
        return y + np.stack([aside[0], -turn[0], aside[1], -turn[1]])

    def _yaws(self, s: float, k: int):
        line = self.line
        turned = (self.nodes[k] + self.nodes[k + 1]) / 2 > line.yaw_at
        beta = line.yaw * turned + line.offset_tail + line.sag_yaw
        beta_head = line.yaw_head * turned + line.offset_head
        beta = sum((f.yaw(s, line) for f in self.of["yaw"]), beta)
        return beta, sum((f.yaw_head(s, line) for f in self.of["yaw_head"]), beta_head)

    def _pushed(self, s, ends, node):
        """Curvature that the loads add at the run-ups and at the run-offs of the two spans, each shape (2, batch)."""
        added_up, added_off = np.zeros((2, 2, len(self.line.stress)))
        for applied in self.history.applied_loads:
            load, to_tail = applied.load, applied.to_tail
            off, up = (np.where(to_tail, *both) for both in zip(*ends, strict=True))
            acts, kept = applied.acts(s, self.line, off, up, applied.now)
            chosen = np.stack([to_tail, ~to_tail])
            added_up += chosen * (load.run_up * acts)
            added_off += chosen * (load.run_off * acts)
            if node is not None:
                applied.now = applied.kept[node] = kept
        return added_up, added_off

    def _yielding(self, beta, beta_head, y, past, to_tail, to_head, pushed):
        """What the span moments leave of the yaw on a compliant tail bearing: beta - C (M_up + M_off)."""
        tail_off, head_off = past
        still = dot(to_tail.run_up, head_off + _ANGLE * beta_head, y[:2])
        still = still + dot(to_head.run_off, tail_off, y[2:] - _ANGLE * beta_head) + pushed
        give = self.line.compliance * self.line.bending
        return (beta - give * still) / (1 + give * (to_tail.run_up[3] - to_head.run_off[1]))

    def _responses(self, s: float, ends) -> tuple[Span, Span]:
        """Of the spans that run to the tail and to the head pulley, given (y, theta) at their ends."""
        spans = self._at_tension(s)
        if not any(self.history.changed_spans):
            return spans
        changed = []
        for span, tables, at in zip(spans, self.history.changed_spans, ends, strict=True):
            for table in tables:
                span = replace(span, **{n: getattr(span, n) + x for n, x in table.added_at(s, at).items()})
            changed.append(span)
        return changed[0], changed[1]

    def _at_tension(self, s: float) -> tuple[Span, Span]:
        """The responses as the tension at travel s makes them."""
        if not self.of["tension"]:
            return self.history.spans
        change, width = sum(f.tension(s, self.line) for f in self.of["tension"]), self.most - self.least
        t = np.divide(change - self.least, width, out=0 * width, where=width > 0)
        weights = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
        blended = [
            replace(span, **{n: sum(w * getattr(r, n) for w, r in zip(weights, rows, strict=True)) for n in _ROWS})
            for span, rows in zip(self.history.spans, self.slacker, strict=True)
        ]
        return blended[0], blended[1]


def _ends(y, past, beta, beta_head):
    """(y, theta) at run-off and run-up of the span to the tail and of the span to the head pulley."""
    tail_off, head_off = past
    to_tail = head_off + _ANGLE * beta_head, y[:2] + _ANGLE * beta
    return to_tail, (tail_off - _ANGLE * beta, y[2:] - _ANGLE * beta_head)


def _nodes(line: Line, reach: float) -> np.ndarray:
    """Nodes of the march: even, but with every yaw step between two nodes a hair apart."""
    longest = min(line.wrap_tail.min(), line.wrap_head.min()) / STEPS_A_WRAP
    steps = [float(s) for s in np.unique(line.yaw_at) if 0 < s < reach]
    edges = [0.0, *(e for s in steps for e in (s - _BEFORE, s)), reach]
    parts = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / longest - 1e-9))), endpoint=False) for a, b in pairwise(edges)
    ]
    return np.append(np.concatenate(parts), reach)
