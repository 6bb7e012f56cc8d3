"""The decision: a pure function of a table and a policy.

log posterior of an explanation = log marginal likelihood (Laplace) + log prior. A fault's size is unknown to its order
of magnitude: its scale is uniform in logarithm over some decades below what is plausible (a Gaussian as wide as that
would pay for room that no reading asks about: Lindley's paradox). A difference of chi2 counts by what chance makes of
one.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from math import comb, log

import numpy as np

from belt_sim.results.verdict import Verdict
from belt_sim.results.words import TOGETHER
from studies.score.policy import Policy
from studies.score.table import Beyond, Ids, Row, Table

#: a set of named effects, and whether something beyond the library is at work beside it
Key = tuple[Ids, bool]
NOTHING: Key = (frozenset(), False)
ROUNDS = 3  # over the scales of all effects of a set, one after the other


@dataclass(frozen=True)
class Decision:
    """verdict; named: effect -> probability; confusable: effect -> what may stand in its place; log_posterior and
    probability of every explanation.
    """

    verdict: Verdict
    named: Mapping[str, float]
    confusable: Mapping[str, tuple[str, ...]]
    log_posterior: Mapping[Key, float]
    probability: Mapping[Key, float]


def decide(table: Table, policy: Policy) -> Decision:
    """The verdict that a table asks for."""
    if table.damaged:
        return Decision(Verdict.CANNOT_SAY, {}, {}, {}, {})
    score = scores(table, policy)
    whole = np.logaddexp.reduce(list(score.values()))
    share = {key: float(np.exp(value - whole)) for key, value in score.items()}
    ids, beyond = max(share, key=lambda key: share[key])
    if share[NOTHING] > policy.alarm:
        ids, beyond = NOTHING
    if beyond:
        ids &= table.steadfast
    verdict = (Verdict.PARTLY if beyond else Verdict.EXPLAINED) if ids else None
    verdict = verdict or (Verdict.NONE_KNOWN if beyond else Verdict.ADEQUATE)
    named = {i: sum(p for (other, _), p in share.items() if i in other) for i in sorted(ids)}
    alike = _confusable(ids, credible(share, policy)) if ids and not beyond else {}
    return Decision(verdict, named, alike, score, share)


def scores(table: Table, policy: Policy) -> dict[Key, float]:
    """log posterior of every explanation over that of nothing."""
    nothing = next(row for row in table.rows if not row.ids)
    each = {row.ids: _log_posterior(row, nothing, table, policy) for row in table.rows if row.plausible}
    found = {(row.ids, False): each[row.ids] for row in table.rows if row.plausible and _predicts(row, nothing, policy)}
    for b in table.beyond:
        if b.beside in each:
            odds = log(policy.unknown) + (log(policy.further) if b.beside else 0.0)  # it is one fault more
            found[b.beside, True] = each[b.beside] + evidence(b, table.inflation, policy) - odds
    return found


def _predicts(row: Row, nothing: Row, policy: Policy) -> bool:
    """The posterior predictive check: whether what was left out does not become less likely."""
    rise = sum(value - nothing.held_out[name] for name, value in row.held_out.items())
    return not row.ids or rise <= policy.held_out


def _log_posterior(row: Row, nothing: Row, table: Table, policy: Policy) -> float:
    count = len(row.ids)
    prior = -log(comb(table.candidates, count)) - log(policy.further) * (count - 1) if count else 0.0
    return 0.5 * (nothing.chi2 - row.chi2) / table.inflation - occam(row, table.inflation, policy) + prior


def occam(row: Row, inflation: float, policy: Policy) -> float:
    """What a row's numbers cost [nats]: log likelihood at the best point over marginal likelihood."""
    owners = [i for i in sorted(row.ids) if any(o == i and s for o, s in zip(row.owner, row.sized, strict=True))]
    scales = _scales(policy)
    chosen = dict.fromkeys(owners, float(scales[len(scales) // 2]))
    among: dict[str, float] = {}  # what the choice of each scale costs
    for _, name in product(range(ROUNDS), owners):
        cost = np.array([_at_scales(row, chosen | {name: float(s)}, inflation) for s in scales])
        chosen[name] = float(scales[int(np.argmin(cost))])
        among[name] = log(len(scales)) - float(np.logaddexp.reduce(cost.min() - cost))
    return _at_scales(row, chosen, inflation) + sum(among.values())


def _at_scales(row: Row, scales: Mapping[str, float], inflation: float) -> float:
    """The same with Gaussian priors of these scales of what is plausible."""
    if not len(row.away):
        return 0.0
    scale = np.array([scales[o] if s else 1.0 for o, s in zip(row.owner, row.sized, strict=True)])
    sigma = np.maximum(row.sigma * scale, 1e-12)
    size, vectors = np.linalg.eigh(row.gram * np.outer(sigma, sigma))
    size, along = np.maximum(size, 0.0), vectors.T @ (row.away / sigma)
    return 0.5 * float(np.sum(size / (1.0 + size) * along**2)) / inflation + 0.5 * float(np.sum(np.log1p(size)))


def _scales(policy: Policy) -> np.ndarray:
    return 10.0 ** np.linspace(-policy.decades, 0.0, int(policy.decades * policy.per_decade) + 1)


def evidence(beyond: Beyond, inflation: float, policy: Policy) -> float:
    """log evidence of something beyond the library: any course at any place, or any law of the dictionary."""
    course = np.logaddexp.reduce(beyond.courses / inflation) - log(len(beyond.courses)) - policy.scanned
    laws = [
        free_size(law.gain / inflation, law.sizes, policy) - 0.5 * law.cost - log(beyond.tried) for law in beyond.laws
    ]
    return float(np.logaddexp.reduce([course, *laws]))


def free_size(gain: float, sizes: int, policy: Policy) -> float:
    """log evidence of sizes that gain so much chi2, their scale uniform in logarithm above one sigma."""
    square = (1.0 / _scales(policy)) ** 2
    each = 0.5 * gain * square / (1.0 + square) - 0.5 * sizes * np.log1p(square)
    return float(np.logaddexp.reduce(each)) - log(len(each))


def credible(share: Mapping[Key, float], policy: Policy) -> list[Ids]:
    """The sets of the likeliest explanations that together hold enough of the probability, likeliest first."""
    found, held = list[Ids](), 0.0
    for ids, beyond in sorted(share, key=lambda key: -share[key]):
        if held >= policy.credible:
            break
        held += share[ids, beyond]
        found.append(ids)
    return found


def _confusable(ids: Ids, sets: Iterable[Ids]) -> dict[str, tuple[str, ...]]:
    """Effect -> what stands in its place in other sets: one or several effects, or itself with one more."""
    found: dict[str, list[str]] = {}
    for other in sets:
        gone, come = sorted(ids - other), sorted(other - ids)
        if len(gone) == 1 and come:
            found.setdefault(gone[0], []).append(TOGETHER.join(come))
        elif not gone and come:
            last = max(ids)
            found.setdefault(last, []).append(TOGETHER.join([last, *come]))
    return {name: tuple(dict.fromkeys(others)) for name, others in found.items()}
