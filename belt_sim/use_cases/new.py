"""New: an empty, commented campaign for a rig and a belt, with the runs that a diagnosis needs."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.config import MAX_TENSION, MAX_YAW, belt_from, rig_from
from belt_sim.errors import InputError
from belt_sim.importing.new_campaign import plan_for, template, tensions_for, travel_for, yaw_for
from belt_sim.reports.importing import tell_plan


def new(folder: Path, config: Mapping[str, Any]) -> Campaign:
    """Write the template and tell the plan; config: as conf/new.yaml. Raises InputError, CampaignError."""
    rig, belt = rig_from(config["rig"]), belt_from(config["belt"])
    asked = config["tensions"]
    tensions = tensions_for(rig, belt) if asked is None else sorted(_numbers("tensions", asked, "N/mm2", MAX_TENSION))
    yaw = yaw_for(rig, belt) if config["yaw"] is None else _numbers("yaw", [config["yaw"]], "degrees", MAX_YAW / 2.0)[0]
    travel = travel_for(rig)
    planned = plan_for(tensions, yaw, _numbers("speed", [config["speed"]], "m/s", 25.0)[0])
    places = config["signals"] if isinstance(config["signals"], list) else [config["signals"]]
    campaign = template(folder, rig, belt, planned, [str(p) for p in places], travel, str(config["title"]))
    tell_plan(planned, folder, travel)
    return campaign


def _numbers(name: str, asked: Any, unit: str, most: float) -> list[float]:
    """Positive numbers of a setting."""
    if not isinstance(asked, Sequence) or isinstance(asked, str) or not asked:
        raise InputError(name, asked, unit, "give a list, as [7,15,35]")
    for value in asked:
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value <= most:
            raise InputError(name, value, unit, f"give a number above 0 and up to {most:g}")
    return [float(v) for v in dict.fromkeys(asked)]
