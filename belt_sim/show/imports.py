"""What an import understood, in the terminal."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from belt_sim.campaign import Campaign
from belt_sim.importing import Proposal
from belt_sim.importing.columns import span_of
from belt_sim.importing.sheets import PLAN_COLUMNS, PlannedRun, plan_rows
from belt_sim.results.display import Table
from belt_sim.show.terminal import console, rich_table
from belt_sim.units import DEGREE, MM, N_PER_MM2


def tell_proposal(proposal: Proposal, out: Console | None = None) -> None:
    out = out or console()
    out.print(rich_table(columns_table(proposal)))
    if proposal.campaign is not None:
        out.print(rich_table(runs_table(proposal.campaign)))
        if proposal.noise:
            out.print(rich_table(noise_table(proposal)))
            out.print(rich_table(run_noise_table(proposal)))
    if proposal.unknown:
        names = ", ".join(q.path[1] for q in proposal.unknown)
        example = f'columns: {{"{proposal.unknown[0].path[1]}": {{at: point_1}}}}, or a role: travel, tension ...'
        out.print(f"left out, nothing is known of: {names}; state  {example}", soft_wrap=True, markup=False)
    alike: dict[str, list[str]] = {}
    for note in proposal.notes:
        alike.setdefault(note.text, []).append(note.about)
    for what, about in alike.items():
        out.print(f"{_names(about)}: {what}" if any(about) else what, soft_wrap=True, markup=False)


def tell_written(folder: Path, campaign: Campaign, pictures: bool) -> None:
    """Where the campaign is, and what to do next."""
    print(f"campaign  {folder}")
    if pictures:
        print(f"picture   {folder / 'understood.png'}")
    has_curves = any(len(r.travel) for r in campaign.runs) and any(s.kind == "lateral" for s in campaign.signals)
    then = f"diagnose campaign={folder}" if has_curves else f"compare campaign={folder}"
    print(f"next      belt-sim check campaign={folder}, then belt-sim {then}")


def columns_table(proposal: Proposal) -> Table:
    """Every column, what it became, the first and the last number that it is believed to hold, and why."""
    alike: dict[tuple[str, ...], list[str]] = {}
    spans: dict[tuple[str, ...], str] = {}
    marked: list[int] = []
    for use in proposal.columns:
        became = f"{use.signal} at {use.at}" if use.signal and use.at else use.role
        row = (use.name, became, use.unit, use.why)
        if row not in alike and use.role != "ignore" and not use.sure:
            marked.append(len(alike))
        alike.setdefault(row, []).append(use.table)
        spans.setdefault(row, span_of(use) if use.role != "ignore" and not use.is_text else "")
    rows = [(_names(tables), *row[:2], spans[row], row[3]) for row, tables in alike.items()]
    columns = ("table", "column", "is", "first to last", "because of")
    return Table(title="Columns", columns=columns, rows=rows, left=columns, marked=marked)


def _names(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)})"


def runs_table(campaign: Campaign) -> Table:
    """Every run as it would be written."""
    rows = [
        {
            "run": r.name,
            "N/mm2": f"{r.tension / N_PER_MM2:.4g}",
            "yaw deg": f"{r.yaw / DEGREE:+.4g}",
            "m/s": f"{r.speed:.3g}",
            "direction": f"{r.direction:+.0f}",
            "yaw at m": f"{r.yaw_at:.3g}" + (f" +-{r.yaw_at_u:.2g}" if r.yaw_at_u else ""),
            "travel m": f"{r.travel[-1]:.4g}" if len(r.travel) else "",
            "samples": f"{len(r.travel)}",
            "start m": "" if r.start is None else f"{r.start:.6g}",
            "repeats": r.repeat_of or "",
            "use": "" if r.use == "fit" else r.use.replace("_", " "),
        }
        for r in campaign.runs
    ]
    return Table("Runs", list(rows[0]), [list(row.values()) for row in rows], left=("run", "repeats", "use"))


def noise_table(proposal: Proposal) -> Table:
    rows = []
    for name, n in proposal.noise.items():
        white, wander, zero = (f"{np.round(x / MM, 6):.3g}" for x in (n.white, n.wander, n.zero))
        rows.append((name, white, wander, f"{n.length:.3g}", zero, n.wander_from))
    columns = ("signal", "white", "wander", "over m", "zero", "wander read off")
    return Table(title="Noise (mm or mrad, one sigma)", columns=columns, rows=rows, left=("signal", "wander read off"))


def run_noise_table(proposal: Proposal) -> Table:
    """White noise of every run, in mm or mrad; blank where a run lacks the signal."""
    runs = dict.fromkeys(run for n in proposal.noise.values() for run in n.by_run)
    rows = [
        (run, *(f"{np.round(n.by_run[run] / MM, 6):.3g}" if run in n.by_run else "" for n in proposal.noise.values()))
        for run in runs
    ]
    columns = ("run", *proposal.noise)
    return Table(title="White noise of each run (mm or mrad)", columns=columns, rows=rows, left=("run",))


def tell_plan(planned: Sequence[PlannedRun], folder: Path, travel: float) -> None:
    """The planned runs and what each is good for."""
    title = f"Runs to measure, {travel:g} m each"
    console().print(rich_table(Table(title, PLAN_COLUMNS, plan_rows(planned), left=("run", "good for"))))
    print(f"campaign  {folder} (campaign.yaml: replace what says REPLACE; plan.md: this table)")
    print(f"next      belt-sim check campaign={folder} travel={travel:g}")
