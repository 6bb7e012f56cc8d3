"""Laws in the linear range: every form at every place, alone and in pairs, by how much chi2 it explains.

All sizes are free; gains are those beside the nuisances and the chosen effects. A law of more numbers must earn them
(``cost``).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import minimize_scalar

from belt_sim.discovery.design import HIDDEN
from belt_sim.discovery.form_products import Products, Targets, form_products
from belt_sim.discovery.search_data import SearchData
from belt_sim.effects.law import Form, Law, Place, Term

WITHIN = 6.0  # chi2: a likelihood ratio of 20
EXPONENTS = (0.0, -1.0, -2.0, 1.0)
SECONDS = 12  # second terms that are kept of a place, and of a first term
STEP_OF_GRID = 1.8  # ratio to the next knee or length of the grid
TERM, NUMBER, WAVE, EXPONENT, APART = 26.0, 3.0, 4.0, 2.0, 4.0  # what a law's numbers must earn, in chi2


@dataclass(frozen=True)
class ScoredLaw:
    """A law, the chi2 it explains, the same less what its numbers cost, and its sizes where they are known."""

    law: Law
    gain: float
    score: float
    sizes: tuple[float, ...] | None = None


@dataclass(frozen=True)
class RankedLaws:
    """Laws of one term, best first; an iteration makes them one by one.

    tables: place, its forms and an exponent; gain, score: of every form of every table.
    """

    tables: list[tuple[Place, list[Form], float]]
    gain: np.ndarray
    score: np.ndarray

    def __len__(self) -> int:
        return len(self.gain)

    def __iter__(self) -> Iterator[ScoredLaw]:
        starts = np.cumsum([0, *(len(forms) for _, forms, _ in self.tables)])
        for k in np.argsort(-self.score, kind="stable"):
            of = int(np.searchsorted(starts, k, side="right")) - 1
            place, forms, exponent = self.tables[of]
            law = Law((Term(place, forms[k - starts[of]], exponent),))
            yield ScoredLaw(law, float(self.gain[k]), float(self.score[k]))


def cost(law: Law) -> float:
    """What a law's numbers must earn."""
    total = TERM * (len(law.terms) - 1)
    total += sum(_price(t.form, t.exponent) for t in law.terms)
    return total + (APART if len({t.place.name for t in law.terms}) > 1 else 0.0)


def _price(form: Form, exponent: float) -> float:
    """Of the numbers of one term."""
    return NUMBER * form.numbers + EXPONENT * (exponent != 0.0) + (WAVE if form.is_wave else 0.0)


def _prices(forms: list[Form]) -> np.ndarray:
    return np.array([_price(f, 0.0) for f in forms])


def gain_of(data: SearchData, law: Law) -> float:
    """chi2 that a law explains."""
    return data.projector.fit_sizes(data.columns(law))[0]


def gains(blocks: Sequence[Products], weight: np.ndarray, beside: list[int], inverse, along) -> np.ndarray:
    """chi2 gains (F,) of the forms of all blocks with run weights (R,).

    Vector 0 of the products is what is explained, ``beside`` are those taken out; inverse: of their Gram matrix and
    prior; along (c,): their products with vector 0.
    """
    return np.concatenate([_gains_of_block(p, weight, beside, inverse, along) for p in blocks])


def _gains_of_block(p: Products, weight: np.ndarray, beside: list[int], inverse, along) -> np.ndarray:
    vectors, square, k = p.with_vectors, weight**2, p.waves
    whole = (weight.astype(vectors.dtype) @ vectors.reshape(len(weight), -1)).reshape(vectors.shape[1:])
    onto = whole[:, beside]
    pull, reduced = whole[:, 0] - onto @ (inverse @ along), onto @ inverse
    own = p.own @ square
    left = own - np.einsum("fc,fc->f", reduced, onto)
    count = len(left) - len(k)
    seen = left > HIDDEN * own + 1e-30
    gain = (pull**2 * np.where(seen, 1.0 / np.where(seen, left, 1.0), 0.0))[:count]
    if len(k):
        pull1, pull2, left1, left2 = pull[k], pull[count:], left[k], left[count:]
        both = p.cross @ square - np.einsum("fc,fc->f", reduced[k], onto[count:])
        det = left1 * left2 - both**2
        fine = (det > 1e-6 * np.maximum(left1 * left2, 1e-30)) & (left2 > 0.0)
        top = left2 * pull1**2 + left1 * pull2**2 - 2.0 * both * pull1 * pull2
        gain[k] = np.where(fine, top / np.where(fine, det, 1.0), gain[k])
    return np.where(np.isfinite(gain), gain, 0.0)  # a form beyond the range of numbers is no law


def single_term_laws(data: SearchData) -> RankedLaws:
    """Every form at every place with every exponent, best first."""
    g = data.projector
    targets = Targets(np.concatenate([g.residual[None], g.shared]))
    beside = list(range(1, 1 + len(g.shared)))
    tables, found, prices = [], [], []
    for place in data.places_to_try:
        forms, blocks = form_products(data, place, targets)
        kind = ("prices", place.kind, place.is_carried, data.wide)
        price = data.compute_once(kind, partial(_prices, forms), data.states)
        for n in exponents_of(data):
            tables.append((place, forms, n))
            found.append(gains(blocks, data.weight(n), beside, g.inverse, g.shared_residual))
            prices.append(price + EXPONENT * (n != 0.0))
    gain = np.concatenate(found).astype(float)
    return RankedLaws(tables, gain, gain - np.concatenate(prices))


def exponents_of(data: SearchData) -> tuple[float, ...]:
    """Exponents of tension to try: only 0 where one tension was run."""
    return EXPONENTS if len(np.unique(data.stated_tension)) > 1 else (0.0,)


def _score_law(law: Law, gain: float) -> ScoredLaw:
    return ScoredLaw(law, float(gain), float(gain) - cost(law))


def distinct_families(scored: Iterable[ScoredLaw], count: int) -> list[ScoredLaw]:
    """The first of each family, ``count`` at most."""
    first: dict[tuple, ScoredLaw] = {}
    for s in scored:
        first.setdefault(s.law.family, s)
        if len(first) == count:
            break
    return list(first.values())


def two_term_laws(data: SearchData, firsts: list[ScoredLaw]) -> list[ScoredLaw]:
    """The best second term beside each of ``firsts``, best first."""
    g = data.projector
    own = [data.columns(s.law) for s in firsts]
    vectors = np.concatenate([g.residual[None], g.shared, *own])
    start = 1 + len(g.shared)
    spans = np.cumsum([start, *[len(c) for c in own]])
    prior = g.gram - np.einsum("crm,drm->cd", g.shared, g.shared)
    targets = Targets(vectors)
    tables = [(place, *form_products(data, place, targets)) for place in data.places_to_try]
    found: list[ScoredLaw] = []
    for first, low, high in zip(firsts, spans[:-1], spans[1:], strict=True):
        beside = [*range(1, start), *range(low, high)]
        block = vectors[beside]
        gram = np.einsum("crm,drm->cd", block, block)
        gram[: start - 1, : start - 1] += prior
        inverse = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)
        along = np.einsum("crm,rm->c", block, g.residual)
        more: list[ScoredLaw] = []
        for place, forms, blocks in tables:
            for n in exponents_of(data):
                gain = gains(blocks, data.weight(n), beside, inverse, along)
                for k in np.argsort(-gain)[:SECONDS]:
                    law = Law((*first.law.terms, Term(place, forms[k], n)))
                    more.append(_score_law(law, first.gain + gain[k]))
        found += distinct_families(sorted(more, key=lambda s: -s.score), SECONDS)
    return sorted(found, key=lambda s: -s.score)


def refine_numbers(data: SearchData, scored: ScoredLaw) -> ScoredLaw:
    """The law with its shape numbers at their best, one after the other."""
    law, gain = scored.law, gain_of(data, scored.law)
    for k, term in enumerate(law.terms):
        for number in ("knee", "at", "wide"):
            value = getattr(term.form, number)
            if value is None:
                continue
            off = np.log(_grid_ratio(data, term.form) if number == "at" else STEP_OF_GRID)
            others = [data.columns(Law((t,))) for t in law.terms]

            def loss(x: float, law=law, k=k, number=number, others=others) -> float:
                own = data.columns(Law((_with_number(law, k, number, float(np.exp(x))).terms[k],)))
                return -data.projector.fit_sizes(np.concatenate([*others[:k], own, *others[k + 1 :]]))[0]

            best = minimize_scalar(
                loss,
                bounds=(np.log(value) - off, np.log(value) + off),
                method="bounded",
                options={"maxiter": 14, "xatol": 1e-3},
            )
            if -best.fun > gain:
                law, gain = _with_number(law, k, number, float(np.exp(best.x))), float(-best.fun)
    return _score_law(law, gain)


def _with_number(law: Law, k: int, number: str, value: float) -> Law:
    """The law with a number of its k-th term changed."""
    term = law.terms[k]
    changed: dict = {number: value}
    return Law((*law.terms[:k], replace(term, form=replace(term.form, **changed)), *law.terms[k + 1 :]))


def _grid_ratio(data: SearchData, form: Form) -> float:
    """Ratio to the next number of the grid."""
    end = float(data.states.s[-1]) / (float(np.min(data.states.speed)) if form.timed else 1.0)
    if form.is_carried:
        return 1.0 + 0.5 * float(form.wide or 1.0) / float(form.at or 1.0)
    if form.is_wave:
        return 1.0 + 0.5 * float(form.at or 1.0) / end
    if form.course in ("step", "interval"):
        return 1.0 + end / 12.0 / float(form.at or 1.0)
    return 2.0
