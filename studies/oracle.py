"""What nobody could do better: python -m studies.oracle first_seed=9930000 count=133 prints a Markdown table.

Blind campaigns of the challenge, answered by an oracle that knows how many effects are hidden, and takes of all sets of
that size the likeliest, by the diagnosis's own table of evidence. What is hidden is always among its sets, whether or
not a search would have met it. Where another set explains the readings better than what is hidden, no method can tell
but by luck; where a smaller one explains as much, nothing shows that there was one effect more.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from belt_sim.api.resolve import candidates_of, fitted_model
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.decision.decide import explanations
from belt_sim.diagnosis.decision.policy import POLICY
from belt_sim.diagnosis.decision.table import EvidenceTable, Ids
from belt_sim.diagnosis.examine import search_sets
from belt_sim.diagnosis.fits.linearisation import linearise
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.diagnosis.search import add_fits, add_pairs, tabulate
from studies.application import application
from studies.challenge.registry import source
from studies.challenge.report import table, with_interval
from studies.challenge.targets import SIZES, size_class

PAIRS = 12  # that promise most in the linear range, fitted
SIMULATED = 100  # campaigns with nothing missing
KINDS = {"library": 1, "two": 2}


@dataclass(frozen=True)
class Bound:
    """One campaign: kind; size of the smallest hidden effect; first: what is hidden is the likeliest set of its size;
    held: it is among those that hold 95 % of the probability, which are ``told`` in number; pays: it explains more than
    the best set of one effect fewer, and pays what that effect's numbers cost and the odds of one fault more.
    """

    seed: int
    kind: str
    size: float
    first: bool
    held: bool
    told: int
    pays: bool


def oracle(config: dict[str, Any]) -> None:
    """Ask it about every campaign with something of the library hidden, and print what it knows."""
    found = []
    for seed in range(int(config["first_seed"]), int(config["first_seed"]) + int(config["count"])):
        campaign, truth = source(config["source"])(seed)
        sizes = [e["d"] for e in truth.effects if e.get("d") is not None]
        if truth.kind not in KINDS or not sizes or size_class(min(sizes)) is None:
            continue
        hidden = frozenset(e["id"] for e in truth.effects)
        evidence = evidence_table(campaign, truth.base, hidden, seed)
        if evidence is not None:
            found.append(bound(evidence, hidden, seed, truth.kind, min(sizes)))
            print(found[-1], flush=True)
    print("\n" + table(HEAD, lines(found)))


def evidence_table(campaign: Campaign, base: str, hidden: Ids, seed: int) -> EvidenceTable | None:
    """The table of the diagnosis's search, of what is hidden, and of more pairs; None where that is no candidate."""
    model = fitted_model(base)
    bench = workbench(campaign, model, candidates_of(None, model))
    if not hidden <= {c.id for c in bench.forward.classes}:
        return None
    nothing = bench.fit([bench.start((), bench.forward.null())])[0]
    near = linearise(bench, nothing, [c.id for c in bench.forward.classes])
    search = search_sets(bench, near, (SIMULATED, seed), lambda text: None)
    if len(hidden) > 1:
        search = add_pairs(search, PAIRS)
    return tabulate(add_fits(search, [tuple(sorted(hidden))]))


def bound(evidence: EvidenceTable, hidden: Ids, seed: int, kind: str, size: float) -> Bound:
    """What the oracle knows of one campaign."""
    every = [e for e in explanations(evidence, POLICY) if not e.refused or frozenset(e.effects) == hidden]
    own = next(e for e in every if frozenset(e.effects) == hidden)
    wanted = sorted((e for e in every if len(e.effects) == len(hidden)), key=lambda e: -e.log_posterior)
    weights = np.exp([e.log_posterior - wanted[0].log_posterior for e in wanted])
    before = np.cumsum([0.0, *weights])[:-1]
    held = [e for e, sum_before in zip(wanted, before, strict=True) if sum_before < POLICY.credible * weights.sum()]
    smaller = max((e.log_posterior for e in every if len(e.effects) < len(hidden)), default=0.0)
    return Bound(seed, kind, size, wanted[0] is own, own in held, len(held), own.log_posterior > smaller)


HEAD = ("hidden", "likeliest of its size", "among 95 %", "sets in these", "pays for its last", "pays, and among 95 %")


def lines(found: Sequence[Bound]) -> Iterator[tuple[str, ...]]:
    """A row for every kind and size."""
    for kind, words in zip(KINDS, ("one effect", "two effects"), strict=True):
        for size in SIZES:
            mine = [b for b in found if b.kind == kind and size_class(b.size) == size]
            flags = [[b.first for b in mine], [b.held for b in mine], [b.pays for b in mine]]
            both = [b.held and b.pays for b in mine]
            if mine:
                first, held, pays = map(with_interval, flags)
                told = f"{np.mean([b.told for b in mine]):.1f}"
                yield (f"{words}, d = {size}", first, held, told, pays, with_interval(both))


if __name__ == "__main__":
    application("oracle", oracle)
