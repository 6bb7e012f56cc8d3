"""Campaigns for fresh judging: other machines, drift before the yaw, any start on the belt, mistakes in the sheet.

A seed makes a campaign again; its truth names plan and number. ``random_campaigns`` draws what it always drew.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from belt_sim.campaign import Campaign, Quantity
from belt_sim.errors import InputError
from belt_sim.virtual_rig.hidden import (
    BLIND,
    OUTSIDE,
    REACHED,
    SPAN,
    Detectability,
    HiddenFaults,
    random_hidden,
)
from belt_sim.virtual_rig.make import (
    FRESH_KINDS,
    KINDS,
    POOL,
    Truth,
    build_campaign,
    check_seed,
    describe_truth,
    measure_campaign,
    plan_by_number,
    random_plan,
    random_streams,
    true_noise,
)
from belt_sim.virtual_rig.march import TrueErrors, add_noise, draw_errors, observe, true_line
from belt_sim.virtual_rig.plan import Noise, Plan

#: Plans by name, and how many there are of each.
FRESH_PLANS = ("stiff_short", "wide_thick", "drift_before", "anywhere")
FRESH_POOL = 24
#: What is hidden -> how often.
FRESH_MIX = {"nothing": 0.5, "library": 0.25, "two": 0.10, "outside": 0.15}
#: Where runs start anywhere on the belt: what depends on it, and in which share of the library's draws it is taken.
_PHASED, _PHASED_SHARE = ("edge_profile", "weld", "wobble"), 0.6
_BEFORE = (0.2, 0.5)  # share of the record that lies before the yaw
_UNKNOWN_ZERO = 5e-3  # [m], stated where the sensors were set to zero long before the yaw
_BEAMS = 0.1  # share of the campaigns on a belt that does not roll
_TRIES = 4  # plans that are tried for an unmodelled fault
TITLE = "Drawn by lot"


def fresh_plan(name: str, number: int) -> tuple[Plan, Noise]:
    """Plan and stated noise of one of the ``FRESH_POOL`` plans of a name."""
    if name not in FRESH_PLANS:
        raise InputError("plan", name, "", f"use one of {', '.join(FRESH_PLANS)}")
    if not 0 <= number < FRESH_POOL:
        raise InputError("plan", number, "", f"give a number from 0 to {FRESH_POOL - 1}")
    rng = np.random.default_rng([2027, FRESH_PLANS.index(name), number])
    kind = name if name in FRESH_KINDS else str(rng.choice([*KINDS, *FRESH_KINDS]))
    plan, noise = random_plan(kind, rng)
    if name != "drift_before":
        return plan, noise
    late = float(round(rng.uniform(*_BEFORE) * plan.length, 1))
    plan = replace(plan, runs=tuple(replace(run, yaw_at=late) for run in plan.runs))
    if number % 2:
        return replace(plan, zero_at_start=True), replace(noise, zero=_UNKNOWN_ZERO)
    return plan, noise


def fresh_campaign(seed: int, name: str, *, kind: str | None = None) -> tuple[Campaign, Truth]:
    """One campaign of a plan of FRESH_PLANS; kind: one of FRESH_MIX."""
    streams, which = random_streams(check_seed(seed)), np.random.default_rng([seed, 1])
    kind = kind or str(which.choice(list(FRESH_MIX), p=list(FRESH_MIX.values())))
    base = _base(which)
    library = _PHASED if name == "anywhere" and which.random() < _PHASED_SHARE else ()
    for _ in range(_TRIES):
        number = int(which.integers(FRESH_POOL))
        plan, stated = fresh_plan(name, number)
        if name == "anywhere":
            plan = start_anywhere(plan, which)
        noise = true_noise(plan, stated, streams[1])
        rule = partial(Detectability, plan, noise, base)
        drawn = library if kind == "library" else ()
        what = random_hidden(plan, rule, base, streams[0], kind=kind, unmodelled=BLIND, library=drawn)
        if kind != "outside" or (what.distance or 0.0) >= REACHED * OUTSIDE[0]:
            break
    return measure_campaign(plan, noise, base, what, seed, streams, TITLE, f"{name} {number}")


def start_anywhere(plan: Plan, rng: np.random.Generator) -> Plan:
    """The plan with every run begun at a place of the belt of its own."""
    machine = plan.machine
    around = 2 * machine.centre_distance.value + np.pi * (machine.head_radius.value + machine.tail_radius.value)
    return replace(plan, runs=tuple(replace(run, start=float(rng.uniform(0.0, around))) for run in plan.runs))


def random_span_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign in which a span is another than the sheet says: a fault of ``SPAN``, on any plan."""
    streams, which = random_streams(check_seed(seed)), np.random.default_rng([seed, 1])
    base = _base(which)
    for _ in range(_TRIES):
        name, plan, stated = _any_plan(which)
        noise = true_noise(plan, stated, streams[1])
        rule = partial(Detectability, plan, noise, base)
        what = random_hidden(plan, rule, base, streams[0], kind="outside", unmodelled=SPAN)
        if (what.distance or 0.0) >= REACHED * OUTSIDE[0]:
            break
    return measure_campaign(plan, noise, base, what, seed, streams, TITLE, name)


def _base(rng) -> str:
    return "beam_th2" if rng.random() < _BEAMS else "strip"


def _any_plan(rng) -> tuple[str, Plan, Noise]:
    """Name with number, plan and stated noise of an old plan or of one on another machine."""
    if rng.random() < 0.5:
        number = int(rng.integers(POOL))
        kind, plan, stated = plan_by_number(number)
        return f"{kind} {number}", plan, stated
    name, number = str(rng.choice(FRESH_KINDS)), int(rng.integers(FRESH_POOL))
    return f"{name} {number}", *fresh_plan(name, number)


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


_LEAST_SIZE = 6.0  # noise units that a mistake makes, where a plan can show as much


def random_mistake_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign with nothing hidden and a mistake in its sheet; ``truth.dirty`` names it, its run and its size d."""
    streams, which = random_streams(check_seed(seed)), np.random.default_rng([seed, 1])
    base = _base(which)
    kind = list(MISTAKES)[seed % len(MISTAKES)]
    best = None
    for _ in range(2 * _TRIES):
        name, plan, stated_noise = _any_plan(which)
        if kind == "exchanged_points" and sum(p.startswith("point_") for p in plan.signals.values()) < 2:
            continue
        if kind == "lost_yaw_sign" and not any(run.yaw < 0 for run in plan.runs):
            continue
        noise = true_noise(plan, stated_noise, streams[1])
        true, stated, run = MISTAKES[kind](plan, which)
        size = mistake_size(Detectability(stated, noise, base), true, base)
        if best is None or size > best[0]:
            best = size, true, stated, run, noise, name
        if size >= _LEAST_SIZE:
            break
    if best is None:
        raise InputError("seed", seed, "", f"finds no plan for {kind}; use another")
    size, true, stated, run, noise, plan_name = best
    errors = draw_errors(true, noise, streams[2])
    readings = observe(true, true_line(true, base, errors), [])
    readings = add_noise(readings, true.travel, noise.sheets(true), noise, streams[3])
    campaign = build_campaign(stated, noise, readings, TITLE, "belt-sim virtual-rig engine=line")
    dirt = {"kind": kind, "run": None if run is None else f"r{run + 1:02d}", "signal": None, "d": float(f"{size:.6g}")}
    salt = streams[4].bytes(16).hex()
    return campaign, describe_truth(seed, base, HiddenFaults(kind="mistake"), noise, errors, dirt, salt, plan_name)


def mistake_size(stated: Detectability, true: Plan, base: str) -> float:
    """d of what the mistake changes in the readings, nuisances of the stated sheet let free."""
    change = observe(true, true_line(true, base, TrueErrors()), []) - stated.clean
    return float(np.linalg.norm(stated.reduce(change)))
