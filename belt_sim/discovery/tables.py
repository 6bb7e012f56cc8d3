"""Tables: products of all forms at a place with whitened vectors, run by run.

What the belt has no hand in is the same beside every state, and at every place of a kind: its inputs and their lengths
are worked out once a survey. Forms that read the state are worked out once for all places of a pulley.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from belt_sim.discovery.forms import travel_of, variable
from belt_sim.discovery.operators import single
from belt_sim.discovery.states import States
from belt_sim.discovery.survey import Survey
from belt_sim.effects.law_terms import TRAVEL, WRAPPED, Form, Place

CANCELS = 1e-4  # of what its cells do one by one: a column that is smaller is multiplied in double precision


@dataclass(frozen=True)
class Products:
    """Products of a place's columns, run by run: with vectors (R, F, q), with themselves (F, R); waves (w,): which
    forms are waves, and the same products of their other halves (R, w, q), (w, R), and of both halves (w, R).
    """

    place: Place
    forms: list[Form]
    with_vectors: np.ndarray
    own: np.ndarray
    waves: np.ndarray
    sine_vectors: np.ndarray
    sine: np.ndarray
    cross: np.ndarray


#: lengths of columns (F, R), of the other halves of waves (w, R), and products of both halves (w, R)
Lengths = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Block:
    """Forms that are worked out together; everything: with the other halves of waves; waves: which forms these are."""

    forms: list[Form]
    everything: list[Form]
    waves: np.ndarray

    @property
    def reading(self) -> bool:
        """Whether they read the state."""
        return _reads(self.forms[0])


class Across:
    """Whitened vectors (q, R, m) as columns (R, m, q), in double and in single precision, with what was worked out."""

    def __init__(self, vectors: np.ndarray) -> None:
        self.double = np.ascontiguousarray(vectors.transpose(1, 2, 0))
        self.single = single(self.double)
        self._felt: dict[str, np.ndarray] = {}

    def felt(self, survey: Survey, channel: str) -> np.ndarray:
        """Products (R, J, q) with what an input at a channel does."""
        if channel not in self._felt:
            self._felt[channel] = survey.ops.rows[channel].swapaxes(0, 1) @ self.double
        return self._felt[channel]


def products(survey: Survey, place: Place, across: Across) -> Products:
    """Products of all columns of a place with vectors."""
    forms, blocks = survey.once(
        ("forms", place.kind, place.carried, survey.wide), lambda: _blocks(survey, place), survey.states
    )
    felt = _felt(survey, place, across)
    found = [
        _reading(survey, place, block, across) if block.reading else _still(survey, place, block, felt)
        for block in blocks
    ]
    starts = np.cumsum([0, *(len(block.forms) for block in blocks)])
    return Products(
        place,
        forms,
        np.concatenate([p.with_vectors for p in found], axis=1),
        np.concatenate([p.own for p in found]),
        np.concatenate([start + p.waves for start, p in zip(starts, found, strict=False)]),
        np.concatenate([p.sine_vectors for p in found], axis=1),
        np.concatenate([p.sine for p in found]),
        np.concatenate([p.cross for p in found]),
    )


def _blocks(survey: Survey, place: Place) -> tuple[list[Form], list[Block]]:
    """The forms to try at a place, block by block; those of the same forms are the same."""
    usual, rare = survey.forms(place)
    still = [[f for f in some if not _reads(f)] for some in (usual, rare)]
    lists = [*still, [f for f in (*usual, *rare) if _reads(f)]]
    blocks = [survey.once(("block", tuple(some)), partial(_block, some)) for some in lists if some]
    return [f for block in blocks for f in block.forms], blocks


def _reads(form: Form) -> bool:
    """Whether a form is another at another pulley: it reads the state, or which part of the belt is there."""
    return form.reads_belt or form.carried


def _block(forms: list[Form]) -> Block:
    waves = np.array([k for k, f in enumerate(forms) if f.is_wave], dtype=int)
    return Block(forms, [*forms, *(forms[k].sine() for k in waves)], waves)


def inputs_of(states: States, forms: Sequence[Form], part: int | None, signal: str | None) -> np.ndarray:
    """Forms along every run, (R, F, J); part: the pulley, signal: the sensor."""
    found = np.empty((len(states.tension), len(forms), len(states.s)))
    shaped: dict[tuple, np.ndarray] = {}
    courses: dict[tuple, np.ndarray] = {}
    with np.errstate(over="ignore"):  # of what has faded away
        for k, f in enumerate(forms):
            what, when = (f.variable, f.shape, f.knee), (f.variable, f.course, f.at, f.wide, f.timed)
            if what not in shaped:
                x = variable(states, f.variable, part, signal)
                shaped[what] = f.shaped(x, states.s, np)
            if when not in courses:
                courses[when] = f.along(travel_of(states, f, part), np)
            np.multiply(shaped[what], courses[when], out=found[:, k])
    return found


def _still(survey: Survey, place: Place, block: Block, felt: np.ndarray) -> Products:
    """Of forms that the belt has no hand in."""
    inputs = survey.once(("inputs", block), lambda: inputs_of(survey.states, block.everything, None, None))
    within = survey.states if place.relative or place.name == TRAVEL else None  # they act on what is bent, and shown
    lengths = survey.once(
        ("lengths", place.name, block), lambda: _lengths(_still_rows(survey, place, block, inputs), block.waves), within
    )
    return _products(place, block, inputs @ felt, lengths)


def _still_rows(survey: Survey, place: Place, block: Block, inputs: np.ndarray) -> np.ndarray:
    """Whitened columns (R, F + w, m) of forms that the belt has no hand in, to single precision.

    Those that almost cancel are multiplied in double precision: their products with readings are, and a length that is
    rounding would make much of them.
    """
    found: Any = 0.0
    for channel, part in place.parts:
        share = survey.states.share(place, part)
        if np.any(share):
            found = found + _shared(_still_part(survey, place, channel, part, block, inputs), share)
    own = np.einsum("rfm,rfm->rf", found, found)
    most = (np.abs(inputs) @ _reach(survey, place))[..., 0]
    faint = np.any(own < np.square(CANCELS * most), axis=0)
    if faint.any():
        found[:, faint] = inputs[:, faint] @ _operator(survey, place)
    return np.asarray(found)


def _still_part(survey: Survey, place: Place, channel: str, part: int | None, block: Block, inputs) -> np.ndarray:
    """The same at one part of a place; those of the places of one kind are remembered, as of ``_rows``."""

    def made() -> np.ndarray:
        lever = np.asarray(survey.states.lever(place.of_all_spans, channel, part), dtype=np.float32)
        op = survey.ops.rows[channel].swapaxes(0, 1) * (lever[..., None] if lever.ndim else lever)
        return survey.once(("single", block), lambda: single(inputs)) @ op

    return _last(survey, "still", place, (channel, block), made)


def _shared(rows: np.ndarray, share: np.ndarray | float) -> np.ndarray:
    """Rows (R, F, m) times what a place has a share in (R, 1), without work where that is all of it."""
    return rows if np.all(share == 1.0) else rows * np.asarray(share, dtype=rows.dtype)[..., None]


def _last(survey: Survey, what: str, place: Place, key: tuple, made: Callable[[], np.ndarray]) -> np.ndarray:
    """What ``made`` gives for a part of a place; that of the places of one kind is remembered, until another comes."""
    last, kind = survey.once((what,), dict, survey.states), place.relative or place.kind
    if last.get("kind") != kind:
        last.clear()
        last["kind"] = kind
    if key not in last:
        last[key] = made()
    return last[key]


def _reach(survey: Survey, place: Place) -> np.ndarray:
    """How much an input of 1 in each cell of a place does at the most, (R, J)."""
    found: Any = 0.0
    for channel, part in place.parts:
        each = survey.once(("reach", channel), partial(_sizes, survey.ops.rows[channel]))
        found = found + each * np.abs(survey.states.lever(place, channel, part))
    return np.asarray(found)[..., None]


def _felt(survey: Survey, place: Place, across: Across) -> np.ndarray:
    """Products (R, J, q) of vectors with what an input at a place, the same to all its parts, does."""
    found: Any = 0.0
    for channel, part in place.parts:
        lever = np.asarray(survey.states.lever(place, channel, part), dtype=float)
        found = found + across.felt(survey, channel) * (lever[..., None] if lever.ndim else lever)
    return np.asarray(found)


def _reading(survey: Survey, place: Place, block: Block, across: Across) -> Products:
    """Of forms that read the state."""
    shares = [survey.states.share(place, part) for _, part in place.parts]
    parts = [
        _shared(_rows(survey, place, channel, part, block), share)
        for (channel, part), share in zip(place.parts, shares, strict=True)
        if np.any(share)
    ]
    whole = np.sum(parts, axis=0) if len(parts) > 1 else parts[0]
    return _products(place, block, whole @ across.single, _lengths(whole, block.waves))


def _rows(survey: Survey, place: Place, channel: str, part: int | None, block: Block) -> np.ndarray:
    """Whitened columns (R, F + w, m) of forms that read the state where a part of a place is.

    Those of the places of one kind are remembered: what is at both pulleys is at each of them as well.
    """
    states, where = survey.states, channel if part is None else part

    def made() -> np.ndarray:
        inputs = survey.once(
            ("inputs", where, place.kind in WRAPPED, block),
            lambda: single(inputs_of(states.read_at(place), block.everything, part, channel)),
            states,
        )
        op = survey.ops.rows[channel].swapaxes(0, 1)
        lever = states.lever(place.of_all_spans, channel, part) if place.relative else None
        return inputs @ (op if lever is None else op * single(np.asarray(lever))[..., None])

    return _last(survey, "rows", place, (channel, block), made)


def _sizes(rows: np.ndarray) -> np.ndarray:
    """Lengths (R, J) of rows (J, R, m)."""
    return np.sqrt(np.einsum("jrm,jrm->rj", rows, rows))


def _operator(survey: Survey, place: Place) -> np.ndarray:
    """What an input at a place, the same to all its parts, does to the whitened readings, (R, J, m)."""
    found: Any = 0.0
    for channel, part in place.parts:
        lever = np.asarray(survey.states.lever(place, channel, part), dtype=float)
        found = found + survey.ops.rows[channel].swapaxes(0, 1) * (lever[..., None] if lever.ndim else lever)
    return np.asarray(found)


def _lengths(rows: np.ndarray, waves: np.ndarray) -> Lengths:
    """Of rows (R, F + w, m)."""
    count = rows.shape[1] - len(waves)
    cosines, sines = rows[:, waves], rows[:, count:]
    own = np.einsum("rfm,rfm->fr", rows, rows)
    return own[:count], own[count:], np.einsum("rfm,rfm->fr", sines, cosines)


def _products(place: Place, block: Block, along: np.ndarray, lengths: Lengths) -> Products:
    count = len(block.forms)
    own, sine, cross = lengths
    return Products(place, block.forms, along[:, :count], own, block.waves, along[:, count:], sine, cross)
