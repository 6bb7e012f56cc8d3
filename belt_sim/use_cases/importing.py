"""Import: a logger's files -> a campaign folder, with what was understood shown before it is written."""

import copy
from collections.abc import Callable, Sequence
from glob import glob
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.errors import InputError
from belt_sim.files import write_text
from belt_sim.importing import Logged, Proposal, mapping_text, read, understand, write
from belt_sim.importing.mapping import mapping_of
from belt_sim.importing.roles import DRAWING
from belt_sim.reports.importing import tell_proposal, tell_written

PICTURE = "understood.png"


def import_files(
    files: Sequence[str],
    folder: Path,
    *,
    mapping: Any = None,
    draft: str | None = None,
    overwrite: bool = False,
    pictures: bool = True,
    ask: Callable[[Logged, dict[str, Any]], Proposal] | None = None,
) -> Campaign | None:
    """Write the campaign that ``files`` hold; None when only a draft of the mapping was written.

    ask: completes the mapping with whoever sits at a terminal; None where nobody does. Raises CampaignError with a line
    for every answer that is missing.
    """
    entry = mapping_of(mapping)
    logged = read([name for f in files for name in expand_pattern(f)], entry.format.model_dump(exclude_none=True))
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
        from belt_sim.pictures.importing import understood_picture

        understood_picture(folder / PICTURE, campaign)
    tell_written(folder, pictures)
    return campaign


def expand_pattern(file: str) -> list[str]:
    """The files that a name with * or ? stands for, where the shell has left it as it is; else the name itself."""
    found = [] if Path(file).exists() or not set("*?") & set(file) else sorted(glob(file))
    return found or [file]


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
    if any(q.path[-1] == "at" for q in (*proposal.missing, *proposal.unknown)):
        lines += [f"# {line}" for line in DRAWING.splitlines()]
    return mapping_text(mapping) + "\n".join([*lines, ""] if lines else [])
