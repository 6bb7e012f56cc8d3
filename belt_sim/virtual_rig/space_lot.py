"""Campaigns of the 3D belt by lot, small enough for minutes: one fault of geometry, friction or gravity, or none."""

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.mujoco3d import Options
from belt_sim.virtual_rig.draw import SIZES, Hidden, shaped
from belt_sim.virtual_rig.make import checked_seed
from belt_sim.virtual_rig.plan import Plan, grid
from belt_sim.virtual_rig.seal import Truth
from belt_sim.virtual_rig.size import fault_of_size, ruler
from belt_sim.virtual_rig.space import OPTIONS, make_space_campaign
from belt_sim.virtual_rig.space_plan import NARROW_BELT, SENSORS, SHORT_RIG, SPACING, TENSIONS, YAW, paced
from belt_sim.virtual_rig.stated_error import with_simulator_error

#: What is hidden in a campaign of as many in turn; the size is drawn from ``SIZES`` by the line's ruler. None: nothing.
SETTINGS = (
    *[None] * 6,
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
PLAN = "small_3d"
TRAVEL = 8.0  # [m], one and a half revolutions of the belt


def small_space_plan() -> Plan:
    """Five runs: two tensions, yaw to either side, one run made again."""
    runs = tuple(paced(run) for run in grid((TENSIONS[0], TENSIONS[2]), (-YAW, YAW), repeats=1))
    return Plan(runs=runs, length=TRAVEL, spacing=SPACING, machine=SHORT_RIG, belt=NARROW_BELT)


def space_setting(seed: int) -> tuple[str, Hidden]:
    """Base law and what is hidden for a seed; as many seeds as there are settings meet every one once, in any order."""
    turn, place = divmod(checked_seed(seed), len(SETTINGS))
    name = SETTINGS[np.random.default_rng([turn, 3]).permutation(len(SETTINGS))[place]]
    if name is None:
        return "strip", Hidden(kind="nothing")
    plan, rng = small_space_plan(), np.random.default_rng([seed, 3])
    base = "beam_th2" if name == "sag_roll" else "strip"
    rule = ruler(plan, with_simulator_error(SENSORS, "quasi_static")[0], base)
    fault = shaped(name, plan, rng)
    if fault.fixed:
        return base, Hidden(kind="library", faults=(fault,), sizes=(float(rule.sizes([fault])[0]),))
    fault, size = fault_of_size(rule, fault, float(rng.choice(SIZES[1:])))
    return base, Hidden(kind="library", faults=(fault,), sizes=(size,))


def random_space_campaign(seed: int, *, options: Options = OPTIONS, workers: int | None = 1) -> tuple[Campaign, Truth]:
    """One campaign of the 3D belt; the same seed and machine make the same. Takes a minute, or five with friction."""
    base, hidden = space_setting(seed)
    return make_space_campaign(
        hidden=hidden,
        seed=seed,
        base=base,
        plan=small_space_plan(),
        options=options,
        workers=workers,
        title="Drawn by lot, in three dimensions",
        name=PLAN,
    )
