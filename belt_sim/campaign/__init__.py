"""Measured campaigns on disk, format belt-campaign/1: read, validate, write, and look for dirty data."""

from belt_sim.campaign.folder import read_campaign, write_campaign
from belt_sim.campaign.problems import CampaignError
from belt_sim.campaign.quality import leave_out_bad_readings, suspicions
from belt_sim.campaign.quality.record import Suspicion
from belt_sim.campaign.types import (
    BeltSheet,
    Campaign,
    Machine,
    Quantity,
    Run,
    SettingsSheet,
    SignalSheet,
    Source,
    SteadyRate,
    case_of,
)

__all__ = [
    "BeltSheet",
    "Campaign",
    "CampaignError",
    "Machine",
    "Quantity",
    "Run",
    "SettingsSheet",
    "SignalSheet",
    "Source",
    "SteadyRate",
    "Suspicion",
    "case_of",
    "leave_out_bad_readings",
    "read_campaign",
    "suspicions",
    "write_campaign",
]
