"""What an import would make of the files: the campaign, what is still to be answered, and what was done."""

from dataclasses import dataclass, field
from typing import Any

from belt_sim.campaign import Campaign
from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.intake.nouns import Logged


@dataclass(frozen=True, kw_only=True)
class Question:
    """Something that the files cannot say.

    path: keys in the mapping under which the answer stands; text: the question; example: how an answer looks; options:
    all possible answers, where there are few; proposed: a likely answer.
    """

    path: tuple[str, ...]
    text: str
    example: str
    options: tuple[str, ...] = ()
    proposed: str = ""

    @property
    def key(self) -> str:
        return ".".join(self.path)

    @property
    def problem(self) -> Problem:
        """The question as one line: what is missing and how to give it."""
        written = self.example
        for key in reversed(self.path):
            written = f"{_key(key)}: {written}" if key is self.path[-1] else f"{_key(key)}: {{{written}}}"
        choice = f" (one of {', '.join(self.options)})" if self.options else ""
        return Problem(file="mapping", name=self.key, remedy=f"{self.text}{choice}; give it as  {written}")


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and not key.isdigit() else f'"{key}"'


@dataclass(frozen=True, kw_only=True)
class ColumnUse:
    """What a column of the files became: role, unit, place, name of the signal; why: where that comes from."""

    table: str
    column: str
    role: str
    unit: str
    at: str = ""
    signal: str = ""
    sure: bool = False
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class NoiseRead:
    """What was read off one signal: white, wander, zero [SI], wander length [m], each with where it comes from."""

    white: float
    wander: float
    length: float
    zero: float
    white_from: str
    wander_from: str
    zero_from: str


@dataclass(frozen=True, kw_only=True)
class Proposal:
    """missing: questions without an answer yet; campaign: None while there are any that it cannot do without;
    mapping: everything that was used, so that the import can be repeated; noise: signal -> what was read off;
    comments: key of campaign.yaml -> remark to be written beside it; notes: what was done, in sentences.
    """

    logged: Logged
    columns: tuple[ColumnUse, ...]
    missing: tuple[Question, ...]
    campaign: Campaign | None
    mapping: dict[str, Any]
    noise: dict[str, NoiseRead] = field(default_factory=dict)
    comments: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def complete(self) -> Campaign:
        """The campaign; raises CampaignError with one line for every answer that is missing."""
        if self.campaign is None:
            raise CampaignError([q.problem for q in self.missing])
        return self.campaign
