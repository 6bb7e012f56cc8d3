"""Results in the terminal: lines and tables."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from belt_sim.model import BY_TENSION
from belt_sim.results.diagnosis import SHOWN_ACTIONS, Diagnosis
from belt_sim.results.display import Table

MIN_WIDTH = 110


def tell_choice(config: Mapping[str, Any], model: str) -> None:
    """Which model a command has chosen, if none was stated."""
    if config["model"]["name"] == BY_TENSION:
        rule = "strip_lift_off below 22 N/mm2, strip above and for synthetic data"
        print(f"model {model}, chosen by tension ({rule}); model=NAME states one")


def tell(tables: Iterable[Table], lines: Iterable[object]) -> None:
    """Tables and lines of a result."""
    out = console()
    for table in tables:
        out.print(rich_table(table))
    for line in lines:
        out.print(str(line), soft_wrap=True, markup=False)


def tell_diagnosis(d: Diagnosis, folder: Path) -> None:
    """Verdict, where it fails, effects, ranking, errors, next runs."""
    found = d.discovery if d.discovery is not None and d.discovery.found else None
    sentences = [*([found.sentence] if found is not None else []), d.where.sentence, d.where.boundary_sentence]
    out = console()
    out.print(f"\n[bold]{d.verdict}[/bold]: {escape(d.sentence)}")
    out.print(*map(escape, sentences), sep="\n")
    for s in d.suspicions:
        out.print(f"[yellow]{s.kind}[/yellow] {escape(str(s))}")
    for line in d.beyond:
        out.print(line, markup=False)
    for e in d.effects:
        out.print(f"  {escape(str(e))}".replace(e.id, f"[bold]{e.id}[/bold]", 1))
    lines: list[object] = [*d.confusables, *d.next_runs[:SHOWN_ACTIONS]]
    if d.unknown is not None and (found is None or found.law is None):
        lines.append(f"unknown: {d.unknown}")
    elif d.unknown is not None and d.unknown.nearest:
        lines.append(f"nearest known effect: {d.unknown.nearest}, but {d.unknown.why}")
    law = ("found_law.yaml",) if found is not None and found.law_file else ()
    files = (folder / name for name in ("report.html", "effects.yaml", "diagnosis.json", *law))
    tell(d.tables(), [*lines, "", *files])


def console() -> Console:
    """A console wide enough for the tables."""
    out = Console(highlight=False)
    out.width = max(out.width, MIN_WIDTH)
    return out


def rich_table(table: Table) -> RichTable:
    """A table of a result for the terminal."""
    shown = RichTable(title=table.title, title_justify="left")
    for name in table.columns:
        shown.add_column(name, justify="left" if name in table.left else "right")
    for k, row in enumerate(table.rows):
        shown.add_row(*map(escape, row), style="red" if k in table.marked else None)
    return shown
