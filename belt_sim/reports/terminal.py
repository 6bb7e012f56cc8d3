"""Results in the terminal: lines and tables."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from belt_sim.registry import BY_TENSION
from belt_sim.results.diagnosis import SHOWN_ACTIONS, Diagnosis, error_table, ranking_table
from belt_sim.results.display import Table

MIN_WIDTH = 110


def tell_choice(config: Mapping[str, Any], model: str) -> None:
    """Which model a command has chosen, if none was stated."""
    if config["model"]["name"] == BY_TENSION:
        rule = "strip_lift_off below 22 N/mm2, strip above and for synthetic data"
        print(f"model {model}, chosen by tension ({rule}); model=NAME states one")


def tell(tables: Iterable[Table], lines: Iterable[str], place: Path) -> None:
    """Tables and lines of a result, and where its files are."""
    out = console()
    for table in tables:
        out.print(rich_table(table))
    for line in (*lines, str(place)):
        out.print(line, soft_wrap=True, markup=False)


def tell_diagnosis(d: Diagnosis, folder: Path) -> None:
    """Verdict, where it fails, effects, ranking, errors, next runs."""
    out = console()
    out.print(f"\n[bold]{d.verdict}[/bold]: {escape(d.sentence)}")
    found = d.discovery if d.discovery is not None and d.discovery.found else None
    if found is not None:
        out.print(found.sentence, markup=False)
    out.print(d.where.sentence, markup=False)
    out.print(d.where.boundary_sentence, markup=False)
    for s in d.suspicions:
        out.print(f"[yellow]{s.kind}[/yellow] {escape(str(s))}")
    for line in d.beyond:
        out.print(line, markup=False)
    for e in d.effects:
        out.print(f"  {escape(str(e))}".replace(e.id, f"[bold]{e.id}[/bold]", 1))
    out.print(rich_table(ranking_table(d.ranking)))
    out.print(rich_table(error_table(d.error)))
    for pair in d.confusables:
        out.print(str(pair), markup=False)
    for action in d.next_runs[:SHOWN_ACTIONS]:
        out.print(str(action), markup=False)
    if d.unknown is not None and (found is None or found.law is None):
        out.print(f"unknown: {d.unknown}")
    elif d.unknown is not None and d.unknown.nearest:
        out.print(f"nearest known effect: {d.unknown.nearest}, but {d.unknown.why}")
    out.print("")
    law = ("found_law.yaml",) if found is not None and found.law_file else ()
    for name in ("report.html", "effects.yaml", "diagnosis.json", *law):
        out.print(str(folder / name), soft_wrap=True)


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
