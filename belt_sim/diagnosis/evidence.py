"""The table of evidence: joint fits of sets of effects, what is seen beyond them, and what else may be."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from belt_sim.analytic.model import MODELS
from belt_sim.diagnosis.decision.decide import explanations, would_show
from belt_sim.diagnosis.decision.policy import Policy
from belt_sim.diagnosis.decision.table import EvidenceTable, Ids, LawEvidence, OtherModel, UnknownEvidence
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.linearisation import Linearisation
from belt_sim.diagnosis.fits.null_simulation import chance_inflation
from belt_sim.diagnosis.fits.workbench import Workbench, predict_alone
from belt_sim.diagnosis.readings.sensor_places import shows_places
from belt_sim.diagnosis.search.best_first import Search, row_of
from belt_sim.diagnosis.search.joint_fits import Trial
from belt_sim.results.discovery import Discovery

BASE_MODELS = ("beam_th1", "beam_th2", "strip", "strip_lift_off")
DESCRIBED = 0.8  # of the chi2 beyond noise: a base model that explains less leaves something unexplained itself


# What a search for laws beyond the library hands to the diagnosis, which does not import the search.


class LawResult(Protocol):
    """What a search has found beside a fit: perhaps a law."""

    @property
    def law(self) -> LawEvidence | None:
        """The law as the march has it; None where none describes what is there."""

    @property
    def fit(self) -> Fit | None:
        """The joint fit with the law; None where there is no law."""

    @property
    def bench(self) -> Workbench:
        """The workbench of that fit."""

    def describe(self, probability: float, config: object = None) -> Discovery:
        """The result; probability: that something unknown is there."""


class LawFinder(Protocol):
    """A search for laws beyond the library."""

    def evidence_of_unknown(self, bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> UnknownEvidence:
        """What is seen beside a fit in the linear range; among: effects of all fits that are looked at."""

    def law(self, bench: Workbench, fit: Fit) -> LawResult:
        """The law of what is seen beside a fit."""


def search_sets(
    bench: Workbench, linearisation: Linearisation, policy: Policy, chance: tuple[int, int], tell: Callable[[str], None]
) -> Search:
    """All sets of effects that are worth a joint fit, about the likeliest of them.

    linearisation: about the fit of no effect; chance: how many campaigns are simulated with nothing missing, and their
    seed.
    """
    names, nothing = [c.id for c in bench.forward.classes], linearisation.fit
    tell("asking what chance does")
    search = Search(
        bench, linearisation, nothing, chance_inflation(bench, linearisation, nothing.values, names, *chance), policy
    )
    tell("fitting sets of effects")
    search.run()
    return search


def gather(search: Search, nothing: Fit, bench: Workbench, laws: LawFinder | None, policy: Policy) -> EvidenceTable:
    """The table of a finished search, with a row for every set beside which something unknown is looked for.

    nothing, bench: the fit of no effect, and the workbench on which the search began; laws: None where nobody looks
    beyond the library.
    """
    table = search.table()
    likeliest = explanations(table, policy)[0].effects  # another than in the search, where held-out data speak
    beside = [(), likeliest, *(tuple(i for i in likeliest if i != name) for name in likeliest)]
    if {frozenset(ids) for ids in beside} - {row.ids for row in table.rows}:
        search.fits.fit_all(beside)
        table = search.table()
    table = replace(
        table,
        additive=frozenset(c.id for c in bench.forward.classes if c.is_additive()),
        other_models=tuple(base_models(bench, nothing, search, frozenset(likeliest))),
    )
    if laws is None:
        return table
    visible = frozenset(t.id for t in search.fits.trials(()) if _would_show(t, search, table, policy))
    return replace(table, visible=visible, unknown=tuple(_unknown_evidence(search, beside, likeliest, laws, table)))


def _would_show(trial: Trial, search: Search, table: EvidenceTable, policy: Policy) -> bool:
    return would_show(row_of(search.fits.bench, trial.fit, checked=False), table, policy)


def _unknown_evidence(
    search: Search, sets: Sequence[Sequence[str]], likeliest: Sequence[str], laws: LawFinder, table: EvidenceTable
) -> Iterator[UnknownEvidence]:
    """What is seen beside those sets that have a row: beside nothing, and beside the likeliest, whole or less one."""
    there = {row.ids for row in table.rows}
    for ids in dict.fromkeys(map(tuple, sets)):
        if frozenset(ids) in there:
            yield laws.evidence_of_unknown(search.fits.bench, search.fits.fit(ids), likeliest)


def base_models(bench: Workbench, nothing: Fit, search: Search, likeliest: Ids) -> list[OtherModel]:
    """The other base models with nothing fitted, those that explain most of what this one does not.

    likeliest: effects; a model that is the base model with just these says the same, and is none.
    """
    asked = bench.forward.model
    beyond_noise = max(nothing.chi2 - float(np.isfinite(bench.fitted.y).sum()), 1e-9)
    others = [m for m in (MODELS[n] for n in BASE_MODELS if n != asked.name) if shows_places(bench.samples.signals, m)]
    found = []
    for model in others:
        values = predict_alone(bench.campaign, model)
        gain = nothing.chi2 - float(bench.metric.chi2(bench.fitted.y - values))
        same = likeliest and likeliest <= model.contains - asked.contains
        if np.isfinite(gain) and gain > DESCRIBED * beyond_noise and not same:
            chi2 = float(search.fits.bench.metric.chi2(bench.fitted.y - values))
            lateral = [k for k, s in enumerate(bench.samples.signals) if s.kind == "lateral"]
            rms = float(np.sqrt(np.nanmean((bench.samples.y - values)[:, lateral] ** 2)))
            found.append(OtherModel(name=f"model={model.name}", chi2=chi2, rms=rms, tried=len(others)))
    return found
