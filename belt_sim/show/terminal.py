"""Results in the terminal: the verdict first, lines that fit the window, tables where they are asked for."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from belt_sim.model import BY_TENSION
from belt_sim.results.words import Table, capital, in_terminal

if TYPE_CHECKING:
    from belt_sim.results.diagnosis import Diagnosis

#: why a model was chosen for one case
REASONS = {
    "strip_lift_off": "the belt is so slack that it lifts off",
    "strip": "the belt is too tight to lift off",
}


def tell_choice(config: Mapping[str, Any], model: str, why: str = "") -> None:
    """Which model a command has chosen and why, if none was stated."""
    if config["model"]["name"] == BY_TENSION:
        print(f"model {model}, as {why or REASONS[model]}; or model=NAME")


def tell(tables: Iterable[Table], lines: Iterable[object]) -> None:
    """Lines of a result, its verdict first, then its tables, then where its files are (a path among the lines)."""
    out, lines = Console(highlight=False), list(lines)
    wrapped = out.is_terminal or "COLUMNS" in os.environ  # a pipe has a sentence a line
    for line in (x for x in lines if not isinstance(x, Path)):
        out.print(in_terminal(line), soft_wrap=not wrapped, markup=False)
    for table in tables:
        out.print(rich_table(table))
    for path in (x for x in lines if isinstance(x, Path)):
        out.print(str(path), soft_wrap=True, markup=False)


def tell_diagnosis(d: "Diagnosis", folder: Path, *, verbose: bool = False) -> None:
    """Verdict, what takes certainty off it, effects, where the model fails, how the error falls, what to do next.

    verbose: the table of candidates and that of errors as well.
    """
    from belt_sim.results.diagnosis import SHOWN_ACTIONS, error_line
    from belt_sim.show.report import plant_card, rival_cards

    out = Console(highlight=False)

    def say(line: str, style: str = "", indent: int = 2) -> None:
        """A line that wraps below its beginning."""
        out.print(Padding(Text(in_terminal(line), style=style), (0, 0, 0, indent), expand=False))

    out.print()
    out.print(Text.assemble((d.headline, "bold"), f": {in_terminal(d.sentence)}"))
    for doubt in d.doubts:
        say(capital(doubt), "yellow")
    rivals = rival_cards(d)
    numbered = [(f"{k}. ", c) for k, c in enumerate(rivals, start=1)]
    certain = [e for e in d.effects if not rivals or e.id in d.certain_effects]
    single = [plant_card(e, d.drawings.machine, d.asked_for) for e in certain]
    for number, c in [*numbered, *(("", c) for c in single)]:
        say(f"{number}{c['id'] or 'nothing more'}: {c['fault']}", "bold")
        for line in (*c["sizes"], *(["effective value, model rejected"] if c.get("stamp") else []), c["sure"]):
            say(line, indent=5)
    found = d.discovery if d.discovery is not None and d.discovery.found else None
    if found is not None and (d.law_holds or found.law is None):
        say(found.sentence)
    if d.unknown is not None and (found is None or found.law is None):
        say(f"unknown: {d.unknown}")
    elif d.unknown is not None and d.unknown.nearest:
        say(f"nearest known effect: {d.unknown.nearest}, but {d.unknown.why}")
    for line in (d.where.sentence, d.where.boundary_sentence, *error_line(d.error), *map(str, d.confusables)):
        say(capital(line))
    for line in d.further_runs[:SHOWN_ACTIONS]:
        say(line if line.startswith("No single") else f"Next: {line}", "green")
    if verbose:
        for table in d.tables():
            out.print(rich_table(table))
    elif d.ranking:
        say(f"verbose=true lists all {len(d.ranking)} effects that were tried", "dim")
    law = ("found_law.yaml",) if found is not None and found.law_file and d.law_holds else ()
    out.print()
    for name in ("report.html", "effects.yaml", "diagnosis.json", *law):
        out.print(str(folder / name), soft_wrap=True, markup=False)


LONGEST_UNBROKEN = 34  # of a run or effect, that its column never breaks


def rich_table(table: Table) -> RichTable:
    """A table of a result for the terminal, without lines between columns: on a narrow window words wrap in place."""
    look: Any = {"box": box.SIMPLE_HEAD, "pad_edge": False, "collapse_padding": True}
    shown = RichTable(title=escape(table.title), title_justify="left", **look)
    for k, name in enumerate(table.columns):
        side = "left" if name in table.left else "right"
        whole = name not in table.left or (k == 0 and all(len(row[0]) <= LONGEST_UNBROKEN for row in table.rows))
        shown.add_column(escape(name), justify=side, overflow="fold", no_wrap=whole)  # type: ignore[arg-type]
    for k, row in enumerate(table.rows):
        shown.add_row(*map(Text, map(in_terminal, row)), style="red" if k in table.marked else None)
    return shown
