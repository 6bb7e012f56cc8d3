"""An import on its way: a logger's files, what they seem to say, and the answers given so far."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from belt_sim.campaign.marked_yaml import parse
from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.errors import BeltError
from belt_sim.importing import Logged, Proposal, Question, read, understand, write
from belt_sim.importing.sheets import known_names

Place = tuple[str, ...]  # keys in the mapping, from the outside in
GROUPS = {"machine": "rig", "belt": "belt"}  # what may be given by the name of one that is known
OF_RUN = ("tension", "yaw", "speed", "direction", "yaw_at")
OF_COLUMN = ("role", "unit", "at", "sign")


@dataclass
class Import:
    """Files as read, and what they mean with ``answers``; asked: questions that were put; said: what is wrong."""

    logged: Logged
    base: Mapping[str, Any]
    answers: dict[Place, str] = field(default_factory=dict)
    asked: dict[Place, Question] = field(default_factory=dict)
    proposal: Proposal | None = None
    said: list[str] = field(default_factory=list)

    def understand(self) -> None:
        """Try what is known so far; what cannot be is said, and the last that could be stays."""
        try:
            self.proposal = understand(self.logged, nested(self.base, self.answers))
            self.said = []
            self.asked |= {q.path: q for q in self.proposal.missing}
        except BeltError as error:
            self.said = str(error).splitlines()

    def answer(self, answers: Mapping[Place, Any]) -> None:
        """Take answers; a blank one takes back what was said. A machine given by its name needs no numbers."""
        for place, value in sorted(answers.items(), key=lambda pair: len(pair[0])):
            text = str(value).strip()
            if place[0] in GROUPS and len(place) == 1:
                self.answers = {p: a for p, a in self.answers.items() if p[0] != place[0]}
            if text and (len(place) == 1 or place[:1] not in self.answers):
                self.answers[place] = text
            else:
                self.answers.pop(place, None)
        self.understand()

    @property
    def files(self) -> list[Path]:
        """The files that were read."""
        return list(dict.fromkeys(table.file for table in self.logged.tables))

    @property
    def ready(self) -> bool:
        """Whether a campaign can be made."""
        return self.proposal is not None and self.proposal.campaign is not None and not self.said

    @property
    def questions(self) -> list[Question]:
        """Open and answered questions that have no place in the tables of columns and runs."""
        open_ = {q.path for q in self.proposal.missing} if self.proposal else set()
        return [
            q for place, q in self.asked.items() if (place in open_ or place in self.answers) and place[0] != "runs"
        ]

    @property
    def runs(self) -> list[str]:
        """Names of the runs that were found."""
        found = list(self.proposal.mapping.get("runs", {})) if self.proposal else []
        return list(dict.fromkeys([*found, *(place[1] for place in self.asked if place[0] == "runs")]))

    def setting(self, run: str, key: str) -> str:
        """What is known of a run, as text."""
        given = self.answers.get(("runs", run, key))
        stated = self.proposal.mapping.get("runs", {}).get(run, {}) if self.proposal else {}
        return given if given is not None else str(stated.get(key) or "")

    def known(self, group: str) -> list[str]:
        """Machines or belts that may be given by name."""
        return known_names(GROUPS[group])

    def write(self, folder: Path) -> Path:
        """Leave the campaign in ``folder``."""
        assert self.proposal is not None
        write(self.proposal, folder)
        return folder


def begin(paths: Sequence[Path], mapping: Mapping[str, Any] | None = None) -> Import:
    """Read the files; raises CampaignError, InputError."""
    base = dict(mapping or {})
    form = base.get("format")
    made = Import(read(paths, form if isinstance(form, Mapping) else None), base)
    made.understand()
    return made


def read_mapping(name: str, data: bytes) -> dict[str, Any]:
    """A dropped mapping.yaml as plain text values; raises CampaignError."""
    problems: list[Problem] = []
    marked = parse(data.decode("utf-8-sig", errors="replace"), name, problems)
    if marked is None or problems or not isinstance(marked.tree, dict):
        raise CampaignError(problems[:1] or [Problem(file=name, remedy="must begin with schema: belt-mapping/1")])
    return marked.tree


def nested(base: Mapping[str, Any], answers: Mapping[Place, str]) -> dict[str, Any]:
    """The mapping with the answers in their places."""
    whole = _copy(base)
    for place, text in answers.items():
        inner = whole
        for key in place[:-1]:
            if not isinstance(inner.get(key), dict):
                inner[key] = {}
            inner = inner[key]
        inner[place[-1]] = text
    return whole


def _copy(value: Any) -> Any:
    return {k: _copy(v) for k, v in value.items()} if isinstance(value, Mapping) else value
