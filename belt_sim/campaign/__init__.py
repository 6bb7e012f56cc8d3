"""Measured campaigns on disk, format belt-campaign/1: read, validate, write, and look for dirty data.

A name is loaded when it is first used: a run of a model needs ``Campaign`` as a type, and no reader of files.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the same names for editors and type checkers
    from belt_sim.campaign.folder import read_campaign as read_campaign
    from belt_sim.campaign.folder import write_campaign as write_campaign
    from belt_sim.campaign.kinematics import suspicions as suspicions
    from belt_sim.campaign.quality import Suspicion as Suspicion
    from belt_sim.campaign.quality import leave_out_bad_readings as leave_out_bad_readings
    from belt_sim.campaign.types import BeltSheet as BeltSheet
    from belt_sim.campaign.types import Campaign as Campaign
    from belt_sim.campaign.types import CampaignError as CampaignError
    from belt_sim.campaign.types import Machine as Machine
    from belt_sim.campaign.types import Quantity as Quantity
    from belt_sim.campaign.types import Run as Run
    from belt_sim.campaign.types import SettingsSheet as SettingsSheet
    from belt_sim.campaign.types import SignalSheet as SignalSheet
    from belt_sim.campaign.types import Source as Source
    from belt_sim.campaign.types import SteadyRate as SteadyRate
    from belt_sim.campaign.types import case_of as case_of

_HOMES = {
    "folder": ("read_campaign", "write_campaign"),
    "types": ("CampaignError",),
    "quality": ("Suspicion", "leave_out_bad_readings"),
    "kinematics": ("suspicions",),
}
_PLACES = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """A name of this package, loaded when it is first used (PEP 562)."""
    if name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES.get(name, 'types')}"), name)
