"""A proposal -> a campaign folder with a commented sheet and the mapping that made it."""

from pathlib import Path
from typing import Any

import yaml

from belt_sim.campaign import Campaign, write_campaign
from belt_sim.intake.known import in_order
from belt_sim.intake.mapping import FILE
from belt_sim.intake.proposal import Proposal
from belt_sim.intake.sheet import sheet_text

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
    for key, value in in_order(mapping).items():
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
