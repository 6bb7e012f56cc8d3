"""Scores in the terminal: a line a campaign, and the table of targets."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from belt_sim.results.words import listed
from studies.challenge.facts import Facts
from studies.challenge.targets import Target, targets

MIN_WIDTH = 120


def told(f: Facts) -> str:
    """One campaign in a line: what was hidden, what was answered, what that is worth."""
    said = f"{f.verdict} {', '.join(f.named)}".strip()
    alike = sorted({a for others in f.aliases.values() for a in others})
    said += f" ~ {', '.join(alike)}" if alike else ""
    spent = f" ({f.seconds:.0f} s)" if f.seconds else ""
    return f"{f.seed} {f.outcome:9s} {hidden_of(f)} -> {said}{spent}"


def hidden_of(f: Facts) -> str:
    """What a campaign hides, with sizes."""
    sizes = [f" (d = {d:.0f})" if d else "" for d in f.d]
    names = [f"{name}{size}" for name, size in zip(f.hidden, sizes, strict=True)]
    far = f", distance {f.distance:.0f}" if f.kind == "outside" and f.distance is not None else ""
    place = f" [{f.plan}]" if f.plan else ""
    return f"{f.kind.replace('_', ' ')}: {listed([*names, *([f.dirt] if f.dirt else [])])}{far}{place}"


def tell_targets(rows: Sequence[Facts], folder: Path) -> None:
    """The table of targets, and how the outcomes are spread."""
    out = Console(highlight=False)
    out.width = max(out.width, MIN_WIDTH)
    shown = Table(title=f"{len(rows)} campaigns", title_justify="left")
    for name in ("figure", "target", "found", "95 % interval", "note"):
        shown.add_column(name, justify="left" if name in ("figure", "note") else "right")
    for row in targets(rows):
        shown.add_row(*cells(row), style="red" if row.met is False else None)
    out.print(shown)
    out.print(str(folder), soft_wrap=True)


def cells(row: Target) -> tuple[str, ...]:
    """One row of the table as text."""
    low, high = row.found.interval
    interval = f"{low:.0%} - {high:.0%}" if row.found.trials else ""
    return row.name, row.wanted, f"{row.found.count} of {row.found.trials}", interval, row.note
