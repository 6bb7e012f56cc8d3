"""A diagnosis from end to end: sets of effects are fitted, what is beyond them is sought, one decision is made."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from belt_sim.analytic.composition import Composition
from belt_sim.campaign import Campaign, Suspicion, case_of, suspicions
from belt_sim.diagnosis.decision.decide import Decision, decide
from belt_sim.diagnosis.decision.policy import POLICY, Policy
from belt_sim.diagnosis.decision.table import EvidenceTable, Ids
from belt_sim.diagnosis.errors.misreadings import find_faults, free_zeros
from belt_sim.diagnosis.evidence import LawFinder, LawResult, gather, search_sets
from belt_sim.diagnosis.fits.belt_starts import find_starts
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.linearisation import linearise
from belt_sim.diagnosis.fits.workbench import Workbench, workbench
from belt_sim.diagnosis.readings.sensor_places import first_place_inside_span, shapes_a_span
from belt_sim.diagnosis.search.best_first import Search
from belt_sim.effects.base import Effect

BOOTSTRAPS = 100


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What was found, with everything that was tried.

    bench, nothing: the campaign laid out at the base model, and the fit of no effect there; search: joint fits about
    the likeliest set; named: the joint fit of the effects that are named; law: what the search for laws found.
    """

    bench: Workbench
    nothing: Fit
    search: Search
    table: EvidenceTable
    decision: Decision
    named: Fit
    suspicions: tuple[Suspicion, ...]
    policy: Policy = POLICY
    law: LawResult | None = None

    @property
    def fitted_bench(self) -> Workbench:
        """The campaign laid out at the named effects."""
        return self.search.fits.bench


def examine(
    campaign: Campaign,
    model: Composition,
    classes: Sequence[type[Effect]],
    *,
    bootstraps: int = BOOTSTRAPS,
    seed: int = 0,
    doubts: Sequence[Suspicion] = (),
    checked: bool = False,
    laws: LawFinder | None = None,
    policy: Policy = POLICY,
    tell: Callable[[str], None] = lambda text: None,
) -> Findings:
    """Which of ``classes`` the ``model`` lacks, judged on ``campaign``.

    bootstraps: campaigns simulated with nothing missing; doubts: about the sheet; checked: data and sheet are right,
    whatever looks wrong; laws: the search for laws that no effect of the library is; tell: hears what is being done.
    Raises InputError when the campaign has no signals, FitError when a larger set fits worse than a smaller one.
    """
    tell("laying out the campaign")
    tried = [c for c in classes if model.refusal(c) is None and is_long_enough(campaign, c)]
    if first_place_inside_span(campaign.signals):
        tried = [c for c in tried if not shapes_a_span(c)]
    of_data = suspicions(campaign)
    bench, nothing = _lay_out(free_zeros(campaign, of_data), model, tried)
    suspect = (*doubts, *find_faults(bench, nothing.values, of_data))
    if checked:
        suspect = tuple(replace(s, severity="look") for s in suspect)
    if (freed := free_zeros(bench.campaign, suspect)).signals != bench.campaign.signals:
        bench, nothing = _lay_out(freed, model, tried)
    damaged = any(s.severity == "stop" for s in suspect)
    if damaged:  # nothing is added: only what is there is judged
        search = Search(bench, linearise(bench, nothing, ()), nothing, 1.0, policy)
        table = replace(search.table(), damaged=True)
    else:
        linearisation = linearise(bench, nothing, [c.id for c in tried])
        if (turned := find_starts(bench, linearisation)) is not None:
            bench, nothing = _lay_out(turned, model, tried)
            linearisation = linearise(bench, nothing, [c.id for c in tried])
        search = search_sets(bench, linearisation, policy, (bootstraps, seed), tell)
        tell("looking for what is beyond the library")
        table = gather(search, nothing, bench, laws, policy)
    decision, found = decide(table, policy), dict[Ids, LawResult]()
    if laws is not None and not damaged and decision.suspects_something_unknown(policy):
        tell("looking for the law of what is left")
        found = _find_laws(search, table, decision, laws)
        decision = decide(table := _add_laws(table, found), policy)
    named = search.fits.fit(tuple(decision.named))
    return Findings(
        bench=bench, nothing=nothing, search=search, table=table, decision=decision, named=named, policy=policy,
        suspicions=tuple(suspect), law=found.get(frozenset(named.ids)) if decision.tells_of_unknown else None,
    )  # fmt: skip


def _lay_out(campaign: Campaign, model: Composition, classes: Sequence[type[Effect]]) -> tuple[Workbench, Fit]:
    """The campaign laid out at the base model, and the fit of no effect there."""
    bench = workbench(campaign, model, classes)
    return bench, bench.fit([bench.start((), bench.forward.null())])[0]


def _find_laws(search: Search, table: EvidenceTable, decision: Decision, laws: LawFinder) -> dict[Ids, LawResult]:
    """The laws beside nothing, and beside the effects that may stay with something unknown.

    A crooked edge takes on part of an unknown that comes round with the belt: only a law alone tells that it is none.
    """
    beside = frozenset(decision.likeliest_unknown.effects) & table.additive
    fits = {ids: search.fits.fit(tuple(sorted(ids))) for ids in {beside, frozenset()}}
    return {ids: laws.law(search.fits.bench, fit) for ids, fit in fits.items()}


def _add_laws(table: EvidenceTable, found: Mapping[Ids, LawResult]) -> EvidenceTable:
    """The table with the evidence of laws in the march."""
    in_march = {ids: f.law for ids, f in found.items() if f.law is not None}
    rows = [replace(b, laws=(*b.laws, in_march[b.ids])) if b.ids in in_march else b for b in table.unknown]
    return replace(table, unknown=tuple(rows))


def is_long_enough(campaign: Campaign, cls: type[Effect]) -> bool:
    """Whether a record of the campaign covers the belt revolutions that an effect needs to be recognised."""
    longest = max((run.travel[-1] for run in campaign.runs if len(run.travel)), default=0.0)
    return longest >= cls.min_revolutions * case_of(campaign, campaign.runs[0]).rig.belt_length
