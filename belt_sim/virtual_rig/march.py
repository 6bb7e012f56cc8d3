"""The belt on its way round: two run-up points against travel, the wraps as a history; then what sensors read of it.

Classical Runge-Kutta of fourth order by the method of steps; the delayed values come from cubic Hermite
interpolation of the computed past. States are y and the contact angle alpha = theta - theta_p at the run-ups
of the tail and of the head pulley: dy/ds = -alpha, dalpha/ds = -kappa. On the tail theta_p is +yaw at the
run-up and -yaw at the run-off, on the head -yaw and +yaw, whichever way the belt runs.

Friction lets a run-up go once, at each change of the commanded yaw, as far as the entry moment that is then left
wants (``slip_turn``); and it lets a run-off go all the time, as far as the moment there differs from that of landing.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.campaign.types import kind_at
from belt_sim.case import GRAVITY, Belt, Rig
from belt_sim.virtual_rig.faults import FAULT_HOOKS, Fault, has_hook
from belt_sim.virtual_rig.line import Line, SpanResponse
from belt_sim.virtual_rig.plan import Noise, Plan


class SpanTable:
    """What a fault adds to the response of one of the two spans, against the fault's ``span_state``."""

    def __init__(self, fault: Fault, line: Line, to_tail: bool) -> None:
        upper = (line.direction > 0) == to_tail
        nominal = line.span(to_tail=to_tail)
        found = [line.span(to_tail=to_tail, sections=fault.sections(x, line, upper)) for x in fault.span_states]
        self.fault, self.line, self.to_tail, self.states = fault, line, to_tail, np.array(fault.span_states)
        self.added = {n: np.stack([getattr(f, n) - getattr(nominal, n) for f in found]) for n in _RESPONSES}

    def added_at(self, s, ends, names: Sequence[str] = ("run_up", "run_off")) -> dict[str, np.ndarray]:
        """Name of a row of ``SpanResponse`` -> what is added to it at travel s (..., batch), shape (4, ..., batch)."""
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


def dot(row, off, up):
    return row[0] * off[0] + row[1] * off[1] + row[2] * up[0] + row[3] * up[1]


# Friction: how far the end of a wrapped belt turns where friction alone holds its moment; equilibrium, integrated once.
#
# Along a zone that slides, friction has the size mu F/(R b) per area and lies against the way of each point across the
# width, (eta theta', theta). It gives a couple m and a side force f per metre, M' = m + S, S' = -f, theta' = M/EI, from
# nothing where the belt still sticks (M = theta = 0) to where nothing pushes it aside any more (S = 0). In widths, and
# with mu F/R = EI = 1, one number is left: S at the beginning.


_BEGINNINGS = np.geomspace(1e-3, 30.0, 60)  # of S
_STEPS = 400  # in a width
_AGAIN = 12  # times that the zone of what is left is worked out
_FAINT = 1e-30  # of a curvature [1/m], instead of none


def slip_turn(kappa, stiff, line: Line, held) -> tuple[np.ndarray, np.ndarray]:
    """Angle [rad] by which a step of curvature ``kappa`` [1/m] turns the belt on the tail and on the head pulley, and
    how far [m] its end goes aside; shape (2, batch).

    stiff: curvature that a radian takes away [1/m]; held: where nothing slides.
    """
    radius, wrap = np.stack([line.tail_radius, line.head_radius]), np.stack([line.wrap_tail, line.wrap_head])
    couple = 4 * radius * line.bending * line.slippery / (line.force * line.width)
    zone = 0.0 * kappa
    for _ in range(_AGAIN):
        left = kappa / (1 + stiff * zone / 2)
        longest = couple * np.abs(left)
        share, aside = (np.interp(longest / line.width, *rows) for rows in _zones())
        zone = np.where(held, 0.0, np.minimum(longest * share, wrap))
    return left * zone / 2, aside * left * zone**2 / 2


@cache
def _zones():
    """(length were there no side force, in widths; share of it that slides) and (the same; way aside over turn times
    zone), as rows to interpolate."""
    side = _BEGINNINGS.copy()
    moment, angle, aside = np.zeros((3, len(side)))
    found = np.zeros((3, len(side)))
    step = 1.0 / _STEPS
    while (open_ := side > 0).any():
        before = moment, angle, aside
        begin = at = [moment, angle, side]
        for way in (0.5, 1.0):  # by the midpoint rule, with the slopes of M, theta and S per width
            moment, angle, pushed = at
            far = np.abs(angle) / np.maximum(np.abs(moment), _FAINT)  # theta/theta'
            lean = far * np.arcsinh(0.5 / np.maximum(far, _FAINT))
            slopes = 0.5 * np.sqrt(0.25 + far**2) - far * lean + pushed, moment, -2 * lean
            at = [x + way * step * dx for x, dx in zip(begin, slopes, strict=True)]
        moment, angle, side_after = at
        aside = aside + step * (before[1] + angle) / 2
        ends = open_ & (side_after <= 0)
        part = np.where(ends, side / np.where(ends, side - side_after, 1.0), 0.0)
        at_end = [a + part * (b - a) for a, b in zip(before, (moment, angle, aside), strict=True)]
        found = np.where(ends, at_end, found)
        side = np.where(open_, side_after, side)
    moment, angle, aside = found
    longest, zone = 4 * moment, 2 * angle / moment
    return (longest, zone / longest), (longest, aside / (angle * zone))


# The march.


#: Steps in one wrapped arc: 1 nm of the 10 mm that the test rig moves in 60 m.
STEPS_A_WRAP = 4
#: The step that carries a yaw step begins this far [m] after the one that ends before it.
_BEFORE = 1e-7
_ANGLE = np.array([[0.0], [1.0]])  # picks the angle out of a pair (y, angle)
_ROWS = ("run_up", "run_off")
_SHARES = (0.0, 0.5, 1.0)  # of the way from the least tension to the most; a response is a parabola through these


class BeltMarch:
    """The march of a batch of lines over ``reach`` metres of travel: their equations of motion and computed past.

    nodes (n,) [m]; state and slope (n, 4, batch): y, alpha tail, y, alpha head; tail_yaw, head_yaw: (n, batch) as they
    really are; bent: curvature at the run-ups, (n, 2, batch); gone: how far friction has let the belt go where it
    leaves, (y, alpha) of the tail, then of the head pulley, (n, 4, batch); spans: the one that runs to the tail and the
    one that runs to the head pulley; of: hook -> the faults that have it; loads: on the spans.
    """

    def __init__(self, line: Line, faults: Sequence[Fault], reach: float) -> None:
        longest = min(line.wrap_tail.min(), line.wrap_head.min()) / STEPS_A_WRAP
        steps = [float(s) for s in np.unique(line.yaw_at) if 0 < s < reach]
        edges = [0.0, *(e for s in steps for e in (s - _BEFORE, s)), reach]  # every yaw step between two nodes
        counts = [max(1, int(np.ceil((b - a) / longest - 1e-9))) for a, b in pairwise(edges)]
        parts = [np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(edges), counts, strict=True)]
        self.line, self.nodes = line, np.append(np.concatenate(parts), reach)
        count, batch = len(self.nodes), len(line.stress)
        self.state, self.slope, self.gone = np.zeros((3, count, 4, batch))
        self.tail_yaw, self.head_yaw = np.zeros((2, count, batch))
        self.bent = np.zeros((count, 2, batch))

        self.of = {hook: [f for f in faults if has_hook(f, hook)] for hook in FAULT_HOOKS}
        self.loads = [replace(x, fault=f, kept=np.zeros((count, batch))) for f in faults for x in f.loads(line)]
        both, swings = (True, False), [f.swing for f in self.of["tension"]]
        self.spans = line.span(), line.span(to_tail=False)
        self.changed_spans = tuple([SpanTable(f, line, to_tail) for f in self.of["sections"]] for to_tail in both)
        self.least, self.most = (sum((swing[i] for swing in swings), 0 * line.stress) for i in (0, 1))
        self.slacker = [
            [line.span(1 + self.least + (self.most - self.least) * t, to_tail=to_tail) for t in _SHARES if swings]
            for to_tail in both
        ]

        self.sticks = line.slippery == 0.0
        self.slips = not self.sticks.all()
        self.soft = 1 + line.cover * line.bending
        self.yields = bool(np.any(line.compliance))
        self.here = self.wrap_exit(np.zeros(batch), slipped=False)  # what leaves the pulleys at this node

        first = (f.initial_state(np.zeros(batch), line) for f in self.of["initial_state"])
        y, last = sum(first, np.zeros_like(self.state[0])), len(self.nodes) - 1
        for k in range(last):
            y = self.step(k, y)
        self.rates(self.nodes[last], last - 1, y, self.here, last)

    def state_at(self, s: np.ndarray, first: int = 0, last: int = 4) -> np.ndarray:
        """Rows first:last of the state at travel s, shape (..., batch) -> (rows, ..., batch)."""
        k = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        rows = np.arange(first, last).reshape(-1, *(1,) * s.ndim)
        lanes = np.arange(s.shape[-1])
        h = self.nodes[k + 1] - self.nodes[k]
        left, before, right, after = (a[j, rows, lanes] for j in (k, k + 1) for a in (self.state, self.slope))
        t = (s - self.nodes[k]) / h  # cubic Hermite interpolation, from values and slopes
        since = left + t * t * (3 - 2 * t) * (right - left) + h * t * (1 - t) * ((1 - t) * before - t * after)
        return np.where(
            s < 0, sum((f.initial_state(s, self.line)[first:last] for f in self.of["initial_state"]), 0.0), since
        )

    def interpolate(self, rows: np.ndarray, s: np.ndarray) -> np.ndarray:
        """What was kept at the nodes, shape (nodes, batch), linear between them at travel s (n, batch); 0 up to 0."""
        lanes = range(s.shape[1])
        values = [np.interp(s[:, b], self.nodes, rows[:, b], left=0.0) for b in lanes]
        return np.where(s > 0, np.stack(values, axis=1), 0.0)

    def wrap_exit(self, s: np.ndarray, *, slipped: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """(y, alpha) of what leaves the tail and the head pulley at travel s, each shape (2, ..., batch); slipped: once
        friction has let the belt go there, for travels (n, batch) that the march has been to."""
        line = self.line
        tail, head = self.state_at(s - line.wrap_tail, 0, 2), self.state_at(s - line.wrap_head, 2, 4)
        # round a canted tail pulley the belt follows y + gamma z = const, in all y_2 = y_1 + 2 R gamma; what lay on it
        # at travel 0 gains only what was left of its way: R gamma (1 - cos(s/R))
        turned = np.clip(s / line.tail_radius, 0.0, np.pi)
        tail[0] += line.tail_radius * line.cant * line.direction * (1 - np.cos(turned))
        for fault in self.of["creep"]:
            slid = fault.creep(s, line, np.stack([tail[1], head[1]]))
            tail[0] += slid[0]
            head[0] += slid[1]
        if not slipped or not self.gone.any():
            return tail, head
        gone = np.stack([self.interpolate(self.gone[:, k], s) for k in range(4)])
        return tail + gone[:2], head + gone[2:]

    def step(self, k: int, y: np.ndarray) -> np.ndarray:
        """One Runge-Kutta step from node k."""
        s, h = self.nodes[k], self.nodes[k + 1] - self.nodes[k]
        # run-ups let go at the start, and where the yaw is changed as this step begins
        before, middle, at = self.nodes[max(k - 1, 0)], (s + self.nodes[k + 1]) / 2, self.line.yaw_at
        changed = (middle > at) & ((before + s) / 2 <= at) | (k == 0)
        if self.slips and changed.any():
            kappa = self.curvatures(s, k, y, self.here)[0]
            ends = _ends(*self.line.along_bent_axes(y, self.here), *self._yaws(s, k))
            stiff = np.stack([span.run_up[3] for span in self._responses(s, ends)])
            gone = slip_turn(kappa, stiff, self.line, self.sticks)
            turn, aside = (np.where(changed, x, 0.0) for x in gone)
            y = y + np.stack([aside[0], -turn[0], aside[1], -turn[1]])
        k1, still = self.rates(s, k, y, self.here, k), np.zeros(len(self.line.stress))
        half, whole = (self.wrap_exit(s + share * h + still, slipped=False) for share in (0.5, 1.0))
        k2 = self.rates(s + h / 2, k, y + h / 2 * k1, half)
        k3 = self.rates(s + h / 2, k, y + h / 2 * k2, half)
        k4 = self.rates(s + h, k, y + h * k3, whole)
        self.here = whole
        return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def rates(self, s, k, y, past, node=None):
        """Rate of change of the state per metre of travel, under the commands of step k; at a node, the state, this
        rate and what acts there are self."""
        line = self.line
        kappa, beta, beta_head = self.curvatures(s, k, y, past, node)
        turn = sum((f.turn(s, line, y[::2], kappa) for f in self.of["turn"]), kappa * self.soft)
        for fault in self.of["recall"]:
            turn = turn + fault.recall(s, self)
        drift = y[1::2]
        for fault in self.of["slide"]:
            drift = drift * fault.slide(s, line, y[1::2])
        rates = -np.stack([drift[0], turn[0], drift[1], turn[1]])
        if node is not None:
            self.state[node], self.slope[node] = y, rates
            self.tail_yaw[node], self.head_yaw[node], self.bent[node] = beta, beta_head, kappa
        return rates

    def curvatures(self, s, k, y, past, node=None):
        """Curvature where the belt runs up, shape (2, batch), and the true yaws of the tail and head pulley."""
        (beta, beta_head), line = self._yaws(s, k), self.line
        y, past = line.along_bent_axes(y, past)
        to_tail, to_head = self._responses(s, _ends(y, past, beta, beta_head))
        if self.yields:
            # the spans' moments turn a compliant tail bearing back, the pull of a belt off the middle turns it further:
            # beta - C (M_up + M_off - F (y_up + y_off))
            pushed = self._load_curvatures(s, _ends(y, past, beta, beta_head), None)[1][1]
            tail_off, head_off = past
            still = dot(to_tail.run_up, head_off + _ANGLE * beta_head, y[:2])
            still = still + dot(to_head.run_off, tail_off, y[2:] - _ANGLE * beta_head) + pushed
            give = line.compliance * line.bending
            beta = beta + line.compliance * line.force * (y[0] + tail_off[0])
            beta = (beta - give * still) / (1 + give * (to_tail.run_up[3] - to_head.run_off[1]))
        if self.slips:
            ends = _ends(y, past, beta, beta_head)
            bent = np.stack([dot(to_head.run_off, *ends[1]), dot(to_tail.run_off, *ends[0])])
            bent = bent + self._load_curvatures(s, ends, None)[1][::-1]
            stiff = -np.stack([to_head.run_off[1], to_tail.run_off[1]])
            back = (np.broadcast_to(s - wrap, line.stress.shape)[None] for wrap in (line.wrap_tail, line.wrap_head))
            landed = np.stack([self.interpolate(self.bent[:, k], there)[0] for k, there in enumerate(back)])
            turn, aside = slip_turn(bent - landed, stiff, line, self.sticks)
            gone = np.stack([aside, turn], axis=1)  # how far friction lets go what leaves the tail and the head pulley
            if node is not None:
                self.gone[node] = gone.reshape(4, -1)
            past = past[0] + gone[0], past[1] + gone[1]
        ends = _ends(y, past, beta, beta_head)
        kappa = np.stack([dot(to_tail.run_up, *ends[0]), dot(to_head.run_up, *ends[1])])
        return kappa + self._load_curvatures(s, ends, node)[0], beta, beta_head

    def _yaws(self, s: float, k: int):
        line = self.line
        turned = (self.nodes[k] + self.nodes[k + 1]) / 2 > line.yaw_at
        before_top = line.sag_roll * line.sag_curvature * line.span_length / 2  # where a cant looks like a yaw, too
        beta = line.yaw * turned + line.offset_tail - line.cant * np.sin(before_top)
        beta_head = line.yaw_head * turned + line.offset_head
        beta = sum((f.yaw(s, line) for f in self.of["yaw"]), beta)
        return beta, sum((f.yaw_head(s, line) for f in self.of["yaw_head"]), beta_head)

    def _load_curvatures(self, s, ends, node):
        """Curvature that the loads add at the run-ups and at the run-offs of the two spans, each shape (2, batch)."""
        added_up, added_off = np.zeros((2, 2, len(self.line.stress)))
        for load in self.loads:
            off, up = (np.where(load.to_tail, *both) for both in zip(*ends, strict=True))
            acts, kept = load.fault.push(s, self.line, load, dot(load.row, off, up), load.now)
            chosen = np.stack([load.to_tail, ~load.to_tail])
            added_up += chosen * (load.run_up * acts)
            added_off += chosen * (load.run_off * acts)
            if node is not None:
                load.now = load.kept[node] = kept
        return added_up, added_off

    def _responses(self, s: float, ends) -> tuple[SpanResponse, SpanResponse]:
        """Of the spans that run to the tail and to the head pulley, given (y, theta) at their ends."""
        spans = self.spans
        if self.of["tension"]:
            change, width = sum(f.tension(s, self.line) for f in self.of["tension"]), self.most - self.least
            t = np.divide(change - self.least, width, out=0 * width, where=width > 0)
            weights = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
            to_tail, to_head = (
                replace(span, **{n: sum(w * getattr(r, n) for w, r in zip(weights, rows, strict=True)) for n in _ROWS})
                for span, rows in zip(spans, self.slacker, strict=True)
            )
            spans = to_tail, to_head
        if not any(self.changed_spans):
            return spans
        changed = []
        for span, tables, at in zip(spans, self.changed_spans, ends, strict=True):
            for table in tables:
                span = replace(span, **{n: getattr(span, n) + x for n, x in table.added_at(s, at).items()})
            changed.append(span)
        return changed[0], changed[1]


def _ends(y, past, beta, beta_head):
    """(y, theta) at run-off and run-up of the span to the tail and of the span to the head pulley."""
    tail_off, head_off = past
    to_tail = head_off + _ANGLE * beta_head, y[:2] + _ANGLE * beta
    return to_tail, (tail_off - _ANGLE * beta, y[2:] - _ANGLE * beta_head)


# Readings of the plan's sensors.


_JUST_BEFORE = 1e-6  # [m] before the yaw is applied


@dataclass(frozen=True, kw_only=True)
class TrueErrors:
    """True minus stated: machine data (name -> SI), and the settings of the runs, shape (runs,)."""

    machine: Mapping[str, float] = field(default_factory=dict)
    tension_rel: np.ndarray | float = 0.0
    yaw: np.ndarray | float = 0.0


def stated_data(plan: Plan) -> dict:
    """Machine data as stated: name -> Quantity."""
    return vars(plan.machine) | vars(plan.belt)


def true_machine(plan: Plan, errors: TrueErrors, gravity: float = GRAVITY) -> tuple[Rig, Belt]:
    """Machine and belt of a plan as they really are."""
    data = {name: q.value + errors.machine.get(name, 0.0) for name, q in stated_data(plan).items()}
    return Rig(**{n: data[n] for n in vars(plan.machine)}, gravity=gravity), Belt(
        **{n: data[n] for n in vars(plan.belt)}
    )


def true_line(plan: Plan, base: str, errors: TrueErrors) -> Line:
    """The runs of a plan as lines of base law ``beam_th2`` or ``strip``, without faults."""
    rig, belt = true_machine(plan, errors)
    settings = ("tension", "yaw", "yaw_head", "yaw_at", "speed", "direction", "start")
    columns = {name: np.array([getattr(run, name) for run in plan.runs], dtype=float) for name in settings}
    columns["stress"] = columns.pop("tension") * (1 + errors.tension_rel)
    columns["yaw"] = columns["yaw"] + errors.yaw
    for name in ("span_length", "wrap_tail", "wrap_head", "tail_radius", "head_radius", "gravity"):
        columns[name] = getattr(rig, name)
    for name in ("width", "thickness", "youngs_modulus", "density", "poisson_ratio"):
        columns[name] = getattr(belt, name)
    line = Line(run=np.arange(len(plan.runs)), sag_roll=float(base == "strip"), **columns)
    return replace(line, **{n: np.broadcast_to(np.asarray(v), (len(plan.runs),)) for n, v in vars(line).items()})


def observe(plan: Plan, line: Line, faults: Sequence[Fault]) -> np.ndarray:
    """Readings without noise [m or rad], shape (signals, n, batch), at the travel that the recorder shows.

    A lateral sensor reads zero where the yaw is applied, or where the record begins; a tilt is against the horizontal.
    """
    shown = plan.travel[:, None]
    for fault in faults:
        line = fault.set(line)
    travelled = np.broadcast_to(shown, (len(shown), len(line.stress)))
    for fault in faults:
        travelled = fault.true_travel(travelled, line)
    reach = max(float(travelled.max()), plan.spacing)
    history = BeltMarch(line, faults, reach)
    begun = np.broadcast_to(0.0 if plan.zero_at_start else line.yaw_at, (1, len(line.stress)))
    readings = []
    for place in plan.signals.values():
        value = perfect_reading(history, faults, place, travelled)
        if kind_at(place) == "lateral":
            value = value - perfect_reading(history, faults, place, begun, _JUST_BEFORE)
        for fault in faults:
            value = fault.read(value, place, travelled, line)
        readings.append(value)
    return np.stack(readings)


#: point -> pulley (0 tail, 1 head), and whether the belt leaves it there, for travel direction +1; -1 swaps run-up and
#: run-off
POINT_PLACES = {"point_1": (0, False), "point_2": (0, True), "point_3": (1, False), "point_4": (1, True)}
TILT_SIGNS = {"upper_mid_span": 1.0, "lower_mid_span": -1.0}  # direction in which the belt comes from the head pulley


def perfect_reading(
    history: BeltMarch, faults: Sequence[Fault], place: str, s: np.ndarray, before: float = 0.0
) -> np.ndarray:
    """What a perfect sensor sees at travel s (n, batch), or a hair before: the belt and its edge [m], where the sensor
    looked, or the tilt of a span [rad]."""
    line = history.line
    if place not in TILT_SIGNS:
        for fault in faults:
            s = fault.sensor_travel(s, line)
        pulley, leaves = POINT_PLACES[place]
        up, off = history.state_at(s - before)[2 * pulley], history.wrap_exit(s - before)[pulley][0]
        seen = np.where((line.direction > 0) == leaves, off, up)
        return sum((f.edge(place, s, line) for f in faults), seen)

    s, tilts = s - before, []
    here, (tail_off, head_off) = line.along_bent_axes(history.state_at(s), history.wrap_exit(s))
    beta, beta_head = (history.interpolate(rows, s) for rows in (history.tail_yaw, history.head_yaw))
    to_tail, to_head = (head_off, here[:2], beta_head, beta), (tail_off, here[2:], -beta, -beta_head)
    for k, (off, up, turn_off, turn_up) in enumerate((to_tail, to_head)):
        # phi at the middle of the span that runs to the tail or to the head pulley, from its ends and its loads
        off, up = np.stack([off[0], off[1] + turn_off]), np.stack([up[0], up[1] + turn_up])
        row = history.spans[k].tilt
        if tables := history.changed_spans[k]:
            row = row[:, None] + sum(table.added_at(s, (off, up), ("tilt",))["tilt"] for table in tables)
        tilt = dot(row, off, up)
        for load in history.loads:
            kept = history.interpolate(load.kept, s)
            acts = load.fault.push(s, line, load, dot(load.row, off, up), kept)[0] * (s > 0)
            tilt = tilt + np.where(load.to_tail == (k == 0), load.tilt * acts, 0.0)
        tilts.append(tilt)
    return np.where(TILT_SIGNS[place] * line.direction > 0, *tilts)


# Random errors: settings, machine data, and what the sensors add.


_TAIL_FREEDOM = 3  # degrees of freedom of the heavy-tailed noise; its variance is nu/(nu - 2)


def draw_errors(plan: Plan, noise: Noise, rng: np.random.Generator) -> TrueErrors:
    """One machine, and one setting of each run, drawn from their stated uncertainties."""
    machine = {name: float(q.u * rng.standard_normal()) for name, q in stated_data(plan).items()}
    runs = len(plan.runs)
    return TrueErrors(
        machine=machine,
        tension_rel=noise.tension_rel * rng.standard_normal(runs),
        yaw=noise.yaw_u * rng.standard_normal(runs),
    )


def add_noise(readings: np.ndarray, travel: np.ndarray, sheets: Sequence[SignalSheet], noise: Noise, rng) -> np.ndarray:
    """Readings, shape (signals, n, runs), with gain, zero, wander and white noise; travel: (n,)."""
    noisy, runs = [], readings.shape[2]
    for sheet, values in zip(sheets, readings, strict=True):
        gain = 1 + sheet.gain * rng.standard_normal(runs)
        zero = sheet.zero * rng.standard_normal(runs)
        length = sheet.wander_length if noise.true_length is None else noise.true_length
        drift = noise.scale * sheet.wander_sd * wander(travel, length, rng.standard_normal(values.shape), noise.smooth)
        lateral = sheet.kind == "lateral"
        if noise.heavy_tails:
            draws = rng.standard_t(_TAIL_FREEDOM, values.shape) / math.sqrt(_TAIL_FREEDOM / (_TAIL_FREEDOM - 2))
        else:
            draws = rng.standard_normal(values.shape)
        white = noise.scale * (noise.white if lateral else sheet.white) * draws
        shown = values * gain + zero + drift + white
        noisy.append(np.round(shown / noise.quantum) * noise.quantum if lateral and noise.quantum else shown)
    return np.stack(noisy)


def wander(travel: np.ndarray, length: float, draws: np.ndarray, smooth: bool) -> np.ndarray:
    """A process of unit variance from independent normal numbers, shape (n, runs): Ornstein-Uhlenbeck, correlation
    exp(-distance/length), or smooth, that is with a slope, (1 + r) exp(-r), r = sqrt(3) distance/length."""
    if smooth:
        apart = math.sqrt(3) * np.abs(travel[:, None] - travel) / length
        root = np.linalg.cholesky((1 + apart) * np.exp(-apart) + 1e-9 * np.eye(len(travel)))
        return root @ draws
    path = np.empty_like(draws)
    path[0] = draws[0]
    for k in range(1, len(travel)):
        keep = math.exp(-(travel[k] - travel[k - 1]) / length)
        path[k] = keep * path[k - 1] + math.sqrt(1 - keep**2) * draws[k]
    return path
