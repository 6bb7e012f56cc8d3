"""Inner products of the columns of all forms at a place with whitened vectors, run by run.

Forms that do not depend on the state are computed once for a search: they are the same beside every state, and at every
place of a kind. Forms that read the state are computed once for all places of a kind.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from belt_sim.discovery.design import single_precision
from belt_sim.discovery.form_dictionary import travel_of, variable
from belt_sim.discovery.search_data import SearchData
from belt_sim.discovery.states import States
from belt_sim.effects.law import TRAVEL, WRAPPED, Form, Place

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
    """Forms that are computed together; waves: which of them are waves; everything: with the sines of these behind."""

    def __init__(self, forms: list[Form]) -> None:
        self.forms, self.waves = forms, np.array([k for k, f in enumerate(forms) if f.is_wave], dtype=int)
        self.everything = [*forms, *(forms[k].sine() for k in self.waves)]

    @property
    def depends_on_pulley(self) -> bool:
        """Whether its forms differ from pulley to pulley."""
        return _depends_on_pulley(self.forms[0])


class Targets:
    """Whitened vectors (q, R, m) as columns (R, m, q), in double and in single precision."""

    def __init__(self, vectors: np.ndarray) -> None:
        self.double = np.ascontiguousarray(vectors.transpose(1, 2, 0))
        self.single = single_precision(self.double)
        self._channels: dict[str, np.ndarray] = {}

    def channel_products(self, data: SearchData, channel: str) -> np.ndarray:
        """Products (R, J, q) with the responses to an input at a channel."""
        if channel not in self._channels:
            self._channels[channel] = data.design.rows[channel].swapaxes(0, 1) @ self.double
        return self._channels[channel]


def form_products(data: SearchData, place: Place, targets: Targets) -> tuple[list[Form], list[Products]]:
    """The forms at a place, and the products of their columns with vectors, block by block."""
    forms, blocks = data.compute_once(
        ("forms", place.kind, place.is_carried, data.wide), lambda: _blocks(data, place), data.states
    )
    along = _sum_of_parts(data, place, lambda channel: targets.channel_products(data, channel))
    found = []
    for block in blocks:
        if block.depends_on_pulley:
            rows = _rows(data, place, block)
            found.append(Products(rows @ targets.single, *_lengths(rows, block.waves), block.waves))
        else:
            found.append(_plain_products(data, place, block, along))
    return forms, found


def _blocks(data: SearchData, place: Place) -> tuple[list[Form], list[Block]]:
    """The forms to try at a place, block by block; those of the same forms are the same."""
    usual, rare = data.forms(place)
    plain = [[f for f in some if not _depends_on_pulley(f)] for some in (usual, rare)]
    lists = [*plain, [f for f in (*usual, *rare) if _depends_on_pulley(f)]]
    blocks = [data.compute_once(("block", tuple(some)), partial(Block, some)) for some in lists if some]
    return [f for block in blocks for f in block.forms], blocks


def _depends_on_pulley(form: Form) -> bool:
    """Whether a form reads the state at a pulley or sensor, or which part of the belt is there."""
    return form.reads_belt or form.is_carried


def form_inputs(states: States, forms: Sequence[Form], part: int | None, signal: str | None) -> np.ndarray:
    """Forms along every run, (R, F, J); part: the pulley, signal: the sensor."""
    found = np.empty((len(states.tension), len(forms), len(states.s)))
    shaped: dict[tuple, np.ndarray] = {}
    courses: dict[tuple, np.ndarray] = {}
    with np.errstate(over="ignore"):  # of what has faded away
        for k, f in enumerate(forms):
            what, when = (f.variable, f.shape, f.knee), (f.variable, f.course, f.at, f.wide, f.timed)
            if what not in shaped:
                x = variable(states, f.variable, part, signal)
                shaped[what] = f.shape_value(x, states.s, np)
            if when not in courses:
                courses[when] = f.course_value(travel_of(states, f, part), np)
            np.multiply(shaped[what], courses[when], out=found[:, k])
    return found


def _plain_products(data: SearchData, place: Place, block: Block, along: np.ndarray) -> Products:
    """Products of forms that do not depend on the pulley; along (R, J, q): those of an input in each cell."""
    inputs = data.compute_once(("inputs", block), partial(form_inputs, data.states, block.everything, None, None))
    within = data.states if place.relative or place.name == TRAVEL else None  # they act on what is bent, and shown
    own, cross = data.compute_once(
        ("lengths", place.name, block), lambda: _lengths(_plain_rows(data, place, block, inputs), block.waves), within
    )
    return Products(inputs @ along, own, cross, block.waves)


def _plain_rows(data: SearchData, place: Place, block: Block, inputs: np.ndarray) -> np.ndarray:
    """Whitened columns (R, F + w, m) of forms that do not depend on the pulley, to single precision.

    Those that almost cancel are multiplied in double precision: their products with readings are, and a length that is
    rounding would make much of them.
    """
    found = _rows(data, place, block)
    own = np.einsum("rfm,rfm->rf", found, found)
    most = (np.abs(inputs) @ _largest_norms(data, place))[..., 0]
    faint = np.any(own < np.square(CANCELS * most), axis=0)
    if faint.any():
        found[:, faint] = inputs[:, faint] @ _sum_of_parts(data, place, lambda c: data.design.rows[c].swapaxes(0, 1))
    return found


def _rows(data: SearchData, place: Place, block: Block) -> np.ndarray:
    """Whitened columns (R, F + w, m) of the forms of a block, in single precision."""
    found: Any = 0.0
    for channel, part in place.parts:
        share = data.states.span_share(place, part)  # of the runs in which the place acts
        if np.any(share):
            rows = _rows_of_part(data, place, channel, part, block)
            found = found + (rows if np.all(share == 1.0) else rows * single_precision(np.asarray(share))[..., None])
    return np.asarray(found)


def _largest_norms(data: SearchData, place: Place) -> np.ndarray:
    """The largest norm that a response to an input of 1 in each cell of a place can have, (R, J, 1)."""
    found: Any = 0.0
    for channel, part in place.parts:
        each = data.compute_once(("norms", channel), partial(np.linalg.norm, data.design.rows[channel], axis=2)).T
        found = found + each * np.abs(data.states.channel_gain(place, channel, part))
    return np.asarray(found)[..., None]


def _sum_of_parts(data: SearchData, place: Place, of_channel: Callable[[str], np.ndarray]) -> np.ndarray:
    """Sum (R, J, ...) over the parts of a place of ``of_channel`` (R, J, ...) for an input that all parts share."""
    found: Any = 0.0
    for channel, part in place.parts:
        gain = np.asarray(data.states.channel_gain(place, channel, part), dtype=float)
        found = found + of_channel(channel) * (gain[..., None] if gain.ndim else gain)
    return np.asarray(found)


def _rows_of_part(data: SearchData, place: Place, channel: str, part: int | None, block: Block) -> np.ndarray:
    """The rows of one part of a place, in every run.

    They are kept for the places of one kind, until another kind comes: what is at both pulleys is at each of them as
    well.
    """
    states, where = data.states, channel if part is None else part
    kind, kept = place.relative or place.kind, data.compute_once(("rows",), dict, states)
    if kept.get("kind") != kind:
        kept.clear()
        kept["kind"] = kind

    def inputs() -> np.ndarray:
        if not block.depends_on_pulley:
            plain = data.compute_once(("inputs", block), partial(form_inputs, states, block.everything, None, None))
            return data.compute_once(("single", block), lambda: single_precision(plain))
        read = partial(form_inputs, states.variables_at(place), block.everything, part, channel)
        return data.compute_once(
            ("inputs", where, place.kind in WRAPPED, block), lambda: single_precision(read()), states
        )

    def compute() -> np.ndarray:
        op = data.design.rows[channel].swapaxes(0, 1)
        if place.is_stretch:
            return single_precision(states.stretch_input(place, channel, int(part or 0), block.everything)) @ op
        gain = states.channel_gain(place.of_all_spans, channel, part)
        return inputs() @ (op if isinstance(gain, float) else op * single_precision(gain)[..., None])

    if (channel, block) not in kept:
        kept[channel, block] = compute()
    return kept[channel, block]


def _lengths(rows: np.ndarray, waves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Products of rows (R, F + w, m) with themselves (F + w, R), and of both halves of each wave (w, R)."""
    sines = rows[:, rows.shape[1] - len(waves) :]
    return np.einsum("rfm,rfm->fr", rows, rows), np.einsum("rfm,rfm->fr", sines, rows[:, waves])
