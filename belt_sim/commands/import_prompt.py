"""Asking in a terminal for what the files cannot say, and whether what was understood is right."""

import copy
from typing import Any

from rich.console import Console
from rich.prompt import Confirm, Prompt

from belt_sim.errors import BeltError
from belt_sim.importing.build import understand
from belt_sim.importing.sheets import known
from belt_sim.importing.types import ROLES, Logged, Proposal, Question
from belt_sim.reports.importing import tell_proposal


def asked(logged: Logged, stated: dict[str, Any] | None = None, out: Console | None = None) -> Proposal:
    """The proposal with every question answered and confirmed by whoever sits at the terminal.

    stated: the mapping as far as it is there already.
    """
    out = out or Console(highlight=False)
    mapping = copy.deepcopy(stated or {})
    proposal = understand(logged, mapping)
    while True:
        tell_proposal(proposal, out)
        if proposal.missing:
            proposal = _answered(logged, mapping, proposal.missing[0], out)
            while proposal.missing:
                proposal = _answered(logged, mapping, proposal.missing[0], out)
            continue
        if Confirm.ask("Is this right?", console=out, default=True):
            return proposal
        proposal = _corrected(logged, mapping, out)


def _answered(logged: Logged, mapping: dict[str, Any], question: Question, out: Console) -> Proposal:
    """Ask one question until the answer can be used."""
    while True:
        trial = copy.deepcopy(mapping)
        _put(trial, *_answer(question, out))
        try:
            proposal = understand(logged, trial)
        except BeltError as error:
            out.print(f"[red]{error}[/red]", soft_wrap=True)
            continue
        mapping.clear()
        mapping.update(trial)
        return proposal


def _answer(question: Question, out: Console) -> tuple[tuple[str, ...], str]:
    """Path and answer; machine and belt may be given by a name that is known."""
    first = question.path
    kind = {"machine": "rig", "belt": "belt"}.get(first[0])
    hint = f", or the name of a {kind}: {', '.join(known(kind))}" if kind else ""
    out.print(f"[bold]{question.text}[/bold] (e.g. {question.example}{hint})", soft_wrap=True)
    choices = list(question.options) or None
    default: Any = question.proposed or ...
    text = str(Prompt.ask("  ", console=out, choices=choices, default=default)).strip()
    return (first[:1], text) if kind and text in known(kind) else (first, text)


def _corrected(logged: Logged, mapping: dict[str, Any], out: Console) -> Proposal:
    """Another role, unit or place for one column, or another setting of one run."""
    columns = list(logged.columns)
    runs = list(mapping.get("runs", {}))
    name = Prompt.ask("Which column or run is wrong?", console=out, choices=[*columns, *runs])
    if name in columns:
        key = Prompt.ask("What of it?", console=out, choices=["role", "unit", "at", "sign", "name"])
        example = {"role": ", ".join(ROLES), "at": "point_1 .. point_4", "sign": "-1"}.get(key, "mm")
        question = Question(path=("columns", name, key), text=f"{name}: {key}?", example=example)
    else:
        key = Prompt.ask("What of it?", console=out, choices=["tension", "yaw", "speed", "direction", "yaw_at"])
        question = Question(path=("runs", name, key), text=f"{name}: {key}?", example="with its unit, as 10 N/mm2")
    return _answered(logged, mapping, question, out)


def _put(mapping: dict[str, Any], path: tuple[str, ...], answer: str) -> None:
    for key in path[:-1]:
        if not isinstance(mapping.get(key), dict):
            mapping[key] = {}
        mapping = mapping[key]
    mapping[path[-1]] = answer
