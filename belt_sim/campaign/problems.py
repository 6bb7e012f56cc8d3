"""What is wrong with a campaign folder: one line a problem, with its place and its remedy."""

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from belt_sim.errors import BeltError

#: Problems that an error prints before it only counts the rest.
MOST_SHOWN = 20
#: Characters of a wrong value that are quoted.
LONGEST_VALUE = 40


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One violation: file, line (from 1; None: the whole file), what is named, its value, what to do."""

    file: str
    line: int | None = None
    name: str = ""
    value: object = None
    unit: str = ""
    remedy: str

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        subject = _plain(self.name)
        if self.value is not None:
            shown = " ".join(part for part in (quote(self.value), _plain(self.unit)) if part)
            subject = f"{subject} = {shown}" if subject else shown
        return ": ".join(part for part in (_plain(place), subject, _plain(self.remedy)) if part)


class CampaignError(BeltError):
    """A campaign folder that cannot be used; ``problems`` holds every violation found in it."""

    def __init__(self, problems: list[Problem]) -> None:
        self.problems = problems
        lines = [str(problem) for problem in problems[:MOST_SHOWN]]
        if len(problems) > MOST_SHOWN:
            lines.append(f"... and {len(problems) - MOST_SHOWN} more")
        super().__init__("\n".join(lines))


def refusal(file: object, remedy: str, **where: Any) -> CampaignError:
    """The error of one problem with a file; where: its line, name, value and unit."""
    return CampaignError([Problem(file=str(file), remedy=remedy, **where)])


def shortlist(items: Iterable[object], most: int = 5) -> str:
    """The first few items, with dots for the rest: 3, 7, 8, 12, 40 ..."""
    shown = [str(item) for item in items]
    return ", ".join(shown[:most]) + (" ..." if len(shown) > most else "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """The nearest known word as a remedy, or the list of all of them."""
    known = list(dict.fromkeys(known))
    lower = {k.lower(): k for k in known}
    near = difflib.get_close_matches(word.lower(), list(lower), n=1, cutoff=0.6)
    near = near or [k for k in lower if word and k.startswith(word.lower())]
    if near:
        return f"did you mean {lower[near[0]]}?"
    return f"use one of {', '.join(known)}" if known else "nothing is known by that name here"


def quote(value: object) -> str:
    """A value as one short printable line."""
    text = f"{value:.15g}" if isinstance(value, float) else str(value)
    text = _plain(text)
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def _plain(text: str) -> str:
    """The text on one line, with anything unprintable written as an escape."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
