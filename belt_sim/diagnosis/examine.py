"""A diagnosis from end to end: sets of effects are fitted, what is beyond them is sought, one decision is made; before
that, what looks wrong in the data is told."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations, groupby
from typing import Any, Protocol

import jax
import numpy as np

from belt_sim.campaign import Campaign, SignalSheet, Suspicion, case_of, suspicions
from belt_sim.campaign.kinematics import check_repeats
from belt_sim.campaign.quality import check_starts, counted_from_yaw, records_of
from belt_sim.campaign.types import first_place_inside_span
from belt_sim.case import Case
from belt_sim.diagnosis.decide import (
    POLICY,
    Decision,
    EvidenceTable,
    Ids,
    LawEvidence,
    OtherModel,
    UnknownEvidence,
    decide,
    explanations,
    needed_gain,
    would_show,
)
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.linearisation import Linearisation, chance_inflation, find_starts, linearise_effects
from belt_sim.diagnosis.noise import FREE_ZERO, Disagreement, metric_of, words_of
from belt_sim.diagnosis.samples import samples_of, shapes_a_span
from belt_sim.diagnosis.search import (
    NO_EFFECTS,
    Names,
    Search,
    add_fits,
    extend,
    row_of,
    run_search,
    start_from,
    tabulate,
)
from belt_sim.diagnosis.workbench import Workbench, expand_at_likely_settings, workbench
from belt_sim.effects.base import Effect
from belt_sim.errors import BeltError
from belt_sim.jax_setup import begin_in_thread, in_float64, map_in_threads
from belt_sim.line.hooks import as_driven
from belt_sim.line.spans import Composition
from belt_sim.model import BASE_MODELS, MODELS

BOOTSTRAPS = 100
MANY_READINGS = 4_000  # readings, from which memory counts for more than time: what is beyond sets is sought one by one
# of the chi2 beyond noise: a base model that explains less leaves something unexplained itself
DESCRIBED_BY_MODEL = 0.8


# What a search for laws beyond the library hands to the diagnosis, which does not import the search.


Matters = Callable[[list[LawEvidence]], bool]


@dataclass(frozen=True)
class LawResult:
    """What a search has found beside a fit.

    outcome: of the search, which its own room puts in words; law: as the march has it, with the joint fit and its
    workbench; None where no law describes what is there.
    """

    outcome: Any
    law: LawEvidence | None = None
    fit: Fit | None = None
    bench: Workbench | None = None


class LawFinder(Protocol):
    """A search for laws beyond the library."""

    def evidence_of_unknown(self, bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> UnknownEvidence:
        """What is seen beside a fit in the linear range; among: effects of all fits that are looked at."""

    def law(self, bench: Workbench, fit: Fit, matters: Matters, most: float) -> LawResult:
        """The law of what is seen beside a fit, with its joint fit; matters: whether laws would change what is decided;
        most: chi2 that a law may explain, less what its form costs."""


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What was found, with everything that was tried.

    bench, nothing: the campaign laid out at the base model, and the fit of no effect there; fitted_bench: laid out at
    the named effects; search: joint fits about the likeliest set; named: the joint fit of the effects that are named;
    law: what the search for laws found; rests_on: effect -> the run without which it would not be named, and which
    differs from its repeats.
    """

    bench: Workbench
    nothing: Fit
    fitted_bench: Workbench
    search: Search
    table: EvidenceTable
    decision: Decision
    named: Fit
    suspicions: tuple[Suspicion, ...]
    law: LawResult | None = None
    rests_on: Mapping[str, str] = field(default_factory=dict)


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
    tell: Callable[[str], None] = lambda text: None,
) -> Findings:
    """Which of ``classes`` the ``model`` lacks, judged on ``campaign``.

    bootstraps: campaigns simulated with nothing missing; doubts: about the sheet; checked: data and sheet are right,
    whatever looks wrong; laws: the search for laws that no effect of the library is; tell: hears what is being done.
    Raises InputError when the campaign has no signals.
    """
    tell("preparing the runs")
    tried = within_reach(campaign, model, classes)
    of_data = suspicions(campaign)
    bench, nothing = _lay_out(free_zeros(campaign, of_data), model, tried)
    repeats = check_repeats(campaign)
    suspect = (*repeats, *doubts, *find_faults(bench, nothing.values, of_data))
    if checked:
        suspect = tuple(replace(s, severity="look") for s in suspect)
    if (freed := free_zeros(bench.campaign, suspect)).signals != bench.campaign.signals:
        bench, nothing = _lay_out(freed, model, tried)
    found: dict[Ids, LawResult] = {}
    if any(s.severity == "stop" for s in suspect):  # nothing is added: only what is there is judged
        search = Search(bench=bench, linearisation=Linearisation(nothing, {}), fits={NO_EFFECTS: nothing})
        table = replace(tabulate(search), damaged=True)
        decision = decide(table, POLICY)
    else:
        linearisation = linearise_effects(bench, nothing, [c.id for c in tried])
        if (turned := find_starts(bench, linearisation)) is not None:
            bench, nothing = _lay_out(turned, model, tried)
            linearisation = linearise_effects(bench, nothing, [c.id for c in tried])
        tell("estimating false alarms")
        inflation = chance_inflation(bench, linearisation, bootstraps, seed)
        tell("fitting sets of effects")
        fits = {NO_EFFECTS: nothing}
        search = run_search(Search(bench=bench, linearisation=linearisation, inflation=inflation, fits=fits))
        tell("searching beyond the catalogue")
        del linearisation  # with the search before, which held it as well, it goes before anything is sought beyond
        search, table, beside = _add_singles(search)
        table = _gather(search, table, beside, bench, nothing, laws)
        decision = decide(table, POLICY)
        apart = repeats or bench.finder.disagreements  # what differs between repeats is no law of the belt
        if laws is not None and not apart and decision.suspects_something_unknown(table, POLICY):
            tell("searching for a law of the rest")
            search, table, found = _add_laws(search, table, decision, laws)
            decision = decide(table, POLICY)
    pairs = groupby([] if repeats else bench.finder.disagreements, key=lambda d: d.runs)
    apart = [Suspicion(None, (), "repeats", words_of([*of_pair]), "look") for _, of_pair in pairs]
    suspect = tuple(sorted((*apart, *suspect), key=lambda s: s.severity != "stop"))
    search = add_fits(search, [tuple(decision.named)])
    named = search.fits[frozenset(decision.named)]
    rests_on = find_single_supports(search, table, named, repeats, bench.finder.disagreements)
    held_back = {name: min(p, POLICY.unsure) if name in rests_on else p for name, p in decision.named.items()}
    decision = replace(decision, named=held_back)
    return Findings(
        bench=bench, nothing=nothing, fitted_bench=search.bench, search=search, table=table, decision=decision,
        named=named, suspicions=suspect, rests_on=rests_on,
        law=found.get(frozenset(named.ids)) if decision.tells_of_unknown else None,
    )  # fmt: skip


def within_reach(campaign: Campaign, model: Composition, classes: Sequence[type[Effect]]) -> list[type[Effect]]:
    """Those of ``classes`` that the model and the sensors' places allow, and for which the records are long enough."""
    longest = max((run.travel[-1] for run in campaign.runs if len(run.travel)), default=0.0)
    length = case_of(campaign, campaign.runs[0]).rig.belt_length
    inside = first_place_inside_span(campaign.signals)
    tried = [c for c in classes if model.refusal(c) is None and longest >= c.min_revolutions * length]
    return [c for c in tried if not (inside and shapes_a_span(c))]


def compile_ahead(campaign: Campaign, model: Composition, classes: Sequence[type[Effect]]) -> None:
    """Compile, or load, the largest program of ``examine`` and those of other base models. What is wrong with the
    campaign is told when ``examine`` meets it."""
    with suppress(BeltError):
        samples = samples_of(campaign)
        others = [(m, ()) for m in _others(samples.signals, model)]
        for one, candidates in [(model, within_reach(campaign, model, classes)), *others]:
            forward = Forward(samples, one, candidates)
            forward.values(forward.null()[None])


def _lay_out(campaign: Campaign, model: Composition, classes: Sequence[type[Effect]]) -> tuple[Workbench, Fit]:
    """The campaign laid out at the base model, and the fit of no effect there."""
    bench = workbench(campaign, model, classes)
    return bench, bench.fit([bench.start((), bench.forward.null())])[0]


def find_single_supports(
    search: Search, table: EvidenceTable, named: Fit, repeats: Sequence[Suspicion], apart: Sequence[Disagreement]
) -> dict[str, str]:
    """Effect of the fit ``named`` -> the run without which it gains too little to be named, of those that differ from
    their ``repeats`` or lie ``apart``: what is left is fitted anew with and without the effect."""
    found: dict[str, str] = {}
    doubtful = {s.run for s in repeats} | {r for d in apart for r in (d.runs if len(d.runs) == 2 else d.runs[-1:])}
    for run in [r.name for r in search.bench.samples.runs if named.ids and r.name in doubtful]:
        bench = search.bench
        y = np.where(np.array([r.name == run for r in bench.samples.runs])[:, None, None], np.nan, bench.fitted.y)
        if not np.isfinite(y).any():
            continue
        fitted = replace(bench.fitted, y=y)
        bench = replace(bench, fitted=fitted, metric=metric_of(fitted, bench.levels, bench.shapes, bench.shared))
        sets = (named.ids, *(tuple(i for i in named.ids if i != name) for name in named.ids))
        whole, *smaller = bench.fit([start_from(bench, ids, dict.fromkeys(ids, named)) for ids in sets])
        needed = [needed_gain(row_of(bench, fit, checked=False), table, POLICY) for fit in (whole, *smaller)]
        for name, fit, least in zip(named.ids, smaller, needed[1:], strict=True):
            if fit.chi2 - whole.chi2 < needed[0] - least:
                found.setdefault(name, run)
    return found


def _add_singles(search: Search) -> tuple[Search, EvidenceTable, list[Names]]:
    """The search with every candidate by itself, and without its linearisation, of what it was for all is done; its
    table; and the sets beside which something unknown is looked for: nothing, and the likeliest, whole or less one."""
    table = tabulate(search)
    likeliest = explanations(table, POLICY)[0].effects  # another than in the search, where held-out data speak
    beside = [(), likeliest, *(tuple(i for i in likeliest if i != name) for name in likeliest)]
    if {frozenset(ids) for ids in beside} - {row.ids for row in table.rows}:
        search = add_fits(search, beside)
        table = tabulate(search)
    search = extend(search, ())
    return replace(search, linearisation=Linearisation(search.fits[NO_EFFECTS], {})), table, beside


def _gather(
    search: Search, table: EvidenceTable, beside: list[Names], bench: Workbench, nothing: Fit, laws: LawFinder | None
) -> EvidenceTable:
    """The table with what is seen beyond the sets ``beside``, and the other base models that describe the readings.

    bench, nothing: the workbench on which the search began, and the fit of no effect there; laws: None where nobody
    looks beyond the library.
    """
    likeliest = beside[1]

    # other base models with nothing fitted, beside what comes next; those that explain most of what this one does not,
    # but for one that is the base model with just the likeliest effects, which says the same
    asked = bench.forward.model
    others, found = _others(bench.samples.signals, asked), []
    beyond_noise = max(nothing.chi2 - float(np.isfinite(bench.fitted.y).sum()), 1e-9)

    def predict(model: Composition) -> np.ndarray:
        forward = Forward(bench.samples, model, (), bench.forward.step)
        null, alone = forward.null(), replace(bench, forward=forward, keeps_noise=True)
        return expand_at_likely_settings(alone.laid_out_by(forward, null), null).values(null[None])[0]

    predictions = begin_in_thread(lambda: [*map(predict, others)])
    additive = frozenset(c.id for c in bench.forward.classes if c.is_additive())
    table = replace(table, additive=additive)
    if laws is not None:
        rows = {name: row_of(search.bench, fit, checked=False) for name, fit in search.singles.items()}
        there = {row.ids for row in table.rows}
        fits = [search.fits[frozenset(ids)] for ids in dict.fromkeys(beside) if frozenset(ids) in there]
        sound = [fit for fit in fits if keeps_tension(search.bench, fit)]
        beyond = partial(laws.evidence_of_unknown, search.bench, among=likeliest)
        unknown = map(beyond, sound) if bench.samples.y.size > MANY_READINGS else map_in_threads(beyond, sound)
        visible = frozenset(name for name, row in rows.items() if would_show(row, table, POLICY))
        table = replace(table, visible=visible, unknown=tuple(unknown))

    for model, values in zip(others, predictions(), strict=True):
        gain = nothing.chi2 - float(bench.metric.chi2(bench.fitted.y - values))
        same = likeliest and frozenset(likeliest) <= model.contains - asked.contains
        if np.isfinite(values).all() and gain > DESCRIBED_BY_MODEL * beyond_noise and not same:
            chi2 = float(search.bench.metric.chi2(bench.fitted.y - values))
            lateral = [k for k, s in enumerate(bench.samples.signals) if s.kind == "lateral"]
            rms = float(np.sqrt(np.nanmean((bench.samples.y - values)[:, lateral] ** 2)))
            found.append(OtherModel(name=f"model={model.name}", chi2=chi2, rms=rms, tried=len(others)))
    return replace(table, other_models=tuple(found))


def keeps_tension(bench: Workbench, fit: Fit) -> bool:
    """Whether a fit leaves the belt under tension in every run. The equations of a compressed span have a solution, so
    that a fit may end there, but its impulse responses are not finite."""
    effects = bench.forward.effects_at(fit.vector, fit.ids)
    over_runs = Case(rig=None, belt=None, settings=0)  # type: ignore[arg-type]
    driven = jax.vmap(lambda case: as_driven(case, effects).settings.tension, in_axes=(over_runs,))
    return bool(np.all(np.asarray(in_float64(driven)(bench.forward.samples.cases)) > 0.0))


def _others(signals: Sequence[SignalSheet], model: Composition) -> list[Composition]:
    """The other base models that say what all sensors read: none whose own effects shape a span where one stands."""
    inside = first_place_inside_span(signals)
    others = [MODELS[n] for n in BASE_MODELS if n != model.name]
    return [m for m in others if not (inside and any(map(shapes_a_span, m.built_in)))]


def _add_laws(
    search: Search, table: EvidenceTable, decision: Decision, laws: LawFinder
) -> tuple[Search, EvidenceTable, dict[Ids, LawResult]]:
    """The search, its table with the evidence of laws in the march, and these laws, by the effects beside them."""
    sets = decision.law_sets(table)
    search = add_fits(search, [tuple(sorted(ids)) for ids in sets])
    found = {}
    for ids in sets:
        matters = partial(decision.could_change, table, ids, policy=POLICY)
        most = decision.most_of_a_law(table, ids)
        found[ids] = laws.law(search.bench, search.fits[ids], matters, most)
    in_march = {ids: f.law for ids, f in found.items() if f.law is not None}
    rows = [replace(b, laws=(*b.laws, in_march[b.ids])) if b.ids in in_march else b for b in table.unknown]
    return search, replace(table, unknown=tuple(rows)), found


# What looks wrong in a campaign once the model's own path is taken off its readings.


CLEARED = 30.0  # chi2 that one record read another way has to clear; no chance among all records does that
ALONE = 0.1  # share of it that the same may clear in another run: what an effect does, it does in several
NOISE_SIGMAS = 4.0  # sigmas of its chi2 that the run may then still be from what noise makes of it
UNLIKE = 1e-3  # m between the places where runs began, from which what acts by the place may act in one of them alone
UNDONE = 0.5  # share of the chi2 beyond noise that a turned sign must at least account for
#: Share of the chi2 cleared that may stay beside that: settings and noise levels are not known exactly.
SHARE_LEFT = 0.05


def free_zeros(campaign: Campaign, suspicions: Sequence[Suspicion]) -> Campaign:
    """The campaign with any zero allowed to signals whose runs begin further from zero than the sheet allows."""
    free = {name for s in suspicions if s.kind == "zero" for name in s.signals}
    signals = tuple(replace(s, zero=max(s.zero, FREE_ZERO)) if s.name in free else s for s in campaign.signals)
    return replace(campaign, signals=signals) if free else campaign


def confirm_signs(bench: Workbench, values: np.ndarray, suspicions: Sequence[Suspicion]) -> tuple[Suspicion, ...]:
    """``suspicions`` of the data by themselves, each sign judged by what is left beside ``values`` (R, S, n) once it is
    turned back.

    A sign that accounts for less than half is to be looked at only: a fault of the machine larger than the yaw turns
    readings as well. A column that was to be looked at stops the diagnosis where noise is all that is left.
    """
    samples, found = bench.samples, list(suspicions)
    lateral = [k for k, s in enumerate(samples.signals) if s.kind == "lateral"]
    for n, told in enumerate(suspicions):
        runs = [r for r, run in enumerate(samples.runs) if told.run in (None, run.name) and run.use == "fit"]
        if told.kind != "wrong_sign" or not runs:
            continue
        before = float(np.sum(_excess_chi2(bench, values, bench.fitted.y)[runs]))
        own, left = [k for k in lateral if samples.signals[k].name == told.signal], []
        # of one signal or all, or of the one that fits; a column that is to be looked at by itself
        for turned in (own, lateral, *([k] for k in lateral)) if told.severity == "stop" else (own,):
            y = bench.fitted.y.copy()
            y[np.ix_(runs, turned)] *= -1.0
            left.append(float(np.sum(_excess_chi2(bench, values, y)[runs])))
        count = np.isfinite(bench.fitted.y[runs]).sum()
        if told.severity == "stop" and not min(left) < UNDONE * before:
            found[n] = replace(told, severity="look")
        elif told.severity != "stop" and told.run is None and _leaves_noise(left[0], before - left[0], count):
            found[n] = replace(told, severity="stop")
    return tuple(found)


def _leaves_noise(left: float, cleared: float, count: int) -> bool:
    """Whether readings, read another way, ``cleared`` more chi2 than chance and have noise ``left``, of ``count``."""
    return cleared > CLEARED and left - NOISE_SIGMAS * np.sqrt(2.0 * count) < SHARE_LEFT * cleared


def _excess_chi2(bench: Workbench, values: np.ndarray, y: np.ndarray) -> np.ndarray:
    """chi2 of readings y (R, S, n) beyond their number, run by run (R,)."""
    white = bench.metric.whiten(y - values).reshape(len(y), -1)
    return np.sum(white**2, axis=1) - np.isfinite(bench.fitted.y).sum(axis=(1, 2))


def find_faults(bench: Workbench, values: np.ndarray, suspicions: Sequence[Suspicion]) -> tuple[Suspicion, ...]:
    """What is wrong, worst first: ``suspicions`` of the data by themselves, and what ``values`` (R, S, n) show: runs
    that do not begin where these do, by more than the sheet's errors allow, and readings that were confused.
    """
    seen = confirm_signs(bench, values, suspicions)
    if all(s.kind == "dropout" and s.severity == "look" for s in seen):  # what was left out says nothing of the rest
        left = residual_campaign(bench, values)
        seen = (*seen, *check_starts(left, counted_from_yaw(records_of(left)), curvature_share=0.0))
    return seen if any(s.severity == "stop" for s in seen) else (*find_misread_run(bench, values), *seen)


def residual_campaign(bench: Workbench, values: np.ndarray) -> Campaign:
    """The campaign with what ``values`` (R, S, n) leave of its readings in their place."""
    samples, runs = bench.samples, []
    for run, travel, rest in zip(samples.runs, samples.travel, samples.y - values, strict=True):
        own = np.append(True, np.diff(travel) > 0.0)  # a shorter record is filled up with its last travel
        signals = {s.name: y[own] for s, y in zip(samples.signals, rest, strict=True) if s.name in run.signals}
        runs.append(replace(run, travel=travel[own], time=None, signals=signals))
    return replace(bench.campaign, runs=tuple(runs))


def find_misread_run(bench: Workbench, values: np.ndarray) -> tuple[Suspicion, ...]:
    """The run in which a single record with its sign turned, or two exchanged, is all that the model does not explain.

    What a machine does shows in more than one record; what a hand did is undone to within noise. Not so where the belt
    stood at unlike places: a crown or a guide may act in one record alone, so that the sheet is only to be looked at.
    """
    measured, signals = bench.fitted.y, bench.samples.signals
    before, count = _excess_chi2(bench, values, measured), np.isfinite(measured).sum(axis=(1, 2))
    gains, found = defaultdict[tuple, list[float]](list), []
    for r, run in enumerate(bench.samples.runs):
        there = [k for k, s in enumerate(signals) if s.kind == "lateral" and np.isfinite(measured[r, k]).any()]
        ways: list[tuple[Suspicion, np.ndarray]] = []  # what may have been done, and readings with that undone
        for turned in [[k] for k in there] + ([there] if len(there) > 1 else []):
            names = (signals[turned[0]].name,) if len(turned) == 1 else ()
            whose = "its sign" if names else "the sign of its yaw"
            words = f"fits the model with {whose} turned round, and nothing else in this run is off"
            read = measured[r].copy()
            read[turned] *= -1.0
            ways.append((Suspicion(run=run.name, signals=names, kind="wrong_sign", sentence=words), read))
        for s, t in combinations(there, 2):
            if np.array_equal(np.isfinite(measured[r, s]), np.isfinite(measured[r, t])):
                words = "fit the model with the two exchanged, and nothing else in this run is off"
                read = measured[r].copy()
                read[[s, t]] = read[[t, s]]
                both = (signals[s].name, signals[t].name)
                ways.append((Suspicion(run=run.name, signals=both, kind="swapped", sentence=words), read))
        for told, read in ways:
            y = measured.copy()
            y[r] = read
            after = _excess_chi2(bench, values, y)
            gain = float(np.sum(before - after))
            gains[told.kind, told.signal].append(gain)
            if _leaves_noise(after[r], gain, count[r]):
                found.append((gain, r, told))

    if len({r for _, r, _ in found}) != 1:
        return ()  # in several runs: the model lacks something
    gain, _, told = max(found, key=lambda f: f[0])
    others = sorted(gains[told.kind, told.signal])[:-1]
    if max(others, default=0.0) >= ALONE * gain:
        return ()
    unlike = np.ptp([run.y0 or 0.0 for run in bench.samples.runs]) > UNLIKE
    return (replace(told, severity="look") if unlike else told,)
