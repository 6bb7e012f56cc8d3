"""A finished diagnosis in words and tables."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.campaign import Suspicion
from belt_sim.campaign.kinematics import check_running_start
from belt_sim.campaign.quality import counted_from_yaw, records_of
from belt_sim.diagnosis.decide import POLICY, needed_gain
from belt_sim.diagnosis.errors import (
    ALL_RUNS,
    drawings,
    error_map,
    errors_of,
    held_out,
    lateral_rms,
    locate_failure,
    run_errors,
    stiffness_drift,
)
from belt_sim.diagnosis.examine import Findings, residual_campaign
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.next_run import Rival, separation
from belt_sim.diagnosis.plausibility import estimates, estimates_of_single_sizes, is_plausible, profile_intervals
from belt_sim.diagnosis.samples import Samples
from belt_sim.diagnosis.search import NO_EFFECTS, row_of
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.effects.base import Effect
from belt_sim.effects.generic_law import GenericLaw, law_entry
from belt_sim.io import provenance
from belt_sim.results.diagnosis import (
    STAMP,
    Candidate,
    Confusable,
    Diagnosis,
    FoundEffect,
    NoiseLevels,
    TiedSet,
    Unknown,
    Verdict,
)
from belt_sim.results.errors import CampaignLabel, Drawings
from belt_sim.results.estimates import Estimate
from belt_sim.results.words import join_words


def drawings_of(d: Findings) -> Drawings:
    """Everything that a diagnosis draws: base model and final model, and where the base model fails."""
    base, final = d.nothing, final_model(d)[1]
    after = final.values if d.named.ids or final is not d.named else None  # effects, or a law
    drifts = [(d.bench, base.vector), *([(d.fitted_bench, d.named.vector)] if d.named.ids else [])]
    return drawings(d.bench, base.values, after, base.values, *(stiffness_drift(*one) for one in drifts))


# From findings to the result: what a diagnosis hands out.


ALIKE_SHOWN = 3  # look-alikes in a sentence
SILENT = "These readings could not show any effect at a plausible size: record longer, at more tensions and yaws."


def describe(d: Findings, *, seed: int, config: Any = None) -> Diagnosis:
    """The findings as a result, without drawings, what was discovered, and the next runs to make."""
    campaign, bench, decision = d.bench.campaign, d.fitted_bench, d.decision
    final, fit = final_model(d)
    effects, tied = _effects(d)
    name, count = bench.forward.model.name, len(d.named.ids)
    without = f"Without the effect{'s' if count > 1 else ''}, {name}" if count else f"Model {name}"
    causes = [cls.cause for cls in d.bench.forward.classes if cls.id in d.named.ids]
    faulty = any(cause is None or not cause.of_model for cause in causes)
    error = errors_of(d.bench, d.nothing, final, fit)
    if ALL_RUNS in error.by_condition:
        error = replace(error, held_out=None, own=None, by_condition={}, untestable=())
    sentence = _sentence(d, [e.id for e in effects if e.told != e.parameters])
    # why the effects that are named are not sure, or their sizes not reliable
    for run in dict.fromkeys(d.rests_on.values()):
        rest = join_words(sorted(n for n in d.named.ids if d.rests_on.get(n) == run))
        sentence += f" Without run {run}, which differs from its repeats, {rest} would not be named: "
        sentence += "measure that run again."
    if d.named.ids and error.own is not None and error.own.after > max(error.own.before, error.own.floor):
        sentence += f" The error on unseen runs rises with {join_words(d.named.ids)}: take no size from these numbers."
    unknown = None
    if decision.tells_of_unknown:  # the look of what is beyond the named effects
        known = next(e for e in decision.explanations if not e.instead and not e.unknown)
        odds = decision.likeliest_unknown.log_posterior - known.log_posterior
        times = "more than a million" if odds > np.log(1e6) else f"{np.exp(odds):.0f}"
        why = f"something unknown is {times} times likelier"
        nearest = (join_words(known.effects), why) if known.effects else (None, None)
        residual = bench.samples.y - d.named.values
        white_rest = bench.metric.whiten(np.where(np.isfinite(residual), residual, 0.0)).reshape(len(residual), -1)
        look = look_of_residual(bench.samples, residual, white_rest)
        unknown = Unknown(nearest=nearest[0], why=nearest[1], **look)
    white, wander = (float(np.exp(np.mean(np.log(x)))) for x in (bench.levels.white, bench.levels.wander))
    source = "repeated runs" if bench.levels.repeats else "as stated in the campaign"
    # a drift before the yaw that the named effects explain: it is no longer in what they leave of the readings
    answered = list[Suspicion]()
    if decision.verdict == Verdict.EXPLAINED and any(s.kind == "running_start" for s in d.suspicions):
        left = residual_campaign(bench, d.named.values)
        if not check_running_start(left, counted_from_yaw(records_of(left))):
            answered = check_running_start(campaign, counted_from_yaw(records_of(campaign)))
    return Diagnosis(
        base_model=name,
        campaign=CampaignLabel.of(campaign),
        verdict=decision.verdict,
        sentence=sentence,
        effects=effects,
        ranking=_rank_candidates(d),
        considered=decision.explanations,
        tied=tied,
        error=error,
        where=locate_failure(error_map(d.bench, d.nothing.values), without, faulty=faulty),
        confusables=tuple(Confusable(effect=r.effect, other=r.other, sigma=r.sigma) for r in rivals(d)),
        next_runs=(),
        unknown=unknown,
        noise=NoiseLevels(white_factor=white, wander_factor=wander, repeats=bench.levels.repeats, source=source),
        suspicions=tuple(s for s in d.suspicions if s not in answered),
        per_run=run_errors(final, d.nothing.values, fit.values),
        provenance=provenance(config) | {"seed": seed, "data_sha256": campaign.sha256},
    )


def final_model(d: Findings) -> tuple[Workbench, Fit]:
    """The workbench and fit of what was found: effects, or the law where none was named."""
    if d.law is not None and d.law.fit is not None and d.law.bench is not None and not d.named.ids:
        return d.law.bench, d.law.fit
    return d.fitted_bench, d.named


def rivals(d: Findings) -> list[Rival]:
    """What the verdict cannot be told apart from, with the fits."""
    found, fits = [], d.search.fits
    for effect, others in d.decision.confusable.items():
        for other in others:
            ids = frozenset(d.named.ids) - {effect} | set(other)
            come = set(other)  # else the best fit with these and without the effect
            near = [f for i, f in fits.items() if come <= i and (effect in come or effect not in i)]
            fit = fits.get(ids) or min(near, key=lambda f: f.chi2, default=None)
            if fit is not None:
                found.append(Rival(effect, " + ".join(other), separation(d.fitted_bench, d.named, fit), fit))
    return found


def _sentence(d: Findings, sized_otherwise: Collection[str] = ()) -> str:
    """sized_otherwise: effects of which tied explanations have other sizes."""
    decision, model = d.decision, d.bench.forward.model.name
    if decision.verdict == Verdict.NONE_KNOWN and decision.instead:
        better = decision.instead.removeprefix("model=")
        return f"{model} fails here, and model {better} explains the difference: use model={better}."
    if decision.verdict == Verdict.CANNOT_SAY and not any(s.severity == "stop" for s in d.suspicions):
        return SILENT
    if decision.verdict == Verdict.ADEQUATE and d.table.visible is not None:
        names, hidden = d.search.names, [n for n in d.search.names if n not in d.table.visible]
        effects = f"{len(names) - len(hidden)} of {len(names)} effects" if len(names) > 1 else "The effect"
        unseen = f"; these would not: {', '.join(hidden)}" if hidden else ""
        said, likeliest = decision.verdict.sentence(model, ()), decision.explanations[0]
        if not likeliest.says_nothing:
            nothing = next(e for e in decision.explanations if e.says_nothing)
            sure, not_at_all = (f"{100.0 * e.probability:.0f} %" for e in (likeliest, nothing))
            said = f"Model {model} may lack {likeliest} ({sure}; nothing {not_at_all}): too little to name it."
        return f"{said} {effects} would show at a plausible size{unseen}."
    named = []
    for name in decision.named:  # with what readings cannot tell from it: no name is said surer than it is
        like = decision.confusable.get(name, ())
        more = ", ..." if len(like) > ALIKE_SHOWN else ""
        named.append(f"{name} (or {', '.join(map(' + '.join, like[:ALIKE_SHOWN]))}{more})" if like else name)
    gravest = min(d.suspicions, key=lambda s: s.severity != "stop", default="")
    alike = decision.like_one_change_of_the_span(POLICY)
    more = f" Or one change of the span, in its bending or twisting, may stand in the place of {join_words(alike)}."
    said = decision.verdict.sentence(model, named, str(gravest)) + (more if alike else "")
    if tied := decision.tied(POLICY):
        doubt = dict.fromkeys(sized_otherwise, " (size not reliable)")
        certain = [n + doubt.get(n, "") for n in decision.named if not any(n in t.effects for t in tied)]
        besides = f"{join_words(certain)} and " if certain else ""
        ways = " or ".join(" + ".join(t.effects) or "nothing more" for t in tied)
        said = f"Model {model} lacks {besides}one of these, and these runs cannot say which: {ways}."
    if shared := decision.in_every_explanation(POLICY):
        said += f" Whatever else acts, every likely explanation has {join_words(shared)} (size not reliable)."
    sheet = [s for s in d.suspicions if s.kind == "sheet" and s.severity == "look"]
    if sheet and decision.named:
        said += " A mistake in the data sheet explains as much: check that first."
    return said


def held_back(probability: float, effect: type[Effect], *told: Mapping[str, Estimate]) -> float:
    """The probability of an effect, at most ``unsure`` where no size of it that is ``told`` is off nothing."""
    seen = []
    for name, e in ((n, e) for one in told for n, e in one.items() if not effect.parameters[n].modifier):
        null, (low, high) = effect.parameters[name].null, e.interval_95
        seen.append(abs(e.value - null) >= POLICY.sized * e.u or not low <= null <= high)
    return probability if any(seen) or not seen else min(probability, POLICY.unsure)


def _effects(d: Findings) -> tuple[tuple[FoundEffect, ...], tuple[TiedSet, ...]]:
    """The named effects, and explanations that are tied: with what sizes each of these gives its own effects, and those
    that all of them have. No sizes beside something unknown, where they are effective ones."""
    decision, bench, named = d.decision, d.fitted_bench, d.named
    seen = estimates(bench.forward, named)
    if decision.verdict == Verdict.EXPLAINED:  # elsewhere numbers are effective ones
        every = estimates(bench.forward, named, every=True)
        seen = profile_intervals(bench, named, {i: own or every[i] for i, own in seen.items()})
    there = {e.id: e for e in bench.forward.effects_at(named.vector, named.ids)}
    sure = {n: held_back(decision.named[n], type(e), seen[n]) for n, e in there.items()}
    unsure = [n for n, p in sure.items() if not seen[n] or p < decision.named[n]]
    alone = {n: estimates_of_single_sizes(bench, named, n) for n in unsure}  # of two that are known together only

    tied = decision.tied(POLICY)
    common = frozenset(named.ids).difference(*(t.effects for t in tied)) if tied else frozenset[str]()
    fits = [d.search.fits.get(common | frozenset(t.effects)) for t in tied]
    rows = [{} if fit is None else estimates(bench.forward, fit) for fit in fits]
    found = []
    for name in named.ids:
        effect = there[name]
        found.append(
            FoundEffect(
                id=name,
                numbers={n: float(getattr(effect, n)) for n in effect.parameters},
                parameters=seen[name],
                probability=held_back(decision.named[name], type(effect), seen[name], alone.get(name, {})),
                confusable_with=decision.confusable.get(name, ()),
                stamp="" if decision.verdict in (Verdict.ADEQUATE, Verdict.EXPLAINED) else STAMP,
                source_file=getattr(type(effect), "source_file", None),
                law=law_entry(effect) if isinstance(effect, GenericLaw) else None,
                alone=alone[name] if not seen[name] else {},
                by_explanation=tuple(row[name] for row in rows if name in row) if name in common else (),
            )
        )
    sized = (replace(t, sizes={i: row[i] for i in t.effects if i in row}) for t, row in zip(tied, rows, strict=True))
    return tuple(found), tuple(sized)


def _rank_candidates(d: Findings) -> tuple[Candidate, ...]:
    """Every candidate by itself, those first that are likeliest to be there, alone or with others."""
    rows = d.decision.explanations
    names = d.search.singles if d.decision.verdict != Verdict.CANNOT_SAY else ()
    without = sum(c.surprise for c in held_out(d.fitted_bench, d.search.fits[NO_EFFECTS]).values())
    bench, found = d.fitted_bench, []
    for name in names:
        fit, own = d.search.singles[name], [e for e in rows if name in e.effects]
        gain = max(d.search.fits[NO_EFFECTS].chi2 - fit.chi2, 0.0)
        held, plausible = held_out(bench, fit), is_plausible(bench.forward, fit)
        needed = needed_gain(row_of(bench, fit, checked=False), d.table, POLICY)
        falls = sum(c.surprise for c in held.values()) < without
        note = "held-out error falls" if falls else "held-out error stays"
        if sum(e.probability for e in own if e.unknown) > 0.5:  # likelier than not
            note = "only beside something unknown"
        note = note if plausible else "implausible value"
        found.append(
            Candidate(
                id=name, gain=gain, threshold=needed, held_out_rms=lateral_rms(held.values()),
                parameters=estimates(bench.forward, fit)[name], plausible=plausible,
                probability=min(sum(e.probability for e in own), 1.0), note=note if gain > needed else "not needed",
            )
        )  # fmt: skip
    rms = {other.name: other.rms for other in d.table.other_models}
    instead = [
        Candidate(
            id=e.instead, gain=e.gain, threshold=0.0, held_out_rms=rms[e.instead], parameters={}, plausible=True,
            probability=e.probability, note=f"use {e.instead} first",
        ) for e in rows if e.instead
    ]  # fmt: skip
    return tuple(sorted([*instead, *found], key=lambda c: (-round(c.probability, 6), -c.gain)))


def look_of_residual(samples: Samples, residual: np.ndarray, white: np.ndarray) -> dict[str, Any]:
    """What a residual (R, S, n), white (R, N) where it is whitened, looks like: whether it turns over with the sign of
    yaw, n of |residual| ~ tension^n, the travel [m] at which the worst run leaves its own zero by three sigma, and the
    wavelength [m] of the line that stands out.

    All but the parity are of the first signal; None where the runs cannot tell.
    """
    first = residual[:, 0]
    sign, stress = np.sign([r.yaw for r in samples.runs]), np.array([r.tension for r in samples.runs])
    parity, exponent, wavelength = "unknown: only one sign of yaw was run", None, None
    if np.any(sign > 0) and np.any(sign < 0):
        plus, minus = white[sign > 0].mean(axis=0), white[sign < 0].mean(axis=0)
        odd, even = float(np.sum((plus - minus) ** 2)), float(np.sum((plus + minus) ** 2))
        share = odd / max(odd + even, 1e-12)
        parity = "odd" if share > 0.8 else "even" if share < 0.2 else "mixed"
    if len(levels := np.unique(stress)) > 1:
        size = [np.sqrt(np.nanmean(first[stress == t] ** 2)) for t in levels]
        exponent = float(np.polyfit(np.log(levels), np.log(np.maximum(size, 1e-12)), 1)[0])

    r = int(np.argmax(np.nansum(first**2, axis=1)))
    travel, error, sheet = samples.travel[r], np.nan_to_num(first[r]), samples.signals[0]
    width = max(1, int(1.0 / max(np.median(np.diff(travel)), 1e-6)))  # samples a metre
    smooth = np.convolve(error - error[:width].mean(), np.ones(width) / width, mode="same")
    beyond = np.flatnonzero(np.abs(smooth) > 3.0 * np.hypot(sheet.white / np.sqrt(width), sheet.wander_sd))
    onset = float(travel[beyond[0]]) if len(beyond) else None

    n, spacing = first.shape[1], float(np.median(np.diff(samples.travel[0])))
    trend = np.vander(np.linspace(-1.0, 1.0, n), 4)
    left = np.nan_to_num(first).T
    left = left - trend @ np.linalg.lstsq(trend, left, rcond=None)[0]
    power = np.sum(np.abs(np.fft.rfft(left * np.hanning(n)[:, None], axis=0)) ** 2, axis=1)
    frequency = np.fft.rfftfreq(n, spacing)
    usable = frequency > 2.5 / (n * spacing)
    k = int(np.argmax(np.where(usable, power, 0.0)))
    if usable.any() and power[k] >= 12.0 * np.median(power[usable]):
        wavelength = float(1.0 / frequency[k])

    return {"parity": parity, "tension_exponent": exponent, "onset": onset, "wavelength": wavelength}
