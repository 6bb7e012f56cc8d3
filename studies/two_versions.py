"""Two versions of the diagnosis on the same campaigns: ``python -m studies.two_versions first_seed=9960020 count=20``.

Campaigns whose answers by an earlier version are stored are drawn and answered again; one file each is kept in
``folder``, so that a stopped run goes on. The table counts what each version had right, and how likely so uneven a
split is by chance (McNemar's test, exact); a second one, and reliability.png, what the probabilities said are worth.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from belt_sim.api.inference import diagnose
from belt_sim.files import read_json, write_json
from belt_sim.results.json import diagnosis_json
from studies.application import application
from studies.challenge.registry import source
from studies.challenge.report import OWN, by_probability, draw_reliability, read_stored, table
from studies.challenge.score import ScoredCase, score_case

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
    folder = Path(config["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    earlier = {(c.source, c.seed): c for s in read_stored(Path(config["stored"])) if s.about["ablation"] == OWN
               for c in s.cases}  # fmt: skip
    first = int(config["first_seed"])
    for seed in range(first, first + int(config["count"])):
        file = folder / f"{config['source']}_{seed}.json"
        if (config["source"], seed) in earlier and not file.exists():
            write_json(file, scored_answer(config["source"], seed))
            print(file, flush=True)
    found = [read_json(p) for p in sorted(folder.glob("*.json"))]
    cases = [(earlier[c["source"], c["seed"]], ScoredCase.from_row(c)) for c in found]
    print(table(HEAD, rows((is_right(a), is_right(b), a.kind) for a, b in cases)))
    sure = [sum(any(p >= 0.9 for p in c.false_names.values()) for c in version) for version in zip(*cases, strict=True)]
    print(by_probability([now for _, now in cases]))
    draw_reliability(folder / "reliability.png", [now for _, now in cases])
    print(f"sure and wrong: {sure[0]} earlier, {sure[1]} now, of {len(cases)}")


def scored_answer(name: str, seed: int) -> Mapping[str, Any]:
    """The scored answer of the present version."""
    campaign, truth = source(name)(seed)
    answer = diagnosis_json(diagnose(campaign, truth.base, advise=False, progress=lambda replicates, stage: None))
    result = {"seed": seed, "source": name, "truth": vars(truth), "answer": answer, "seconds": {}}
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
