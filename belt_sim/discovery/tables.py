"""Tables: products of all forms at a place with whitened vectors, run by run.

What the belt has no hand in is the same beside every state, and at every place of a kind: its inputs and their lengths
are worked out once a survey. Forms that read the state are worked out once for all places of a pulley.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from belt_sim.discovery.forms import COURSES, SHAPES, STATELESS, Form, formula, stop, travel_of, variable
from belt_sim.discovery.places import TRAVEL, Place
from belt_sim.discovery.states import States
from belt_sim.discovery.survey import Survey


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


def products(survey: Survey, place: Place, vectors: np.ndarray) -> Products:
    """Products of all columns of a place with vectors (q, R, m)."""
    forms, across = survey.forms(place), vectors.transpose(1, 2, 0)  # (R, m, q)
    still = [f for f in forms if f.variable in STATELESS]
    reading = [f for f in forms if f.variable not in STATELESS]
    found = [_still(survey, place, still, across)]
    found += [_reading(survey, place, reading, across)] if reading else []
    starts = np.cumsum([0, *(len(p.forms) for p in found)])
    waves = [start + p.waves for start, p in zip(starts, found, strict=False)]
    return Products(
        place,
        [*still, *reading],
        np.concatenate([p.with_vectors for p in found], axis=1),
        np.concatenate([p.own for p in found]),
        np.concatenate(waves),
        np.concatenate([p.sine_vectors for p in found], axis=1),
        np.concatenate([p.sine for p in found]),
        np.concatenate([p.cross for p in found]),
    )


def inputs_of(
    states: States, forms: Sequence[Form], part: int | None, signal: str | None, dtype: type = np.float32
) -> np.ndarray:
    """Forms along every run, (R, F, J); part: the pulley, signal: the sensor."""
    found: np.ndarray = np.empty((len(states.tension), len(forms), len(states.s)), dtype=dtype)
    shaped: dict[tuple, np.ndarray] = {}
    courses: dict[tuple, np.ndarray] = {}
    with np.errstate(over="ignore"):  # of what has faded away
        for k, f in enumerate(forms):
            what, when = (f.variable, f.shape, f.knee), (f.variable, f.course, f.at, f.wide, f.timed)
            if what not in shaped:
                x = variable(states, f.variable, part, signal)
                shaped[what] = formula(SHAPES[f.shape])(x=x, p=f.knee, s=states.s, xp=np, stop=stop)
            if when not in courses:
                courses[when] = formula(COURSES[f.course])(s=travel_of(states, f), p=f.at, q=f.wide, xp=np)
            np.multiply(shaped[what], courses[when], out=found[:, k], casting="same_kind")
    return found


def _still(survey: Survey, place: Place, forms: list[Form], across: np.ndarray) -> Products:
    """Of forms that the belt has no hand in.

    In double precision: of a column that almost cancels the length and the products are rounded alike in no other way,
    where they do not come from the same rows.
    """
    everything, waves = _with_sines(forms)
    key = tuple(everything)
    inputs = survey.once(("inputs", key), lambda: inputs_of(survey.states, everything, None, None, float))
    operator = _operator(survey, place)
    within = survey.states if place.name == TRAVEL else None  # the encoder's error acts on what is shown
    lengths = survey.once(("lengths", place.name, key), lambda: _lengths(inputs @ operator, waves), within)
    return _products(place, forms, waves, inputs @ (operator @ across), lengths)


def _reading(survey: Survey, place: Place, forms: list[Form], across: np.ndarray) -> Products:
    """Of forms that read the state."""
    everything, waves = _with_sines(forms)
    key, states = tuple(everything), survey.states

    def rows(channel: str, part: int | None) -> np.ndarray:
        where = channel if part is None else part
        inputs = survey.once(("inputs", where, key), lambda: inputs_of(states, everything, part, channel), states)
        return inputs @ survey.ops.rows[channel].swapaxes(0, 1)

    whole = np.sum([rows(*part) for part in place.parts], axis=0) if len(place.parts) > 1 else rows(*place.parts[0])
    return _products(place, forms, waves, whole @ across.astype(np.float32), _lengths(whole, waves))


def _with_sines(forms: list[Form]) -> tuple[list[Form], np.ndarray]:
    """Forms and the other halves of those that are waves, and which these are."""
    waves = np.array([k for k, f in enumerate(forms) if f.waving], dtype=int)
    return [*forms, *(forms[k].sine() for k in waves)], waves


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


def _products(place: Place, forms: list[Form], waves: np.ndarray, along: np.ndarray, lengths: Lengths) -> Products:
    count = len(forms)
    own, sine, cross = lengths
    return Products(place, forms, along[:, :count], own, waves, along[:, count:], sine, cross)
