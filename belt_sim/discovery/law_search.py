"""The search for unknown laws as a diagnosis asks for it (``belt_sim.diagnosis.examine``)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby

import numpy as np

from belt_sim.diagnosis.decide import LawEvidence, UnknownEvidence
from belt_sim.diagnosis.examine import LawResult, Matters
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.discovery.linear_search import (
    TERM,
    RankedLaws,
    ScoredLaw,
    distinct_families,
    exponents_of,
    single_term_laws,
)
from belt_sim.discovery.search_data import LatentInput, SearchData, Spectra, has_many_readings, search_data_of
from belt_sim.discovery.selection import search_law
from belt_sim.discovery.words import describe_discovery

LAWS = 12  # that are compared in the linear range


@dataclass(frozen=True)
class LawSearch:
    """The search; tell: hears what is being done; spectra: as in ``latent_inputs``; begun: the data and latent inputs
    beside sets of effects that only add to the readings, for a law may be asked for beside these."""

    tell: Callable[[str], None] = lambda text: None
    spectra: Spectra = field(default_factory=dict)
    begun: dict[frozenset[str], tuple[SearchData, list[LatentInput]]] = field(default_factory=dict)

    def evidence_of_unknown(self, bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> UnknownEvidence:
        """What is seen beside a fit in the linear range."""
        data = search_data_of(bench, fit, among, self.spectra)
        found, latent_inputs = unknown_evidence(data)
        data.forget_inputs()
        data.design.cache_clear()  # a law is seldom asked for
        if all(c.is_additive() for c in bench.forward.classes if c.id in fit.ids):
            self.begun[frozenset(fit.ids)] = data, latent_inputs
        return found

    def law(self, bench: Workbench, fit: Fit, matters: Matters = lambda laws: True, most: float = np.inf) -> LawResult:
        """The law of what is seen beside a fit, with its joint fit; matters, most: as in ``LawFinder``."""
        data, latent_inputs = self.begun.pop(frozenset(fit.ids), (None, None))
        if data is None or data.bench is not bench or data.fit is not fit:
            data, latent_inputs = search_data_of(bench, fit, spectra=self.spectra), None
        pair = LawEvidence(gain=most, cost=TERM, sizes=2)
        outcome = search_law(
            data, self.tell, latent_inputs=latent_inputs, pairs=matters([pair]),
            matters=lambda some: matters([*map(law_evidence, some)]),
        )  # fmt: skip
        data.forget_inputs()
        result, made = LawResult(partial(describe_discovery, outcome)), outcome.best
        if made is None:
            return result
        law = law_evidence(ScoredLaw(made.scored.law, made.gain, made.worth))
        return replace(result, law=law, fit=made.fit, bench=made.bench)


def unknown_evidence(data: SearchData) -> tuple[UnknownEvidence, list[LatentInput]]:
    """The evidence of latent inputs and of laws of one term, in the linear range; and these inputs, by evidence.

    A latent input at one sensor that differs from run to run is no law: it is that instrument's wander.
    """
    by_kind = [data]
    if has_many_readings(data.bench):  # what a kind of place needs is dropped before the next
        kinds = groupby(data.places, key=lambda place: (place.kind, place.is_carried))
        by_kind = [replace(data, places=tuple(some)) for _, some in kinds]
    ranked, latent_inputs = list[RankedLaws](), list[LatentInput]()
    for some in by_kind:
        ranked.append(single_term_laws(some))
        latent_inputs += some.latent_inputs
    together = (np.concatenate([getattr(r, name) for r in ranked]) for name in ("gain", "score"))
    ones = RankedLaws([table for r in ranked for table in r.tables], *together)
    latent_gains = [c.gain for c in latent_inputs if not (c.place.kind == "sensor" and c.pool == "each run")]
    evidence = UnknownEvidence(
        ids=frozenset(data.fit.ids),
        courses=np.array(latent_gains),
        laws=tuple(law_evidence(s) for s in distinct_families(ones, LAWS)),
        tried=max(len(ones.gain) / len(exponents_of(data)), 1.0),
    )
    return evidence, sorted(latent_inputs, key=lambda c: -c.gain)


def law_evidence(scored: ScoredLaw) -> LawEvidence:
    """A law as the table of evidence has it."""
    sizes = sum(t.sizes for t in scored.law.terms)
    return LawEvidence(gain=scored.gain, cost=scored.gain - scored.score, sizes=sizes)
