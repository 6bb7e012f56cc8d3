"""The decision: a pure function of a table and a policy.

log posterior of an explanation = log marginal likelihood (Laplace's approximation; Kass & Raftery 1995, J. Am. Stat.
Assoc. 90, 773) + log prior. The size of a fault is unknown to its order of magnitude: its scale is uniform in logarithm
over some decades below what is plausible. (A Gaussian as wide as what is plausible would make every small fault
unlikely: Lindley's paradox.) A difference of chi2 counts by what chance makes of one.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from math import comb, log

import numpy as np

from belt_sim.results.diagnosis import LIKELY_FROM, SOMETHING_UNKNOWN, Explanation, TiedSet, Verdict

# Every constant of the decision.


@dataclass(frozen=True, kw_only=True)
class Policy:
    """What is declared before any reading. All but ``chance`` are judgements; none is fitted to single campaigns.

    further: odds of one fault against one more, 1
    unknown: odds of no unknown law against one, 1
    scales: of the size of a fault, over the largest plausible, that are tried: three orders of magnitude
    chance: log evidence [nats] of a free input, its length and height chosen among 68, that chance exceeds in one of
        100 campaigns. It is the one number that was calibrated: 7.5 +- 1.5 on 97 campaigns in which nothing is hidden
    linear: share of a difference in fit, to which the linear range is good: less far behind, a law is searched for all
        the same. Calibrated: in 14 blind campaigns searches lifted laws by up to 6.5 % of it
    held_out: -2 log of the predictive density, by which whole conditions that were left out may become less likely than
        with nothing
    alarm: probability of nothing, below which something is said: a false alarm costs twenty times what a miss does
    credible: probability in the set of explanations that cannot be told apart
    likely: probability from which one of them is the answer; below it, they are tied
    sized: sigma by which one size of an effect has to be off nothing, or its probability counts as ``unsure`` at most
    unsure: highest probability of an effect without such a size, or that one run alone shows, unlike its repeats
    like_one_change_of_the_span: an error of the load cell does nearly what one change of a span's stiffness does, as a
        span knows its tension by F/EI and F/T; with it a crown or an edge guide makes up for a slope
    """

    further: float = 10.0
    unknown: float = 10.0
    scales: tuple[float, ...] = tuple((10.0 ** np.linspace(-3.0, 0.0, 7)).tolist())
    chance: float = 7.0
    linear: float = 0.1
    held_out: float = 2.0
    alarm: float = 0.05
    credible: float = 0.95
    likely: float = LIKELY_FROM
    sized: float = 2.0
    unsure: float = 0.5
    like_one_change_of_the_span: tuple[str, ...] = ("tension_bias", "crown", "edge_guide")


POLICY = Policy()


# The table of evidence: what joint fits and searches say of a campaign, as plain numbers.


Ids = frozenset[str]


@dataclass(frozen=True, kw_only=True)
class Row:
    """A set of named effects, fitted jointly on the metric that all rows share.

    chi2: at the best point; gram (k, k): products of whitened derivatives; away (k,): the numbers in units of their
    scales; sigma (k,): the largest that a machine may have, for harmonics what they have in common; owner (k,): the
    effect of each number; sized (k,): whether it takes its effect's scale (a number that only shapes, and a harmonic,
    have their own); scanned: of every further number, which was scanned over a grid, how many values were tried;
    plausible: whether a real machine could have these numbers; held_out: condition that can be tested -> -2 log of its
    predictive density.
    """

    ids: Ids
    chi2: float
    gram: np.ndarray
    away: np.ndarray
    sigma: np.ndarray
    owner: tuple[str, ...]
    sized: np.ndarray
    scanned: tuple[int, ...] = ()
    plausible: bool = True
    held_out: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class OtherModel:
    """Another base model in the place of effects, with nothing fitted.

    name: as the user would set it; chi2: on the same metric; rms: of its lateral errors [m]; tried: how many were.
    """

    name: str
    chi2: float
    rms: float = 0.0
    tried: int = 1


@dataclass(frozen=True, kw_only=True)
class LawEvidence:
    """A generic law: its chi2 gain, what its numbers must earn [chi2], and of how many sizes it is."""

    gain: float
    cost: float
    sizes: int


@dataclass(frozen=True, kw_only=True)
class UnknownEvidence:
    """What is seen beside a set of named effects.

    courses: log evidence of a free course of the unknown at every place and way of pooling runs, over that of none;
    laws: the best of the dictionary; tried: how many of one term were tried.
    """

    ids: Ids
    courses: np.ndarray
    laws: tuple[LawEvidence, ...]
    tried: float


@dataclass(frozen=True, kw_only=True)
class EvidenceTable:
    """All that a decision rests on.

    candidates: how many effects could be named; inflation: by how much chance gains more than its degrees of freedom,
    the noise being uncertain; damaged: whether the data look so; additive: effects that only add to the readings, so
    that something unknown in the belt's movement neither changes them nor is imitated by them; visible: effects that
    these readings would show at a plausible size (None: not asked).
    """

    candidates: int
    inflation: float
    damaged: bool
    rows: tuple[Row, ...]
    unknown: tuple[UnknownEvidence, ...] = ()
    other_models: tuple[OtherModel, ...] = ()
    additive: Ids = frozenset()
    visible: Ids | None = None


SCALE_ROUNDS = 3  # over the scales of all effects of a set, one after the other


@dataclass(frozen=True)
class Decision:
    """verdict; named: effect -> probability; confusable: effect -> sets of effects that may stand in its place;
    explanations: all that were compared, likeliest first; instead: the name of another base
    model, where that is the likeliest.
    """

    verdict: Verdict
    named: Mapping[str, float]
    confusable: Mapping[str, tuple[tuple[str, ...], ...]]
    explanations: tuple[Explanation, ...]
    instead: str = ""

    @property
    def tells_of_unknown(self) -> bool:
        """Whether the verdict is that something unknown is there."""
        return self.verdict in (Verdict.PARTLY, Verdict.NONE_KNOWN) and not self.instead

    @property
    def likeliest_unknown(self) -> Explanation:
        """The likeliest with something unknown; of all the likeliest where none was compared."""
        return next((e for e in self.explanations if e.unknown and not e.refused), self.explanations[0])

    @property
    def probability_of_unknown(self) -> float:
        """That something unknown is there, alone or beside effects."""
        return min(sum(e.probability for e in self.explanations if e.unknown), 1.0)

    def tied(self, policy: Policy) -> tuple[TiedSet, ...]:
        """What may be there besides the effects that every likely explanation has, one of several that readings cannot
        tell apart, likeliest first; () where one is likely."""
        likely = [e for e in credible(self.explanations, policy) if not e.instead]
        if self.verdict is not Verdict.EXPLAINED or len(likely) < 2 or likely[0].probability >= policy.likely:
            return ()
        certain = frozenset.intersection(*(frozenset(e.effects) for e in likely))
        found = dict[tuple[str, ...], float]()
        for e in likely:
            further = (*(i for i in e.effects if i not in certain), *([SOMETHING_UNKNOWN] if e.unknown else []))
            found[further] = found.get(further, 0.0) + e.probability
        return tuple(TiedSet(effects=ids, probability=p) for ids, p in found.items())

    def in_every_explanation(self, policy: Policy) -> tuple[str, ...]:
        """Effects that all likely explanations have, beside something unknown as well, and that are not named."""
        if not self.tells_of_unknown:
            return ()
        likely = [frozenset(e.effects) for e in credible(self.explanations, policy)]
        return tuple(sorted(frozenset.intersection(*likely) - frozenset(self.named))) if likely else ()

    def like_one_change_of_the_span(self, policy: Policy) -> tuple[str, ...]:
        """The named effects that together do nearly what one change of a span's stiffness does; none, or some."""
        first, *others = policy.like_one_change_of_the_span
        return (*(name for name in others if name in self.named), first) if first in self.named else ()

    def law_sets(self, table: EvidenceTable) -> tuple[Ids, ...]:
        """The sets of effects beside which a law is fitted in the march: none, and those that only add to the readings
        of the likeliest set with something unknown.

        A crooked edge takes on part of an unknown that comes round with the belt: only a law alone tells that it is
        none.
        """
        return tuple(dict.fromkeys([frozenset(self.likeliest_unknown.effects) & table.additive, frozenset[str]()]))

    def suspects_something_unknown(self, table: EvidenceTable, policy: Policy) -> bool:
        """Whether something unknown may be there, so that its law is worth a search.

        A search changes the rows of ``law_sets`` and no others, and lifts them by what its law gains. Beside the
        likeliest effects the linear range has that gain to first order. In the place of some of them a row counts where
        a law as good as can be would pass the alarm, and which is behind by less than a share of what they explain
        (docs/diagnosis.md).
        """
        if self.instead:
            return False
        if self.probability_of_unknown > policy.alarm:
            return True
        best, sets = self.explanations[0], self.law_sets(table)
        unknown = [e for e in self.explanations if e.unknown and frozenset(e.effects) in sets]
        for e in (e for e in unknown if set(e.effects) < set(best.effects)):
            near = best.log_posterior - e.log_posterior < policy.linear * (best.likelihood - e.likelihood)
            if near and self.most_probable_unknown(table, frozenset(e.effects), policy) > policy.alarm:
                return True
        return False

    def most_probable_unknown(self, table: EvidenceTable, ids: Ids, policy: Policy) -> float:
        """The probability of something unknown if a further law beside the effects ``ids`` explained the most that one
        may."""
        law = LawEvidence(gain=self.most_of_a_law(table, ids), cost=0.0, sizes=1)
        return unknown_with_laws(table, ids, [law], policy)

    def could_change(self, table: EvidenceTable, ids: Ids, laws: Iterable[LawEvidence], policy: Policy) -> bool:
        """Whether something unknown is likelier than ``alarm``, or would be with these laws beside the effects."""
        return unknown_with_laws(table, ids, laws, policy) > policy.alarm

    def most_of_a_law(self, table: EvidenceTable, ids: Ids) -> float:
        """chi2 that a law beside the effects ``ids`` may explain, less what its form costs: what the likeliest effects
        do, and what a law or a free input does beside them; where that is not known, all that is left.

        A law's gain is at most that of itself and the effects together: theirs, and to first order its own beside them.
        """
        best = frozenset(self.explanations[0].effects)
        known = {frozenset(e.effects): e.gain for e in self.explanations if not e.unknown and not e.instead}
        for b in table.unknown:
            if b.ids == best:
                seen = [0.0, *(law.gain - law.cost for law in b.laws), *(2.0 * b.courses)]  # courses are in nats
                return float(known[best] - known.get(ids, 0.0) + max(seen))
        return next(row.chi2 for row in table.rows if not row.ids) - known.get(ids, 0.0)


def unknown_with_laws(table: EvidenceTable, ids: Ids, laws: Iterable[LawEvidence], policy: Policy) -> float:
    """The probability of something unknown with these laws as well beside the effects ``ids``."""
    rows = tuple(replace(b, laws=(*b.laws, *laws)) if b.ids == ids else b for b in table.unknown)
    return sum(e.probability for e in explanations(replace(table, unknown=rows), policy) if e.unknown)


def decide(table: EvidenceTable, policy: Policy) -> Decision:
    """The verdict that a table asks for."""
    found = explanations(table, policy)
    if table.damaged:
        return Decision(Verdict.CANNOT_SAY, {}, {}, found)
    best = found[0]
    nothing = next(e for e in found if e.says_nothing)
    if nothing.probability > policy.alarm:
        best = nothing
    if best.instead:
        return Decision(Verdict.NONE_KNOWN, {}, {}, found, best.instead)
    ids = frozenset(best.effects)
    if best.unknown:
        ids &= table.additive
    verdict = (Verdict.PARTLY if best.unknown else Verdict.EXPLAINED) if ids else None
    silent = table.visible is not None and not table.visible  # nothing said by readings that could say nothing
    verdict = verdict or (Verdict.NONE_KNOWN if best.unknown else Verdict.CANNOT_SAY if silent else Verdict.ADEQUATE)
    named = {i: min(sum(e.probability for e in found if i in e.effects), 1.0) for i in sorted(ids)}
    # what stands in the place of each effect in other likely sets: one or several effects, or itself with one more;
    # where several give way to others, these stand in the place of each of them
    alike: dict[str, dict[tuple[str, ...], None]] = {}
    for e in credible(found, policy) if ids and not best.unknown else ():
        gone, come = sorted(ids - {*e.effects}), sorted({*e.effects} - ids)
        if come and not e.instead:
            for name in gone or [max(ids)]:
                alike.setdefault(name, {})[(*come,) if gone else (name, *come)] = None
    return Decision(verdict, named, {name: tuple(others) for name, others in alike.items()}, found)


def explanations(table: EvidenceTable, policy: Policy) -> tuple[Explanation, ...]:
    """Every explanation with its probability, likeliest first; of two alike the one of fewer effects."""
    nothing = next(row for row in table.rows if not row.ids)
    each: dict[Ids, Explanation] = {}
    for row in table.rows:  # named effects
        rise = sum(value - nothing.held_out[name] for name, value in row.held_out.items()) if row.ids else 0.0
        refused = "predicts what is held out worse than nothing does" if row.ids and rise > policy.held_out else ""
        each[row.ids] = Explanation(
            effects=tuple(sorted(row.ids)),
            gain=nothing.chi2 - row.chi2,
            likelihood=0.5 * (nothing.chi2 - row.chi2) / table.inflation,
            parameters=len(row.away) + len(row.scanned),
            occam=occam(row, table.inflation, policy),
            prior=_log_prior(len(row.ids), table, policy),
            held_out_rise=rise,
            implausible=not row.plausible,
            refused=refused if row.plausible else "no machine has such numbers",
        )
    found = list(each.values())
    for b in table.unknown:  # something unknown beside these
        alone = each[b.ids]
        if not alone.implausible:
            more = log(policy.unknown) + (log(policy.further) if b.ids else 0.0)  # it is one fault more
            seen = log_evidence(b, table.inflation, policy)
            prior = alone.prior - more
            found.append(replace(alone, unknown=True, unknown_evidence=seen, prior=prior, refused=""))
    for other in table.other_models:  # nothing is fitted
        gain = nothing.chi2 - other.chi2
        prior, likelihood = -log(policy.further) - log(other.tried), 0.5 * gain / table.inflation
        found.append(
            Explanation(
                effects=(), instead=other.name, gain=gain, likelihood=likelihood, parameters=0, occam=0.0, prior=prior
            )
        )
    score = np.array([-np.inf if e.refused else e.log_posterior for e in found])
    share = np.exp(score - np.logaddexp.reduce(score))
    made = [replace(e, probability=float(p)) for e, p in zip(found, share, strict=True)]
    return tuple(sorted(made, key=lambda e: (bool(e.refused), -e.log_posterior, len(e.effects))))


def needed_gain(row: Row, table: EvidenceTable, policy: Policy) -> float:
    """The chi2 gain from which a row's effects are likelier than that nothing is missing."""
    return 2.0 * table.inflation * (occam(row, table.inflation, policy) - _log_prior(len(row.ids), table, policy))


def _log_prior(count: int, table: EvidenceTable, policy: Policy) -> float:
    """log prior odds of one set of so many of the candidates against that nothing is missing."""
    return -log(comb(table.candidates, count)) - log(policy.further) * (count - 1) if count else 0.0


def would_show(row: Row, table: EvidenceTable, policy: Policy) -> bool:
    """Whether one of a row's sizes, the largest that a machine may have, would be told."""
    gain = np.max(np.diag(row.gram)[row.sized] * row.sigma[row.sized] ** 2, initial=0.0)
    told = 2.0 * table.inflation * log(1.0 / policy.alarm - 1.0)
    return bool(gain > needed_gain(row, table, policy) + told)


def occam(row: Row, inflation: float, policy: Policy) -> float:
    """What a row's numbers cost [nats]: log likelihood at the best point over marginal likelihood.

    A number that is scanned pays for the values that were tried (trial factor; Gross & Vitells 2010, Eur. Phys. J. C
    70, 525).
    """
    owners = [i for i in sorted(row.ids) if any(o == i and s for o, s in zip(row.owner, row.sized, strict=True))]
    scales = np.array(policy.scales)
    chosen = dict.fromkeys(owners, float(scales[len(scales) // 2]))
    among: dict[str, float] = {}  # what the choice of each scale costs
    for _, name in product(range(SCALE_ROUNDS), owners):
        cost = _occam_at_scales(row, chosen | {name: scales}, inflation)
        chosen[name] = float(scales[int(np.argmin(cost))])
        among[name] = log(len(scales)) - float(np.logaddexp.reduce(cost.min() - cost))
    return float(_occam_at_scales(row, chosen, inflation)[0]) + sum(among.values()) + sum(map(log, row.scanned))


def _occam_at_scales(row: Row, scales: Mapping[str, float | np.ndarray], inflation: float) -> np.ndarray:
    """The same with Gaussian priors of these scales of what is plausible, of which one may be several (S,): (S,)."""
    if not len(row.away):
        return np.zeros(max(np.size(s) for s in scales.values()) if scales else 1)
    own = [scales[o] if s else 1.0 for o, s in zip(row.owner, row.sized, strict=True)]
    sigma = np.maximum(row.sigma * np.stack(np.broadcast_arrays(*map(np.atleast_1d, own)), axis=-1), 1e-12)
    size, vectors = np.linalg.eigh(row.gram * sigma[:, :, None] * sigma[:, None, :])
    size, along = np.maximum(size, 0.0), np.einsum("skj,sk->sj", vectors, row.away / sigma)
    return 0.5 * np.sum(size / (1.0 + size) * along**2, axis=1) / inflation + 0.5 * np.sum(np.log1p(size), axis=1)


def log_evidence(unknown: UnknownEvidence, inflation: float, policy: Policy) -> float:
    """log evidence of something beyond the library: any free course at any place, or any law of the dictionary.

    The best of so many pays for their number.
    """
    course = np.logaddexp.reduce(unknown.courses / inflation) - log(len(unknown.courses)) - policy.chance
    square = (1.0 / np.array(policy.scales)) ** 2  # of a law's sizes, their scale uniform in logarithm above one sigma
    found = [course]
    for law in unknown.laws:
        each = 0.5 * law.gain / inflation * square / (1.0 + square) - 0.5 * law.sizes * np.log1p(square)
        found.append(float(np.logaddexp.reduce(each)) - log(len(each)) - 0.5 * law.cost - log(unknown.tried))
    return float(np.logaddexp.reduce(found))


def probability_of_unknown(unknown: UnknownEvidence, policy: Policy, inflation: float = 1.0) -> float:
    """Probability that something unknown is there beside effects that are known to be."""
    odds = log_evidence(unknown, inflation, policy) - log(policy.unknown)
    return float(1.0 / (1.0 + np.exp(-np.clip(odds, -700.0, 700.0))))


def credible(found: Iterable[Explanation], policy: Policy) -> list[Explanation]:
    """The likeliest explanations that together hold enough of the probability, likeliest first."""
    likely, held = list[Explanation](), 0.0
    for e in found:
        if held >= policy.credible or e.refused:
            break
        held += e.probability
        likely.append(e)
    return likely
