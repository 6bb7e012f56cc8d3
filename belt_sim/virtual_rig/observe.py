"""From a plan and its faults to readings, without noise and with it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.case import GRAVITY, Belt, Rig
from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.line import Line, line_from
from belt_sim.virtual_rig.march import DelayHistory, march
from belt_sim.virtual_rig.plan import Noise, Plan

_BEFORE = 1e-6  # [m] before the yaw is applied


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
    columns = {
        name: np.array([getattr(run, name) for run in plan.runs], dtype=float)
        for name in ("yaw_head", "yaw_at", "speed", "direction", "start")
    }
    tension = np.array([run.tension for run in plan.runs]) * (1 + errors.tension_rel)
    yaw = np.array([run.yaw for run in plan.runs]) + errors.yaw
    coupled = np.full(len(plan.runs), float(base == "strip"))
    return line_from(rig, belt, stress=tension, yaw=yaw, sag_roll=coupled, **columns)


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
    history = march(line, faults, reach)
    begun = np.broadcast_to(0.0 if plan.zero_at_start else line.yaw_at, (1, len(line.stress)))
    readings = []
    for place in plan.signals.values():
        value = _perfect_reading(history, faults, place, travelled)
        if place.startswith("point_"):
            value = value - _perfect_reading(history, faults, place, begun, _BEFORE)
        for fault in faults:
            value = fault.read(value, place, travelled, line)
        readings.append(value)
    return np.stack(readings)


def _perfect_reading(
    history: DelayHistory, faults: Sequence[Fault], place: str, s: np.ndarray, before: float = 0.0
) -> np.ndarray:
    """What a perfect sensor sees at travel s, or a hair before: the belt and its edge, where the sensor looked."""
    if not place.startswith("point_"):
        return position(history, place, s - before)
    for fault in faults:
        s = fault.sensor_travel(s, history.line)
    return sum((f.edge(place, s, history.line) for f in faults), position(history, place, s - before))


def repeat_line(line: Line, count: int) -> Line:
    """A batch repeated ``count`` times, lane after lane: entry k of the runs stands at k, k + runs, ..."""
    return replace(line, **{n: np.tile(getattr(line, n), count) for n in Line.__dataclass_fields__})


#: place -> (state row, wrapped arc behind it) for travel direction +1; -1 swaps top and bottom.
POINTS = {"point_1": (0, None), "point_2": (0, "wrap_tail"), "point_3": (2, None), "point_4": (2, "wrap_head")}
_MIRRORED = {"point_1": "point_2", "point_2": "point_1", "point_3": "point_4", "point_4": "point_3"}
TILTS = {"upper_mid_span": 1.0, "lower_mid_span": -1.0}  # direction in which the belt comes from the head pulley


def position(history: DelayHistory, place: str, s: np.ndarray) -> np.ndarray:
    """Lateral position [m] or tilt [rad] at a place, at travel s, shape (n, batch) -> (n, batch)."""
    forward = history.line.direction > 0
    if place in TILTS:
        to_tail = TILTS[place] * history.line.direction > 0
        return np.where(to_tail, _tilt(history, s, True), _tilt(history, s, False))
    return np.where(forward, _lateral(history, place, s), _lateral(history, _MIRRORED[place], s))


def _lateral(history: DelayHistory, place: str, s: np.ndarray) -> np.ndarray:
    row, wrap = POINTS[place]
    if wrap is None:
        return history.state_at(s)[row]
    return history.wrap_exit(s)[0 if wrap == "wrap_tail" else 1][0]


def _tilt(history: DelayHistory, s: np.ndarray, to_tail: bool) -> np.ndarray:
    """phi at the middle of the span that runs to the tail (or to the head) pulley, from its ends and its loads."""
    line = history.line
    here, (tail_off, head_off) = line.along_bent_axes(history.state_at(s), history.wrap_exit(s))
    beta, beta_head = (history.interpolate(rows, s) for rows in (history.tail_yaw, history.head_yaw))
    if to_tail:
        off, up, turn_off, turn_up = head_off, here[:2], beta_head, beta
    else:
        off, up, turn_off, turn_up = tail_off, here[2:], -beta, -beta_head
    off, up = np.stack([off[0], off[1] + turn_off]), np.stack([up[0], up[1] + turn_up])
    row = history.spans[0 if to_tail else 1].tilt
    if tables := history.changed_spans[0 if to_tail else 1]:
        row = row[:, None] + sum(table.added_at(s, (off, up), ("tilt",))["tilt"] for table in tables)
    tilt = row[0] * off[0] + row[1] * off[1] + row[2] * up[0] + row[3] * up[1]
    for applied in history.applied_loads:
        acts = applied.acts(s, line, off, up, history.interpolate(applied.kept, s))[0] * (s > 0)
        tilt = tilt + np.where(applied.to_tail == to_tail, applied.load.tilt * acts, 0.0)
    return tilt


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


def add_noise(values: np.ndarray, travel: np.ndarray, sheet: SignalSheet, noise: Noise, rng) -> np.ndarray:
    """Readings of one signal with gain, zero, wander and white noise; values shape (n, runs), travel (n,)."""
    runs = values.shape[1]
    gain = 1 + sheet.gain * rng.standard_normal(runs)
    zero = sheet.zero * rng.standard_normal(runs)
    length = sheet.wander_length if noise.true_length is None else noise.true_length
    course = smooth_wander if noise.smooth else wander
    drift = noise.scale * sheet.wander_sd * course(travel, length, runs, rng)
    return values * gain + zero + drift + noise.scale * sheet.white * _white(values.shape, noise, rng)


def wander(travel: np.ndarray, length: float, runs: int, rng) -> np.ndarray:
    """Ornstein-Uhlenbeck process of unit variance, correlation exp(-distance/length), shape (n, runs)."""
    draws = rng.standard_normal((len(travel), runs))
    path = np.empty_like(draws)
    path[0] = draws[0]
    for k in range(1, len(travel)):
        keep = math.exp(-(travel[k] - travel[k - 1]) / length)
        path[k] = keep * path[k - 1] + math.sqrt(1 - keep**2) * draws[k]
    return path


def smooth_wander(travel: np.ndarray, length: float, runs: int, rng) -> np.ndarray:
    """A process of unit variance with a slope: correlation (1 + r) exp(-r), r = sqrt(3) distance/length."""
    apart = math.sqrt(3) * np.abs(travel[:, None] - travel) / length
    root = np.linalg.cholesky((1 + apart) * np.exp(-apart) + 1e-9 * np.eye(len(travel)))
    return root @ rng.standard_normal((len(travel), runs))


def _white(shape, noise: Noise, rng) -> np.ndarray:
    if noise.heavy_tails:
        return rng.standard_t(_TAIL_FREEDOM, shape) / math.sqrt(_TAIL_FREEDOM / (_TAIL_FREEDOM - 2))
    return rng.standard_normal(shape)
