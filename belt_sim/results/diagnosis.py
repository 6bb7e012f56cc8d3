"""A diagnosis: what the model lacks, as effects with their numbers or as a law, how sure that is, what else was tried
and cannot be told apart, and what to measure next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, InstanceOf, PlainSerializer, computed_field

from belt_sim.campaign.quality import Suspicion
from belt_sim.results import words
from belt_sim.results.errors import CampaignLabel, Drawings, Errors, RunError, Where, error_grid
from belt_sim.results.estimates import Array, EffectSet, Estimate, Free, MachineSizes, file_field, number_texts
from belt_sim.results.words import Display, Table, join_words
from belt_sim.units import MM

STAMP = "effective value, model rejected"  # what has to stand beside the numbers of a rejected model


@dataclass(frozen=True, kw_only=True)
class FoundEffect:
    """An effect that the model lacks; numbers: every parameter in SI; parameters: those that the readings can see.

    probability: its weight against what could stand in its place, confusable_with; source_file: of an effect of one's
    own; law: its entry in an effects.yaml; stamp: what stands beside its numbers where the model fails even with it;
    alone: what each of several numbers would be without the others, where only together they are known;
    by_explanation: parameters in each of several tied explanations that all have the effect.
    """

    id: str
    numbers: Mapping[str, float]
    parameters: Mapping[str, Estimate]
    probability: float
    confusable_with: tuple[EffectSet, ...] = ()
    source_file: Annotated[str | None, file_field("source_file", omit_empty=True)] = None
    law: Annotated[Mapping[str, Any] | None, file_field("law", omit_empty=True)] = None
    alone: Annotated[Mapping[str, Estimate], file_field("alone", omit_empty=True)] = field(default_factory=dict)
    by_explanation: Annotated[tuple[Mapping[str, Estimate], ...], file_field("by_explanation", omit_empty=True)] = ()
    stamp: Annotated[str, file_field("stamp", omit_empty=True)] = ""

    @property
    def told(self) -> Mapping[str, Estimate]:
        """The parameters; of which tied explanations disagree, the range over all of them."""
        found = dict(self.parameters)
        for name in dict.fromkeys(n for row in self.by_explanation for n in row):
            each = [row[name] for row in self.by_explanation if name in row]
            low, high = (np.array([e.interval_95[k] for e in each]) for k in (0, 1))
            if low.max() > high.min():
                values = [e.value for e in each]
                middle, ends = 0.5 * (min(values) + max(values)), (min(values), max(values))
                found[name] = replace(each[0], value=middle, u=ends[1] - ends[0], interval_95=ends)
        return found

    def sizes_on(self, machine: MachineSizes | None) -> tuple[str, ...]:
        """What is known of its numbers, a line each; on a machine, as people there measure them."""
        if self.parameters:
            said = tuple(f"{n} = {text}" for n, text in number_texts(self.id, self.told, machine).items())
            return (*said, "size not reliable: it differs by explanation") if self.told != self.parameters else said
        if self.alone:
            each = " or ".join(f"{n} = {text}" for n, text in number_texts(self.id, self.alone, machine).items())
            return (f"{each} (each if it were alone: the readings do not tell which)",)
        return ("that it is there is known, how large it is not",)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect tried by itself: chi2 gain, the gain from which it is likelier than nothing (None: the readings cannot
    show it), rms [m] on held-out conditions, probability that it is there, alone or with others."""

    id: str
    gain: float
    threshold: float | None
    held_out_rms: Annotated[float, file_field("held_out_rms_mm", MM)]
    parameters: Mapping[str, Estimate]
    plausible: bool
    probability: float
    note: str


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """A row of the table of evidence: effects that are missing together (none: nothing is), with or without something
    unknown beside them; or, instead of effects, another base model. All but gain in nats.

    gain: chi2 below that of nothing; likelihood: what that counts, 0.5 gain over what chance makes of one; parameters:
    free numbers, and occam: what they cost; unknown_evidence: log evidence of something unknown beside the effects;
    prior: log odds against nothing before any reading; held_out_rise: of -2 log predictive density of what was left
    out, against nothing; refused: why it is no answer whatever it explains (empty: nothing speaks against it).
    """

    effects: tuple[str, ...]
    unknown: bool = False
    instead: str = ""
    gain: float
    likelihood: float
    parameters: int
    occam: float
    prior: float
    unknown_evidence: float = 0.0
    held_out_rise: float = 0.0
    implausible: bool = False
    refused: str = ""
    probability: float = 0.0

    @computed_field  # type: ignore[prop-decorator]
    @property
    def log_posterior(self) -> float:
        """log odds against nothing after all readings."""
        return self.likelihood - self.occam + self.unknown_evidence + self.prior

    @property
    def says_nothing(self) -> bool:
        """Whether it is that nothing is missing."""
        return not (self.instead or self.effects or self.unknown)

    def __str__(self) -> str:
        named = [self.instead] if self.instead else [*self.effects, *([SOMETHING_UNKNOWN] if self.unknown else [])]
        return " + ".join(named) or "nothing is missing"


@dataclass(frozen=True, kw_only=True)
class Confusable:
    """``other``, one effect or several joined by +, in the place of ``effect`` fits almost as well: sigma apart."""

    effect: Annotated[str, file_field("a")]
    other: Annotated[str, file_field("b")]
    sigma: float

    def __str__(self) -> str:
        return f"{self.effect} cannot be told apart from {self.other} ({words.decimal(self.sigma, 1)} sigma)"


NO_MORE_THAN_NOISE = 1.2  # times the noise floor, up to which an error is noise
RESOLVED = 3.0  # sigma, below which nobody takes two explanations for told apart
#: sigma by which the likelier of two stands out in 97 of 100 campaigns, so that it has 95 % of the probability
SURE_APART = 5.0
WORTH = 1.0  # sigma, by which a further run must raise what tells two apart


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """What an advised run is set to [Pa, rad, m/s, m]; direction: +1, or -1 for reversed travel; all_points: sensors at
    all four; turned_over: the belt."""

    tension: float
    yaw: float
    speed: float
    direction: float
    travel: float
    all_points: bool = False
    turned_over: bool = False


@dataclass(frozen=True)
class NextRun:
    """One action on the rig, the pair that it separates, and the separation before and after in sigma."""

    action: str
    separates: tuple[str, str]
    sigma_before: float
    sigma_after: float
    settings: RunSettings | None = None

    @property
    def resolves(self) -> bool:
        """Whether the run would tell the pair apart, better than these runs do; else nobody is advised to make it."""
        return self.sigma_after >= RESOLVED and self.sigma_after - self.sigma_before >= WORTH

    def __str__(self) -> str:
        pair = " from ".join(self.separates)
        if not self.resolves:
            better = " better" if self.sigma_after >= RESOLVED else ""
            return f"No single further run on this rig tells {pair}{better} at the sizes that were found."
        tells = "tells" if self.sigma_after >= SURE_APART else "may tell"
        change = f"{words.decimal(self.sigma_before, 1)} -> {words.decimal(self.sigma_after, 1)} sigma"
        return f"{self.action[:1].upper()}{self.action[1:]}. It {tells} {pair} ({change})."


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """The shape card of an unknown effect, with the nearest known effect and why that fails; lengths in m; None where
    the residual does not show it."""

    parity: str
    tension_exponent: float | None
    onset: Annotated[float | None, file_field("onset_m")]
    wavelength: Annotated[float | None, file_field("wavelength_m")]
    nearest: str | None
    why: str | None

    def __str__(self) -> str:
        parts = [f"parity {self.parity}"]
        parts += [f"tension exponent {self.tension_exponent:.1f}"] if self.tension_exponent is not None else []
        parts += [f"onset {self.onset:.1f} m"] if self.onset is not None else []
        parts += [f"wavelength {self.wavelength:.2f} m"] if self.wavelength is not None else []
        parts += [f"nearest {self.nearest}: {self.why}"] if self.nearest else []
        return "; ".join(parts)


@dataclass(frozen=True, kw_only=True)
class NoiseLevels:
    """Factors on the stated white noise and wander, how many repeats they were read off (0: as stated), and where they
    come from."""

    white_factor: float
    wander_factor: float
    repeats: int
    source: str


@dataclass(frozen=True, kw_only=True)
class PlaceEvidence:
    """How much likelier the data are with a smooth unknown at a place: gain in log evidence over none, with the way of
    pooling runs (odd or even in yaw, each run by itself) and the length [m] on which it changes."""

    place: str
    words: str
    pool: str
    gain: float
    length: float


@dataclass(frozen=True, kw_only=True)
class UnknownCourse:
    """The unknown u against travel [m] in one group of runs, with one sigma; tension [Pa]; all arrays (k,)."""

    label: str
    tension: float
    travel: Array
    u: Array
    sd: Array


@dataclass(frozen=True, kw_only=True)
class LawPoints:
    """The unknown against the variable of its law, as the data show it: points of one tension [Pa]; arrays (k,)."""

    tension: float
    x: Array
    u: Array


@dataclass(frozen=True, kw_only=True)
class FoundLaw:
    """A law that was found: formula as people read it, its variable and unit, parity in yaw, exponent of tension with
    one sigma (None where one tension was run), parameters, the share of the residual's chi2 that it explains, what it
    looks like."""

    formula: str
    place: str
    variable: str
    variable_unit: str
    parity: str
    exponent: Estimate | None
    parameters: Mapping[str, Estimate]
    share: float
    looks_like: str


@dataclass(frozen=True, kw_only=True)
class RivalLaw:
    """A law that the data cannot tell from the found one: chi2 by which it explains less, numbers paid for."""

    formula: str
    place: str
    less: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Discovery(Display):
    """What was discovered, if anything; probability: that something is missing; law: None where no generic law
    describes it; unit: of u; alike: places, in words, at which something may act as well; limits: what these runs
    cannot show; law_file: text of found_law.yaml."""

    base_model: str
    campaign: CampaignLabel
    beside: tuple[str, ...]
    found: bool
    probability: float
    sentence: str
    places: tuple[PlaceEvidence, ...]
    unit: str = ""
    courses: tuple[UnknownCourse, ...] = ()
    law: FoundLaw | None = None
    rivals: tuple[RivalLaw, ...] = ()
    alike: tuple[str, ...] = ()
    against: tuple[LawPoints, ...] = ()
    curve: LawPoints | None = None
    error: Errors | None = None
    limits: tuple[str, ...] = ()
    law_file: str = ""
    provenance: Free = field(default_factory=dict)

    def lines(self) -> list[str]:
        """The verdict, the sentence, the places, what cannot be told apart and what cannot be known."""
        lines = [self.sentence]
        if self.law is not None:
            where = ", at a place that these runs cannot tell" if self.alike else f", at the {self.law.place}"
            verdict = f"Something is missing (probability {self.probability:.2g}), and a law describes it{where}."
            lines.insert(0, verdict)
        if self.found:
            lines += [f"{p.words}: log evidence {p.gain:.0f} ({p.pool})" for p in self.places[:4]]
        lines += [f"not told apart from: {r.formula} ({r.place})" for r in self.rivals]
        if self.error is not None and self.error.held_out is not None:
            change = self.error.held_out
            lines.append(f"held-out error {change.before * 1e3:.3f} -> {change.after * 1e3:.3f} mm")
        return lines + list(self.limits)


class Verdict(StrEnum):
    """What a diagnosis says of the base model."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    PARTLY = "partly"
    NONE_KNOWN = "none_known"
    CANNOT_SAY = "cannot_say"

    @property
    def headline(self) -> str:
        return _SAID[self][0]

    def sentence(self, model: str, effects: Sequence[str], damage: str = "") -> str:
        """The verdict as people would say it; damage: what looks wrong in the data."""
        return _SAID[self][1].format(model=model, effects=join_words(effects), damage=damage)


#: headline and sentence of each
_SAID = {
    Verdict.ADEQUATE: ("Nothing is missing", "{model} agrees with every run."),
    Verdict.EXPLAINED: (
        "Explained",
        "Model {model} lacks {effects}; with it, the model agrees with all runs within measurement error.",
    ),
    Verdict.PARTLY: (
        "Explained in part",
        "Model {model} lacks {effects}, and something else that is not in the library.",
    ),
    Verdict.NONE_KNOWN: (
        "Something unknown is missing",
        "Model {model} disagrees with these runs, and no effect of the catalogue explains the difference.",
    ),
    Verdict.CANNOT_SAY: (
        "This campaign cannot say",
        "The data look damaged, or the sheet is wrong, so no effect is named: {damage}; if you have checked this and "
        "it is right, add checked=true.",
    ),
}


SHOWN_ACTIONS = 3
LIKELY_FROM = 0.9  # probability from which one explanation is called likely
WRONG_MODEL = "Wrong model"  # headline, where another base model explains what this one does not
THE_LAW = "the discovered law"
SOMETHING_UNKNOWN = "something unknown"  # in the place of an effect


@dataclass(frozen=True, kw_only=True)
class TiedSet:
    """One of several explanations that a campaign cannot tell apart: ids of effects (none: nothing more is there);
    sizes: their numbers, by effect."""

    effects: tuple[str, ...]
    probability: float
    sizes: Annotated[Mapping[str, Mapping[str, Estimate]], file_field("sizes", omit_empty=True)] = field(
        default_factory=dict
    )


def _read_suspicion(row: Any) -> Suspicion:
    """Return a suspicion; in a file the two signals of some kinds stand in one text, "y1 and y4"."""
    signal, of_two = row["signal"], row["kind"] in ("swapped", "same_place")
    signals = tuple(signal.split(" and ", 1) if of_two else [signal]) if signal else ()
    return Suspicion(**{k: row[k] for k in ("run", "kind", "sentence", "severity")}, signals=signals)


StoredSuspicion = Annotated[
    InstanceOf[Suspicion],
    BeforeValidator(_read_suspicion),
    PlainSerializer(
        lambda s: {n: getattr(s, n) for n in ("run", "signal", "kind", "sentence", "severity")},
        return_type=dict[str, Any],
    ),
]


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis(Display):
    """What was found, with everything that was tried.

    ranking: every candidate by itself, considered: the table of evidence, likeliest first; tied: what may be there
    besides the effects that every likely explanation has, one of several that these runs cannot tell apart (none where
    one is likely); per_run: base model and final model; admitted: what the admission test said of effects of one's own;
    beyond: where the final model is used beyond its validity, a sentence a limit; discovery: the search for laws beside
    the effects that were found (None: not made); asked_for: number of candidates where they were cut, else None.
    """

    base_model: str
    campaign: CampaignLabel
    verdict: Verdict
    sentence: str
    effects: tuple[FoundEffect, ...]
    ranking: tuple[Candidate, ...]
    considered: tuple[Explanation, ...]
    error: Errors
    where: Where
    confusables: tuple[Confusable, ...]
    next_runs: tuple[NextRun, ...]
    unknown: Unknown | None
    noise: NoiseLevels
    suspicions: tuple[StoredSuspicion, ...]
    per_run: tuple[RunError, ...]
    provenance: Free
    tied: Annotated[tuple[TiedSet, ...], file_field("tied", omit_empty=True)] = ()
    admitted: Annotated[tuple[str, ...], file_field("admitted", omit_empty=True)] = ()
    drawings: Annotated[Drawings, Field(exclude=True)] = field(default_factory=Drawings)
    beyond: Annotated[tuple[str, ...], file_field("beyond_validity", omit_empty=True)] = ()
    asked_for: Annotated[int | None, file_field("effects_asked_for", omit_empty=True)] = None
    discovery: Annotated[Discovery | None, Field(exclude=True)] = None

    @property
    def certain_effects(self) -> tuple[str, ...]:
        """Named effects that every likely explanation has."""
        return tuple(e.id for e in self.effects if not any(e.id in t.effects for t in self.tied))

    @property
    def further_runs(self) -> tuple[str, ...]:
        """Runs to make next, each with what it tells apart; for a pair that no run tells apart, that."""
        told = {n.separates for n in self.next_runs if n.resolves}
        kept = [n for n in self.next_runs if n.resolves or n.separates not in told]
        return tuple(dict.fromkeys(map(str, kept)))

    @property
    def law_holds(self) -> bool:
        """Whether a law was found that predicts what was held out better than nothing does."""
        if self.discovery is None or not self.discovery.found or self.discovery.law is None:
            return False
        change = self.discovery.error.held_out if self.discovery.error is not None else None
        return change is None or change.after < change.before

    @property
    def doubts(self) -> tuple[str, ...]:
        """What takes certainty off the verdict, first of all: a model beyond its limits, damaged data."""
        explained, error = False, self.discovery.error if self.discovery is not None and self.law_holds else None
        if error is not None and (change := error.held_out or error.fit):  # no more error than noise would leave
            explained = change.after <= NO_MORE_THAN_NOISE * error.noise_floor
        seen = [s for s in self.suspicions if not (s.kind == "sheet" and s.severity == "look" and explained)]
        return (*self.beyond, *map(str, seen))

    @property
    def headline(self) -> str:
        """The verdict in a few words, never surer than the doubts beside it allow."""
        if self.tied:
            return f"One of {words.count(len(self.tied))}"
        if self.verdict is Verdict.NONE_KNOWN and any(e.instead for e in self.considered[:1]):
            return WRONG_MODEL
        if self.verdict is Verdict.ADEQUATE and self.considered and not self.considered[0].says_nothing:
            return "Nothing is certain to be missing"
        # a limit that hangs on what nobody states ("if friction is ...") takes no certainty off a model that agrees
        limits = [sentence for sentence in self.beyond if not sentence.startswith("if ")]
        reserved = limits and self.verdict in (Verdict.ADEQUATE, Verdict.EXPLAINED)
        return f"{self.verdict.headline}, with a reservation" if reserved else self.verdict.headline

    @property
    def final_model(self) -> str:
        """The base model with what was found: the named effects, or where there are none the law."""
        found = [e.id for e in self.effects]
        if not found and self.discovery is not None and self.discovery.law is not None:
            found = [THE_LAW]
        return " + ".join([self.base_model, *found])

    def lines(self) -> Sequence[str]:
        """The verdict, where the base model fails, the effects, and how the error fell."""
        said = [f"{self.headline}: {self.sentence}", *self.doubts, self.where.sentence]
        for e in self.effects:
            alike = f"; confusable with {', '.join(map(' + '.join, e.confusable_with))}" if e.confusable_with else ""
            sizes, stamp = ", ".join(e.sizes_on(self.drawings.machine)), f" ({e.stamp})" if e.stamp else ""
            said.append(f"{e.id}: {sizes}; probability {words.decimal(e.probability, 2)}{alike}{stamp}")
        said += error_line(self.error)
        if self.discovery is not None and self.discovery.found:
            said.append(self.discovery.sentence)
        return [*said, *self.further_runs[:1]]

    def tables(self) -> Sequence[Table]:
        rows = []
        for c in self.ranking:
            gains = words.decimal(c.gain, 1), words.decimal(c.threshold, 1), words.column(c.held_out_rms)
            rows.append((c.id, *gains, words.decimal(c.probability, 3), c.note.replace("held-out", "unseen")))
        title = "candidates: chi-square gain, gain needed, rms of unseen runs"
        columns = ("effect", "gain", "needed", "unseen mm", "prob.", "note")
        errors = [(name, words.column(e.before), words.column(e.after)) for name, e in self.error.rows().items()]
        floor = f"error (noise and settings alone: {words.decimal(1e3 * self.error.noise_floor, 3)} mm)"
        beside = Table(floor, ("rms in mm", "before", "after"), errors)
        return [Table(title, columns, rows, left=("effect", "note")), beside]

    def to_pandas(self) -> Any:
        """The candidates, best first: gain, threshold, held-out rms [m], and their notes."""
        import pandas as pd

        names = ("id", "gain", "threshold", "held_out_rms", "plausible", "probability", "note")
        return pd.DataFrame([{n: getattr(c, n) for n in names} for c in self.ranking])

    to_xarray = error_grid


def error_line(error: Errors) -> list[str]:
    """How the error on held-out conditions fell, beside each run's own zero and settings where that is known."""
    change, floor, beside, alone = error.held_out, error.noise_floor, "", "noise and settings alone"
    if error.own is not None:
        change, floor, alone = error.own, error.own.floor, "noise alone"
        beside = ", after correcting sensor zero and settings"
    if change is None:
        return []
    before, after, least = (words.thousandths(x) for x in (change.before, change.after, floor))
    said = [f"error on unseen runs{beside} {before} -> {after} mm, {alone} {least} mm"]
    worse = [f"{n} {words.thousandths(c.before)} -> {words.thousandths(c.after)} mm" for n, c in error.worse().items()]
    return [*said, f"left out and predicted, these got worse: {', '.join(worse)}"] if worse else said
