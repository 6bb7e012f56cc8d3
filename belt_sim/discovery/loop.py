"""The closed loop without a march: a law that reads the state which it moves, solved with the impulse responses.

At fixed tension the march is linear in small inputs, so that state = base + answers(u(state)). That is solved by
iteration along every run, for many sets of numbers at once, and the numbers are fitted by Gauss and Newton. A law is
judged by what it does, and not by how well the state as read, which holds the unknown's own work, goes with it.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim.discovery.rounds import Loop, Run, run, states_at_work
from belt_sim.discovery.search import Scored, cost, fitted
from belt_sim.discovery.states import States
from belt_sim.discovery.survey import Survey
from belt_sim.effects.law_terms import Law

STEPS = 8  # of the fit
ENOUGH, SAME = 0.05, 1e-4  # chi2 and share of it, between steps
SHORTER = 4  # halvings of a step
NUDGE = 1e-3  # of a number, for derivatives
LONGEST = 3.0  # records, of a length
NUMBERS = ("knee", "at", "wide")


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
    return sum(t.sizes for t in law.terms)


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
    return run(loop, [_read(law, numbers) for numbers in sets], begin)


def states_with(loop: Loop, found: Closed) -> States:
    """All states with a law at work, whatever the law reads."""
    return states_at_work(loop, found.law, found.sizes, found.states)
