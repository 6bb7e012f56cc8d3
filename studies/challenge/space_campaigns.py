"""Random campaigns of the 3D belt, small enough for minutes: one fault of geometry, friction or gravity, or none."""

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.effects.load import load_effects
from belt_sim.space import Options
from belt_sim.virtual_rig.hidden import LIBRARY_SIZES, Detectability, HiddenFaults, random_fault, scale_to_size
from belt_sim.virtual_rig.make import Truth, check_seed
from belt_sim.virtual_rig.plan import Plan
from belt_sim.virtual_rig.space import OPTIONS, SENSORS, TENSIONS, make_space_campaign, space_plan, with_simulator_error

#: What as many campaigns in turn hide, None: nothing; the size is drawn from ``SIZES``, as the line shows it.
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
    "thickness_wedge",  # a bent pulley shows only where the belt is far off the middle, which a short run is not
    "slip",
    "camber",
    "weld",
    "edge_guide",
    "sag_roll",
)
SMALL_PLAN = "small_3d"
SMALL_TRAVEL = 8.0  # [m], one and a half revolutions of the belt


def small_space_plan() -> Plan:
    """Five runs: two tensions, yaw to either side, one run made again."""
    return space_plan((TENSIONS[0], TENSIONS[2]), repeats=1, length=SMALL_TRAVEL)


def space_setting(seed: int) -> tuple[str, HiddenFaults]:
    """Base law and what is hidden for a seed; as many seeds as there are settings meet every one once, in any order."""
    turn, place = divmod(check_seed(seed), len(SETTINGS))
    name = SETTINGS[np.random.default_rng([turn, 3]).permutation(len(SETTINGS))[place]]
    if name is None:
        return "strip", HiddenFaults(kind="nothing")
    plan, rng = small_space_plan(), np.random.default_rng([seed, 3])
    base = "beam_th2" if name == "sag_roll" else "strip"
    detectability = Detectability(plan, with_simulator_error(SENSORS, "quasi_static")[0], base)
    fault = random_fault(name, plan, rng)
    if fault.fixed:
        return base, HiddenFaults(kind="library", faults=(fault,), sizes=(float(detectability.sizes([fault])[0]),))
    fault, size = scale_to_size(detectability, fault, float(rng.choice(LIBRARY_SIZES[1:])))
    return base, HiddenFaults(kind="library", faults=(fault,), sizes=(size,))


def random_space_campaign(seed: int, *, options: Options = OPTIONS, workers: int | None = 1) -> tuple[Campaign, Truth]:
    """One campaign of the 3D belt; the same seed and machine make the same. Takes a minute, or five with friction."""
    base, hidden = space_setting(seed)
    return make_space_campaign(
        load_effects,
        hidden=hidden,
        seed=seed,
        base=base,
        plan=small_space_plan(),
        options=options,
        workers=workers,
        title="Drawn by lot, in three dimensions",
        name=SMALL_PLAN,
    )
