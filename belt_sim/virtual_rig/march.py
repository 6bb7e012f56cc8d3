"""The belt on its way round: two run-up points against travel, the wraps as a history; then what sensors read of it.

Classical Runge-Kutta of fourth order by the method of steps; the delayed values come from cubic Hermite
interpolation of the computed past. States are y and the contact angle alpha = theta - theta_p at the run-ups
of the tail and of the head pulley: dy/ds = -alpha, dalpha/ds = -kappa. On the tail theta_p is +yaw at the
run-up and -yaw at the run-off, on the head -yaw and +yaw, whichever way the belt runs.

Friction lets a run-up go once, at each change of the commanded yaw, as far as the entry moment that is then left
wants (``slip_turn``); and it lets a run-off go all the time, as far as the moment there differs from that of landing.

Arrays have these axes, whichever of them they have: pulley (0 tail, 1 head) or the span that runs to it; y and angle,
or the four boundary values y, theta at the run-off and y, theta at the run-up; readings n; batch.
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
from belt_sim.virtual_rig.line import RUN_OFF, RUN_UP, TILT, Line
from belt_sim.virtual_rig.plan import Noise, Plan

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


def slip_turn(kappa, stiff, line: Line, held) -> np.ndarray:
    """How far [m] the belt's end goes aside and the angle [rad] by which it turns, where a step of curvature ``kappa``
    [1/m], shape (2, batch), is left to friction; shape (2, 2, batch).

    stiff: curvature that a radian takes away [1/m]; held: where nothing slides.
    """
    couple = 4 * line.radii * line.bending * line.slippery / (line.force * line.width)
    zone = 0.0 * kappa
    for _ in range(_AGAIN):
        left = kappa / (1 + stiff * zone / 2)
        longest = couple * np.abs(left)
        share, aside = (np.interp(longest / line.width, *rows) for rows in _zones())
        zone = np.where(held, 0.0, np.minimum(longest * share, line.wraps))
    return np.stack([aside * left * zone**2 / 2, left * zone / 2], axis=1)


@cache
def _zones():
    """(length were there no side force, in widths; share of it that slides) and (the same; way aside over turn times
    zone), as rows to interpolate."""
    found, step = np.zeros((3, len(_BEGINNINGS))), 1.0 / _STEPS
    state = np.stack([0 * _BEGINNINGS, 0 * _BEGINNINGS, _BEGINNINGS, 0 * _BEGINNINGS])  # M, theta, S, way aside

    def slopes(moment, angle, pushed, aside):
        far = np.abs(angle) / np.maximum(np.abs(moment), _FAINT)  # theta/theta'
        lean = far * np.arcsinh(0.5 / np.maximum(far, _FAINT))
        return np.stack([0.5 * np.sqrt(0.25 + far**2) - far * lean + pushed, moment, -2 * lean, angle])

    while (open_ := state[2] > 0).any():
        after = state + step * slopes(*(state + step / 2 * slopes(*state)))  # by the midpoint rule
        ends = open_ & (after[2] <= 0)
        part = np.where(ends, state[2] / np.where(ends, state[2] - after[2], 1.0), 0.0)
        found = np.where(ends, (state + part * (after - state))[[0, 1, 3]], found)
        state = np.where(open_, after, state)
    moment, angle, aside = found
    longest, zone = 4 * moment, 2 * angle / moment
    return (longest, zone / longest), (longest, aside / (angle * zone))


# The march.


#: Steps in one wrapped arc: 1 nm of the 10 mm that the test rig moves in 60 m.
STEPS_A_WRAP = 4
#: The step that carries a yaw step begins this far [m] after the one that ends before it.
_BEFORE = 1e-7
_SIGNS = np.array([[1.0], [-1.0]])  # of theta_p over the yaw at the run-up; at the run-off the other pulley's


class BeltMarch:
    """The march of a batch of lines over ``reach`` metres of travel: their equations of motion and computed past.

    nodes (n,) [m]; state and slope: (y, alpha) at the run-ups, (n, 2, 2, batch); yaw, as the pulleys really are, and
    bent, the curvature at the run-ups: (n, 2, batch); gone: how far (y, alpha) friction has let the belt go where it
    leaves, (n, 2, 2, batch); rows: the spans' responses, (2, 3, 4, batch); of: hook -> the faults that have it; loads:
    on the spans; changed: a fault, and what it adds to the rows at its ``span_states``, (states, 2, 3, 4, batch).
    """

    def __init__(self, line: Line, faults: Sequence[Fault], reach: float) -> None:
        longest = line.wraps.min() / STEPS_A_WRAP
        steps = [float(s) for s in np.unique(line.yaw_at) if 0 < s < reach]
        edges = [0.0, *(e for s in steps for e in (s - _BEFORE, s)), reach]  # every yaw step between two nodes
        counts = [max(1, int(np.ceil((b - a) / longest - 1e-9))) for a, b in pairwise(edges)]
        parts = [np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(edges), counts, strict=True)]
        self.line, self.nodes = line, np.append(np.concatenate(parts), reach)
        count, batch = len(self.nodes), len(line.stress)
        self.state, self.slope, self.gone = np.zeros((3, count, 2, 2, batch))
        self.yaw, self.bent = np.zeros((2, count, 2, batch))

        self.of = {hook: [f for f in faults if has_hook(f, hook)] for hook in FAULT_HOOKS}
        self.loads = [replace(x, fault=f, kept=np.zeros((count, batch))) for f in faults for x in f.loads(line)]
        both = [(to_tail, (line.direction > 0) == to_tail) for to_tail in (True, False)]
        self.rows = np.stack([line.span(to_tail=to_tail)[0] for to_tail, _ in both])
        self.changed = []
        for f in self.of["sections"]:
            at = [[line.span(to_tail=k, sections=f.sections(x, line, up))[0] for k, up in both] for x in f.span_states]
            self.changed.append((f, np.stack(at) - self.rows))
        self.sticks = line.slippery == 0.0

        self.here = self.wrap_exit(np.zeros(batch), slipped=False)  # what leaves the pulleys at this node
        y, last = self._before(np.zeros((2, batch))), count - 1
        for k in range(last):
            y = self.step(k, y)
        self.rates(self.nodes[last], last - 1, y, self.here, last)

    def _before(self, s: np.ndarray) -> np.ndarray:
        """The state at travels s <= 0 (2, ..., batch) of the run-ups, shape (2, 2, ..., batch)."""
        return sum((f.initial_state(s, self.line) for f in self.of["initial_state"]), np.zeros((2, *s.shape)))

    def _place(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The step of the march in which travel s lies, and how far along it, from 0 to 1."""
        k = np.clip(np.searchsorted(self.nodes, s, side="right") - 1, 0, len(self.nodes) - 2)
        return k, (s - self.nodes[k]) / (self.nodes[k + 1] - self.nodes[k])

    def state_at(self, s: np.ndarray) -> np.ndarray:
        """(y, alpha) at the run-ups, each at travels s (2, ..., batch) of its own; shape (2, 2, ..., batch)."""
        k, t = self._place(s)
        pulley, lanes = np.arange(2).reshape(2, *(1,) * (s.ndim - 1)), np.arange(s.shape[-1])
        left, before, right, after = (
            np.moveaxis(a[j, pulley, :, lanes], -1, 1) for j in (k, k + 1) for a in (self.state, self.slope)
        )
        h, t = (self.nodes[k + 1] - self.nodes[k])[:, None], t[:, None]  # cubic Hermite interpolation
        since = left + t * t * (3 - 2 * t) * (right - left) + h * t * (1 - t) * ((1 - t) * before - t * after)
        return np.where(s[:, None] < 0, self._before(s), since)

    def interpolate(self, rows: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Rows that were kept at the nodes, (nodes, m, batch), linear between them at travel s (..., batch) and 0 up to
        0; shape (m, ..., batch)."""
        k, t = self._place(s)
        left, right = (np.moveaxis(rows[j, :, np.arange(s.shape[-1])], -1, 0) for j in (k, k + 1))
        return np.where(s > 0, left + t * (right - left), 0.0)

    def wrap_exit(self, s: np.ndarray, *, slipped: bool = True) -> np.ndarray:
        """(y, alpha) of what leaves the pulleys at travel s (..., batch), shape (2, 2, ..., batch); slipped: once
        friction has let the belt go there, for travels that the march has been to."""
        line = self.line
        past = self.state_at(s - np.expand_dims(line.wraps, tuple(range(1, s.ndim))))
        # round a canted tail pulley the belt follows y + gamma z = const, in all y_2 = y_1 + 2 R gamma; what lay on it
        # at travel 0 gains only what was left of its way: R gamma (1 - cos(s/R))
        turned = np.clip(s / line.tail_radius, 0.0, np.pi)
        past[0, 0] += line.tail_radius * line.cant * line.direction * (1 - np.cos(turned))
        for fault in self.of["creep"]:
            past[:, 0] += fault.creep(s, line, past[:, 1])
        if slipped and self.gone.any():
            past += self.interpolate(self.gone.reshape(len(self.nodes), 4, -1), s).reshape(past.shape)
        return past

    def step(self, k: int, y: np.ndarray) -> np.ndarray:
        """One Runge-Kutta step from node k."""
        s, h = self.nodes[k], self.nodes[k + 1] - self.nodes[k]
        # run-ups let go at the start, and where the yaw is changed as this step begins
        before, middle, at = self.nodes[max(k - 1, 0)], (s + self.nodes[k + 1]) / 2, self.line.yaw_at
        changed = (middle > at) & ((before + s) / 2 <= at) | (k == 0)
        if not self.sticks.all() and changed.any():
            kappa, _, rows = self.curvatures(s, k, y, self.here)
            slid = slip_turn(kappa, rows[:, RUN_UP, 3], self.line, self.sticks)
            y = y + np.where(changed, slid * [[1.0], [-1.0]], 0.0)
        k1, still = self.rates(s, k, y, self.here, k), np.zeros(len(self.line.stress))
        half, whole = (self.wrap_exit(s + share * h + still, slipped=False) for share in (0.5, 1.0))
        k2 = self.rates(s + h / 2, k, y + h / 2 * k1, half)
        k3 = self.rates(s + h / 2, k, y + h / 2 * k2, half)
        k4 = self.rates(s + h, k, y + h * k3, whole)
        self.here = whole
        return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def rates(self, s, k, y, past, node=None):
        """Rate of change of the state per metre of travel, under the commands of step k; at a node, the state, this
        rate and what acts there are kept."""
        line = self.line
        kappa, yaw, _ = self.curvatures(s, k, y, past, node)
        turn = kappa * (1 + line.cover * line.bending)
        for fault in self.of["turn"]:
            turn = turn + fault.turn(s, line, y[:, 0], kappa)
        for fault in self.of["recall"]:
            turn = turn + fault.recall(s, self)
        drift = y[:, 1]
        for fault in self.of["slide"]:
            drift = drift * fault.slide(s, line, y[:, 1])
        rates = -np.stack([drift, turn], axis=1)
        if node is not None:
            self.state[node], self.slope[node], self.yaw[node], self.bent[node] = y, rates, yaw, kappa
        return rates

    def curvatures(self, s, k, y, past, node=None):
        """Curvature where the belt runs up, (2, batch), the pulleys' true yaw, (2, batch), and the spans' rows."""
        line = self.line
        turned = (self.nodes[k] + self.nodes[k + 1]) / 2 > line.yaw_at
        before_top = line.sag_roll * line.sag_curvature * line.span_length / 2  # where a cant looks like a yaw, too
        tail = line.yaw * turned + line.offset_tail - line.cant * np.sin(before_top)
        yaw = np.stack([tail, line.yaw_head * turned + line.offset_head])
        for fault in self.of["yaw"]:
            yaw = yaw + fault.yaw(s, line)
        ends = self.ends(y, past, yaw)
        rows = self.responses(s, ends)
        if np.any(line.compliance):
            # the spans' moments turn a compliant tail bearing back, the pull of a belt off the middle turns it further:
            # beta - C (M_up + M_off - F (y_up + y_off)), where M are those at the yaw that is left
            bent = (rows[0, RUN_UP] * ends[0] + rows[1, RUN_OFF] * ends[1]).sum(axis=0) + self.push(s, ends)[RUN_OFF, 1]
            pull, give = line.force * (y[0, 0] + past[0, 0]), line.compliance * line.bending
            yaw[0] += (line.compliance * pull - give * bent) / (1 + give * (rows[0, RUN_UP, 3] - rows[1, RUN_OFF, 1]))
            ends = self.ends(y, past, yaw)
        if not self.sticks.all():
            bent = ((rows[:, RUN_OFF] * ends).sum(axis=1) + self.push(s, ends)[RUN_OFF])[
                ::-1
            ]  # where the belt leaves the pulleys
            landed = self.interpolate(self.bent, s - line.wraps)[[0, 1], [0, 1]]
            gone = slip_turn(bent - landed, -rows[::-1, RUN_OFF, 1], line, self.sticks)
            if node is not None:
                self.gone[node] = gone
            ends[:, :2] += gone[::-1]
        return (rows[:, RUN_UP] * ends).sum(axis=1) + self.push(s, ends, node)[RUN_UP], yaw, rows

    def ends(self, y: np.ndarray, past: np.ndarray, yaw: np.ndarray) -> np.ndarray:
        """Boundary values of the spans, (2, 4, ..., batch), from the run-ups, what leaves the pulleys, and their yaw.

        A pulley that bends is yawed by compliance F y where the belt lies, one way at the run-up, the other beyond."""
        off, bow = past[::-1], self.line.deflection * self.line.force
        turn = np.stack([yaw[0], -yaw[1]])  # theta_p at the run-ups, and less than nothing at the run-offs
        return np.stack(
            [off[:, 0], off[:, 1] + bow * off[:, 0] - turn[::-1], y[:, 0], y[:, 1] - bow * y[:, 0] + turn], axis=1
        )

    def responses(self, s, ends: np.ndarray) -> np.ndarray:
        """Rows of the spans' curvature at run-up and run-off and of their tilt, (2, 3, 4, ..., batch), given what is at
        their ends."""
        rows = np.expand_dims(self.rows, tuple(range(3, ends.ndim)))
        for fault, added in self.changed:
            states = (fault.span_state(s, self.line, k, at) for k, at in zip((True, False), ends, strict=True))
            state = np.stack([np.broadcast_to(x, ends.shape[2:]) for x in states])
            rows = rows + np.einsum("ks...b,ksijb->sij...b", _weights(fault.span_states, state), added)
        return rows

    def push(self, s, ends: np.ndarray, node=None) -> np.ndarray:
        """Curvature that the loads add at the run-ups and at the run-offs of the spans, shape (2, 2, batch)."""
        added = np.zeros((2, 2, len(self.line.stress)))
        for load in self.loads:
            acts, kept = load.act(s, self.line, ends, load.now)
            added += load.adds[:2, None] * np.stack([load.to_tail, ~load.to_tail]) * acts
            if node is not None:
                load.now = load.kept[node] = kept
        return added


def _weights(states: Sequence[float], x: np.ndarray) -> np.ndarray:
    """Weights of what is known at equally spaced states, of which x is clipped to the ends: linear between them, but of
    three a parabola; shape (states, *x.shape)."""
    count = len(states)
    if count == 1:
        return np.ones((1, *x.shape))
    t = np.clip((x - states[0]) / (states[1] - states[0]), 0.0, count - 1.0)
    if count == 3:
        return np.stack([(1 - t) * (2 - t) / 2, t * (2 - t), t * (t - 1) / 2])
    return np.maximum(1 - np.abs(t - np.arange(count).reshape(-1, *(1,) * t.ndim)), 0.0)


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
        up, off = history.state_at(np.stack([s, s]) - before), history.wrap_exit(s - before)
        seen = np.where((line.direction > 0) == leaves, off[pulley, 0], up[pulley, 0])
        return sum((f.edge(place, s, line) for f in faults), seen)

    s = s - before
    yaw = history.interpolate(history.yaw, s)
    ends = history.ends(history.state_at(np.stack([s, s])), history.wrap_exit(s), yaw)
    tilts = (history.responses(s, ends)[:, TILT] * ends).sum(axis=1)  # phi at the middle of the spans
    for load in history.loads:
        acts = load.act(s, line, ends, history.interpolate(load.kept[:, None], s)[0])[0] * (s > 0)
        tilts += np.stack([load.to_tail, ~load.to_tail])[:, None] * (load.adds[TILT] * acts)
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


def correlation(travel: np.ndarray, length: float, smooth: bool) -> np.ndarray:
    """Of a wander of unit variance, (n, n): Ornstein-Uhlenbeck, exp(-distance/length), or smooth, that is with a slope,
    (1 + r) exp(-r), r = sqrt(3) distance/length."""
    apart = np.abs(travel[:, None] - travel) / length * (math.sqrt(3) if smooth else 1.0)
    return (1 + apart if smooth else 1.0) * np.exp(-apart)


def wander(travel: np.ndarray, length: float, draws: np.ndarray, smooth: bool) -> np.ndarray:
    """A process of such a correlation from independent normal numbers, shape (n, runs)."""
    hair = 1e-9 if smooth else 0.0  # a smooth one is nearly singular
    return np.linalg.cholesky(correlation(travel, length, smooth) + hair * np.eye(len(travel))) @ draws
