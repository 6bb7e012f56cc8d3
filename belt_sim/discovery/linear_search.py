"""Laws in the linear range: every form at every place, alone and in pairs, by how much chi2 it explains.

All sizes are free; gains are those beside the nuisances and the chosen effects. A law of more numbers must earn them
(``cost``).
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any, TypeVar

import numpy as np

from belt_sim.discovery.responses import CHOSEN, HIDDEN, single_precision
from belt_sim.discovery.search_data import SearchData, form_inputs, has_many_readings
from belt_sim.effects.law import SPAN_NAMES, WRAPPED, Form, Law, Place, Term

# Inner products of the columns of all forms at a place with whitened vectors, run by run.
#
# Forms that do not depend on the state are computed once for a search: they are the same beside every state, and at
# every place of a kind. Forms that read the state are computed once for all places of a kind.


Item = TypeVar("Item")
COLUMN_MEMORY = 2**22  # [bytes] of the columns of forms that are worked on together
FEWEST_AT_ONCE = 64  # of these
CANCELS = 1e-4  # of what its cells do one by one: a column that is smaller is multiplied in double precision


@dataclass(frozen=True)
class Products:
    """Products of columns, run by run: of forms, and behind them of the other halves of those that are waves.

    with_vectors (R, F + w, q): with vectors; own (F + w, R): with themselves; cross (w, R): of both halves of each
    wave; waves (w,): which forms are waves.
    """

    with_vectors: np.ndarray
    own: np.ndarray
    cross: np.ndarray
    waves: np.ndarray


class Block:
    """Forms that are computed together; waves: which of them are waves; everything: with the sines of these behind;
    depends_on_pulley: whether they read the state at a pulley or sensor, or which part of the belt is there."""

    def __init__(self, forms: list[Form], depends_on_pulley: bool) -> None:
        self.forms, self.depends_on_pulley = forms, depends_on_pulley
        self.waves = np.array([k for k, f in enumerate(forms) if f.is_wave], dtype=int)
        self.everything = [*forms, *(forms[k].halves["sin"] for k in self.waves)]


class Targets:
    """Whitened vectors (q, R, m) as columns (R, m, q), in double and in single precision."""

    def __init__(self, vectors: np.ndarray) -> None:
        self.double = np.ascontiguousarray(vectors.transpose(1, 2, 0))
        self.single = single_precision(self.double)
        self.channels: dict[str, np.ndarray] = {}  # products (R, J, q) with the responses to an input there


def form_products(
    data: SearchData, places: Iterable[Place], targets: Targets
) -> Iterator[tuple[Place, list[Form], list[Products]]]:
    """Each place, its forms, and the products of their columns with vectors, block by block.

    A block is worked on for all places of a kind at once, which share its columns, and is small enough for these.
    """
    at_once = max(FEWEST_AT_ONCE, COLUMN_MEMORY // targets.single[..., 0].nbytes)
    for _, some in groupby(places, key=lambda place: (place.kind, place.is_carried)):
        alike = list(some)
        kind = ("forms", alike[0].kind, alike[0].is_carried, data.wide)
        blocks = data.compute_once(kind, partial(_blocks, data, alike[0], at_once), data.states)
        for channel in {channel for place in alike for channel, _ in place.parts} - set(targets.channels):
            targets.channels[channel] = data.design(channel).swapaxes(0, 1) @ targets.double
        along = list[np.ndarray]()  # (R, J, q), for an input that all parts of a place share
        for place in alike:
            own = [(np.asarray(data.states.channel_gain(place, *part), dtype=float), part[0]) for part in place.parts]
            parts = (targets.channels[channel] * (gain[..., None] if gain.ndim else gain) for gain, channel in own)
            along.append(np.asarray(sum(parts)))
        found = [list[Products]() for _ in alike]
        for block in blocks:
            for place, onto, products in zip(alike, along, found, strict=True):
                if block.depends_on_pulley:
                    rows = _rows(data, place, block)
                    products.append(Products(rows @ targets.single, *_lengths(rows, block.waves), block.waves))
                    continue
                plain = partial(form_inputs, data.states, block.everything, None, None)
                inputs = data.compute_once(("inputs", block), plain)
                # what acts on what is bent, and shown, is another beside every state
                within = data.states if place.relative or place.name == "travel" else None
                lengths = partial(_plain_lengths, data, place, block, inputs)
                squares, cross = data.compute_once(("lengths", place.name, block), lengths, within)
                products.append(Products(inputs @ onto, squares, cross, block.waves))
            if has_many_readings(data.bench):
                data.forget_inputs()
        forms = [f for block in blocks for f in block.forms]
        yield from zip(alike, [forms] * len(alike), found, strict=True)


def _blocks(data: SearchData, place: Place, at_once: int) -> list[Block]:
    """The forms at a place of a kind, so many together; blocks of the same forms are the same."""
    usual, rare = data.forms(place)
    reading = [f for f in (*usual, *rare) if f.reads_belt or f.is_carried]
    lists = [*([f for f in some if not (f.reads_belt or f.is_carried)] for some in (usual, rare)), reading]
    parts = ((some[k : k + at_once], some is reading) for some in lists for k in range(0, len(some), at_once))
    return [data.compute_once(("block", tuple(part)), partial(Block, part, reads)) for part, reads in parts]


def _plain_lengths(data: SearchData, place: Place, block: Block, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``_lengths`` of the columns of forms that do not depend on the pulley, to single precision.

    Columns that almost cancel are multiplied in double precision: their products with readings are, and a length that
    is rounding would make much of them.
    """
    found, norms = _rows(data, place, block), 0.0
    own = np.einsum("rfm,rfm->rf", found, found)
    for channel, part in place.parts:  # the largest that a response to an input of 1 in each cell can have, (R, J)
        each = data.compute_once(("norms", channel), partial(np.linalg.norm, data.design(channel), axis=2)).T
        norms = norms + each * np.abs(data.states.channel_gain(place, channel, part))
    most = (np.abs(inputs) @ np.asarray(norms)[..., None])[..., 0]
    faint = np.any(own < np.square(CANCELS * most), axis=0)
    if faint.any():
        found = found.copy()  # the rows are kept for other places
        own = [np.broadcast_to(data.states.channel_gain(place, *part), data.states.beta.shape) for part in place.parts]
        for r, some in enumerate(inputs[:, faint]):  # one run at a time takes little memory
            exact = sum(data.design(c)[:, r] * gain[r, :, None] for (c, _), gain in zip(place.parts, own, strict=True))
            found[r, faint] = some @ exact
    return _lengths(found, block.waves)


def _rows(data: SearchData, place: Place, block: Block) -> np.ndarray:
    """Whitened columns (R, F + w, m) of the forms of a block, in single precision.

    Those of a part, in every run, are kept for the places of one kind, until another kind or block comes: what is at
    both pulleys is at each of them as well. They may be what is returned: it is not written to.
    """
    states, kind, found = data.states, place.relative or place.kind, np.zeros(1, np.float32)
    kept = data.compute_once(("rows",), dict, states)
    if kept.get("of") != (kind, block):
        kept.clear()
        kept["of"] = kind, block
    of_all_spans = replace(place, where="both") if place.where in SPAN_NAMES else place
    for channel, part in place.parts:
        share, op = np.asarray(states.span_share(place, part)), data.design(channel).swapaxes(0, 1)
        if not np.any(share):  # the place acts in no run
            continue
        if channel in kept:
            rows = kept[channel]
        elif place.is_stretch:
            rows = single_precision(states.stretch_input(place, channel, int(part or 0), block.everything)) @ op
        else:
            key: tuple
            if block.depends_on_pulley:
                key, within = ("inputs", channel if part is None else part, place.kind in WRAPPED, block), states
                read_at = states.at_landing if place.kind in WRAPPED else states
                read = partial(form_inputs, read_at, block.everything, part, channel)
            else:
                key, within, plain = ("single", block), None, partial(form_inputs, states, block.everything, None, None)
                read = partial(data.compute_once, ("inputs", block), plain)
            inputs = data.compute_once(key, lambda: single_precision(read()), within)  # noqa: B023 - called at once
            gain = states.channel_gain(of_all_spans, channel, part)
            rows = inputs @ (op if isinstance(gain, float) else op * single_precision(gain)[..., None])
        kept[channel] = rows
        rows = rows if np.all(share == 1.0) else rows * single_precision(share)[..., None]
        found = rows if len(place.parts) == 1 else found + rows
    return found


def _lengths(rows: np.ndarray, waves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Products of rows (R, F + w, m) with themselves (F + w, R), and of both halves of each wave (w, R)."""
    sines = rows[:, rows.shape[1] - len(waves) :]
    return np.einsum("rfm,rfm->fr", rows, rows), np.einsum("rfm,rfm->fr", sines, rows[:, waves])


WITHIN = 6.0  # chi2: a likelihood ratio of 20
EXPONENTS = (0.0, -1.0, -2.0, 1.0)
SECONDS = 12  # second terms that are kept of a place, and of a first term
STEP_OF_GRID = 1.8  # ratio to the next knee or length of the grid
TERM, NUMBER, WAVE, EXPONENT_PRICE, APART = 26.0, 3.0, 4.0, 2.0, 4.0  # what a law's numbers must earn, in chi2


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

    def __iter__(self) -> Iterator[ScoredLaw]:
        starts = np.cumsum([0, *(len(forms) for _, forms, _ in self.tables)])
        for k in np.argsort(-self.score, kind="stable"):
            of = int(np.searchsorted(starts, k, side="right")) - 1
            place, forms, exponent = self.tables[of]
            law = Law((Term(place, forms[k - starts[of]], exponent),))
            yield ScoredLaw(law, float(self.gain[k]), float(self.score[k]))


def cost(law: Law) -> float:
    """What a law's numbers must earn."""
    found = TERM * (len(law.terms) - 1) + APART * (len({t.place.name for t in law.terms}) > 1)
    for t in law.terms:
        found += NUMBER * len(t.form.numbers) + EXPONENT_PRICE * (t.exponent != 0.0) + WAVE * t.form.is_wave
    return found


def gains(blocks: Sequence[Products], weight: np.ndarray, inverse, along) -> np.ndarray:
    """chi2 gains (F,) of the forms of all blocks with run weights (R,).

    The first vector of the products is what is explained, the others are taken out; inverse: of their Gram
    matrix and prior; along (c,): their products with the first.
    """
    found, square = [], weight**2
    for p in blocks:
        seen, k = p.with_vectors, p.waves
        whole = (weight.astype(seen.dtype) @ seen.reshape(len(weight), -1)).reshape(seen.shape[1:])
        onto = whole[:, 1:]
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
        found.append(np.where(np.isfinite(gain), gain, 0.0))  # a form beyond the range of numbers is no law
    return np.concatenate(found)


def single_term_laws(data: SearchData) -> RankedLaws:
    """Every form at every place with every exponent, best first."""
    g = data.projector
    targets = Targets(np.concatenate([g.residual[None], g.shared]))
    tables, found, prices = [], [], []
    for place, forms, blocks in form_products(data, data.places_to_try, targets):
        kind = ("prices", place.kind, place.is_carried, data.wide)
        costs = (cost(Law((Term(place, form),))) for form in forms)
        price = data.compute_once(kind, partial(np.fromiter, costs, float), data.states)
        for n in exponents_of(data):
            tables.append((place, forms, n))
            found.append(gains(blocks, data.weight(n), g.inverse, g.shared_residual))
            prices.append(price + EXPONENT_PRICE * (n != 0.0))
    gain, price = (np.concatenate([np.empty(0), *some]).astype(float) for some in (found, prices))
    return RankedLaws(tables, gain, gain - price)


def unexplained_elsewhere(data: SearchData, law: Law) -> dict[Place, float]:
    """chi2 of what ``law`` makes of the readings that the best law of one term leaves, at every other place.

    Of a response r it is |r|^2 sin^2 of the angle to the nearest column there, nuisances taken out, in the campaign's
    own plan: the log likelihood ratio, doubled, by which the readings can tell the places apart at their noise. No
    reading counts but through the sizes of ``law``.
    """
    columns = data.columns(law)
    made = np.tensordot(data.projector.fit_sizes(columns)[1], columns, axes=1)
    alone = replace(data, projector=replace(data.projector, residual=made), wide=True)
    whole, own = alone.projector.chi2(), {t.place for t in law.terms}
    ranked, found = single_term_laws(alone), dict[Place, float]()
    ends = np.cumsum([len(forms) for _, forms, _ in ranked.tables])
    for (place, _, _), gain in zip(ranked.tables, np.split(ranked.gain, ends[:-1]), strict=True):
        if place not in own:
            found[place] = min(max(whole - float(gain.max(initial=0.0)), 0.0), found.get(place, np.inf))
    return found


def exponents_of(data: SearchData) -> tuple[float, ...]:
    """Exponents of tension to try: only 0 where one tension was run."""
    return EXPONENTS if len(np.unique(data.stated_tension)) > 1 else (0.0,)


def first_of_each(items: Iterable[Item], key: Callable[[Item], Any], count: int | None = None) -> list[Item]:
    """The first item of each key, ``count`` at most; no more items are asked for than that takes."""
    first: dict[Any, Item] = {}
    for item in items:
        first.setdefault(key(item), item)
        if len(first) == count:
            break
    return list(first.values())


def distinct_families(scored: Iterable[ScoredLaw], count: int) -> list[ScoredLaw]:
    """The first of each family, ``count`` at most."""
    return first_of_each(scored, lambda s: s.law.family, count)


def two_term_laws(data: SearchData, first: ScoredLaw) -> list[ScoredLaw]:
    """The best second terms beside the ``first``, best first."""
    own = data.columns(first.law)  # of any size
    own /= np.maximum(np.sqrt(np.sum(own**2, axis=(1, 2), keepdims=True)), 1e-300)
    g, prior = data.projector, np.full(len(own), CHOSEN)
    g = replace(g, shared=np.concatenate([g.shared, own]), prior=np.concatenate([g.prior, prior]))
    targets, found = Targets(np.concatenate([g.residual[None], g.shared])), list[ScoredLaw]()
    for place, forms, blocks in form_products(data, data.places_to_try, targets):
        for n in exponents_of(data):
            gain = gains(blocks, data.weight(n), g.inverse, g.shared_residual)
            for k in np.argsort(-gain)[:SECONDS]:
                law, both = Law((*first.law.terms, Term(place, forms[k], n))), float(first.gain + gain[k])
                found.append(ScoredLaw(law, both, both - cost(law)))
    return distinct_families(sorted(found, key=lambda s: -s.score), SECONDS)


def refine_numbers(data: SearchData, law: Law) -> Law:
    """The law with its shape numbers at their best, one after the other, each between its neighbours on the grid."""
    from scipy.optimize import minimize_scalar  # a diagnosis loads it beside its first marches

    gain = data.projector.fit_sizes(data.columns(law))[0]
    for k, term in enumerate(law.terms):
        others, form = [data.columns(Law((t,))) for t in law.terms], term.form
        end, at = float(data.states.s[-1]) / data.pace(form), float(form.at or 1.0)
        next_at = 1.0 + end / 12.0 / at if form.course in ("step", "interval") else 2.0  # ratio on the grid
        if form.is_carried:
            next_at = 1.0 + 0.5 * float(form.wide or 1.0) / at
        elif form.is_wave:
            next_at = 1.0 + 0.5 * at / end
        for number, value in form.numbers.items():

            def changed(x: float, old=law.terms[k], number=number) -> Term:
                return replace(old, form=replace(old.form, **{number: float(np.exp(x))}))

            def loss(x: float, k=k, changed=changed, others=others) -> float:
                columns = [*others[:k], data.columns(Law((changed(x),))), *others[k + 1 :]]
                return -data.projector.fit_sizes(np.concatenate(columns))[0]

            off = np.log(next_at if number == "at" else STEP_OF_GRID)
            least = min(np.log(data.shortest(form)), np.log(value)) if number == "at" else -np.inf
            bounds, few = (max(np.log(value) - off, least), np.log(value) + off), {"maxiter": 14, "xatol": 1e-3}
            best = minimize_scalar(loss, bounds=bounds, method="bounded", options=few)
            if -best.fun > gain:
                gain, law = float(-best.fun), Law((*law.terms[:k], changed(best.x), *law.terms[k + 1 :]))
    return law
