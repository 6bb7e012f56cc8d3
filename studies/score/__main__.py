"""The score beside the stored answers: python -m studies.score count=20 prints the paired table.

Campaigns of stored files are drawn again by their seeds. What a campaign's table holds is kept in ``folder``, so that
another policy is judged in seconds.
"""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from belt_sim.files import write_json
from studies.application import application
from studies.challenge.facts import Facts, facts_of
from studies.challenge.published import read_published
from studies.challenge.sources import source
from studies.challenge.tables import table as as_markdown
from studies.score.decide import Decision, decide
from studies.score.gather import gather
from studies.score.policy import Policy
from studies.score.table import Table
from studies.score.table_json import as_json, from_json

HEAD = ("hidden", "campaigns", "both right", "stored answer alone", "score alone", "neither", "p (McNemar)")

#: kind, whether the stored answer is right, whether the score is
Pair = tuple[str, bool, bool]


def judge(config: dict[str, Any]) -> None:
    """Answer the campaigns that the configuration names, and print both answers side by side."""
    pairs, policy = Counter[Pair](), Policy(**(config["policy"] or {}))
    for old, truth, evidence in _each(config, policy):
        new = answered(old, truth, decide(evidence, policy))
        pairs[new.kind, old.right, new.right] += 1
        if config["each"]:
            print(
                f"{old.source} {old.seed} {old.kind} {old.hidden}: {old.outcome}, {old.verdict} {old.named}", flush=True
            )
            print(f"    score: {new.outcome}, {new.verdict} {new.named} {new.aliases}", flush=True)
    print(as_markdown(HEAD, list(paired(pairs))))


def answered(old: Facts, truth: dict[str, Any], decision: Decision) -> Facts:
    """The facts of a decision, by the rules of the challenge."""
    effects = [
        {"id": i, "probability": p, "parameters": {}, "confusable_with": list(decision.confusable.get(i, ()))}
        for i, p in decision.named.items()
    ]
    answer = {"verdict": str(decision.verdict), "effects": effects, "sentence": ""}
    return facts_of({"seed": old.seed, "source": old.source, "truth": truth, "answer": answer, "seconds": {}})


def paired(pairs: Counter[Pair]) -> Iterator[tuple[str, ...]]:
    """A line a kind: how often both are right, one alone, none; and how likely so uneven a split is by chance."""
    for kind in dict.fromkeys(kind for kind, *_ in pairs):
        both, old, new, none = (
            pairs[kind, a, b] for a, b in ((True, True), (True, False), (False, True), (False, False))
        )
        p = binomtest(old, old + new).pvalue if old + new else 1.0
        yield kind, *map(str, (both + old + new + none, both, old, new, none)), f"{p:.2g}"


def _each(config: dict[str, Any], policy: Policy) -> Iterator[tuple[Facts, dict[str, Any], Table]]:
    folder = Path(config["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    for p in read_published(Path(config["stored"])):
        if [p.about["source"], p.about["seeds"][0], p.about["ablation"]] in config["challenges"]:
            for old in p.rows[: config["count"]]:
                file = folder / f"{old.source}_{old.seed}.json"
                if not file.exists():
                    campaign, truth = source(old.source)(old.seed)
                    gathered = as_json(gather(campaign, truth.base, policy))
                    write_json(file, {"truth": asdict(truth), "table": gathered})
                kept = json.loads(file.read_text(encoding="utf-8"))
                yield old, kept["truth"], from_json(kept["table"])


if __name__ == "__main__":
    application("score", judge)
