"""From a plan and its faults to readings without noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.rig import Belt, Rig
from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.line import Line, line_of
from belt_sim.virtual_rig.plan import Plan
from belt_sim.virtual_rig.readings import position
from belt_sim.virtual_rig.travel import Journey, march

RIG_DATA = ("centre_distance", "head_radius", "tail_radius")
BELT_DATA = ("width", "thickness", "youngs_modulus", "density", "poisson_ratio")
_BEFORE = 1e-6  # [m] before the yaw is applied


@dataclass(frozen=True, kw_only=True)
class Errors:
    """True minus stated: machine data (name -> SI), and the settings of the runs, shape (runs,)."""

    machine: Mapping[str, float] = field(default_factory=dict)
    tension_rel: np.ndarray | float = 0.0
    yaw: np.ndarray | float = 0.0


def stated(plan: Plan) -> dict:
    """Machine data as stated: name -> Quantity."""
    rig = {name: getattr(plan.machine, name) for name in RIG_DATA}
    return rig | {name: getattr(plan.belt, name) for name in BELT_DATA}


def true_line(plan: Plan, base: str, errors: Errors) -> Line:
    """The runs of a plan as lines of base law ``beam_th2`` or ``strip``, without faults."""
    data = {name: q.value + errors.machine.get(name, 0.0) for name, q in stated(plan).items()}
    rig = Rig(**{name: data[name] for name in RIG_DATA})
    belt = Belt(**{name: data[name] for name in BELT_DATA})
    columns = {
        name: np.array([getattr(run, name) for run in plan.runs], dtype=float)
        for name in ("yaw_head", "yaw_at", "speed", "direction")
    }
    tension = np.array([run.tension for run in plan.runs]) * (1 + errors.tension_rel)
    yaw = np.array([run.yaw for run in plan.runs]) + errors.yaw
    coupled = np.full(len(plan.runs), float(base == "strip"))
    return line_of(rig, belt, stress=tension, yaw=yaw, sag_roll=coupled, **columns)


def observe(plan: Plan, line: Line, faults: Sequence[Fault]) -> np.ndarray:
    """Readings without noise [m or rad], shape (signals, n, batch), at the travel that the recorder shows.

    A lateral sensor reads zero where the yaw is applied; a tilt is against the horizontal.
    """
    shown = plan.travel[:, None]
    for fault in faults:
        line = fault.set(line)
    travelled = np.broadcast_to(shown, (len(shown), len(line.stress)))
    for fault in faults:
        travelled = fault.travelled(travelled, line)
    reach = max(float(travelled.max()), plan.spacing)
    journey = march(line, faults, reach)
    begun = np.broadcast_to(line.yaw_at, (1, len(line.stress)))
    readings = []
    for place in plan.signals.values():
        value = _seen(journey, faults, place, travelled)
        if place.startswith("point_"):
            value = value - _seen(journey, faults, place, begun, _BEFORE)
        for fault in faults:
            value = fault.read(value, place, travelled, line)
        readings.append(value)
    return np.stack(readings)


def _seen(journey: Journey, faults: Sequence[Fault], place: str, s: np.ndarray, before: float = 0.0) -> np.ndarray:
    """What a perfect sensor sees at travel s, or a hair before: the belt and its edge, where the sensor looked."""
    if not place.startswith("point_"):
        return position(journey, place, s - before)
    for fault in faults:
        s = fault.seen_at(s, journey.line)
    return sum((f.edge(place, s, journey.line) for f in faults), position(journey, place, s - before))


def varied(line: Line, count: int) -> Line:
    """A batch repeated ``count`` times, lane after lane: entry k of the runs stands at k, k + runs, ..."""
    return replace(line, **{n: np.tile(getattr(line, n), count) for n in Line.__dataclass_fields__})
