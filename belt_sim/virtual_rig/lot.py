"""Campaigns by lot for a challenge: a plan, a noise and something hidden, or nothing; a seed makes them again."""

from functools import partial

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.virtual_rig.draw import MIX, OUTSIDE, REACHED, by_lot
from belt_sim.virtual_rig.lot_plans import POOL, plan_by_number, true_noise
from belt_sim.virtual_rig.make import checked_seed, measured_campaign, streams_of
from belt_sim.virtual_rig.seal import Truth
from belt_sim.virtual_rig.size import ruler

TITLE = "Drawn by lot"
_PLANS = 4  # plans that are tried for a stranger
_BEAMS = 0.1  # share of the campaigns on a belt that does not roll


def random_campaign(
    seed: int, *, kind: str | None = None, blind: bool | None = True, plan: int | None = None
) -> tuple[Campaign, Truth]:
    """One campaign of the mix (``draw.MIX``), or of one kind of it, on one of the plans or the one of a number.

    blind: True for strangers of the blind list only, False for those of the development list, None for both.
    """
    streams = streams_of(checked_seed(seed))
    which = np.random.default_rng([seed, 1])
    kind = kind or str(which.choice(list(MIX), p=list(MIX.values())))
    base = "beam_th2" if which.random() < _BEAMS else "strip"
    for _ in range(_PLANS):
        number = int(which.integers(POOL)) if plan is None else plan
        name, chosen, stated = plan_by_number(number)
        noise = true_noise(chosen, stated, streams[1])
        rule_of = partial(ruler, chosen, noise, base)
        what = by_lot(chosen, rule_of, base, streams[0], kind=kind, blind=blind)
        if kind != "outside" or (what.distance or 0.0) >= REACHED * OUTSIDE[0]:
            break  # a plan that measures little tells no stranger from the library
    return measured_campaign(chosen, noise, base, what, seed, streams, TITLE, f"{name} {number}")


def random_stranger_campaign(seed: int, blind: bool | None = True) -> tuple[Campaign, Truth]:
    """One campaign with something hidden that the library has not; its best three effects leave 6 to 30 over."""
    return random_campaign(seed, kind="outside", blind=blind)


def random_nothing_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign with nothing hidden."""
    return random_campaign(seed, kind="nothing")
