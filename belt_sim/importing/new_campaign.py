"""An empty campaign for a machine: planned runs, a commented sheet, empty tables."""

from pathlib import Path

from belt_sim.campaign import Campaign, Machine, Quantity, SettingsSheet, SignalSheet, Source, plausible
from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.read import read_plan
from belt_sim.campaign.types import PLACES, BeltSheet
from belt_sim.campaign.write import put_folder, runs_text
from belt_sim.case import Belt, Rig
from belt_sim.errors import InputError
from belt_sim.foresight.harm import harm_warnings
from belt_sim.importing.columns import SIGNAL_NAMES
from belt_sim.importing.plan import PlannedRun, plan_text
from belt_sim.importing.sheets import BELT, GAIN, MACHINE, TENSION_REL, YAW_U
from belt_sim.importing.write import sheet_text

#: Sensors as they usually are, to be replaced: white, zero, wander [m] or [rad] and its length [m].
WHITE, ZERO, WANDER, LENGTH = 2e-5, 1e-4, 5e-5, 3.0
TYPICAL = "typical, REPLACE by your sensor's"


def template(
    folder: str | Path, rig: Rig, belt: Belt, planned: list[PlannedRun], places: list[str], travel: float, title: str
) -> Campaign:
    """Write the folder and return the plan as it is read back; raises InputError for a folder that is not empty."""
    for place in places:
        if place not in PLACES:
            raise InputError("signals", place, "", did_you_mean(place, PLACES))
    signals = tuple(_signal(place) for place in dict.fromkeys(places))
    campaign = Campaign(
        title=title,
        source=Source(kind="measured", reference="REPLACE: log book, date", licence=""),
        machine=Machine(**{n: _quantity(getattr(rig, n), MACHINE[n].relative_u) for n in plausible.MACHINE}),
        belt=BeltSheet(**{n: _quantity(getattr(belt, n), BELT[n].relative_u) for n in BELT}),
        signals=signals,
        settings=SettingsSheet(tension_rel=TENSION_REL, yaw_u=YAW_U),
        runs=tuple(p.run for p in planned),
    )
    texts = {
        "campaign.yaml": sheet_text(campaign, _remarks(campaign)),
        "runs.csv": runs_text(campaign.runs),
        "signals.csv": ",".join(["run", "travel_m", *(s.name for s in signals)]) + "\n",
        "plan.md": plan_text(planned, travel, harm_warnings(campaign)),
    }
    return put_folder(texts, folder, overwrite=False, check=lambda f: read_plan(f, travel=travel, step=travel / 120.0))


def _signal(place: str) -> SignalSheet:
    kind = PLACES[place]
    unit, white = ("mm", WHITE) if kind == "lateral" else ("mrad", 5.0 * WHITE)
    errors = {"zero": ZERO, "gain": GAIN, "wander_sd": WANDER, "wander_length": LENGTH}
    return SignalSheet(name=SIGNAL_NAMES[place], at=place, kind=kind, unit=unit, white=white, **errors)


def _quantity(value: float, relative: float) -> Quantity:
    return Quantity(value=float(value), u=float(f"{relative * value:.2g}"))


def _remarks(campaign: Campaign) -> dict[str, str]:
    keys = [f"machine.{k}" for k in MACHINE] + [f"belt.{k}" for k in ("width", "thickness", "youngs_modulus")]
    remarks = dict.fromkeys(keys, "u is assumed")
    for signal in campaign.signals:
        remarks |= {f"signals.{signal.name}.{k}": TYPICAL for k in ("white", "zero", "gain", "wander")}
    return remarks | {f"settings.{k}": "assumed, REPLACE" for k in ("tension_rel", "yaw")}
