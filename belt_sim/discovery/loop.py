"""The closed loop without a march: a law that reads the state which it moves, solved with the impulse responses.

At fixed tension the march is linear in small inputs, so that state = base + answers(u(state)). That is solved by
iteration along every run, for many sets of numbers at once, and the numbers are fitted by Gauss and Newton. A law is
judged by what it does, and not by how well the state as read, which holds the unknown's own work, goes with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from belt_sim.discovery.channels import CHANNELS, drift_at
from belt_sim.discovery.forms import STATELESS, Form
from belt_sim.discovery.operators import kept_row
from belt_sim.discovery.places import place_columns
from belt_sim.discovery.responses import MOMENT
from belt_sim.discovery.search import Scored, cost, fitted
from belt_sim.discovery.states import States
from belt_sim.discovery.survey import Law, Survey

ROUNDS = 60  # of the iteration at most; those of a Volterra equation converge
CLOSE = 1e-5  # of the largest state, between rounds
FURTHEST = 10.0  # times the largest state: a belt that has run away
STEPS = 8  # of the fit
ENOUGH, SAME = 0.05, 1e-4  # chi2 and share of it, between steps
SHORTER = 4  # halvings of a step
NUDGE = 1e-3  # of a number, for derivatives
LONGEST = 3.0  # records, of a length
NUMBERS = ("knee", "at", "wide")

#: whitened readings (F, R, m) of sets of numbers, and the states with the first
Run = tuple[np.ndarray, States]


@dataclass(frozen=True)
class Loop:
    """A survey with the answers of its states to inputs, kept as they are asked for."""

    survey: Survey
    kept: dict = field(default_factory=dict)

    def answers(self, name: str, where: int, channel: str) -> np.ndarray:
        """What an input in each cell of a channel adds to a state of a pulley, or of a signal (R, J, J)."""
        key = (name, where, channel)
        if key not in self.kept:
            self.kept[key] = np.stack([self._one(r, *key) for r in range(len(self.survey.states.tension))]).astype(
                np.float32
            )
        return self.kept[key]

    def _one(self, run: int, name: str, where: int, channel: str) -> np.ndarray:
        s, grid = self.survey, self.survey.ops.grid
        row = where if name != "kappa" else MOMENT + where
        if name in ("shown", "rate"):
            row = kept_row(s.bench.samples.signals[where].at, s.bench.samples.runs[run].direction)
        found = s.answers.at(s.answers.pulses[run, CHANNELS.index(channel), row], grid)
        if name == "alpha":  # dy/ds = -alpha + drift
            drift = np.eye(len(grid)) if channel == drift_at(where) else 0.0
            return drift - np.gradient(found, grid[1] - grid[0], axis=0)
        return found / float(s.bench.samples.cases.belt.bending_stiffness) if name == "kappa" else found


@dataclass(frozen=True)
class Closed:
    """A law with its numbers as the closed loop has them: sizes, the chi2 explained, whitened readings (R, m) that it
    makes, and the states with it at work."""

    law: Law
    sizes: np.ndarray
    gain: float
    readings: np.ndarray
    states: States

    @property
    def score(self) -> float:
        """What is explained less what the numbers cost."""
        return self.gain - cost(self.law)

    @property
    def scored(self) -> Scored:
        """As the search has it."""
        return Scored(self.law, self.gain, self.score, tuple(self.sizes))


def closed(loop: Loop, law: Law, sizes, steps: int = STEPS) -> Closed | None:
    """The law fitted in closed loop from ``sizes``; None where the belt runs away however small they are made."""
    ground = loop.survey.ground
    numbers, now = _on_its_pulleys(loop, law, _numbers(law, sizes))
    if now is None:
        return None
    none, chi2 = ground.left(), ground.left(ground.residual - now[0][0])
    for _ in range(steps):
        found = _better(loop, law, numbers, now, chi2)
        if found is None:
            break
        before = chi2
        numbers, now, chi2 = found
        if before - chi2 < ENOUGH + SAME * before:
            break
    law, sizes = _read(law, numbers)
    return Closed(law, sizes, none - chi2, now[0][0], now[1])


def _on_its_pulleys(loop: Loop, law: Law, numbers: np.ndarray) -> tuple[np.ndarray, Run | None]:
    """Numbers with sizes halved until the belt does not run away, and what they make."""
    for _ in range(2 * SHORTER):
        now = _run(loop, law, numbers[None])
        if now is not None:
            return numbers, now
        numbers = np.concatenate([0.5 * numbers[: _sizes(law)], numbers[_sizes(law) :]])
    return numbers, None


def _better(loop: Loop, law: Law, numbers: np.ndarray, now: Run, chi2: float) -> tuple[np.ndarray, Run, float] | None:
    """Numbers after a step of Gauss and Newton, what they make, and its chi2; None where no step helps."""
    ground = loop.survey.ground
    moved = _moved(law, numbers)
    others = _run(loop, law, moved, now[1])
    if others is None:
        return None
    slopes = (others[0] - now[0]) / np.diagonal(moved - numbers)[:, None, None]
    step = _step(loop.survey, ground.residual - now[0][0], slopes)
    for k in range(SHORTER):
        tried = _allowed(loop.survey, law, numbers, numbers + step * 0.4**k)
        after = _run(loop, law, tried[None], now[1])
        left = np.inf if after is None else ground.left(ground.residual - after[0][0])
        if after is not None and left < chi2:
            return tried, after, left
    return None


def _step(survey: Survey, residual: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Gauss and Newton's step of numbers, with what runs share free."""
    beside = replace(survey, ground=replace(survey.ground, residual=residual))
    return fitted(beside, slopes)[1]


def _numbers(law: Law, sizes) -> np.ndarray:
    """Sizes of all terms, then logarithms of their shape numbers."""
    shapes = [getattr(t.form, n) for t in law.terms for n in NUMBERS]
    return np.array([*sizes, *(np.log(v) for v in shapes if v is not None)], dtype=float)


def _sizes(law: Law) -> int:
    return sum(2 if t.form.waving else 1 for t in law.terms)


def _moved(law: Law, numbers: np.ndarray) -> np.ndarray:
    """Sets of numbers (p, p), each with one of them moved a little."""
    count = _sizes(law)
    step = np.full(len(numbers), NUDGE)
    step[:count] = NUDGE * np.maximum(np.abs(numbers[:count]), 1e-3 * np.abs(numbers[:count]).max() + 1e-12)
    return numbers + np.diag(step)


def _allowed(survey: Survey, law: Law, old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """New numbers, shape numbers no further than a factor of two from the old, lengths no longer than some records."""
    count, names = _sizes(law), [n for t in law.terms for n in NUMBERS if getattr(t.form, n) is not None]
    longest = np.array([np.inf if n == "knee" else np.log(LONGEST * float(survey.states.s[-1])) for n in names])
    top = np.minimum(old[count:] + np.log(2.0), np.maximum(longest, old[count:]))
    return np.concatenate([new[:count], np.clip(new[count:], old[count:] - np.log(2.0), top)])


def _read(law: Law, numbers: np.ndarray) -> tuple[Law, np.ndarray]:
    """The law with shape numbers from ``numbers``, and its sizes."""
    count, terms = _sizes(law), []
    left = list(np.exp(numbers[count:]))
    for t in law.terms:
        changed: dict[str, Any] = {n: float(left.pop(0)) for n in NUMBERS if getattr(t.form, n) is not None}
        terms.append(replace(t, form=replace(t.form, **changed)))
    return Law(tuple(terms)), numbers[:count]


def _run(loop: Loop, law: Law, sets: np.ndarray, begin: States | None = None) -> Run | None:
    """Whitened readings (F, R, m) that a law makes with each set of numbers (F, p), and the states with the first; None
    where a belt runs away. begin: states to begin the iteration with."""
    laws = [_read(law, numbers) for numbers in sets]
    states = [begin or loop.survey.states for _ in laws]
    reading = any(t.form.variable not in STATELESS for t in law.terms)
    largest = {n: float(np.abs(getattr(loop.survey.states, n)).max()) + 1e-12 for n in ("y", "alpha", "kappa", "shown")}
    for _ in range(ROUNDS if reading else 1):
        inputs = [_inputs(loop.survey, one, sizes, at) for (one, sizes), at in zip(laws, states, strict=True)]
        moved = _states(loop, law, inputs, states)
        off, furthest = _difference(law, states, moved, largest)
        states = moved
        if not furthest < FURTHEST:
            return None
        if off < CLOSE:
            break
    else:
        if reading:
            return None
    readings = np.zeros((len(sets), *loop.survey.ground.residual.shape))
    for k, term in enumerate(law.terms):
        parts = [np.stack([one[k][p] for one in inputs]) for p in range(len(term.place.parts))]
        readings += place_columns(loop.survey.ops, term.place, parts)
    return readings, states[0]


def _inputs(survey: Survey, law: Law, sizes, states: States) -> list[list[np.ndarray]]:
    """Input (R, J) of every part of every term."""
    found, left = [], list(sizes)
    for t in law.terms:
        forms: list[Form] = [t.form, t.form.sine()] if t.form.waving else [t.form]
        own = [left.pop(0) for _ in forms]
        weight = survey.weight(t.exponent)[:, None]
        parts = []
        for channel, part in t.place.parts:
            u = weight * sum(c * f.values(states, part, channel) for c, f in zip(own, forms, strict=True))
            parts.append(u * survey.states.lever(t.place, channel, part))
        found.append(parts)
    return found


def _read_by(law: Law) -> set[tuple[str, str | None, int | None]]:
    """What a law reads: variable, and the channel and pulley of the part that reads it."""
    return {(t.form.variable, *part) for t in law.terms if t.form.variable not in STATELESS for part in t.place.parts}


def _states(loop: Loop, law: Law, inputs, before: Sequence[States]) -> list[States]:
    """The states that the inputs make."""
    base = loop.survey.states
    acting = [(k, p, c) for k, t in enumerate(law.terms) for p, (c, at) in enumerate(t.place.parts) if at is not None]
    found = [{n: getattr(base, n).copy() for n in ("y", "alpha", "kappa", "shown", "rate")} for _ in before]
    for name, channel, pulley in _read_by(law):
        where = base.signals.index(channel) if pulley is None else pulley
        for k, p, acts in acting:
            u = np.stack([one[k][p] for one in inputs], axis=-1).astype(np.float32)  # (R, J, F)
            added = loop.answers("shown" if name == "rate" else name, where, acts) @ u
            for f, one in enumerate(found):
                _add(loop.survey, one, name, where, added[..., f])
    return [replace(base, **one) for one in found]


def _add(survey: Survey, state: dict, name: str, where: int, added: np.ndarray) -> None:
    if name not in ("shown", "rate"):
        state[name][:, where] += added
        return
    grid, runs = survey.ops.grid, survey.bench.samples.runs
    zero = np.array([np.interp(run.yaw_at, grid, row) for run, row in zip(runs, added, strict=True)])
    state["shown"][:, where] += added - zero[:, None]
    state["rate"][:, where] += np.gradient(added, grid[1] - grid[0], axis=-1) * survey.states.speed[:, None]


def _difference(law: Law, before, after, largest: dict[str, float]) -> tuple[float, float]:
    """Largest change of what a law reads, and largest size, both over those of the base model."""
    off = size = 0.0
    for name in {n if n != "rate" else "shown" for n, _, _ in _read_by(law)}:
        for a, b in zip(before, after, strict=True):
            x, y = getattr(a, name), getattr(b, name)
            off = max(off, float(np.abs(x - y).max()) / largest[name])
            size = max(size, float(np.abs(y).max()) / largest[name])
    return off, size


def states_with(loop: Loop, found: Closed) -> States:
    """All states with a law at work, whatever the law reads."""
    survey = loop.survey
    inputs = _inputs(survey, found.law, found.sizes, found.states)
    base = survey.states
    state = {n: getattr(base, n).copy() for n in ("y", "alpha", "kappa", "shown", "rate")}
    sensors = [k for k, s in enumerate(survey.bench.samples.signals) if s.kind == "lateral"]
    for k, t in enumerate(found.law.terms):
        for p, (channel, at) in enumerate(t.place.parts):
            if at is None:
                continue
            u = inputs[k][p][..., None]
            for name, wheres in (("y", (0, 1)), ("alpha", (0, 1)), ("kappa", (0, 1)), ("shown", sensors)):
                for where in wheres:
                    _add(survey, state, name, where, (loop.answers(name, where, channel) @ u)[..., 0])
    return replace(base, **state)
