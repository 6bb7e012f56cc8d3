"""Which law: every form at every place, alone and in pairs, by how much of the residual it explains.

All sizes are free; gains are projected, so that nuisances and chosen effects have had their say. A law of more numbers
must earn them (cost).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from belt_sim.discovery.survey import Survey
from belt_sim.discovery.tables import Across, Products, products
from belt_sim.effects.law_terms import Form, Law, Place, Term

WITHIN = 6.0  # chi2: a likelihood ratio of 20
EXPONENTS = (0.0, -1.0, -2.0, 1.0)
FIRSTS, SECONDS = 12, 12
STEP_OF_GRID = 1.8  # ratio to the next knee or length of the grid
HIDDEN = 2e-3  # share of a column that must be left beside what is chosen
TERM, NUMBER, WAVE, EXPONENT, APART = 26.0, 3.0, 4.0, 2.0, 4.0  # what a law's numbers must earn, in chi2


@dataclass(frozen=True)
class Scored:
    """A law, the chi2 it explains, the same less what its numbers cost, and its sizes where they are known."""

    law: Law
    gain: float
    score: float
    sizes: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Ranked:
    """Laws of one term, best first: they are made as they are asked for.

    tables: place, its forms and an exponent; gain, score: of every form of every table; halves: 2 of a wave, else 1.
    """

    tables: list[tuple[Place, list[Form], float]]
    gain: np.ndarray
    score: np.ndarray
    halves: np.ndarray

    def __len__(self) -> int:
        return len(self.gain)

    def __iter__(self) -> Iterator[Scored]:
        starts = np.cumsum([0, *(len(forms) for _, forms, _ in self.tables)])
        for k in np.argsort(-self.score, kind="stable"):
            of = int(np.searchsorted(starts, k, side="right")) - 1
            place, forms, exponent = self.tables[of]
            law = Law((Term(place, forms[k - starts[of]], exponent),))
            yield Scored(law, float(self.gain[k]), float(self.score[k]))


def ranked(tables: list[tuple[Place, list[Form], float]], gains: list[np.ndarray]) -> Ranked:
    """Laws of one term by their gains, an array a table."""
    prices, halves = [], []
    known: dict[int, tuple[np.ndarray, np.ndarray]] = {}  # of a list of forms
    for _, forms, exponent in tables:
        if id(forms) not in known:
            known[id(forms)] = np.array([_price(f, 0.0) for f in forms]), np.array([1 + f.is_wave for f in forms])
        price, half = known[id(forms)]
        prices.append(price + EXPONENT * (exponent != 0.0))
        halves.append(half)
    gain = np.concatenate(gains).astype(float)
    return Ranked(tables, gain, gain - np.concatenate(prices), np.concatenate(halves))


def cost(law: Law) -> float:
    """What a law's numbers must earn."""
    total = TERM * (len(law.terms) - 1)
    total += sum(_price(t.form, t.exponent) for t in law.terms)
    return total + (APART if len({t.place.name for t in law.terms}) > 1 else 0.0)


def _price(form: Form, exponent: float) -> float:
    """Of the numbers of one term."""
    return NUMBER * form.numbers + EXPONENT * (exponent != 0.0) + (WAVE if form.is_wave else 0.0)


def gain_of(survey: Survey, law: Law) -> float:
    """chi2 that a law explains."""
    return fitted(survey, survey.columns(law))[0]


def fitted(survey: Survey, columns: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """(chi2 explained, sizes (k,), covariance (k, k)) of whitened columns (k, R, m)."""
    ground = survey.ground
    flat = columns.reshape(len(columns), -1)
    along = flat @ ground.residual.ravel()
    onto, own = flat @ ground.shared.reshape(len(ground.shared), -1).T, flat @ flat.T
    left = own - onto @ ground.inverse @ onto.T
    pull = along - onto @ ground.inverse @ ground.shared_residual
    scale = 1.0 / np.sqrt(np.maximum(np.diag(own), 1e-300))
    if not np.isfinite(left).all() or np.any(np.diag(left) * scale**2 < HIDDEN):
        return 0.0, np.zeros(len(pull)), np.zeros_like(left)
    inverse = np.linalg.pinv(left * np.outer(scale, scale), rcond=1e-6, hermitian=True)
    sizes = scale * (inverse @ (pull * scale))
    return float(pull @ sizes), sizes, inverse * np.outer(scale, scale)


def gains(p: Products, weight: np.ndarray, targets: int, beside: list[int], inverse, along) -> np.ndarray:
    """chi2 gains (F, targets) with run weights (R,).

    Vectors 0..targets-1 are what is explained, ``beside`` those taken out; inverse: of their Gram matrix and prior;
    along (c, targets): their products with the targets.
    """
    taken = inverse @ along

    def projected(vectors):
        onto = (weight.astype(vectors.dtype) @ vectors.reshape(len(weight), -1)).reshape(vectors.shape[1:])
        return onto[:, :targets] - onto[:, beside] @ taken, onto[:, beside]

    pull, onto = projected(p.with_vectors)
    whole = p.own @ weight**2
    left = whole - np.einsum("fc,fc->f", onto @ inverse, onto)
    seen = left > HIDDEN * whole + 1e-30
    gain = pull**2 * np.where(seen, 1.0 / np.where(seen, left, 1.0), 0.0)[:, None]
    k = p.waves
    if len(k):
        pull1, (pull2, onto2) = pull[k], projected(p.sine_vectors)
        left1, left2 = left[k], p.sine @ weight**2 - np.einsum("fc,fc->f", onto2 @ inverse, onto2)
        both = p.cross @ weight**2 - np.einsum("fc,fc->f", onto[k] @ inverse, onto2)
        det = left1 * left2 - both**2
        fine = (det > 1e-6 * np.maximum(left1 * left2, 1e-30)) & (left2 > 0.0)
        top = left2[:, None] * pull1**2 + left1[:, None] * pull2**2 - 2.0 * both[:, None] * pull1 * pull2
        gain[k] = np.where(fine[:, None], top / np.where(fine, det, 1.0)[:, None], gain[k])
    return np.where(np.isfinite(gain), gain, 0.0)  # a form beyond the range of numbers is no law


def singles(survey: Survey) -> Ranked:
    """Every form at every place with every exponent, best first."""
    g = survey.ground
    across = Across(np.concatenate([g.residual[None], g.shared]))
    beside, along = list(range(1, 1 + len(g.shared))), np.einsum("crm,rm->c", g.shared, g.residual)[:, None]
    tables, found = [], []
    for place in survey.tried:
        p = products(survey, place, across)
        for n in exponents_of(survey):
            tables.append((p.place, p.forms, n))
            found.append(gains(p, survey.weight(n), 1, beside, g.inverse, along)[:, 0])
    return ranked(tables, found)


def exponents_of(survey: Survey) -> tuple[float, ...]:
    """Exponents of tension to try: only 0 where one tension was run."""
    return EXPONENTS if len(np.unique(survey.stated_tension)) > 1 else (0.0,)


def _scored(law: Law, gain: float) -> Scored:
    return Scored(law, float(gain), float(gain) - cost(law))


def distinct(scored: Iterable[Scored], count: int, each: int = 1) -> list[Scored]:
    """The first ``count`` that say different things, at most ``each`` of the same kind."""
    seen: dict = {}
    kept = []
    for s in scored:
        key = s.law.family
        seen[key] = seen.get(key, 0) + 1
        if seen[key] <= each:
            kept.append(s)
        if len(kept) == count:
            break
    return kept


def pairs(survey: Survey, firsts: list[Scored]) -> list[Scored]:
    """The best second term beside each of ``firsts``, best first."""
    g = survey.ground
    own = [survey.columns(s.law) for s in firsts]
    vectors = np.concatenate([g.residual[None], g.shared, *own])
    start = 1 + len(g.shared)
    spans = np.cumsum([start, *[len(c) for c in own]])
    prior = g.gram - np.einsum("crm,drm->cd", g.shared, g.shared)
    across = Across(vectors)
    tables = [products(survey, place, across) for place in survey.tried]
    found: list[Scored] = []
    for first, low, high in zip(firsts, spans[:-1], spans[1:], strict=True):
        beside = [*range(1, start), *range(low, high)]
        block = vectors[beside]
        gram = np.einsum("crm,drm->cd", block, block)
        gram[: start - 1, : start - 1] += prior
        inverse = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)
        along = np.einsum("crm,rm->c", block, g.residual)
        more: list[Scored] = []
        for p in tables:
            for n in exponents_of(survey):
                gain = gains(p, survey.weight(n), 1, beside, inverse, along[:, None])[:, 0]
                for k in np.argsort(-gain)[:SECONDS]:
                    law = Law((*first.law.terms, Term(p.place, p.forms[k], n)))
                    more.append(_scored(law, first.gain + gain[k]))
        found += distinct(sorted(more, key=lambda s: -s.score), SECONDS)
    return sorted(found, key=lambda s: -s.score)


def refined(survey: Survey, scored: Scored) -> Scored:
    """The law with its shape numbers at their best, one after the other."""
    law, gain = scored.law, gain_of(survey, scored.law)
    for k, term in enumerate(law.terms):
        for number in ("knee", "at", "wide"):
            value = getattr(term.form, number)
            if value is None:
                continue
            off = np.log(_neighbour(survey, term.form) if number == "at" else STEP_OF_GRID)
            others = [survey.columns(Law((t,))) for t in law.terms]

            def loss(x: float, law=law, k=k, number=number, others=others) -> float:
                own = survey.columns(Law((_put(law, k, number, float(np.exp(x))).terms[k],)))
                return -fitted(survey, np.concatenate([*others[:k], own, *others[k + 1 :]]))[0]

            best = minimize_scalar(
                loss,
                bounds=(np.log(value) - off, np.log(value) + off),
                method="bounded",
                options={"maxiter": 14, "xatol": 1e-3},
            )
            if -best.fun > gain:
                law, gain = _put(law, k, number, float(np.exp(best.x))), float(-best.fun)
    return _scored(law, gain)


def _put(law: Law, k: int, number: str, value: float) -> Law:
    """The law with a number of its k-th term changed."""
    term = law.terms[k]
    changed: dict = {number: value}
    return Law((*law.terms[:k], replace(term, form=replace(term.form, **changed)), *law.terms[k + 1 :]))


def _neighbour(survey: Survey, form: Form) -> float:
    """Ratio to the next number of the grid."""
    end = float(survey.states.s[-1]) / (float(np.min(survey.states.speed)) if form.timed else 1.0)
    if form.carried:
        return 1.0 + 0.5 * float(form.wide or 1.0) / float(form.at or 1.0)
    if form.is_wave:
        return 1.0 + 0.5 * float(form.at or 1.0) / end
    if form.course in ("step", "interval"):
        return 1.0 + end / 12.0 / float(form.at or 1.0)
    return 2.0
