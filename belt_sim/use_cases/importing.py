"""Import: a logger's files -> a campaign folder, with what was understood shown before it is written."""

from collections.abc import Callable, Sequence
from glob import glob
from pathlib import Path
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.errors import InputError
from belt_sim.files import write_text
from belt_sim.importing import Logged, Proposal, mapping_text, read, understand, write
from belt_sim.importing.mapping import mapping_of
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
    logged = read([name for f in files for name in named(f)], entry.format.model_dump(exclude_none=True))
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


def named(file: str) -> list[str]:
    """The files that a name with * or ? stands for, where the shell has left it as it is; else the name itself."""
    found = [] if Path(file).exists() or not set("*?") & set(file) else sorted(glob(file))
    return found or [file]


def draft_text(proposal: Proposal) -> str:
    """The mapping with a blank for every answer that is missing, and the question beside it."""
    mapping = _deep(proposal.mapping)
    for question in proposal.missing:
        inner = mapping
        for key in question.path[:-1]:
            if not isinstance(inner.get(key), dict):
                inner[key] = {}
            inner = inner[key]
        inner[question.path[-1]] = None
    text = mapping_text(mapping)
    notes = [f"#   {q.key}: {q.text} e.g. {q.example}" for q in proposal.missing]
    return text + "\n".join(["# still to be answered (null above):", *notes, ""] if notes else [])


def _deep(value: Any) -> Any:
    return {k: _deep(v) for k, v in value.items()} if isinstance(value, dict) else value
