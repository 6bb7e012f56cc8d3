"""Random campaigns: a plan of some machine, a noise, and something hidden or nothing; a seed makes them again."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from belt_sim.campaign import BeltSheet, Campaign, Machine, Quantity
from belt_sim.errors import InputError
from belt_sim.units import MM, N_PER_MM2
from belt_sim.virtual_rig.effect_size import detectability_of
from belt_sim.virtual_rig.hidden_faults import MIX, OUTSIDE, REACHED, random_hidden
from belt_sim.virtual_rig.library import BLIND, DEVELOPMENT
from belt_sim.virtual_rig.make import check_seed, measure_campaign, random_streams
from belt_sim.virtual_rig.plan import TEST_BELT, TEST_RIG, Noise, Plan, RunSetting
from belt_sim.virtual_rig.sealed_truth import Truth

#: How often each kind of machine is drawn.
KINDS = {"test_rig": 0.4, "short_rig": 0.2, "between": 0.2, "wide_belt": 0.2}
#: Machines of the plans for fresh judging (fresh_campaigns.py), which this draw does not know.
FRESH_KINDS = ("stiff_short", "wide_thick")
#: How many plans there are in all: plan number n is always the same, so that shapes of data come again.
POOL = 48
_TENSIONS = {  # [N/mm2]
    "test_rig": (7, 10, 15, 20, 30, 40),
    "short_rig": (10, 15, 20, 40, 60),
    "between": (10, 15, 20, 30, 40),
    "wide_belt": (10, 15, 20, 30, 50),
    "stiff_short": (8, 11, 15, 20, 30, 45, 60),
    "wide_thick": (8, 12, 20, 30, 50),
}
_LENGTHS = {  # [m]
    "test_rig": (30.0, 60.0, 60.0, 100.0),
    "short_rig": (10.0, 20.0, 40.0),
    "between": (20.0, 40.0, 60.0),
    "wide_belt": (40.0, 60.0, 100.0),
    "stiff_short": (20.0, 30.0, 60.0),
    "wide_thick": (40.0, 60.0, 100.0),
}
_READINGS = (120, 240, 400)  # a run
_SLACK = (0.35, 0.8)  # share of the yaw at which an edge of the slackest belt goes slack
_SPEEDS = (0.25, 0.5, 0.5, 0.5, 1.0, 2.0)  # [m/s]
_LEAST, _MOST = 4, 20  # runs
_SIGNALS = (
    ("point_1",),
    ("point_4",),
    ("point_1", "point_4"),
    ("point_1", "point_4"),
    ("point_1", "point_3"),
    ("point_2", "point_3"),
    ("point_1", "point_2", "point_4"),
    ("point_1", "point_2", "point_3", "point_4"),
    ("point_1", "point_4", "upper_mid_span"),
)
#: Ranges of what the file states of the noise [SI].
_WHITE, _ZERO, _WANDER = (0.01 * MM, 0.03 * MM), (0.03 * MM, 0.2 * MM), (0.02 * MM, 0.08 * MM)
_WITH_REPEATS, _WITHOUT = (0.3, 3.0), (0.6, 1.4)  # true noise over what is stated
_TRUE_LENGTH = (1.0, 10.0)  # [m], where 3 m are stated
_HEAVY, _SMOOTH = 0.10, 0.10  # how often


def plan_by_number(number: int) -> tuple[str, Plan, Noise]:
    """Kind, plan and stated noise of one of the ``POOL`` plans; their kinds come in the shares of ``KINDS``."""
    if not 0 <= number < POOL:
        raise InputError("plan", number, "", f"give a number from 0 to {POOL - 1}")
    shares = np.cumsum(list(KINDS.values()))
    kind = list(KINDS)[int(np.searchsorted(shares, ((number * 29) % POOL + 0.5) / POOL))]
    return kind, *random_plan(kind, np.random.default_rng([2026, number]))


def true_noise(plan: Plan, stated: Noise, rng: np.random.Generator) -> Noise:
    """The noise as it truly is: its level far off only where repeats tell, its wander of another length."""
    repeats = any(run.repeat_of is not None for run in plan.runs)
    low, high = np.log(_WITH_REPEATS if repeats else _WITHOUT)
    return replace(
        stated,
        scale=float(np.exp(rng.uniform(low, high))),
        heavy_tails=bool(rng.random() < _HEAVY),
        true_length=float(np.exp(rng.uniform(*np.log(_TRUE_LENGTH)))),
        smooth=bool(rng.random() < _SMOOTH),
    )


def random_plan(kind: str, rng: np.random.Generator) -> tuple[Plan, Noise]:
    """A plan and stated noise for a machine of one kind."""
    machine, belt = _machine(kind, rng)
    length = float(rng.choice(_LENGTHS[kind]))
    signals = _SIGNALS[int(rng.integers(len(_SIGNALS)))]
    runs = _runs(kind, machine, belt, rng)
    plan = Plan(
        runs=runs,
        length=length,
        spacing=max(length / float(rng.choice(_READINGS)), 0.1),
        signals={_name(place): place for place in signals},
        machine=machine,
        belt=belt,
    )
    return plan, _stated_noise(runs, rng)


def _name(place: str) -> str:
    return f"y{place[-1]}" if place.startswith("point_") else "phi_upper"


def _machine(kind: str, rng) -> tuple[Machine, BeltSheet]:
    if kind == "test_rig":
        return TEST_RIG, TEST_BELT
    distance, width, thickness, radius = {
        "short_rig": lambda: (2.0, float(rng.choice((0.1, 0.2))), 3e-4, 0.17),
        "between": lambda: (round(rng.uniform(3.0, 9.0), 2), float(rng.choice((0.15, 0.2, 0.3))), 4e-4, 0.2),
        "wide_belt": lambda: (round(rng.uniform(8.0, 14.0), 2), 1.5, float(rng.choice((8e-4, 1e-3))), 0.5),
        "stiff_short": lambda: (round(rng.uniform(3.0, 6.4), 2), 0.4, 8e-4, 0.25),
        "wide_thick": lambda: (
            round(rng.uniform(6.0, 12.0), 2),
            float(rng.choice((1.0, 1.5, 2.0))),
            float(rng.choice((1.2e-3, 1.6e-3, 2e-3))),
            0.75,
        ),
    }[kind]()
    machine = Machine(
        centre_distance=Quantity(value=distance, u=max(5e-4 * distance, 1e-3)),
        head_radius=Quantity(value=radius, u=3e-3 * radius),
        tail_radius=Quantity(value=radius, u=3e-3 * radius),
    )
    belt = replace(
        TEST_BELT, width=Quantity(value=width, u=5e-4 * width), thickness=Quantity(value=thickness, u=0.01 * thickness)
    )
    return machine, belt


def _runs(kind: str, machine: Machine, belt: BeltSheet, rng) -> tuple[RunSetting, ...]:
    """Tensions times yaws; then, by chance, zero yaw, reversed travel, a second speed, repeats; 4 to 20 in all."""
    count = int(rng.choice((1, 2, 3, 4), p=(0.15, 0.25, 0.3, 0.3)))
    tensions = sorted(float(t) * N_PER_MM2 for t in rng.choice(_TENSIONS[kind], count, replace=False))
    slack = tensions[0] * machine.centre_distance.value / (2 * belt.youngs_modulus.value * belt.width.value)
    largest = float(min(rng.uniform(*_SLACK) * slack, 2e-3))
    yaws = {
        "both": (-largest, largest),
        "one": (largest, 0.5 * largest) if count < 3 else (largest,),
        "many": (-largest, -0.5 * largest, 0.5 * largest, largest),
    }[str(rng.choice(("both", "one", "many"), p=(0.6, 0.2, 0.2)))]
    speed = float(rng.choice(_SPEEDS))
    late = float(round(rng.uniform(1.0, 4.0), 1)) if rng.random() < 0.2 else 0.0
    first = [RunSetting(tension=t, yaw=y, speed=speed, yaw_at=late) for t in tensions for y in yaws]
    extra = []
    if rng.random() < 0.3:
        extra += [replace(first[0], yaw=0.0, tension=t) for t in tensions]
    if rng.random() < 0.25:
        extra += [replace(first[k], direction=-1.0) for k in (0, -1)]
    if rng.random() < 0.25:
        extra += [replace(first[k], speed=2 * speed) for k in (0, -1)]
    runs = (first + extra)[:_MOST]
    return _add_repeats(runs, rng)


def _add_repeats(runs: Sequence[RunSetting], rng) -> tuple[RunSetting, ...]:
    """Some runs once more, or none; as many as it takes to have four."""
    wanted = int(rng.choice((0, 1, 2, 4), p=(0.35, 0.15, 0.3, 0.2)))
    wanted = max(min(wanted, _MOST - len(runs)), _LEAST - len(runs), 0)
    picked = [int(k) % len(runs) for k in rng.permutation(max(len(runs), wanted))[:wanted]]
    return (*runs, *(replace(runs[k], repeat_of=k) for k in picked))


def _stated_noise(runs: Sequence[RunSetting], rng) -> Noise:
    """What the file states; the yaw is known to half a percent of the largest."""

    def draw_rounded(low: float, high: float) -> float:
        return float(f"{math.exp(rng.uniform(math.log(low), math.log(high))):.2g}")

    return Noise(
        white=draw_rounded(*_WHITE),
        zero=draw_rounded(*_ZERO),
        wander_sd=draw_rounded(*_WANDER),
        gain=0.005 if rng.random() < 0.3 else 0.0,
        tension_rel=draw_rounded(0.005, 0.02),
        yaw_u=float(f"{0.005 * max(abs(run.yaw) for run in runs):.2g}"),
    )


TITLE = "Drawn by lot"
_PLANS = 4  # plans that are tried for an unmodelled fault
_BEAMS = 0.1  # share of the campaigns on a belt that does not roll


def random_campaign(
    seed: int, *, kind: str | None = None, blind: bool | None = True, plan: int | None = None
) -> tuple[Campaign, Truth]:
    """One campaign of the mix (``draw.MIX``), or of one kind of it, on one of the plans or the one of a number.

    blind: True for unmodelled faults of the blind list only, False for those of the development list, None for both.
    """
    unmodelled = {None: BLIND + DEVELOPMENT, True: BLIND, False: DEVELOPMENT}[blind]
    streams = random_streams(check_seed(seed))
    which = np.random.default_rng([seed, 1])
    kind = kind or str(which.choice(list(MIX), p=list(MIX.values())))
    base = "beam_th2" if which.random() < _BEAMS else "strip"
    for _ in range(_PLANS):
        number = int(which.integers(POOL)) if plan is None else plan
        name, chosen, stated = plan_by_number(number)
        noise = true_noise(chosen, stated, streams[1])
        get_detectability = partial(detectability_of, chosen, noise, base)
        what = random_hidden(chosen, get_detectability, base, streams[0], kind=kind, unmodelled=unmodelled)
        if kind != "outside" or (what.distance or 0.0) >= REACHED * OUTSIDE[0]:
            break  # a plan that measures little tells no unmodelled fault from the library
    return measure_campaign(chosen, noise, base, what, seed, streams, TITLE, f"{name} {number}")
