"""Campaigns by lot for a challenge: a plan, a noise and something hidden, or nothing; a seed makes them again."""

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.virtual_rig.draw import by_lot
from belt_sim.virtual_rig.lot_plans import POOL, plan_by_number, true_noise
from belt_sim.virtual_rig.make import checked_seed, measured_campaign, streams_of
from belt_sim.virtual_rig.seal import Truth
from belt_sim.virtual_rig.size import ruler

TITLE = "Drawn by lot"
_BEAMS = 0.1  # share of the campaigns on a belt that does not roll


def random_campaign(
    seed: int, *, kind: str | None = None, blind: bool | None = True, plan: int | None = None
) -> tuple[Campaign, Truth]:
    """One campaign of the mix (``draw.MIX``), or of one kind of it, on one of the plans or the one of a number.

    blind: True for strangers of the blind list only, False for those of the development list, None for both.
    """
    streams = streams_of(checked_seed(seed))
    which = np.random.default_rng([seed % 2**63, 1])
    drawn, beam = int(which.integers(POOL)), bool(which.random() < _BEAMS)
    number = drawn if plan is None else plan
    name, chosen, stated = plan_by_number(number)
    base = "beam_th2" if beam else "strip"
    noise = true_noise(chosen, stated, streams[1])
    what = by_lot(chosen, lambda: ruler(chosen, noise, base), base, streams[0], kind=kind, blind=blind)
    return measured_campaign(chosen, noise, base, what, seed, streams, TITLE, f"{name} {number}")


def random_stranger_campaign(seed: int, blind: bool | None = True) -> tuple[Campaign, Truth]:
    """One campaign with something hidden that the library has not; its best three effects leave 6 to 30 over."""
    return random_campaign(seed, kind="outside", blind=blind)


def random_nothing_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign with nothing hidden."""
    return random_campaign(seed, kind="nothing")
