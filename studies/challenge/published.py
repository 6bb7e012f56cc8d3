"""The files of facts in which challenges are published: written and read."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from belt_sim.provenance import provenance
from studies.challenge.facts import Facts, facts_of

FACTS = "belt-challenge-facts/1"
_SENTENCE = 160  # characters that are kept of an answer's sentence, of its law, and of why it is wrong
#: what another answer to the same campaign changes
_OF_AN_ANSWER = ("verdict", "named", "aliases", "outcome", "covered", "removed")


@dataclass(frozen=True, kw_only=True)
class Published:
    """One challenge: how it was run, its facts, and the facts of other methods on the same campaigns."""

    about: dict[str, Any]
    rows: list[Facts]
    others: dict[str, list[Facts]]

    @property
    def code(self) -> str:
        """Commits of the code that answered."""
        return ", ".join(c[:10] for c in self.about["commits"])

    @property
    def unanswered(self) -> list[int]:
        """Seeds between the first and the last that have no answer."""
        first, last = self.about["seeds"]
        return sorted(set(range(first, last + 1)) - {f.seed for f in self.rows})


def as_text(results: Sequence[Mapping[str, Any]], drawn: Iterable[int] = ()) -> str:
    """Facts of results as JSON, a campaign a line, so that a change shows as one; drawn: seeds of campaigns that were
    sealed, answered or not."""
    results = sorted(results, key=lambda r: r["seed"])
    seeds = [*(r["seed"] for r in results), *drawn]
    about = {name: results[0][name] for name in ("source", "ablation", "bootstraps")}
    about |= {"seeds": [min(seeds), max(seeds)], "campaigns": len(results)}
    about |= {"commits": sorted({str(r["commit"]) for r in results}), "versions": provenance()["versions"]}
    lines = ",\n".join(json.dumps(_row(r), allow_nan=False) for r in results)
    head = json.dumps({"schema": FACTS, **about}, allow_nan=False)
    return f'{head[:-1]}, "rows": [\n{lines}\n]}}\n'


def _row(result: Mapping[str, Any]) -> dict[str, Any]:
    facts = facts_of(result)
    words = {name: said[:_SENTENCE] for name in ("sentence", "discovered", "why") if (said := getattr(facts, name))}
    row = replace(facts, **words).row()
    if result["truth"] is None or facts.verdict == "crash" or "crash" in (result.get("others") or {"crash": ""}):
        return row
    others = {name: facts_of(result, answer).row() for name, answer in result["others"].items()}
    return row | {"others": {n: {k: o[k] for k in _OF_AN_ANSWER if k in o} for n, o in others.items()}}


def read_published(folder: Path) -> list[Published]:
    """Every file of facts in a folder, by name."""
    contents = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
    return [_published(c) for c in contents if c.get("schema") == FACTS]


def _published(content: dict[str, Any]) -> Published:
    rows: list[Facts] = []
    others: dict[str, list[Facts]] = {}
    for row in content.pop("rows"):
        answers = row.pop("others", {})
        rows.append(Facts(**row))
        truth = {
            k: v
            for k, v in row.items()
            if k not in (*_OF_AN_ANSWER, "advice", "promised", "discovered", "place", "law", "why", "p")
        }
        for name, other in answers.items():
            others.setdefault(name, []).append(Facts(**truth | other))
    return Published(about=content, rows=rows, others=others)
