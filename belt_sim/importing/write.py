"""A proposal -> a campaign folder: a sheet with a comment beside every field, and the mapping that made it."""

from pathlib import Path
from typing import Any

import yaml

from belt_sim.campaign import Campaign, write_campaign
from belt_sim.campaign.write import sheet_tree
from belt_sim.importing.build import Proposal
from belt_sim.importing.mapping import FILE

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
    """The sheet with a comment beside every field; remarks: dotted key -> where its number comes from."""
    lines = ["# belt-sim campaign sheet. Every number that is uncertain has u: one sigma in the unit of the value."]
    tree = sheet_tree(campaign)
    for signal in campaign.signals:
        tree["signals"][signal.name].setdefault("wander", {"sd": 0, "length_m": signal.wander_length})
    for key, value in tree.items():
        lines += _lines((key,), value, remarks)
    return "\n".join([*lines, ""])


def _lines(path: tuple[str, ...], value: Any, remarks: dict[str, str]) -> list[str]:
    """The lines of a field; a quantity and a spread take one."""
    begin, where = "  " * (len(path) - 1) + _flow(path[-1]) + ":", ".".join(path)
    if isinstance(value, dict) and value and not {"u", "sd"} & set(value):
        return [begin, *(line for key, inner in value.items() for line in _lines((*path, key), inner, remarks))]
    meaning = MEANING.get(where, MEANING.get(path[-1], ""))
    comment = "; ".join(part for part in (meaning, remarks.get(where, "")) if part)
    text = f"{begin} {_flow(_whole(value))}"
    return [f"{text:{COLUMN}s}  # {comment}" if comment else text]


def _whole(value: Any) -> Any:
    """A value with whole numbers as such: 200, not 200.0."""
    if isinstance(value, dict):
        return {k: _whole(v) for k, v in value.items()}
    return int(value) if isinstance(value, float) and value.is_integer() else value


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
