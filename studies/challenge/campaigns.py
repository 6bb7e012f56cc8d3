"""Campaigns beside those of the virtual rig's own lot: other machines, drift before the yaw, any start on the belt,
mistakes in the sheet; and campaigns as plants make them, of a running belt, with repeats that disagree.

A seed makes a campaign again; its truth names plan and number. ``random_campaigns`` draws what it always drew.
"""

from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from functools import cache
from typing import Any

import numpy as np

from belt_sim.campaign import BeltSheet, Campaign, Machine, Quantity
from belt_sim.errors import InputError
from belt_sim.units import N_PER_MM2
from belt_sim.virtual_rig.faults import Fault, log_uniform
from belt_sim.virtual_rig.hidden import (
    BLIND_FAULTS,
    CORRUPTIONS,
    DEVELOPMENT_FAULTS,
    OUTSIDE,
    REACHED,
    SPAN_FAULTS,
    Detectability,
    HiddenFaults,
    damage,
    random_hidden,
    scale_fault,
)  # fmt: skip
from belt_sim.virtual_rig.make import (
    FRESH_KINDS,
    MACHINE_SHARES,
    POOL,
    TITLE,
    Truth,
    build_campaign,
    check_seed,
    describe_truth,
    draw_campaign,
    plan_by_number,
    random_base,
    random_plan,
    random_streams,
    true_noise,
)  # fmt: skip
from belt_sim.virtual_rig.march import TrueErrors, add_noise, draw_errors, observe, true_line
from belt_sim.virtual_rig.plan import TEST_BELT, Noise, Plan, RunSetting

#: Plans by name, and how many there are of each.
FRESH_PLANS = ("stiff_short", "wide_thick", "drift_before", "anywhere")
FRESH_POOL = 24
#: What is hidden -> how often.
FRESH_MIX = {"nothing": 0.5, "library": 0.25, "two": 0.10, "outside": 0.15}
#: Where runs start anywhere on the belt: what depends on it, and in which share of the library's draws it is taken.
_PHASED, _PHASED_SHARE = ("edge_profile", "weld", "wobble"), 0.6
_BEFORE = (0.2, 0.5)  # share of the record that lies before the yaw
_UNKNOWN_ZERO = 5e-3  # [m], stated where the sensors were set to zero long before the yaw


def fresh_plan(name: str, number: int) -> tuple[Plan, Noise]:
    """Plan and stated noise of one of the ``FRESH_POOL`` plans of a name."""
    if name not in FRESH_PLANS:
        raise InputError("plan", name, "", f"use one of {', '.join(FRESH_PLANS)}")
    if not 0 <= number < FRESH_POOL:
        raise InputError("plan", number, "", f"give a number from 0 to {FRESH_POOL - 1}")
    rng = np.random.default_rng([2027, FRESH_PLANS.index(name), number])
    kind = name if name in FRESH_KINDS else str(rng.choice([*MACHINE_SHARES, *FRESH_KINDS]))
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
    base = random_base(which)
    phased = name == "anywhere" and which.random() < _PHASED_SHARE

    def draw_plan() -> tuple[str, Plan, Noise]:
        number = int(which.integers(FRESH_POOL))
        plan, stated = fresh_plan(name, number)
        return f"{name} {number}", start_anywhere(plan, which) if name == "anywhere" else plan, stated

    drawn = _PHASED if phased and kind == "library" else ()
    return draw_campaign(seed, streams, base, draw_plan, kind=kind, unmodelled=BLIND_FAULTS, library=drawn)


def start_anywhere(plan: Plan, rng: np.random.Generator) -> Plan:
    """The plan with every run begun at a place of the belt of its own."""
    starts = (float(rng.uniform(0.0, plan.belt_length)) for _ in plan.runs)
    return replace(plan, runs=tuple(replace(run, start=start) for run, start in zip(plan.runs, starts, strict=True)))


def random_span_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign in which a span is another than the sheet says: a fault of ``SPAN_FAULTS``, on any plan."""
    streams, which = random_streams(check_seed(seed)), np.random.default_rng([seed, 1])
    base = random_base(which)
    return draw_campaign(seed, streams, base, lambda: _any_plan(which), kind="outside", unmodelled=SPAN_FAULTS)


def _any_plan(rng) -> tuple[str, Plan, Noise]:
    """Name with number, plan and stated noise of an old plan or of one on another machine."""
    if rng.random() < 0.5:
        number = int(rng.integers(POOL))
        kind, plan, stated = plan_by_number(number)
        return f"{kind} {number}", plan, stated
    name, number = str(rng.choice(FRESH_KINDS)), int(rng.integers(FRESH_POOL))
    return f"{name} {number}", *fresh_plan(name, number)


# Mistakes in the sheet: what the file states is not what was done.


def mistaken(kind: str, plan: Plan, rng, hours: tuple[float, ...] = ()) -> tuple[Plan, Plan, Any, int | None]:
    """The plan as it was and as it is stated, the yaw that acted before the records (runs,), and the run concerned
    (None: all of them); hours: clock times of the runs."""
    runs, machine, turned = plan.runs, plan.machine, [run.yaw != 0.0 for run in plan.runs]
    largest, true, stated, prior, k = max(abs(run.yaw) for run in runs), plan, plan, 0.0, None
    if kind == "lost_direction":  # the belt ran backwards; the file states its speed only
        repeated = {run.repeat_of for run in runs}
        alone = [ok and j not in repeated and runs[j].repeat_of is None for j, ok in enumerate(turned)]
        k = int(rng.choice(np.flatnonzero(alone if any(alone) else turned)))
        true, stated = _with_run(plan, k, direction=-1.0), _with_run(plan, k, direction=1.0)
    elif kind == "diameter_for_radius":
        head, tail = (Quantity(value=2 * q.value, u=2 * q.u) for q in (machine.head_radius, machine.tail_radius))
        stated = replace(plan, machine=replace(machine, head_radius=head, tail_radius=tail))
    elif kind == "exchanged_points":  # two lateral sensors stand at each other's points
        names = [name for name, place in plan.signals.items() if place.startswith("point_")]
        one, other = (str(name) for name in rng.permutation(names)[:2])
        places = plan.signals | {one: plan.signals[other], other: plan.signals[one]}
        stated = replace(plan, signals=places)
    elif kind == "one_tension_wrong":  # of a run that is made again
        k = next(k for k, run in enumerate(runs) if run.repeat_of is not None)
        tension = float(rng.choice((0.7, 0.8, 1.25, 1.4))) * runs[k].tension
        true = replace(plan, runs=(*runs[:k], replace(runs[k], tension=tension), *runs[k + 1 :]))
    elif kind in ("tension_by_clock", "yaw_by_clock"):  # goes with the time of day
        swing = (rng.uniform(0.15, 0.3) * np.sin(2 * np.pi * np.array(hours) / 24.0)).tolist()
        by = {
            "tension_by_clock": [{"tension": run.tension * (1 + x)} for run, x in zip(runs, swing, strict=True)],
            "yaw_by_clock": [{"yaw": run.yaw + largest * x} for run, x in zip(runs, swing, strict=True)],
        }
        true = replace(plan, runs=tuple(replace(run, **new) for run, new in zip(runs, by[kind], strict=True)))
    elif kind == "steered_before":
        prior = rng.uniform(-0.8, 0.8, len(runs)) * largest
    elif kind == "all_backwards":
        true = replace(plan, runs=tuple(replace(run, direction=-run.direction) for run in runs))
    return true, stated, prior, k


def _with_run(plan: Plan, k: int, **changed) -> Plan:
    runs = list(plan.runs)
    runs[k] = replace(runs[k], repeat_of=None, **changed)
    return replace(plan, runs=tuple(runs))


# Campaigns as plants make them.

_BASE = "strip"
#: What as many campaigns in turn hide: an effect ("": any), or what is wrong with the sheet, repeats or records.
PLANT_KINDS = (
    *[("nothing", "")] * 13,
    *zip(
        ["library"] * 7,
        ("crown", "crown", "pulley_deflection", "taper", "taper", "edge_profile", "wobble"),
        strict=True,
    ),
    *[("library", "")] * 8,
    *[("two", "")] * 8,
    *[("outside", "")] * 6,
    *[("mistake", "one_tension_wrong"), ("mistake", "tension_by_clock"), ("mistake", "yaw_by_clock")] * 2,
    *[("mistake", "one_tension_wrong"), ("mistake", "tension_by_clock")],
    *[("mistake", "exchanged_points"), ("mistake", "all_backwards"), ("mistake", "steered_before")] * 2,
    *[("mistake", "inch"), ("mistake", "unit_slip"), ("mistake", "lost_direction"), ("mistake", "diameter_for_radius")],
)
_OF_REPEATS = ("one_tension_wrong", "tension_by_clock", "yaw_by_clock")
_OF_READINGS = ("inch", *CORRUPTIONS)
_STANDS = ("crown", "pulley_deflection")  # what acts by the absolute position
PLAIN = 99.0  # stands for a size that nobody measured
_LEAST, _PLANT_TRIES = 5.0, 24  # d of what is hidden, where a plan can show as much; plans that are tried


@dataclass(frozen=True, kw_only=True, eq=False)
class RunningPlan(Plan):
    """A plan whose records begin ``run_in`` [m] behind the straight start; ``yaw_at`` and ``length`` count from it."""

    run_in: float = 0.0

    @property
    def travel(self) -> np.ndarray:
        """Where readings are taken, from the straight start [m], shape (n,)."""
        every = super().travel
        return every[every >= self.run_in]


class StandingFault(Fault):
    """The belt starts beside the middle of the pulleys, ``y0`` [m] in every run (batch,)."""

    y0: Any = 0.0

    def initial_state(self, s, line):
        at = self.y0 + 0.0 * s
        return np.stack([at, 0.0 * at], axis=1)


@dataclass(frozen=True, kw_only=True)
class Habits:
    """What the file tells beside a plan: start_m, run_in_m, clock times [h] and y0 [m], each where it is stated."""

    start: bool
    run_in: bool
    hours: tuple[float, ...] = ()
    y0: tuple[float, ...] = ()


def plant_plan(
    rng: np.random.Generator, *, running: bool = True, repeats: int = 0
) -> tuple[RunningPlan, Noise, Habits]:
    """Plan, stated noise and habits; running: records may begin on a running belt; repeats: so many at least."""
    width, radius = log_uniform(rng, 0.2, 2.0), log_uniform(rng, 0.12, 0.6)
    thickness = log_uniform(rng, 2e-4, min(2e-3, radius / 260.0))
    other = radius * (rng.uniform(1.0, 1.5) if rng.random() < 0.3 else 1.0)
    span = rng.uniform(max(1.0, 1.2 * width, radius + other + 0.3), 8.0)
    machine = Machine(
        centre_distance=Quantity(value=round(span, 3), u=max(5e-4 * span, 1e-3)),
        head_radius=Quantity(value=round(radius, 4), u=3e-3 * radius),
        tail_radius=Quantity(value=round(other, 4), u=3e-3 * radius),
    )
    sizes = {"width": (round(width, 3), 5e-4), "thickness": (round(thickness, 5), 0.01)}
    belt: BeltSheet = replace(TEST_BELT, **{n: Quantity(value=v, u=u * v) for n, (v, u) in sizes.items()})
    length, late = float(round(log_uniform(rng, 15.0, 100.0))), float(round(rng.uniform(1.0, 5.0), 1))
    late = late if rng.random() < 0.5 else 0.0
    runs = _plant_runs(rng, machine, belt, repeats)
    points = rng.permutation([f"point_{k}" for k in (1, 2, 3, 4)])[: rng.choice((2, 2, 3, 4))]
    places = sorted(map(str, points)) + (["upper_mid_span"] if rng.random() < 0.15 and len(points) < 4 else [])
    run_in = float(round(rng.uniform(1.0, 5.0) * span)) if running and rng.random() < 0.35 else 0.0
    starts = rng.uniform(0.0, 60.0, len(runs)) if rng.random() < 0.75 else np.zeros(len(runs))
    y0: tuple[float, ...] = ()
    if running and not run_in and rng.random() < 0.35:
        late, y0 = 0.0, tuple(float(x) for x in np.round(rng.uniform(-8e-3, 8e-3, len(runs)), 4))
    plan = RunningPlan(
        runs=tuple(replace(run, yaw_at=run_in + late, start=float(s)) for run, s in zip(runs, starts, strict=True)),
        length=run_in + length,
        spacing=round(length / float(rng.choice((90, 130, 180))), 3),
        signals={f"y{place[-1]}" if place.startswith("point_") else "phi_upper": place for place in places},
        machine=machine,
        belt=belt,
        run_in=run_in,
    )
    white = float(f"{log_uniform(rng, 5e-6, 1e-4):.2g}")
    noise = Noise(
        white=white,
        zero=float(f"{log_uniform(rng, 3e-5, 3e-4):.2g}"),
        gain=0.005 if rng.random() < 0.3 else 0.0,
        wander_sd=float(f"{min(white * rng.uniform(0.3, 2.0), 1e-4):.2g}"),
        wander_length=float(f"{log_uniform(rng, 1.0, 8.0):.2g}"),
        tension_rel=float(f"{log_uniform(rng, 0.005, 0.03):.2g}"),
        yaw_u=float(f"{log_uniform(rng, 0.005, 0.02) * max(abs(run.yaw) for run in runs):.2g}"),
        quantum=float(rng.choice((0.0, 0.0, 0.5, 2.0))) * white,
    )
    hours = np.cumsum(rng.uniform(0.2, 2.5, len(runs))) if repeats or rng.random() < 0.6 else ()
    stated = bool(starts.any() and rng.random() < 0.4)
    return plan, noise, Habits(start=stated, run_in=rng.random() < 0.6, hours=tuple(map(float, hours)), y0=y0)


def _plant_runs(rng, machine: Machine, belt: BeltSheet, repeats: int) -> tuple[RunSetting, ...]:
    """3 to 12 runs at tensions of 7 to 40 N/mm2, at yaws that keep both edges tight."""
    tensions = np.unique([round(log_uniform(rng, 7.0, 40.0), 1) for _ in range(rng.choice((1, 2, 3, 4)))]) * N_PER_MM2
    slack = tensions[0] * machine.centre_distance.value / (2 * belt.youngs_modulus.value * belt.width.value)
    yaw = float(f"{min(rng.uniform(0.35, 0.85) * slack, 2e-3):.3g}")
    yaws = [(-yaw, yaw), (yaw,), (-yaw, 0.5 * yaw, yaw), (yaw, 0.5 * yaw)][int(rng.integers(4))]
    speed = float(rng.choice((0.1, 0.3, 0.5, 1.0, 2.0)))
    runs = [RunSetting(tension=float(t), yaw=y, speed=speed) for t in tensions for y in yaws]
    runs += [replace(runs[0], yaw=0.0)] if rng.random() < 0.35 else []
    runs += [replace(runs[-1], direction=-1.0)] if rng.random() < 0.25 else []
    runs += [replace(runs[0], speed=2 * speed)] if rng.random() < 0.25 else []
    runs = runs[: 12 - 2]
    again = max(3 - len(runs), repeats, int(rng.integers(0, 3)))
    picked = [int(k) % len(runs) for k in rng.permutation(max(len(runs), again))[:again]]
    return (*runs, *(replace(runs[k], repeat_of=k) for k in picked))


def plant_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign; as many seeds as there are ``PLANT_KINDS`` meet every one once."""
    kind, name = PLANT_KINDS[check_seed(seed) % len(PLANT_KINDS)]
    mistake = name if kind == "mistake" else ""
    streams, which = random_streams(seed), np.random.default_rng([seed, 45])
    best: tuple[float, tuple] | None = None
    for _ in range(_PLANT_TRIES):
        running = mistake in ("", "steered_before")
        plan, stated, habits = plant_plan(which, running=running, repeats=2 if mistake in _OF_REPEATS else 0)
        if (name in ("steered_before", "taper") and not plan.run_in) or (name in _STANDS and not habits.y0):
            continue
        noise = true_noise(plan, stated, streams[1])
        shown = cache(lambda plan=plan, noise=noise: Detectability(plan, noise, _BASE))
        true, sheet, prior, run = mistaken(mistake, plan, which, habits.hours)
        run = run if mistake == "one_tension_wrong" else None
        if kind == "mistake":
            what = HiddenFaults(kind="mistake", dirty=mistake if mistake in CORRUPTIONS else None)
            size = _size(shown(), true, prior, (), habits) if sheet is plan and mistake not in _OF_READINGS else PLAIN
        else:
            drawn = (name,) if name else ()
            what = random_hidden(
                plan, shown, _BASE, streams[0], kind=kind, unmodelled=BLIND_FAULTS + DEVELOPMENT_FAULTS, library=drawn
            )
            what = _scaled_where_it_stands(what, shown, plan, habits)
            size = (what.distance if kind == "outside" else min((s or 0.0 for s in what.sizes), default=PLAIN)) or 0.0
        if best is None or size > best[0]:
            best = size, (true, sheet, prior, run, habits, what, noise)
        if best[0] >= (REACHED * OUTSIDE[0] if kind == "outside" else _LEAST):
            break
    assert best is not None
    return _measured(seed, streams, *best[1], mistake=mistake, size=best[0])


def plant_span_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign in which a span is another than the sheet says, far from the catalogue, on such a plan."""
    streams, which = random_streams(check_seed(seed)), np.random.default_rng([seed, 46])
    best: tuple[float, tuple] | None = None
    for trial in range(_PLANT_TRIES):
        plan, stated, habits = plant_plan(which, running=False)
        if len({run.tension for run in plan.runs}) < 2:
            continue
        noise = true_noise(plan, stated, streams[1])
        shown = cache(lambda plan=plan, noise=noise: Detectability(plan, noise, _BASE))
        drawn = SPAN_FAULTS if trial > _PLANT_TRIES // 2 else (SPAN_FAULTS[seed % len(SPAN_FAULTS)],)
        what = random_hidden(plan, shown, _BASE, streams[0], kind="outside", unmodelled=drawn)
        if best is None or (what.distance or 0.0) > best[0]:
            best = what.distance or 0.0, (plan, plan, 0.0, None, habits, what, noise)
        if best[0] >= 8.0:
            break
    assert best is not None
    return _measured(seed, streams, *best[1])


def _observe(plan: Plan, errors, prior, faults, habits: Habits) -> np.ndarray:
    """Readings without noise; prior: yaw that the tail pulley had from the straight start on [rad]."""
    line = true_line(plan, _BASE, errors)
    line = replace(line, run=np.arange(len(plan.runs)), offset_tail=prior + 0.0 * line.yaw, yaw=line.yaw - prior)
    standing = (StandingFault(y0=np.array(habits.y0)),) if habits.y0 else ()
    return observe(plan, line, (*faults, *standing))


def _size(shown: Detectability, true: Plan, prior, faults, habits: Habits) -> float:
    """d of the change against what the sheet says, beside nuisances."""
    return float(np.linalg.norm(shown.reduce(_observe(true, TrueErrors(), prior, faults, habits) - shown.clean)))


def _scaled_where_it_stands(what: HiddenFaults, shown, plan: Plan, habits: Habits) -> HiddenFaults:
    """The same sizes d where the belt stands beside the middle, for what acts by the absolute position."""
    if not habits.y0 or not any(f.id in _STANDS for f in what.faults):
        return what
    faults, sizes = list(what.faults), list(what.sizes)
    for k, fault in enumerate(faults):
        for _ in range(3 if fault.id in _STANDS else 0):
            size = _size(shown(), plan, 0.0, (faults[k],), habits)
            faults[k] = scale_fault(faults[k], float(np.clip((what.sizes[k] or size) / size, 0.2, 5.0)))
            sizes[k] = what.sizes[k]
    return replace(what, faults=tuple(faults), sizes=tuple(sizes))


def _measured(seed, streams, true, sheet, prior, run, habits, what, noise, *, mistake="", size=None):
    """Campaign and truth: readings of the true plan, stated as the sheet and the habits say."""
    errors = draw_errors(true, noise, streams[2])
    readings = _observe(true, errors, prior, what.faults, habits)
    readings = add_noise(readings, true.travel, noise.sheets(true), noise, streams[3])
    lateral = [k for k, place in enumerate(true.signals.values()) if place.startswith("point_")]
    k = int(streams[4].choice(lateral))
    if mistake == "inch":  # written in inches in a column of millimetres, in every run
        readings[k] /= 25.4
    if what.dirty:
        run = next(i for i, r in enumerate(true.runs) if r.yaw)
        damage(readings, what.dirty, k, run)
    campaign = build_campaign(sheet, noise, readings, TITLE, "belt-sim virtual-rig engine=line")
    told, begin = [], getattr(sheet, "run_in", 0.0)
    for i, one in enumerate(campaign.runs):
        started = habits.hours and (datetime(2026, 3, 2, 6) + timedelta(hours=habits.hours[i])).isoformat(
            "T", "seconds"
        )
        given = {"run_in": begin} if habits.run_in else {"travel": one.travel - begin, "yaw_at": one.yaw_at - begin}
        given |= {"start": sheet.runs[i].start + begin} if habits.start else {}
        given |= {"y0": habits.y0[i]} if habits.y0 else {}
        told.append(replace(one, **given, started=started or ""))
    campaign = replace(campaign, runs=tuple(told))
    dirt = None
    if mistake:
        signal = list(true.signals)[k] if mistake in ("inch", *CORRUPTIONS) else None
        dirt = {"kind": mistake, "run": None if run is None else f"r{run + 1:02d}", "signal": signal, "d": size}
    unstated = {"start": [r.start for r in true.runs], "run_in": [begin, float(habits.run_in)], "y0": list(habits.y0)}
    unstated |= {"true_tension": [r.tension / N_PER_MM2 for r in true.runs], "true_yaw": [r.yaw for r in true.runs]}
    unstated |= {"prior_yaw": np.broadcast_to(prior, len(true.runs)).tolist()}
    plan = f"plant {len(PLANT_KINDS)}"
    return campaign, describe_truth(seed, _BASE, what, noise, errors, dirt, streams[4], plan, unstated)
