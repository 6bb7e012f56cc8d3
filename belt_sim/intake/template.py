"""An empty campaign: a commented sheet with typical sensors, the planned runs, and a signals.csv of a header."""

from pathlib import Path

from belt_sim.campaign import Campaign, Machine, Quantity, SettingsSheet, SignalSheet, Source
from belt_sim.campaign.problems import did_you_mean
from belt_sim.campaign.read import read_plan
from belt_sim.campaign.types import PLACES, BeltSheet
from belt_sim.campaign.write import put_folder, runs_text
from belt_sim.errors import InputError
from belt_sim.intake.machine import BELT, MACHINE
from belt_sim.intake.plan import Planned, plan_text
from belt_sim.intake.sheet import sheet_text
from belt_sim.rig import Belt, Rig

#: Sensors as they usually are, to be replaced: white, zero, wander [m] or [rad] and its length [m], gain.
WHITE, ZERO, WANDER, LENGTH, GAIN = 2e-5, 1e-4, 5e-5, 3.0, 0.005
TENSION_REL, YAW_U = 0.01, 5e-6
TYPICAL = "typical, REPLACE by your sensor's"


def template(
    folder: str | Path, rig: Rig, belt: Belt, planned: list[Planned], places: list[str], travel: float, title: str
) -> Campaign:
    """Write the folder and return the plan as it is read back; raises InputError for a folder that is not empty."""
    for place in places:
        if place not in PLACES:
            raise InputError("signals", place, "", did_you_mean(place, PLACES))
    signals = tuple(_signal(place) for place in dict.fromkeys(places))
    campaign = Campaign(
        title=title,
        source=Source(kind="measured", reference="REPLACE: log book, date", licence=""),
        machine=_machine(rig),
        belt=BeltSheet(**{n: _quantity(getattr(belt, n), BELT[n][2]) for n in BELT}),
        signals=signals,
        settings=SettingsSheet(tension_rel=TENSION_REL, yaw_u=YAW_U),
        runs=tuple(p.run for p in planned),
    )
    texts = {
        "campaign.yaml": sheet_text(campaign, _remarks(campaign)),
        "runs.csv": runs_text(campaign.runs),
        "signals.csv": ",".join(["run", "travel_m", *(s.name for s in signals)]) + "\n",
        "plan.md": plan_text(planned, travel, belt),
    }
    return put_folder(texts, folder, overwrite=False, check=lambda f: read_plan(f, travel=travel, step=travel / 120.0))


def _signal(place: str) -> SignalSheet:
    kind = PLACES[place]
    name = f"y{place[-1]}" if kind == "lateral" else "tilt" if place.startswith("upper") else "tilt_lower"
    return SignalSheet(
        name=name,
        at=place,
        kind=kind,
        unit="mm" if kind == "lateral" else "mrad",
        white=WHITE if kind == "lateral" else 5.0 * WHITE,
        zero=ZERO,
        gain=GAIN,
        wander_sd=WANDER,
        wander_length=LENGTH,
    )


def _quantity(value: float, relative: float) -> Quantity:
    return Quantity(value=float(value), u=float(f"{relative * value:.2g}"))


def _machine(rig: Rig) -> Machine:
    return Machine(
        centre_distance=_quantity(rig.centre_distance, MACHINE["centre_distance"][2]),
        head_radius=_quantity(rig.head_radius, MACHINE["head_radius"][2]),
        tail_radius=_quantity(rig.tail_radius, MACHINE["tail_radius"][2]),
    )


def _remarks(campaign: Campaign) -> dict[str, str]:
    keys = [f"machine.{k}" for k in MACHINE] + [f"belt.{k}" for k in ("width", "thickness", "youngs_modulus")]
    remarks = dict.fromkeys(keys, "u is assumed")
    for signal in campaign.signals:
        remarks |= {f"signals.{signal.name}.{k}": TYPICAL for k in ("white", "zero", "gain", "wander")}
    return remarks | {f"settings.{k}": "assumed, REPLACE" for k in ("tension_rel", "yaw")}
