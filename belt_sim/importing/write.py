"""A proposal -> a campaign folder: a sheet with a comment beside every field, and the mapping that made it."""

from pathlib import Path
from typing import Any

import yaml

from belt_sim.campaign import Campaign, Quantity, SignalSheet, write_campaign
from belt_sim.campaign.plausible import SIGNAL_DIMENSION
from belt_sim.campaign.sheet import SCHEMA
from belt_sim.importing.mapping import FILE
from belt_sim.importing.types import Proposal
from belt_sim.si import to_si

#: key of the sheet -> what it is
MEANING = {
    "schema": "what kind of folder this is; leave it",
    "title": "what the campaign is, in a line",
    "source.kind": "measured, digitised (from a printed figure) or synthetic (computed)",
    "source.reference": "log book, paper or figure, date",
    "source.licence": "under which others may use the data",
    "machine.centre_distance": "between the axes of the pulleys; u: one sigma",
    "machine.pulley_radius": "to the belt's middle surface; or head_radius and tail_radius where they differ",
    "machine.head_radius": "of the pulley that stands still, to the belt's middle surface",
    "machine.tail_radius": "of the pulley that yaws, to the belt's middle surface",
    "belt.width": "",
    "belt.thickness": "",
    "belt.youngs_modulus": "of the belt's material",
    "belt.density": "of the belt's material",
    "belt.poisson_ratio": "of the belt's material; 0.3 if left out",
    "unit": "of this column of signals.csv, of white, zero and wander.sd",
    "at": "point_1, _2: upper, lower end at the tail pulley; _3, _4: lower, upper end at the head; or mid-span (tilt)",
    "white": "one sigma from sample to sample",
    "zero": "one sigma of where y = 0 is, anew in every run",
    "gain": "one sigma of the scale, relative",
    "wander": "slow noise: its sd, and the travel [m] over which it forgets itself",
    "settings.tension_rel": "one sigma of how a run hits its stated tension, relative",
    "settings.yaw": "one sigma of how a run hits its stated yaw",
}
COLUMN = 60


def sheet_text(campaign: Campaign, remarks: dict[str, str]) -> str:
    """The sheet; remarks: dotted key -> where its number comes from."""
    out = [
        "# belt-sim campaign sheet. Every number that is uncertain has u: one sigma in the unit of the value.",
        _line("schema", SCHEMA, "schema"),
        _line("title", _text(campaign.title), "title"),
        "source:",
        *(_line(f"  {k}", _text(getattr(campaign.source, k)), f"source.{k}") for k in ("kind", "reference", "licence")),
        *_machine(campaign, remarks),
        "belt:",
    ]
    belt = campaign.belt
    for name, dimension, unit in (
        ("width", "length", "mm"),
        ("thickness", "length", "mm"),
        ("youngs_modulus", "stress", "GPa"),
        ("density", "density", "kg/m^3"),
        ("poisson_ratio", "number", ""),
    ):
        value = _quantity(getattr(belt, name), dimension, unit)
        out.append(_line(f"  {name}", value, f"belt.{name}", remarks.get(f"belt.{name}", "")))
    out.append("signals:" if campaign.signals else "signals: {}")
    for signal in campaign.signals:
        out += _signal(signal, remarks)
    yaw = _number(campaign.settings.yaw_u, to_si(1.0, "urad", dimension="angle", name="yaw"))
    relative, of_yaw = (remarks.get(f"settings.{k}", "") for k in ("tension_rel", "yaw"))
    out += [
        "settings:",
        _line("  tension_rel", f"{campaign.settings.tension_rel:.6g}", "settings.tension_rel", relative),
        _line("  yaw", f"{{u: {yaw}, unit: urad}}", "settings.yaw", of_yaw),
    ]
    return "\n".join([*out, ""])


def _line(key: str, value: str, meaning: str, remark: str = "") -> str:
    comment = "; ".join(part for part in (MEANING[meaning], remark) if part)
    text = f"{key}: {value}"
    return f"{text:{COLUMN}s}  # {comment}" if comment else text


def _text(text: str) -> str:
    """A text as a YAML scalar on one line."""
    if not text:
        return '""'
    return yaml.safe_dump(text, width=10_000, allow_unicode=True).splitlines()[0].strip()


def _number(si: float, scale: float) -> str:
    return f"{si / scale:.12g}"


def _quantity(quantity: Quantity, dimension: str, unit: str) -> str:
    scale = to_si(1.0, unit, dimension=dimension, name="unit")
    value, u = _number(quantity.value, scale), _number(quantity.u, scale)
    return f"{{value: {value}, u: {u}, unit: {unit}}}" if unit else f"{{value: {value}, u: {u}}}"


def _machine(campaign: Campaign, remarks: dict[str, str]) -> list[str]:
    machine = campaign.machine
    names = {"centre_distance": machine.centre_distance}
    if machine.head_radius == machine.tail_radius:
        names["pulley_radius"] = machine.head_radius
    else:
        names |= {"head_radius": machine.head_radius, "tail_radius": machine.tail_radius}
    lines = [
        _line(f"  {k}", _quantity(q, "length", "m"), f"machine.{k}", remarks.get(f"machine.{k}", ""))
        for k, q in names.items()
    ]
    return ["machine:", *lines]


def _signal(signal: SignalSheet, remarks: dict[str, str]) -> list[str]:
    scale = to_si(1.0, signal.unit, dimension=SIGNAL_DIMENSION[signal.kind], name=signal.name)
    told = {k: remarks.get(f"signals.{signal.name}.{k}", "") for k in ("white", "zero", "gain", "wander")}
    wander = f"{{sd: {_number(signal.wander_sd, scale)}, length_m: {signal.wander_length:.6g}}}"
    return [
        f"  {_text(signal.name)}:",
        _line("    unit", signal.unit, "unit"),
        _line("    at", signal.at, "at"),
        _line("    white", _number(signal.white, scale), "white", told["white"]),
        _line("    zero", _number(signal.zero, scale), "zero", told["zero"]),
        _line("    gain", f"{signal.gain:.6g}", "gain", told["gain"]),
        _line("    wander", wander, "wander", told["wander"]),
    ]


_HEAD = """\
# How the logger's files were understood; belt-sim import FILES mapping=THIS_FILE does the same again.
"""


def write(proposal: Proposal, folder: str | Path, *, overwrite: bool = False) -> Campaign:
    """Write campaign.yaml (commented), runs.csv, signals.csv or steady.csv, and mapping.yaml; all of it or nothing.

    Returns the campaign as the loader reads it back. Raises CampaignError for answers that are missing and for what
    the loader refuses, InputError for a folder that is not empty.
    """
    campaign = proposal.complete()
    instead = {"campaign.yaml": sheet_text(campaign, proposal.comments), FILE: mapping_text(proposal.mapping)}
    return write_campaign(campaign, folder, overwrite=overwrite, instead=instead)


def mapping_text(mapping: dict[str, Any]) -> str:
    """The mapping as YAML, one column or run a line."""
    flow = {"columns", "runs"}
    lines = []
    for key, value in mapping.items():
        if value in (None, {}):
            continue
        if key in flow and isinstance(value, dict):
            lines.append(f"{key}:")
            lines += [f"  {_flow(str(k))}: {_flow(v)}" for k, v in value.items()]
        else:
            text = yaml.safe_dump({key: value}, sort_keys=False, allow_unicode=True, width=10_000)
            lines += text.rstrip("\n").split("\n")
    return _HEAD + "\n".join([*lines, ""])


def _flow(value: Any) -> str:
    """A value on one line."""
    text = yaml.safe_dump(value, sort_keys=False, allow_unicode=True, width=10_000, default_flow_style=True)
    return text.removesuffix("\n...\n").strip()
