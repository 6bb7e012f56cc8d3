"""Write a campaign folder: an empty one with a plan of runs, or one from a logger's files."""

import copy
from collections.abc import Callable, Mapping, Sequence
from glob import glob
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.errors import InputError, finite, flag
from belt_sim.foresight.harm import harm_warnings
from belt_sim.importing import LoggedTables, Proposal, mapping_text, read, understand, write
from belt_sim.importing.columns import DRAWING
from belt_sim.importing.mapping import mapping_of
from belt_sim.importing.sheets import plan_for, template, tensions_for, travel_for, yaw_for
from belt_sim.io import write_text
from belt_sim.settings import BOUNDS, belt_from, rig_from
from belt_sim.show.imports import tell_plan, tell_proposal, tell_written


def new_campaign(folder: Path, config: Mapping[str, Any]) -> Campaign:
    """Write the template and tell the plan; config: as conf/new.yaml. Raises InputError, CampaignError."""
    rig, belt = rig_from(config["rig"]), belt_from(config["belt"])
    if config["tensions"] is None:
        tensions = tensions_for(rig, belt)
    else:
        tensions = sorted(_numbers("tensions", config["tensions"], "N/mm2", BOUNDS["tension"].high))
    if config["yaw"] is None:
        yaw = yaw_for(rig, belt, tensions)
    else:
        yaw = _numbers("yaw", [config["yaw"]], "degrees", BOUNDS["yaw"].high / 2.0)[0]
    travel = travel_for(rig)
    planned = plan_for(tensions, yaw, _numbers("speed", [config["speed"]], "m/s", 25.0)[0])
    places = config["signals"] if isinstance(config["signals"], list) else [config["signals"]]
    campaign = template(folder, rig, belt, planned, [str(p) for p in places], travel, str(config["title"]))
    tell_plan(planned, folder, travel)
    for warning in harm_warnings(campaign):
        print(f"warning   {warning}")
    return campaign


def _numbers(name: str, asked: Any, unit: str, most: float) -> list[float]:
    """Positive numbers of a setting."""
    if not isinstance(asked, Sequence) or isinstance(asked, str) or not asked:
        raise InputError(name, asked, unit, "give a list, as [7,15,35]")
    remedy = f"give a number above 0 and up to {most:g}"
    return list(dict.fromkeys(finite(name, v, unit, remedy, lambda x: 0.0 < x <= most) for v in asked))


PICTURE = "understood.png"


def import_files(
    files: Sequence[str],
    folder: Path,
    *,
    mapping: Any = None,
    draft: str | None = None,
    overwrite: bool = False,
    pictures: bool = True,
    ask: Callable[[LoggedTables, dict[str, Any]], Proposal] | None = None,
) -> Campaign | None:
    """Write the campaign that ``files`` hold; None when only a draft of the mapping was written.

    ask: completes the mapping with whoever sits at a terminal; None where nobody does. Raises CampaignError with a line
    for every answer that is missing.
    """
    flag("overwrite", overwrite), flag("pictures", pictures)
    entry = mapping_of(mapping)
    names: list[str] = []
    for file in files:  # * and ? stand for several where the shell has left them
        found = [] if Path(file).exists() or not set("*?") & set(file) else sorted(glob(file))
        names += found or [file]
    logged = read(names, entry.format.model_dump(exclude_none=True))
    proposal = understand(logged, entry)
    if draft is not None:
        path = Path(draft)
        if path.exists():
            raise InputError("draft", draft, "", "exists; choose another name")
        write_text(path, draft_text(proposal))
        tell_proposal(proposal)
        print(f"draft     {path}: fill in what is blank, then  mapping={path}")
        return None
    if ask is not None:
        proposal = ask(logged, entry.model_dump(by_alias=True, exclude_unset=True))
    try:
        campaign = write(proposal, folder, overwrite=overwrite)
    finally:
        if ask is None:
            tell_proposal(proposal)
    if pictures:
        from belt_sim.show.curves import understood_picture

        understood_picture(folder / PICTURE, campaign)
    tell_written(folder, campaign, pictures)
    return campaign


def draft_text(proposal: Proposal) -> str:
    """The mapping with a blank for every answer that is missing, and the question beside it."""
    mapping = copy.deepcopy(proposal.mapping)
    for question in (*proposal.missing, *proposal.unknown):
        question.put(mapping, None)
    lines = []
    if proposal.missing:
        lines += ["# still to be answered (null above):"]
        lines += [f"#   {q.key}: {q.text} e.g. {q.example}" for q in proposal.missing]
    if proposal.unknown:
        lines += ["# left out as long as at is null; give a place, or in its stead a role as {role: tension}:"]
        lines += [f"#   {q.path[1]}" for q in proposal.unknown]
    guesses = {u.name: f"#   {u.name}: {u.unit} ({u.why})" for u in proposal.columns if u.unit_is_guess}
    if guesses:
        lines += ["# units that only the size of the numbers tells; look at them, and state unit: for good:"]
        lines += guesses.values()
    if any(q.path[-1] == "at" for q in (*proposal.missing, *proposal.unknown)):
        lines += [f"# {line}" for line in DRAWING.splitlines()]
    return mapping_text(mapping) + "\n".join([*lines, ""] if lines else [])
