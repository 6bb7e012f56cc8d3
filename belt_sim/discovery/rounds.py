"""Rounds of the closed loop: what a law does to the state that it reads, for many sets of its numbers at once.

Everything of a law that the state has no hand in is worked out once. What an input adds does not change with travel, so
that a round is a convolution with the impulse responses. Arrays are (R, F, J): runs, sets of numbers, cells.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from belt_sim.discovery.channels import CHANNELS, drift_at
from belt_sim.discovery.forms import travel_of, variable
from belt_sim.discovery.operators import kept_row, relative_turn, single
from belt_sim.discovery.places import place_columns
from belt_sim.discovery.responses import MOMENT
from belt_sim.discovery.states import States
from belt_sim.discovery.survey import Survey
from belt_sim.effects.law_terms import WRAPPED, Form, Law, Term, stop

ROUNDS = 60  # at most, of whole ones; those of a Volterra equation converge
PART = 0.3  # of a round's way, where whole rounds do not end
CLOSE = 1e-5  # of the largest state, between rounds
FURTHEST = 10.0  # times the largest state: a belt that has run away

#: a law with some shape numbers, and its sizes
Sized = tuple[Law, np.ndarray]
#: whitened readings (F, R, m) of sets of numbers, and the states with the first
Run = tuple[np.ndarray, States]
#: a variable, and the pulley or signal where it is read
Read = tuple[str, int]


@dataclass(frozen=True)
class Loop:
    """A survey with the answers of its states to inputs, kept as they are asked for."""

    survey: Survey
    kept: dict = field(default_factory=dict)

    def spectrum(self, name: str, where: int, channel: str) -> np.ndarray:
        """Of what an input in one cell of a channel adds to what is read at a pulley, or to a signal (R, 1, w)."""
        key = (name, where, channel)
        if key not in self.kept:
            rows = np.stack([self._row(r, *key) for r in range(len(self.survey.states.tension))])
            self.kept[key] = rfft(single(rows), self.length)[:, None]
        return self.kept[key]

    @property
    def length(self) -> int:
        """Of what is transformed: no end of a record reaches its beginning."""
        return next_fast_len(2 * len(self.survey.ops.grid), real=True)

    def _row(self, run: int, name: str, where: int, channel: str) -> np.ndarray:
        s, grid = self.survey, self.survey.ops.grid
        row = where if name != "kappa" else MOMENT + where
        if name == "reading":
            row = kept_row(s.bench.samples.signals[where].at, s.bench.samples.runs[run].direction)
        pulse = s.answers.pulses[run, CHANNELS.index(channel)]
        if name in s.states.relative:
            seen = relative_turn(s.states.relative[name].per_end[run, None, :3], pulse[None, :MOMENT])[0, where]
        else:
            seen = pulse[row]
        found = s.answers.at(seen, grid + grid[1] - grid[0])[:, 1]
        return found / float(s.bench.samples.cases.belt.bending_stiffness) if name == "kappa" else found


def run(loop: Loop, laws: Sequence[Sized], begin: States | None = None) -> Run | None:
    """Whitened readings that a law makes with each set of its numbers, and the states with the first; None where a belt
    runs away. begin: states to begin with."""
    survey, law = loop.survey, laws[0][0]
    base, reads = survey.states, _read_by(law, survey.states)
    inputs = _inputs(survey, laws)
    largest = {r: float(np.abs(base.read(r[0])).max()) + 1e-12 for r in reads if r[0] != "reading_rate"}
    at = {read: _at(begin or base, read) for read in reads}
    still = _added(loop, _acting(law, inputs(at), reading=False), reads)
    unread = {read: _at(base, read) + still[read] for read in reads}

    def moved(at: dict[Read, np.ndarray]) -> dict[Read, np.ndarray]:
        added = _added(loop, _acting(law, inputs(at), reading=True), reads)
        return {read: unread[read] + added[read] for read in reads}

    settled = _settled(moved, at, largest)
    if settled is None:
        return None
    felt = inputs(settled)
    readings = np.zeros((len(laws), *survey.ground.residual.shape))
    for term, parts in zip(law.terms, felt, strict=True):
        whole = [np.broadcast_to(u, (len(base.tension), len(laws), len(base.s))).swapaxes(0, 1) for u in parts]
        readings += place_columns(survey.ops, term.place, whole)
    return readings, _with(base, {r: x[:, 0] for r, x in settled.items()})


def _settled(moved: Callable[[dict], dict], at: dict[Read, np.ndarray], largest: dict[Read, float]) -> dict | None:
    """What is read, once rounds change it no more; None where a belt runs away.

    Of a law that steers against what it reads by as much or more, rounds swing ever further though the belt does not:
    then each goes a part of its way.
    """
    if not at:
        return at
    whole = _in_rounds(moved, at, largest, 1.0)
    return whole if whole is not None else _in_rounds(moved, at, largest, PART)


def _in_rounds(moved: Callable[[dict], dict], at: dict[Read, np.ndarray], largest: dict[Read, float], part: float):
    """What is read after rounds that each go a part of their way; None where it goes too far, or does not settle."""
    for _ in range(int(ROUNDS / part)):
        step = {read: x - at[read] for read, x in moved(at).items()}
        off = _largest({r: step[r] for r in largest}, largest)
        at = {read: at[read] + part * step[read] for read in at}
        if not _largest(at, largest) < FURTHEST:
            return None
        if off < CLOSE:
            return at
    return None


def states_at_work(loop: Loop, law: Law, sizes: np.ndarray, states: States) -> States:
    """All states with a law at work, whatever the law reads; states: those that it reads."""
    survey = loop.survey
    felt = _inputs(survey, [(law, sizes)])({r: _at(states, r) for r in _read_by(law, states)})
    sensors = [k for k, s in enumerate(survey.bench.samples.signals) if s.kind == "lateral"]
    reads = [(n, k) for n in ("y", "alpha", "kappa", *states.bent) for k in (0, 1)]
    reads += [(n, k) for k in sensors for n in ("reading", "reading_rate")]
    added = _added(loop, _acting(law, felt), reads)
    return _with(survey.states, {r: _at(survey.states, r)[:, 0] + added[r][:, 0] for r in reads})


def _inputs(survey: Survey, laws: Sequence[Sized]) -> Callable[[dict[Read, np.ndarray]], list[list[np.ndarray]]]:
    """A function that gives the input (R, F, J) of every part of every term, from what the law reads."""
    first = laws[0][0]
    left, sizes = 0, np.stack([s for _, s in laws])
    factors: list[list[np.ndarray]] = []
    for k, t in enumerate(first.terms):
        count = t.sizes
        forms, own = [law.terms[k].form for law, _ in laws], sizes[:, left : left + count]
        left += count
        factors.append([_factor(survey, t, forms, own, *part) for part in t.place.parts])

    def inputs(at: dict[Read, np.ndarray]) -> list[list[np.ndarray]]:
        found = []
        for k, (t, own) in enumerate(zip(first.terms, factors, strict=True)):
            forms = [law.terms[k].form for law, _ in laws]
            found.append(
                [_driven(survey.states, t, forms, u, at, *part) for u, part in zip(own, t.place.parts, strict=True)]
            )
        return found

    return inputs


def _factor(survey: Survey, t: Term, forms: list[Form], sizes: np.ndarray, channel: str, part: int | None):
    """Everything in a term's input (R, F, J) that the state has no hand in."""
    states = survey.states
    s = travel_of(states, t.form, part)[:, None]
    halves = [t.form, t.form.sine()][: sizes.shape[1]]
    with np.errstate(over="ignore"):  # of what has faded away
        course = sum(
            size[:, None] * half.along(s, np, _column(forms, "at"), _column(forms, "wide"))
            for half, size in zip(halves, sizes.T, strict=True)
        )
    found = course * survey.weight(t.exponent)[:, None, None]
    lever = np.asarray(states.share(t.place, part) if t.place.relative else states.lever(t.place, channel, part))
    found = found * (lever[:, None] if lever.ndim else lever)
    if t.form.reads_belt:
        return found
    return found * _shaped(forms, variable(states, t.form.variable, part, channel)[:, None])


def _driven(states: States, t: Term, forms: list[Form], u: np.ndarray, at: dict[Read, np.ndarray], channel, part):
    """A factor u with what the state makes of it: the shape of what the term reads, and how far the span is bent."""
    variable_read, bent = _reads(t, states, channel, part)
    if variable_read is not None:
        x = at[variable_read]
        u = u * _shaped(forms, states.late(x, part) if t.place.kind in WRAPPED and part is not None else x)
    return u if bent is None else states.relative[t.place.relative].grown(u) * at[bent]


def _shaped(forms: list[Form], x: np.ndarray) -> np.ndarray:
    """The shape of what is read (R, F, J), or (R, 1, J) where every set reads the same."""
    if forms[0].shape == "stick":
        rows = np.broadcast_to(x, (len(x), len(forms), x.shape[-1]))
        return np.stack([stop(rows[:, f], form.knee or 0.0) for f, form in enumerate(forms)], axis=1)
    return forms[0].shaped(x, None, np, _column(forms, "knee"))


def _column(forms: list[Form], number: str) -> np.ndarray | None:
    values = [getattr(f, number) for f in forms]
    return None if values[0] is None else np.array(values)[:, None]


def _reading(t: Term) -> bool:
    """Whether what a term does goes with the state: it reads that, or it acts where the belt is bent."""
    return t.form.reads_belt or bool(t.place.relative)


def _reads(t: Term, states: States, channel: str, part: int | None) -> tuple[Read | None, Read | None]:
    """The variable that a term reads, and how far what it changes bends the span; None where it does not."""
    where = states.signals.index(channel) if part is None else part
    variable_read = (t.form.variable, where) if t.form.reads_belt else None
    return variable_read, (t.place.relative, where) if t.place.relative else None


def _read_by(law: Law, states: States) -> list[Read]:
    """What a law reads; with the rate of a signal the signal itself."""
    every = [r for t in law.terms for part in t.place.parts for r in _reads(t, states, *part) if r is not None]
    found = dict.fromkeys(every)
    return list(dict.fromkeys([*found, *(("reading", where) for name, where in found if name == "reading_rate")]))


def _largest(x: dict[Read, np.ndarray], unit: dict[Read, float]) -> float:
    """The largest of what is read, in units; nan where one is."""
    return float(np.max([np.abs(x[read]).max() / size for read, size in unit.items()], initial=0.0))


def _at(states: States, read: Read) -> np.ndarray:
    return states.read(read[0])[:, read[1], None]


def _acting(law: Law, felt: list[list[np.ndarray]], reading: bool | None = None) -> list[tuple[str, np.ndarray]]:
    """The channels of the march at which a law acts, and its inputs; reading: of terms that read the state, or not."""
    return [
        (channel, u)
        for t, parts in zip(law.terms, felt, strict=True)
        if reading is None or _reading(t) == reading
        for u, (channel, pulley) in zip(parts, t.place.parts, strict=True)
        if pulley is not None
    ]


def _added(loop: Loop, acting: list[tuple[str, np.ndarray]], reads: Sequence[Read]) -> dict[Read, np.ndarray]:
    """What inputs (R, F, J) add to what is read, (R, F, J)."""
    states, cells = loop.survey.states, len(loop.survey.states.s)
    if not acting:
        return dict.fromkeys(reads, np.zeros((len(states.tension), 1, cells)))
    spacing, found = states.s[1] - states.s[0], {}
    first = np.where(np.arange(cells) > 0, 1.0, 0.5).astype(np.float32)  # half a cell
    there = [(channel, rfft(single(u) * first, loop.length)) for channel, u in acting]

    def seen(name: str, where: int) -> np.ndarray:
        whole = sum(u * loop.spectrum(name, where, channel) for channel, u in there)
        return irfft(whole, loop.length)[..., :cells]

    for name, where in reads:
        if name == "alpha":  # dy/ds = -alpha + drift
            drift = sum(u for channel, u in acting if channel == drift_at(where))
            found[name, where] = drift - np.gradient(seen("y", where), spacing, axis=-1)
        elif name != "reading_rate":
            found[name, where] = seen(name, where)
        if ("reading_rate", where) in reads and name == "reading":
            found["reading_rate", where] = (
                np.gradient(found[name, where], spacing, axis=-1) * states.speed[:, None, None]
            )
        if name == "reading":
            found[name, where] = found[name, where] - _where_yawed(loop.survey, found[name, where])
    return found


def _where_yawed(survey: Survey, added: np.ndarray) -> np.ndarray:
    """What is added where a sensor reads zero, (R, F, 1)."""
    grid, runs = survey.ops.grid, survey.bench.samples.runs
    place = np.clip(np.array([r.yaw_at for r in runs]) / (grid[1] - grid[0]), 0.0, len(grid) - 1.001)
    low = place.astype(int)
    part, rows = (place - low)[:, None], np.arange(len(runs))
    return ((1.0 - part) * added[rows, :, low] + part * added[rows, :, low + 1])[..., None]


def _with(base: States, found: dict[Read, np.ndarray]) -> States:
    """The states with some of them changed (R, J)."""
    changed: dict[str, Any] = {name: base.read(name).copy() for name, _ in found}
    for (name, where), x in found.items():
        changed[name][:, where] = x
    bent = {kind: changed.pop(kind, x) for kind, x in base.bent.items()}
    return replace(base, bent=bent, **changed)
