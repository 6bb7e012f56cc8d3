"""Two versions of the diagnosis on the same campaigns: ``python -m studies.two_versions count=200 workers=64``.

Campaigns whose answers by an earlier version are stored, or a sample of them, are drawn and answered again in parallel
processes; one file each is kept in ``folder``, so that a stopped run goes on. ``against`` is the folder of the same
command run with another checkout, whose answers then count as the earlier ones. The table counts what each version had
right, and how likely so uneven a split is by chance (McNemar's test, exact); every changed answer has a line; a second
table, and reliability.png, say what the probabilities are worth.
"""

import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from belt_sim.api.inference import diagnose
from belt_sim.io import read_json, write_json
from belt_sim.jax_setup import cores
from belt_sim.results.files import diagnosis_json
from studies.application import application
from studies.challenge.pool import share
from studies.challenge.registry import source
from studies.challenge.report import OWN, by_probability, draw_reliability, read_stored, table
from studies.challenge.score import ScoredCase, score_case

PATIENCE = 1800.0  # [s] that one campaign may take
HEAD = ("hidden", "campaigns", "both right", "earlier alone", "now alone", "neither", "p (McNemar)")
KINDS = {
    "nothing": "nothing",
    "library": "one effect",
    "two": "two effects",
    "outside": "not in the library",
    "dirty": "damaged data",
    "below_noise": "below the noise",
}


def two_versions(config: dict[str, Any]) -> None:
    """Answer the campaigns that the configuration names, and print the table of all in the folder."""
    folder = Path(config["folder"]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    earlier = {(c.source, c.seed): c for s in read_stored(Path(config["stored"])) if s.about["ablation"] == OWN
               for c in s.cases}  # fmt: skip
    todo = [(*key, folder) for key in sample(list(earlier), config) if not _file(*key, folder).exists()]
    if config["against"]:
        rows_there = [read_json(p) for p in sorted(Path(config["against"]).glob("*.json"))]
        earlier = {(c["source"], c["seed"]): ScoredCase.from_row(c) for c in rows_there}
    for task, trouble in share(todo, answer, config["workers"] or cores(), limit=PATIENCE):
        print(f"{_file(*task)} {trouble}", flush=True)
    found = [ScoredCase.from_row(read_json(p)) for p in sorted(folder.glob("*.json"))]
    cases = [(earlier[c.source, c.seed], c) for c in found if (c.source, c.seed) in earlier]
    print(table(HEAD, rows((is_right(a), is_right(b), a.kind) for a, b in cases)))
    for a, b in cases:
        if (a.verdict, sorted(a.named)) != (b.verdict, sorted(b.named)):
            said = [f"{c.verdict} {', '.join(sorted(c.named)) or '-'} ({c.outcome})" for c in (a, b)]
            print(f"{a.source} {a.seed} hides {', '.join(a.hidden or a.unknown) or a.kind}: {said[0]} -> {said[1]}")
    sure = [sum(any(p >= 0.9 for p in c.false_names.values()) for c in version) for version in zip(*cases, strict=True)]
    print(by_probability([now for _, now in cases]))
    draw_reliability(folder / "reliability.png", [now for _, now in cases])
    seconds = [sum(c.seconds or 0.0 for c in version) for version in zip(*cases, strict=True)]
    print(
        f"sure and wrong: {sure[0]} earlier, {sure[1]} now, of {len(cases)}; CPU s: {seconds[0]:.0f}, {seconds[1]:.0f}"
    )


def sample(there: Sequence[tuple[str, int]], config: Mapping[str, Any]) -> list[tuple[str, int]]:
    """Return ``count`` stored campaigns (source, seed): of one source from first_seed on, or of all by chance."""
    if config["source"] != "stored":
        first = int(config["first_seed"])
        return [
            key
            for key in sorted(there)
            if key[0] == config["source"] and key[1] in range(first, first + config["count"])
        ]
    drawn = np.random.default_rng(int(config["first_seed"])).permutation(len(there))
    return [sorted(there)[k] for k in drawn[: int(config["count"])]]


def answer(task: tuple[str, int, Path]) -> None:
    """Answer one campaign and keep what it scored."""
    write_json(_file(*task), scored_answer(*task[:2]))


def _file(name: str, seed: int, folder: Path) -> Path:
    return folder / f"{name}_{seed}.json"


def scored_answer(name: str, seed: int) -> Mapping[str, Any]:
    """The scored answer of the present version."""
    campaign, truth = source(name)(seed)
    begun = time.process_time()
    answer = diagnosis_json(diagnose(campaign, truth.base, advise=False, progress=lambda replicates, stage: None))
    spent = {"answer": time.process_time() - begun}
    result = {"seed": seed, "source": name, "truth": vars(truth), "answer": answer, "seconds": spent}
    return score_case(result).row()


def is_right(case: ScoredCase) -> bool:
    """Whether an answer is right, up to what it says itself that it cannot tell apart."""
    return case.outcome in ("right", "alias")


def rows(found: Iterable[tuple[bool, bool, str]]) -> Iterator[tuple[str, ...]]:
    """A line a kind: how often both versions are right, one alone, none, and p."""
    counts = Counter(found)
    for kind, words in KINDS.items():
        both, old, new, none = (
            counts[a, b, kind] for a, b in ((True, True), (True, False), (False, True), (False, False))
        )
        if many := both + old + new + none:
            p = binomtest(old, old + new).pvalue if old + new else 1.0
            yield (words, *map(str, (many, both, old, new, none)), f"{p:.2g}")


if __name__ == "__main__":
    application("two_versions", two_versions)
