"""What nobody could do better: python -m studies.oracle first_seed=9930000 count=133 prints a Markdown table.

Blind campaigns of the challenge, answered by an oracle that knows how many effects are hidden, and takes of all sets of
that size the likeliest, with the diagnosis's own readings, noise, refits and thresholds. What is hidden is always among
its sets, whether or not a search would have met it. Where another set explains the readings better than what is hidden,
no method can tell but by luck; where a smaller one explains as much, nothing shows that there was one effect more.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from belt_sim.api.resolve import candidates_of, fitted_model
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.answer.confusable import HELD
from belt_sim.diagnosis.choice.chance import chance_of
from belt_sim.diagnosis.choice.decide import Ids, one_more
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.choice.select import FAMILY_LEVEL
from belt_sim.diagnosis.fits.around import around
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.diagnosis.left_over.null import null_gains
from studies.application import application
from studies.challenge.registry import source
from studies.challenge.report import table, with_interval
from studies.challenge.targets import SIZES, size_class

BESIDE = 4  # best single effects beside which every other is tried
LINEAR = 12  # pairs that promise most in the linear range, refitted
LAST = 16  # sets that are compared about the likeliest
KINDS = {"library": 1, "two": 2}


@dataclass(frozen=True)
class Bound:
    """One campaign: kind; size of the smallest hidden effect; first: what is hidden is the likeliest set of its size;
    held: it is among those that hold 95 % of the probability, which are ``told`` in number; pays: it explains more than
    the best set of one effect fewer, by what chance gives that effect and by the odds of one fault more.
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
        evidence = laid_out(campaign, truth.base, int(config["bootstraps"]), seed)
        hidden = tuple(e["id"] for e in truth.effects)
        if set(hidden) <= set(evidence.names):
            found.append(bound(evidence, hidden, seed, truth.kind, min(sizes)))
            print(found[-1], flush=True)
    print("\n" + table(HEAD, lines(found)))


def laid_out(campaign: Campaign, base: str, bootstraps: int, seed: int) -> Refits:
    """A campaign as the diagnosis lays it out, with what chance reaches, before anything is chosen."""
    model = fitted_model(base)
    bench = workbench(campaign, model, candidates_of(None, model))
    fit = bench.fit([bench.start((), bench.forward.null())])[0]
    names = [c.id for c in bench.forward.classes]
    near = around(bench, fit, names)
    shapes = {n: near.shapes(bench, n) for n in names}
    null = null_gains(bench, shapes, fit.slopes, fit.values, count=bootstraps, seed=seed)
    chance = chance_of(bench, bench.samples.y - fit.values, seed + 1)
    return Refits(bench, null, null.critical(names, FAMILY_LEVEL), chance, near, fits={frozenset(): fit})


def bound(evidence: Refits, hidden: Ids, seed: int, kind: str, size: float) -> Bound:
    """What the oracle knows of one campaign."""
    fewer, wanted = (_likeliest(evidence, k) for k in (len(hidden) - 1, len(hidden)))
    key = frozenset(hidden)
    about = evidence.moved(tuple(wanted[0] if wanted else hidden))
    sets = list(dict.fromkeys([key, *wanted[:LAST]]))
    worth = {s: _worth(about, s) for s in sets if s == key or about.plausible(tuple(s))}
    units = {s: max(1.0, *(about.null.inflation(i) for i in s)) for s in worth}
    best = max(worth.values())
    weights = {s: float(np.exp((worth[s] - best) / (2.0 * units[s]))) for s in worth}
    ranked = sorted(weights, key=lambda s: -weights[s])
    before = np.cumsum([0.0, *(weights[s] for s in ranked)])[:-1]
    held = [s for s, sum_before in zip(ranked, before, strict=True) if sum_before < HELD * sum(weights.values())]
    smaller = max((_worth(about, s) for s in fewer[:LAST] if about.plausible(tuple(s))), default=0.0)
    pays = worth[key] - smaller > one_more(hidden) - one_more(hidden[1:])
    return Bound(seed, kind, size, ranked[0] == key, key in held, len(held), pays)


def _worth(evidence: Refits, ids: frozenset) -> float:
    """What a set explains above what chance would give it."""
    return evidence.gains([tuple(sorted(ids))])[0] - sum(map(evidence.threshold, ids))


def _likeliest(evidence: Refits, size: int) -> list[frozenset]:
    """Sets of a size that a machine could have, likeliest first: every effect, those beside the best, the best pairs by
    their columns.
    """
    if not size:
        return []
    worth: dict[frozenset, float] = {}
    singles = sorted(evidence.trials(()), key=lambda t: -t.score)
    if size == 1:
        return [frozenset([t.id]) for t in singles if t.plausible]
    for first in singles[:BESIDE]:
        for t in evidence.trials((first.id,)):
            if t.plausible:
                worth[frozenset((first.id, t.id))] = first.score + t.score
    by_columns = evidence.pairs_in_place(singles[0].id, np.inf)  # those with the best effect are there already
    new = [ids for ids in by_columns if frozenset(ids) not in worth][:LINEAR]
    for ids, gain in zip(new, evidence.gains(new), strict=True):
        if evidence.plausible(ids):
            worth[frozenset(ids)] = gain - sum(map(evidence.threshold, ids))
    return sorted(worth, key=lambda s: -worth[s])


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
