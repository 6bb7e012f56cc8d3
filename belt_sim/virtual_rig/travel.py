"""The belt on its way round: the two run-up points against travel, the wraps as a history.

Classical Runge-Kutta of fourth order by the method of steps; the delayed values come from cubic Hermite
interpolation of the computed past. States are y and the contact angle alpha = theta - theta_p at the run-ups
of the tail and of the head pulley: dy/ds = -alpha, dalpha/ds = -kappa. On the tail theta_p is +yaw at the
run-up and -yaw at the run-off, on the head -yaw and +yaw, whichever way the belt runs.

Friction lets a run-up go once, at each change of the commanded yaw: by M z/(2 EI), M the entry moment that is
left when it has let go and z = 4 R M/(mu F b) the length over which friction takes that up, a wrap at most.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from belt_sim.virtual_rig.fault import Fault, overrides
from belt_sim.virtual_rig.line import Line
from belt_sim.virtual_rig.load import Load
from belt_sim.virtual_rig.span import Span

#: Steps in one wrapped arc: 1 nm of the 10 mm that the test rig moves in 60 m.
STEPS_A_WRAP = 4
#: The step that carries a yaw step begins this far [m] after the one that ends before it.
_BEFORE = 1e-7
_HALVINGS = 40  # of the interval in which the angle lies that friction lets a run-up turn by
_ANGLE = np.array([[0.0], [1.0]])  # picks the angle out of a pair (y, angle)
_ROWS = ("run_up", "run_off")
_SHARES = (0.0, 0.5, 1.0)  # of the way from the least tension to the most; a response is a parabola through these


@dataclass(frozen=True)
class Journey:
    """The computed past: nodes (n,) [m]; state and slope (n, 4, batch): y, alpha tail, y, alpha head.

    tail_yaw, head_yaw: (n, batch) as they really are; spans: the one that runs to the tail and the one that runs to
    the head pulley; faults: by which the belt creeps on the wraps; began: with which it did not begin straight; props:
    the loads on the spans.
    """

    line: Line
    nodes: np.ndarray
    state: np.ndarray
    slope: np.ndarray
    tail_yaw: np.ndarray
    head_yaw: np.ndarray
    spans: tuple[Span, Span]
    faults: tuple[Fault, ...] = ()
    began: tuple[Fault, ...] = ()
    props: list["Prop"] = field(default_factory=list)

    def at(self, s: np.ndarray, first: int = 0, last: int = 4) -> np.ndarray:
        """Rows first:last of the state at travel s, shape (..., batch) -> (rows, ..., batch)."""
        k = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        rows = np.arange(first, last).reshape(-1, *(1,) * s.ndim)
        lanes = np.arange(s.shape[-1])
        h = self.nodes[k + 1] - self.nodes[k]
        ends = [a[j, rows, lanes] for j in (k, k + 1) for a in (self.state, self.slope)]
        since = _blend((s - self.nodes[k]) / h, h, *ends)
        return np.where(s < 0, sum((f.before(s, self.line)[first:last] for f in self.began), 0.0), since)

    def leaving(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(y, alpha) of what leaves the tail and the head pulley at travel s, each shape (2, ..., batch)."""
        tail = self.at(s - self.line.wrap_tail, 0, 2)
        head = self.at(s - self.line.wrap_head, 2, 4)
        tail[0] += self.line.wrap_shift(s)
        for fault in self.faults:
            slid = fault.creep(s, self.line, np.stack([tail[1], head[1]]))
            tail[0] += slid[0]
            head[0] += slid[1]
        return tail, head


@dataclass
class Prop:
    """A load of a fault: on the span that runs to the tail (lane by lane)?, what it remembers, now and (n, batch)."""

    fault: Fault
    load: Load
    to_tail: np.ndarray
    now: np.ndarray
    kept: np.ndarray

    def acts(self, s, line: Line, off, up, kept):
        """How much of the load acts at travel s, and what it remembers then; off, up: (y, theta) at its span's ends."""
        return self.fault.push(s, line, self.load, _dot(self.load.row, off, up), kept)


def march(line: Line, faults: Sequence[Fault], reach: float) -> Journey:
    """Run a batch of lines over ``reach`` metres of travel."""
    nodes, batch = _nodes(line, reach), len(line.stress)
    past = Journey(
        line=line,
        nodes=nodes,
        state=np.zeros((len(nodes), 4, batch)),
        slope=np.zeros((len(nodes), 4, batch)),
        tail_yaw=np.zeros((len(nodes), batch)),
        head_yaw=np.zeros((len(nodes), batch)),
        spans=(line.span(), line.span(to_tail=False)),
        faults=tuple(f for f in faults if overrides(f, "creep")),
        began=tuple(f for f in faults if overrides(f, "before")),
        props=[
            Prop(f, load, (line.direction > 0) == load.upper, np.zeros(batch), np.zeros((len(nodes), batch)))
            for f in faults
            for load in f.loads(line)
        ],
    )
    road = _Road(past, faults)
    y = sum((f.before(np.zeros(batch), line) for f in past.began), np.zeros((4, batch)))
    for k in range(len(nodes) - 1):
        y = road.step(k, y)
    road.store(len(nodes) - 1, y, k)
    return past


class _Road:
    """The equations of motion with their history so far."""

    def __init__(self, past: Journey, faults: Sequence[Fault]) -> None:
        self.past, self.line, self.nodes = past, past.line, past.nodes
        hooks = ("yaw", "yaw_head", "turn", "recall", "slide", "tension")
        self.of = {hook: [f for f in faults if overrides(f, hook)] for hook in hooks}
        line = past.line
        self.here = past.leaving(np.zeros(past.state.shape[2]))  # what leaves the pulleys at the node at hand
        self.slips = bool(np.isfinite(line.friction).any())
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
            y = self.slipped(k, y)
        k1 = self.store(k, y, k)
        half, whole = self.delayed(k, 0.5), self.delayed(k, 1.0)
        k2 = self.rates(s + h / 2, k, y + h / 2 * k1, half)
        k3 = self.rates(s + h / 2, k, y + h / 2 * k2, half)
        k4 = self.rates(s + h, k, y + h * k3, whole)
        self.here = whole
        return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def store(self, node: int, y: np.ndarray, k: int) -> np.ndarray:
        """Keep state, slope and what acts at a node, under the commands of step k; returns the slope."""
        slope = self.rates(self.nodes[node], k, y, self.here, node)
        self.past.state[node], self.past.slope[node] = y, slope
        return slope

    def delayed(self, k: int, share: float) -> tuple[np.ndarray, np.ndarray]:
        """What leaves the tail and the head pulley: (y, alpha) one wrapped arc ago, each shape (2, batch)."""
        s = self.nodes[k] + share * (self.nodes[k + 1] - self.nodes[k])
        return self.past.leaving(np.broadcast_to(s, self.line.stress.shape))

    def rates(self, s, k, y, past, node=None):
        """Rate of change of the state per metre of travel; at a node, what acts there is kept."""
        line = self.line
        kappa, beta, beta_head = self.bent(s, k, y, past, node)
        turn = sum((f.turn(s, line, y[::2], kappa) for f in self.of["turn"]), kappa * self.soft)
        for fault in self.of["recall"]:
            turn = turn + fault.recall(s, self.past)
        drift = y[1::2]
        for fault in self.of["slide"]:
            drift = drift * fault.slide(s, line, y[1::2])
        if node is not None:
            self.past.tail_yaw[node], self.past.head_yaw[node] = beta, beta_head
        return -np.stack([drift[0], turn[0], drift[1], turn[1]])

    def bent(self, s, k, y, past, node=None):
        """Curvature where the belt runs up, shape (2, batch), and the true yaws of the tail and head pulley."""
        to_tail, to_head = self._responses(s)
        beta, beta_head = self._yaws(s, k)
        if self.yields:
            off = self._pushed(s, _ends(y, past, beta, beta_head), None)[1][1]
            beta = self._yielding(beta, beta_head, y, past, to_tail, to_head, off)
        ends = _ends(y, past, beta, beta_head)
        kappa = np.stack([_dot(to_tail.run_up, *ends[0]), _dot(to_head.run_up, *ends[1])])
        return kappa + self._pushed(s, ends, node)[0], beta, beta_head

    def slipped(self, k: int, y: np.ndarray) -> np.ndarray:
        """The state once the run-ups have let go, in lanes whose yaw is changed at the beginning of step k."""
        line, before = self.line, self.nodes[max(k - 1, 0)]
        middle = (self.nodes[k] + self.nodes[k + 1]) / 2
        changed = (middle > line.yaw_at) & ((k == 0) | ((before + self.nodes[k]) / 2 <= line.yaw_at))
        if not changed.any():
            return y
        least, most = np.zeros((2, y.shape[1])), self._wanted(k, y)
        for _ in range(_HALVINGS):  # what turns the run-up is the moment that is left when it has turned
            turn = (least + most) / 2
            more = np.abs(self._wanted(k, self._turned(y, turn))) > np.abs(turn)
            least, most = np.where(more, turn, least), np.where(more, most, turn)
        return self._turned(y, np.where(changed, (least + most) / 2, 0.0))

    def _turned(self, y: np.ndarray, turn: np.ndarray) -> np.ndarray:
        y = y.copy()
        y[1::2] -= turn
        return y

    def _wanted(self, k: int, y: np.ndarray) -> np.ndarray:
        """Angle [rad] by which friction would let the run-ups turn at their present curvature, shape (2, batch)."""
        line = self.line
        kappa = self.bent(self.nodes[k], k, y, self.here)[0]
        radius, wrap = np.stack([line.tail_radius, line.head_radius]), np.stack([line.wrap_tail, line.wrap_head])
        length = 4 * radius * np.abs(kappa) * line.bending / (line.friction * line.force * line.width)
        return kappa * np.minimum(length, wrap) / 2

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
        for prop in self.past.props:
            load, to_tail = prop.load, prop.to_tail
            off, up = (np.where(to_tail, *both) for both in zip(*ends, strict=True))
            acts, kept = prop.acts(s, self.line, off, up, prop.now)
            chosen = np.stack([to_tail, ~to_tail])
            added_up += chosen * (load.run_up * acts)
            added_off += chosen * (load.run_off * acts)
            if node is not None:
                prop.now = prop.kept[node] = kept
        return added_up, added_off

    def _yielding(self, beta, beta_head, y, past, to_tail, to_head, pushed):
        """What the span moments leave of the yaw on a compliant tail bearing: beta - C (M_up + M_off)."""
        tail_off, head_off = past
        still = _dot(to_tail.run_up, head_off + _ANGLE * beta_head, y[:2])
        still = still + _dot(to_head.run_off, tail_off, y[2:] - _ANGLE * beta_head) + pushed
        give = self.line.compliance * self.line.bending
        return (beta - give * still) / (1 + give * (to_tail.run_up[3] - to_head.run_off[1]))

    def _responses(self, s: float) -> tuple[Span, Span]:
        """Of the span that runs to the tail and the one that runs to the head pulley."""
        if not self.of["tension"]:
            return self.past.spans
        change, width = sum(f.tension(s, self.line) for f in self.of["tension"]), self.most - self.least
        t = np.divide(change - self.least, width, out=0 * width, where=width > 0)
        weights = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
        blended = [
            replace(span, **{n: sum(w * getattr(r, n) for w, r in zip(weights, rows, strict=True)) for n in _ROWS})
            for span, rows in zip(self.past.spans, self.slacker, strict=True)
        ]
        return blended[0], blended[1]


def _ends(y, past, beta, beta_head):
    """(y, theta) at run-off and run-up of the span to the tail and of the span to the head pulley."""
    tail_off, head_off = past
    to_tail = head_off + _ANGLE * beta_head, y[:2] + _ANGLE * beta
    return to_tail, (tail_off - _ANGLE * beta, y[2:] - _ANGLE * beta_head)


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
