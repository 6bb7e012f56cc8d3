"""What goes wrong between the machine and the file: damaged readings, and mistakes in the sheet."""

from dataclasses import replace

import numpy as np

from belt_sim.campaign import Quantity
from belt_sim.virtual_rig.plan import Plan

# Damaged readings, shape (signals, n, runs): each function changes one signal of one run in place.

_CLIP_SHARE = 0.5  # of the largest reading
_KNOCK = 0.05  # [m]
_LOST_SHARE = (0.4, 0.6)  # of the record


def unit_slip(readings: np.ndarray, signal: int, run: int) -> None:
    """Written in metres in a column of millimetres."""
    readings[signal, :, run] *= 1e-3


def clipped_sensor(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor's range ends half-way."""
    most = _CLIP_SHARE * np.abs(readings[signal, :, run]).max()
    readings[signal, :, run] = np.clip(readings[signal, :, run], -most, most)


def swapped_columns(readings: np.ndarray, signal: int, run: int) -> None:
    """Two plugs exchanged."""
    other = (signal + 1) % len(readings)
    readings[[signal, other], :, run] = readings[[other, signal], :, run]


def wrong_sign(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor looks from the other side."""
    readings[signal, :, run] *= -1


def dropout(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor shows 0 for a while."""
    count = readings.shape[1]
    readings[signal, int(_LOST_SHARE[0] * count) : int(_LOST_SHARE[1] * count), run] = 0.0


def shifted_run(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor was knocked before this run."""
    readings[signal, :, run] += _KNOCK


CORRUPTIONS = {f.__name__: f for f in (unit_slip, clipped_sensor, swapped_columns, wrong_sign, dropout, shifted_run)}
NEEDS_TWO = ("swapped_columns",)  # signals


# Mistakes in the sheet: what the file states is not what was done. Each function returns the plan as it was and the
# plan as it is stated, and the index of the run (None: all of them).

_LATE = (1.5, 5.0)  # [m]
_WIDTHS = (1.25, 0.8)  # stated over true


def late_yaw(plan: Plan, rng) -> tuple[Plan, Plan, int | None]:
    """The yaw came later than stated."""
    k = _one_run(plan, rng, [run.yaw != 0.0 for run in plan.runs])
    late = plan.runs[k].yaw_at + float(round(rng.uniform(*_LATE), 2))
    return _with_run(plan, k, yaw_at=late), plan, k


def lost_yaw_sign(plan: Plan, rng) -> tuple[Plan, Plan, int | None]:
    """The yaw is stated to the other side."""
    k = _one_run(plan, rng, [run.yaw < 0.0 for run in plan.runs])
    return plan, _with_run(plan, k, yaw=-plan.runs[k].yaw), k


def lost_direction(plan: Plan, rng) -> tuple[Plan, Plan, int | None]:
    """The belt ran backwards; the file states its speed only."""
    k = _one_run(plan, rng, [run.yaw != 0.0 for run in plan.runs])
    return _with_run(plan, k, direction=-1.0), _with_run(plan, k, direction=1.0), k


def diameter_for_radius(plan: Plan, rng) -> tuple[Plan, Plan, int | None]:
    """The sheet gives diameters in the place of radii."""
    machine = plan.machine
    head, tail = (Quantity(value=2 * q.value, u=2 * q.u) for q in (machine.head_radius, machine.tail_radius))
    return plan, replace(plan, machine=replace(machine, head_radius=head, tail_radius=tail)), None


def wrong_width(plan: Plan, rng) -> tuple[Plan, Plan, int | None]:
    """The belt is narrower or wider than the sheet says."""
    width = plan.belt.width
    stated = Quantity(value=round(width.value * float(rng.choice(_WIDTHS)), 4), u=width.u)
    return plan, replace(plan, belt=replace(plan.belt, width=stated)), None


def exchanged_points(plan: Plan, rng) -> tuple[Plan, Plan, int | None]:
    """Two lateral sensors stand at each other's points."""
    names = [name for name, place in plan.signals.items() if place.startswith("point_")]
    one, other = (str(name) for name in rng.permutation(names)[:2])
    places = plan.signals | {one: plan.signals[other], other: plan.signals[one]}
    return plan, replace(plan, signals=places), None


MISTAKES = {
    f.__name__: f for f in (late_yaw, lost_yaw_sign, lost_direction, diameter_for_radius, wrong_width, exchanged_points)
}


def _one_run(plan: Plan, rng, able: list[bool]) -> int:
    """A run by chance, one that has no repeat and is none where there is such a run."""
    repeated = {run.repeat_of for run in plan.runs}
    alone = [ok and k not in repeated and plan.runs[k].repeat_of is None for k, ok in enumerate(able)]
    return int(rng.choice(np.flatnonzero(alone if any(alone) else able)))


def _with_run(plan: Plan, k: int, **changed) -> Plan:
    runs = list(plan.runs)
    runs[k] = replace(runs[k], repeat_of=None, **changed)
    return replace(plan, runs=tuple(runs))
