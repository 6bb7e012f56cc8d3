"""From the workbench to the result: what a diagnosis hands out."""

from typing import Any

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.diagnosis.answer.confusable import probabilities, selection_frequency
from belt_sim.diagnosis.answer.ladder import Rung
from belt_sim.diagnosis.answer.verdict import damage, nearest_words
from belt_sim.diagnosis.choice.refits import Trial
from belt_sim.diagnosis.errors.own_errors import errors_of
from belt_sim.diagnosis.errors.run_errors import run_errors
from belt_sim.diagnosis.errors.where import where
from belt_sim.diagnosis.examine import Findings
from belt_sim.diagnosis.fits.candidate import estimates, numbers
from belt_sim.diagnosis.fits.intervals import by_likelihood
from belt_sim.diagnosis.fits.within import each_alone
from belt_sim.diagnosis.left_over.shape_card import shape_card
from belt_sim.provenance import provenance
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.errors import CampaignLabel, Errors
from belt_sim.results.found import Candidate, Confusable, FoundEffect, LeftOver, NoiseLevels, Tried, Unknown
from belt_sim.results.verdict import Verdict, other_model

ALIKE_SHOWN = 3  # look-alikes in a sentence


def describe(d: Findings, *, seed: int, config: Any = None) -> Diagnosis:
    """The findings as a result, without drawings and the next runs to make."""
    bench, found = d.bench, d.found
    campaign, model = bench.campaign, bench.forward.model.name
    named = d.verdict != Verdict.CANNOT_SAY
    levels = bench.levels
    return Diagnosis(
        base_model=model,
        campaign=label(campaign),
        verdict=d.verdict,
        sentence=_sentence(d),
        effects=_effects(d) if named else (),
        ranking=_ranking(d, seed),
        considered=tuple(e for e in found.table if np.isfinite(e.by_chance)),
        rounds=tuple(tuple(Tried(**_tried(t)) for t in trials) for trials in found.rounds),
        error=_errors(d),
        where=where(bench, found.base.values),
        confusables=tuple(Confusable(effect=r.effect, other=r.other, sigma=r.sigma) for r in d.rivals),
        next_runs=(),
        unknown=_unknown(d),
        open_set=LeftOver(
            failed=d.left.failed,
            gain=d.left.gain,
            threshold={n: _finite(t) for n, t in d.left.threshold.items()},
        ),
        noise=NoiseLevels(white_factor=_mean(levels.white), wander_factor=_mean(levels.wander), repeats=levels.repeats),
        suspicions=d.suspicions,
        per_run=run_errors(found.bench, found.base.values, d.judgement.named.values),
        provenance=provenance(config) | _by(d, seed),
    )


def _sentence(d: Findings) -> str:
    model, use = d.bench.forward.model.name, d.judgement.use_model
    if d.verdict == Verdict.NONE_KNOWN and use is not None:
        return other_model(model, use.model)
    named = d.judgement.named.ids if d.verdict != Verdict.CANNOT_SAY else ()
    return d.verdict.sentence(model, [_or_alike(d, name) for name in named], damage(d.suspicions))


def _or_alike(d: Findings, name: str) -> str:
    """An effect with what these readings cannot tell from it: no name is said surer than it is."""
    alike = _alike(d, name)
    more = ", ..." if len(alike) > ALIKE_SHOWN else ""
    return f"{name} (or {', '.join(alike[:ALIKE_SHOWN])}{more})" if alike else name


def _alike(d: Findings, name: str) -> tuple[str, ...]:
    """What these readings cannot tell from an effect."""
    return tuple(dict.fromkeys(r.other for r in d.rivals if r.effect == name))


def _by(d: Findings, seed: int) -> dict[str, Any]:
    """What the verdict was calibrated by."""
    return {"seed": seed, "data_sha256": d.bench.campaign.sha256}


def label(campaign: Campaign) -> CampaignLabel:
    """Which campaign it was."""
    return CampaignLabel(title=campaign.title, sha256=campaign.sha256, source=campaign.source.kind)


def _effects(d: Findings) -> tuple[FoundEffect, ...]:
    whole = d.verdict == Verdict.EXPLAINED  # then nothing stands out beside the set
    weights = probabilities(d.found, d.left if whole else d.judgement.base_left, beside=whole)
    chosen, forward = d.judgement.named, d.bench.forward
    seen = estimates(forward, chosen)
    if d.verdict == Verdict.EXPLAINED:  # elsewhere numbers are effective ones
        every = numbers(forward, chosen)
        seen = by_likelihood(d.found.bench, chosen, {i: own or every[i] for i, own in seen.items()})
    there = {e.id: e for e in forward.effects_at(chosen.vector, chosen.ids)}
    return tuple(
        FoundEffect(
            id=name,
            numbers={n: float(getattr(there[name], n)) for n in there[name].parameters},
            parameters=seen[name],
            probability=weights[name],
            confusable_with=_alike(d, name),
            rejected=d.verdict.rejects_model,
            source_file=getattr(type(there[name]), "source_file", None),
            alone=each_alone(d.found.bench, chosen, name) if not seen[name] else {},
        )
        for name in chosen.ids
    )


def _ranking(d: Findings, seed: int) -> tuple[Candidate, ...]:
    frequency = selection_frequency(d.found, seed)
    use = d.judgement.use_model
    first = () if use is None else (_model_candidate(use),)
    return first + tuple(
        Candidate(
            **_tried(t),
            parameters=estimates(d.bench.forward, t.fit)[t.id],
            plausible=t.plausible,
            selection_frequency=frequency.get(t.id, 0.0),
            note=_note(t, d.found.base_held_out.chi2),
        )
        for t in d.ranking
    )


def _model_candidate(use: Rung) -> Candidate:
    """Another base model, as the first of the candidates."""
    return Candidate(
        id=f"model={use.model}", gain=use.gain, threshold=0.0, held_out_rms=use.rms, parameters={}, plausible=True,
        selection_frequency=1.0, note=f"use model={use.model} first",
    )  # fmt: skip


def _note(t: Trial, base_chi2: float) -> str:
    if t.gain <= t.threshold:
        return "not needed"
    if not t.plausible:
        return "implausible value"
    return "held-out error falls" if t.held_out.chi2 < base_chi2 else "held-out error stays"


def _tried(t: Trial) -> dict[str, Any]:
    return {"id": t.id, "gain": t.gain, "threshold": _finite(t.threshold), "held_out_rms": t.held_out.rms}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _errors(d: Findings) -> Errors:
    found, judged = d.found, d.judgement
    return errors_of(found.bench, found.base, found.base_held_out, judged.named, judged.named_held_out)


def _unknown(d: Findings) -> Unknown | None:
    if not (d.verdict.rejects_model and d.left.failed):
        return None
    return shape_card(d.found.bench, d.judgement.named, d.left, nearest_words(d.judgement) or _closest(d))


def _closest(d: Findings) -> tuple[str, str] | None:
    """The candidate that takes most of what stands out, though not enough to be chosen."""
    best = max(d.found.rounds[0] if d.found.rounds else [], key=lambda t: t.gain, default=None)
    if best is None:
        return None
    worst = max(d.left.gain.values(), default=0.0)
    return best.id, f"it takes a chi2 of {best.gain:.0f} of what stands out ({worst:.0f} in the worst test)"


def _mean(factors: float | tuple[float, ...]) -> float:
    """One factor for all signals."""
    return float(np.exp(np.mean(np.log(factors))))
