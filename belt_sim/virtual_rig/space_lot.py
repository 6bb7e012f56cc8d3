"""Campaigns of the 3D belt by lot, small enough for minutes: one fault of geometry, friction or gravity, or none."""

from functools import partial

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.mujoco3d import Options
from belt_sim.virtual_rig.draw import SIZES, shaped
from belt_sim.virtual_rig.make import checked_seed
from belt_sim.virtual_rig.plan import Plan, grid
from belt_sim.virtual_rig.seal import Truth
from belt_sim.virtual_rig.size import fault_of_size, ruler
from belt_sim.virtual_rig.space import OPTIONS, make_space_campaign
from belt_sim.virtual_rig.space_plan import NARROW_BELT, SENSORS, SHORT_RIG, SPACING, TENSIONS, YAW, paced
from belt_sim.virtual_rig.stated_error import with_simulator_error

#: What is hidden; the size is drawn from ``SIZES`` by the line's ruler. None: nothing.
SETTINGS = (
    None,
    None,
    "taper",
    "crown",
    "cant",
    "wobble",
    "yaw_offset_tail",
    "yaw_offset_head",
    "yaw_compliance",
    "unequal_tension",
    "pulley_deflection",
    "slip",
    "camber",
    "weld",
    "edge_guide",
    "sag_roll",
)
TRAVEL = 8.0  # [m], three and a half revolutions less a wrap


def small_space_plan() -> Plan:
    """Five runs: two tensions, yaw to either side, one run made again."""
    runs = tuple(paced(run) for run in grid((TENSIONS[0], TENSIONS[2]), (-YAW, YAW), repeats=1))
    return Plan(runs=runs, length=TRAVEL, spacing=SPACING, machine=SHORT_RIG, belt=NARROW_BELT)


def space_setting(seed: int) -> tuple[str, list[dict]]:
    """Base law and what is hidden for a seed, as ``make_space_campaign`` takes it."""
    rng = np.random.default_rng([checked_seed(seed), 3])
    name, plan = SETTINGS[int(rng.integers(len(SETTINGS)))], small_space_plan()
    base = "beam_th2" if name == "sag_roll" else "strip"
    if name is None:
        return base, []
    fault = shaped(name, plan, rng)
    if not fault.fixed:
        rule_of = partial(ruler, plan, with_simulator_error(SENSORS)[0], base)
        fault, _ = fault_of_size(rule_of(), fault, float(rng.choice(SIZES[1:])))
    return base, [{"id": name, **{n: float(v) for n, v in fault.parameters().items()}}]


def random_space_campaign(
    seed: int, *, options: Options = OPTIONS, workers: int | None = None
) -> tuple[Campaign, Truth]:
    """One campaign of the 3D belt; the same seed and machine make the same."""
    base, hidden = space_setting(seed)
    return make_space_campaign(
        hidden=hidden, seed=seed, base=base, plan=small_space_plan(), options=options, workers=workers
    )
