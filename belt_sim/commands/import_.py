"""belt-sim import: a logger's files -> a campaign; a person at the terminal is asked for what is missing."""

import copy
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.prompt import Confirm, Prompt

from belt_sim.api.campaigns import import_files
from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import BeltError, InputError
from belt_sim.files import group_names
from belt_sim.importing.build import understand
from belt_sim.importing.roles import DRAWING
from belt_sim.importing.types import ROLES, LoggedTables, Proposal, Question
from belt_sim.reports.imports import tell_proposal


def run(run_dir: RunDir) -> None:
    """Read, ask what is missing (in a terminal), show what was understood, and write the folder."""
    config = run_dir.config
    files = [config["files"]] if isinstance(config["files"], str | int | float) else config["files"]
    if not isinstance(files, list):
        raise InputError("files", files, "", "write file names after the command, or files=[a.csv,b.csv]")
    folder = Path(config["out"]) if config["out"] else run_dir.path / "campaign"
    import_files(
        [str(f) for f in files],
        folder,
        mapping=config["mapping"],
        draft=config["draft"],
        overwrite=bool(config["overwrite"]),
        pictures=bool(config["pictures"]),
        ask=ask_in_terminal if sys.stdin.isatty() and sys.stdout.isatty() else None,
    )


def ask_in_terminal(logged: LoggedTables, stated: dict[str, Any] | None = None, out: Console | None = None) -> Proposal:
    """The proposal with every question answered and confirmed by whoever sits at the terminal.

    Columns of which nothing is known are asked for too; ``ignore`` leaves them out. stated: the mapping as far as it is
    there already.
    """
    out = out or Console(highlight=False)
    mapping = copy.deepcopy(stated or {})
    proposal = understand(logged, mapping)
    tell_proposal(proposal, out)
    if any(q.path[-1] == "at" for q in (*proposal.missing, *proposal.unknown)):
        out.print(DRAWING, markup=False)
    while True:
        questions = [*proposal.missing, *proposal.unknown]
        if questions:
            proposal = _ask(logged, mapping, questions[0], out)
            continue
        tell_proposal(proposal, out)
        if Confirm.ask("Is this right?", console=out, default=True):
            return proposal
        proposal = _ask(logged, mapping, _correction(logged, proposal, out), out)


def _ask(logged: LoggedTables, mapping: dict[str, Any], question: Question, out: Console) -> Proposal:
    """Ask one question until the answer can be used; a machine or belt may be given by a name that is known."""
    kind = {"machine": "rig", "belt": "belt"}.get(question.path[0])
    hint = f", or the name of a {kind}: {', '.join(group_names(kind))}" if kind else ""
    while True:
        out.print(f"[bold]{escape(question.text)}[/bold] (e.g. {escape(question.example + hint)})", soft_wrap=True)
        default: Any = question.proposed or ...
        numbers = {p.removeprefix("point_"): p for p in question.options if p.startswith("point_")}
        choices = [*question.options, *numbers] or None
        text = str(Prompt.ask("  ", console=out, choices=choices, default=default)).strip()
        text = numbers.get(text, text)
        trial = copy.deepcopy(mapping)
        if kind and text in group_names(kind):
            trial[question.path[0]] = text
        else:
            question.put(trial, text)
        try:
            proposal = understand(logged, trial)
        except BeltError as error:
            out.print(f"[red]{escape(str(error))}[/red]", soft_wrap=True)
            continue
        mapping.clear()
        mapping.update(trial)
        return proposal


def _correction(logged: LoggedTables, proposal: Proposal, out: Console) -> Question:
    """The question about a column or run that was understood wrongly."""
    columns, runs = list(logged.columns), [r.name for r in proposal.complete().runs]
    out.print(escape(f"columns: {', '.join(columns)}; runs: {', '.join(runs)}"), soft_wrap=True)
    name = Prompt.ask("Which column or run is wrong?", console=out, choices=[*columns, *runs], show_choices=False)
    if name in columns:
        key = Prompt.ask("What of it?", console=out, choices=["role", "unit", "at", "sign", "factor", "name"])
        examples = {"role": ", ".join(ROLES), "at": "point_1 .. point_4", "sign": "-1", "factor": "0.001"}
        return Question(path=("columns", name, key), text=f"{name}: {key}?", example=examples.get(key, "mm"))
    choices = ["tension", "yaw", "speed", "direction", "yaw_at", "start"]
    key = Prompt.ask("What of it?", console=out, choices=choices)
    return Question(path=("runs", name, key), text=f"{name}: {key}?", example="with its unit, as 10 N/mm2")
