"""Write a campaign folder from a logger's files, and tell what an import understood."""

import copy
from collections.abc import Callable, Mapping, Sequence
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.campaign.folder import SEALED
from belt_sim.errors import InputError, flag
from belt_sim.importing import LoggedTables, Proposal, mapping_text, read, understand, write
from belt_sim.importing.columns import DRAWING, span_of
from belt_sim.importing.mapping import MappingEntry, mapping_of
from belt_sim.io import write_text
from belt_sim.results.words import Table
from belt_sim.show.terminal import say, tell
from belt_sim.units import DEGREE, MM, N_PER_MM2

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
    if not isinstance(mapping, Mapping | MappingEntry | str | Path | None):
        raise InputError("mapping", mapping, "", "give a mapping, or the name of a YAML file")
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
    sealed = [folder / name for name in SEALED if (folder / name).exists()]
    try:
        campaign = write(proposal, folder, overwrite=overwrite)
    finally:
        if ask is None:
            tell_proposal(proposal)
    if pictures:
        from belt_sim.show.curves import understood_picture

        understood_picture(folder / PICTURE, campaign)
    print(f"campaign  {folder}")
    if sealed:
        print(f"removed   {', '.join(map(str, sealed))}: of the virtual rig's campaign that stood there")
    if pictures:
        print(f"picture   {folder / PICTURE}")
    has_curves = any(len(r.travel) for r in campaign.runs) and any(s.kind == "lateral" for s in campaign.signals)
    then = "diagnose" if has_curves else "compare"
    print(f"next      belt-sim check campaign={folder}\nthen      belt-sim {then} campaign={folder}")
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
    if any(q.path[-1] == "at" for q in (*proposal.missing, *proposal.unknown)):
        lines += [f"# {line}" for line in DRAWING.splitlines()]
    return mapping_text(mapping) + "\n".join([*lines, ""] if lines else [])


def tell_proposal(proposal: Proposal) -> None:
    """What an import understood, in the terminal: tables of columns, runs and noise, and what is left open."""

    def several(names: Sequence[str]) -> str:
        return names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)})"

    tables: dict[tuple[str, ...], list[str]] = {}  # row of a column -> tables that have it alike
    spans: dict[tuple[str, ...], str] = {}  # its first and last number
    for use in proposal.columns:
        became = f"{use.signal} at {use.at}" if use.signal and use.at else use.role
        row = (use.name, became, use.unit, use.why)
        tables.setdefault(row, []).append(use.table)
        spans.setdefault(row, span_of(use) if use.role != "ignore" and not use.is_text else "")
    rows = [(several(names), *row[:2], spans[row], row[3]) for row, names in tables.items()]
    columns = ("table", "column", "is", "first to last", "because of")
    shown = [Table(title="Columns", columns=columns, rows=rows, left=columns)]
    if proposal.campaign is not None:
        shown += [imported_runs_table(proposal.campaign), *([noise_table(proposal)] if proposal.noise else [])]
    tell(shown, [])
    if proposal.unknown:
        left_out = ", ".join(q.path[1] for q in proposal.unknown)
        example = f'columns: {{"{proposal.unknown[0].path[1]}": {{at: point_1}}}}, or a role: travel, tension ...'
        say(f"left out, nothing is known of: {left_out}; state  {example}")
    alike: dict[str, list[str]] = {}
    for note in proposal.notes:
        alike.setdefault(note.text, []).append(note.about)
    for what, about in alike.items():
        say(f"{several(about)}: {what}" if any(about) else what)


def imported_runs_table(campaign: Campaign) -> Table:
    """Every run as it would be written."""
    rows = [
        {
            "run": r.name,
            "N/mm2": f"{r.tension / N_PER_MM2:.4g}",
            "yaw deg": f"{r.yaw / DEGREE:+.4g}",
            "m/s": f"{r.speed:.3g}",
            "direction": f"{r.direction:+.0f}",
            "yaw at m": f"{r.yaw_at - r.counted_from:.3g}" + (f" +-{r.yaw_at_u:.2g}" if r.yaw_at_u else ""),
            "travel m": f"{r.travel[-1] - r.counted_from:.4g}" if len(r.travel) else "",
            "samples": f"{len(r.travel)}",
            "start m": "" if r.start is None else f"{r.start + r.counted_from:.6g}",
            "repeats": r.repeat_of or "",
            "use": "" if r.use == "fit" else r.use.replace("_", " "),
        }
        for r in campaign.runs
    ]
    alike = {n: rows[0][n] for n in rows[0] if len(rows) > 1 and len({row[n] for row in rows}) == 1}
    said = [
        f"{v} {n}" if "/" in n else f"{n.removesuffix(' m')} {v}{' m' * n.endswith(' m')}"
        for n, v in alike.items()
        if v
    ]
    title = "Runs" + (f", all with {', '.join(said)}" if said else "")
    columns = [name for name in rows[0] if name not in alike]
    return Table(title, columns, [[row[n] for n in columns] for row in rows], left=("run", "repeats", "use"))


def noise_table(proposal: Proposal) -> Table:
    """White noise, wander and zero of every signal, in mm or mrad."""
    rows = []
    for name, n in proposal.noise.items():
        white, wander, zero = (f"{np.round(x / MM, 6):.3g}" for x in (n.white, n.wander, n.zero))
        rows.append((name, white, wander, f"{n.length:.3g}", zero, n.wander_from))
    columns = ("signal", "white", "wander", "over m", "zero", "wander read off")
    return Table("Noise (mm or mrad, one sigma)", columns, rows, left=("signal", "wander read off"))
