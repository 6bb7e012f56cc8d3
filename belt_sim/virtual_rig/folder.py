"""Virtual-rig campaigns on disk."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from belt_sim.campaign import write_campaign
from belt_sim.campaign.read import campaign_folder
from belt_sim.virtual_rig.lot import random_campaign
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Noise, Plan
from belt_sim.virtual_rig.seal import Truth, reveal, seal


def run_virtual_rig(
    out: str | Path,
    *,
    hidden: Sequence[str | dict] | Literal["random"] = (),
    seed: int | None = None,
    base: str | None = None,
    plan: Plan | None = None,
    noise: Noise | None = None,
    title: str = "Virtual rig",
    overwrite: bool = False,
) -> str:
    """Write a campaign with its sealed truth into ``out``; returns the SHA-256 to publish."""
    campaign, truth = make_campaign(hidden=hidden, seed=seed, base=base, plan=plan, noise=noise, title=title)
    write_campaign(campaign, out, overwrite=overwrite)
    return seal(truth, Path(out))


def run_lot(out: str | Path, *, seed: int, plan: int | None = None, overwrite: bool = False) -> str:
    """Write a campaign drawn by lot, on any plan or on the one of a number, into ``out``; returns the SHA-256."""
    campaign, truth = random_campaign(seed, blind=None, plan=plan)
    write_campaign(campaign, out, overwrite=overwrite)
    return seal(truth, Path(out))


def run_reveal(folder: str | Path) -> Truth:
    """The truth of a campaign folder, checked against its published hash."""
    return reveal(campaign_folder(folder))
