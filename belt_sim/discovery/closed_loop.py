"""The closed loop without a march: a law that reads the state which it moves, solved with the impulse responses.

At fixed tension the march is linear in small inputs, so that state = base + responses(u(state)): a Volterra equation.
A change of a span's tension or stiffness, however large, is such an input too: the curvature that it adds by how the
span's ends stand. Fixed-point iteration solves it along every run for many sets of numbers at once; each iteration is a
convolution.
Gauss-Newton steps fit the numbers. A law is judged by what it does, not by how well it goes with the measured state,
which holds the work of the unknown itself. Arrays are (R, F, J): runs, sets of numbers, cells.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from belt_sim.discovery.linear_search import ScoredLaw, cost, exponents_of
from belt_sim.discovery.responses import CHANNELS, MOMENT, States, curve_row, single_precision, span_ends
from belt_sim.discovery.search_data import LatentInput, SearchData, course_travel, variable
from belt_sim.effects.law import PULLEYS, ROLLS, WRAPPED, Form, Law, Term, stop

ITERATIONS = 60  # at most; those of a Volterra equation converge
DAMPING = 0.3  # share of a step, where whole steps do not converge
STATE_TOLERANCE = 1e-5  # of the largest state, between iterations
RUNAWAY_STATE = 10.0  # times the largest state: a belt that has run away
LOOP_STEPS = 8  # of the fit
LEAST_FALL, LEAST_SHARE = 0.05, 1e-4  # chi2 and share of it, between steps
STEP_HALVED = 4  # halvings of a step
NUDGE = 1e-3  # of a number, for derivatives
LONGEST_LENGTH = 3.0  # records, of a length
STEEPEST = (-4.0, 4.0)  # exponents of the tension
# relative changes of a span where a fit may begin: chi2 has several minima
LARGE_CHANGES = (-0.9, -0.75, -0.5, 1.0, 4.0)

#: whitened readings (F, R, m) of sets of numbers, and the states with the first
LoopSolution = tuple[np.ndarray, States]
#: a variable, and the pulley or signal where it is read
PlacedVariable = tuple[str, int]


def solve_loop(data: SearchData, law: Law, sizes: np.ndarray, begin: States | None = None) -> LoopSolution | None:
    """Whitened readings that a law makes with each set of its numbers, and the states with the first; None where a belt
    runs away.

    law: its shape numbers and exponents may be columns (F, 1), one of each set; sizes (F, k); begin: states that the
    iteration starts from.
    """
    base = data.states
    inputs, reads = _loop_inputs(data, law, sizes)
    largest = {r: float(np.abs(getattr(base, r[0])).max()) + 1e-12 for r in reads if r[0] != "reading_rate"}
    at = _state_values(begin or base, reads)
    acting = [one for one in inputs if one.channel in CHANNELS]
    still = _responses_to(data, [(one.channel, one.value(at)) for one in acting if not one.reads], reads)
    unread = {read: x + still[read] for read, x in _state_values(base, reads).items()}

    def furthest(x: dict[PlacedVariable, np.ndarray]) -> float:  # of what is read, in units; nan where one is
        return float(np.max([np.abs(x[read]).max() / size for read, size in largest.items()], initial=0.0))

    # a law that steers against what it reads by as much or more swings ever further in whole steps, the belt does not
    for part in (1.0, DAMPING):
        settled, converged = at, False
        for _ in range(int(ITERATIONS / part)):
            added = _responses_to(data, [(one.channel, one.value(settled)) for one in acting if one.reads], reads)
            step = {read: unread[read] + added[read] - settled[read] for read in reads}
            settled = {read: settled[read] + part * step[read] for read in reads}
            converged = furthest(step) < STATE_TOLERANCE
            if converged or not furthest(settled) < RUNAWAY_STATE:
                break
        if converged and furthest(settled) < RUNAWAY_STATE:
            break
    else:
        return None
    readings = np.zeros((len(sizes), *data.projector.residual.shape))
    for one in inputs:
        u = np.broadcast_to(one.value(settled), (len(base.tension), len(sizes), len(base.s)))
        readings += data.columns_at(one.channel, u.swapaxes(0, 1))
    return readings, _replace_states(base, settled)


@dataclass(frozen=True)
class LoopInput:
    """The input of a term at one part of its place: a channel of the march at a pulley, or a sensor (pulley: None).

    factor (R, F, J): all of it that does not depend on what the belt does; of a change of a span that does not read the
    belt, (3, R, F, J): what it adds per unit of each of the span's ends.
    """

    states: States
    term: Term
    channel: str
    pulley: int | None
    factor: np.ndarray

    @cached_property
    def reads(self) -> list[PlacedVariable]:
        """What it depends on: the variable of the term, and the ends of a span that it changes."""
        form, where = self.term.form, self.states.signals.index(self.channel) if self.pulley is None else self.pulley
        found = [(form.variable, where)] if form.reads_belt else []
        if self.term.place.relative and np.any(self.states.span_share(self.term.place, self.pulley)):
            found += [("ends", 3 * int(self.pulley or 0) + k) for k in range(3)]
        return found

    def value(self, at: dict[PlacedVariable, np.ndarray]) -> np.ndarray:
        """The input (R, F, J), or (R, 1, 1) where it is none, from what is read."""
        t, u = self.term, self.factor
        if t.form.reads_belt:
            x = at[self.reads[0]]
            late = t.place.kind in WRAPPED and self.pulley is not None
            u = u * _shape_values(t.form, self.states.delay(x, int(self.pulley or 0)) if late else x)
        if not t.place.relative:
            return u
        ends = [read for read in self.reads if read[0] == "ends"]
        if not ends:
            return np.zeros((len(self.states.tension), 1, 1))
        change = self.states.changes[t.place.relative]
        per_end = change.per_end(u, int(self.channel in ROLLS)) if t.form.reads_belt else u
        return np.asarray(sum(factor * at[read] for factor, read in zip(per_end, ends, strict=True)))


def _loop_inputs(data: SearchData, law: Law, sizes: np.ndarray) -> tuple[list[LoopInput], list[PlacedVariable]]:
    """The inputs of all terms at all parts of their places, and what they depend on, with the rate of a signal the
    signal itself; sizes (F, k)."""
    states, found, left = data.states, list[LoopInput](), 0
    for t in law.terms:
        own, left = sizes[:, left : left + t.sizes], left + t.sizes  # (F, 1), of a wave (F, 2)
        weight = np.atleast_2d(data.weight(t.exponent)).T  # (R, F) or (R, 1): by the tension
        for channel, part in t.place.parts:
            roll, relative = int(channel in ROLLS), t.place.relative
            if t.place.is_stretch:
                at, wide = (np.reshape(np.asarray(n), (-1, 1)) for n in (t.form.at, t.form.wide))
                change = (weight * own[:, 0])[..., None]
                factor = states.stretch_per_end(t.place, channel, int(part or 0), change, at, wide)
            else:
                s = course_travel(states, t.form, part)[:, None]
                with np.errstate(over="ignore"):  # of what has faded away
                    halves = zip(t.form.halves.values(), own.T, strict=True)
                    course = sum(size[:, None] * half.course_value(s, np) for half, size in halves)
                share = states.span_share(t.place, part)
                gain = np.asarray(share if relative else states.channel_gain(t.place, channel, part))
                factor = course * weight[:, :, None] * (gain[:, None] if gain.ndim else gain)
                if not t.form.reads_belt:
                    x = variable(states, t.form.variable, part, channel)[:, None]
                    factor = factor * _shape_values(t.form, x)
                    factor = states.changes[relative].per_end(factor, roll) if relative else factor
            found.append(LoopInput(states, t, channel, part, factor))
    reads = dict.fromkeys(read for one in found for read in one.reads)
    return found, list(dict.fromkeys([*reads, *(("reading", k) for name, k in reads if name == "reading_rate")]))


def _shape_values(form: Form, x: np.ndarray) -> np.ndarray:
    """The shape of what is read (R, F, J), or (R, 1, J) where every set reads the same."""
    if form.shape == "stick":
        knee = np.ravel(np.asarray(form.knee))
        return stop(np.broadcast_to(x, (len(x), max(x.shape[1], len(knee)), x.shape[2])), knee)
    return form.shape_value(x, None, np)


def _state_values(states: States, reads: Iterable[PlacedVariable]) -> dict[PlacedVariable, np.ndarray]:
    return {(name, where): getattr(states, name)[:, where, None] for name, where in reads}


#: inputs (R, F, J) at channels of the march
ChannelInputs = Sequence[tuple[str, np.ndarray]]


def _spectra(data: SearchData, rows: Sequence[PlacedVariable], channel: str, length: int) -> np.ndarray:
    """Spectra (k, R, 1, w) of what an input in the first whole cell of a channel adds to variables."""
    s, samples, added = data.states.s, data.bench.samples, []
    rig, belt = samples.cases.rig, samples.cases.belt
    for name, where in rows:
        for run, pulse in zip(samples.runs, data.responses.pulses[:, CHANNELS.index(channel)], strict=True):
            if name == "ends":
                seen = span_ends(pulse[None])[0][where]
            elif name == "kappa_mean":
                ends = span_ends(pulse[None])[0]
                seen = (ends[3 * where + 2] - ends[3 * where + 1]) / float(rig.span_length)
            elif name == "kappa":
                seen = pulse[MOMENT + where] / float(belt.bending_stiffness)
            else:
                seen = pulse[curve_row(samples.signals[where].at, run.direction) if name == "reading" else where]
            added.append(data.responses.cell_responses(seen, s + (s[1] - s[0]))[:, 1])
    shaped = np.reshape(added, (len(rows), len(samples.runs), len(s)))
    return rfft(single_precision(shaped), length)[:, :, None]


def _responses_to(
    data: SearchData, inputs: ChannelInputs, reads: Collection[PlacedVariable]
) -> dict[PlacedVariable, np.ndarray]:
    """What inputs add to what is read, (R, F, J)."""
    states, cells = data.states, len(data.states.s)
    acting = [(channel, u) for channel, u in inputs if np.any(u)]
    if not acting or not reads:
        return dict.fromkeys(reads, np.zeros((len(states.tension), 1, cells)))
    spacing, found = states.s[1] - states.s[0], {}
    first = np.where(np.arange(cells) > 0, 1.0, 0.5).astype(np.float32)  # half a cell
    rows = tuple(dict.fromkeys(("y" if name == "alpha" else name, k) for name, k in reads if name != "reading_rate"))
    length, runs = next_fast_len(2 * cells, real=True), np.arange(len(states.tension))  # no end reaches its beginning
    whole = sum(
        rfft(single_precision(u) * first, length)
        * data.compute_once(("spectra", rows, channel), partial(_spectra, data, rows, channel, length))
        for channel, u in acting
    )
    responses = dict(zip(rows, irfft(whole, length)[..., :cells], strict=True))
    for name, where in reads:
        if name == "alpha":  # dy/ds = -alpha + drift
            drift = sum(u for channel, u in acting if channel == f"drift_{PULLEYS[where]}")
            found[name, where] = drift - np.gradient(responses["y", where], spacing, axis=-1)
        elif name != "reading_rate":
            found[name, where] = responses[name, where]
        if name == "reading":
            added = found[name, where]
            if ("reading_rate", where) in reads:
                rate = np.gradient(added, spacing, axis=-1)
                found["reading_rate", where] = rate * states.speed[:, None, None]
            yaw_at = np.array([r.yaw_at for r in data.bench.samples.runs])  # where it is zero
            place = np.clip(yaw_at / spacing, 0.0, cells - 1.001)
            low = place.astype(int)
            part = (place - low)[:, None]
            zero = (1.0 - part) * added[runs, :, low] + part * added[runs, :, low + 1]
            found[name, where] = added - zero[..., None]
    return found


def _replace_states(base: States, found: dict[PlacedVariable, np.ndarray]) -> States:
    """The states with some of them changed (R, F, J), as the first set of numbers has them."""
    changed: dict[str, Any] = {name: getattr(base, name).copy() for name, _ in found}
    for (name, where), x in found.items():
        changed[name][:, where] = x[:, 0]
    return replace(base, **changed)


@dataclass(frozen=True)
class ClosedLoopFit:
    """A law with its numbers as the closed loop has them: sizes (k,), the chi2 explained (gain), the same less what the
    numbers cost (score), whitened readings (R, m) that it makes, and the states with it at work."""

    law: Law
    sizes: np.ndarray
    gain: float
    score: float
    readings: np.ndarray
    states: States

    @property
    def scored_law(self) -> ScoredLaw:
        """As the search has it."""
        return ScoredLaw(self.law, self.gain, self.score, tuple(self.sizes))


def fit_closed_loop(data: SearchData, law: Law, sizes, steps: int = LOOP_STEPS) -> ClosedLoopFit | None:
    """The law fitted in closed loop from ``sizes``; None where the belt runs away however small they are made.

    What a large change of a span does goes with the tension otherwise than the linear range has it: its exponent is
    fitted, and then held at the nearest whole number.
    """
    exponents = [t.exponent for t in law.terms if t.place.relative] if len(exponents_of(data)) > 1 else []
    for free in (exponents, []) if exponents else ([],):
        # numbers: sizes of all terms, logarithms of their shape numbers, free exponents
        logarithms = [np.log(v) for t in law.terms for v in t.form.numbers.values()]
        numbers = np.array([*sizes, *logarithms, *free], dtype=float)
        is_size, term = np.arange(len(numbers)) < sum(t.sizes for t in law.terms), law.terms[0]
        # it begins with sizes halved until the belt does not run away; a steady change of a span with the size that
        # explains most, of that, half and a quarter of it and LARGE_CHANGES
        halved = (_evaluate(data, law, np.where(is_size, 0.5**k * numbers, numbers)) for k in range(2 * STEP_HALVED))
        first, factors = next((point for point in halved if point is not None), None), list[float]()
        steady = (term.form.variable, term.form.shape, term.form.course) == ("none", "linear", "constant")
        if len(law.terms) == 1 and term.place.relative and steady:
            largest = float(numbers[0] * np.max(data.weight(term.exponent)))  # change, at any tension
            factors = [0.5, 0.25, *(change / largest for change in LARGE_CHANGES)] if largest else []
        points = [first, *(_evaluate(data, law, np.where(is_size, factor * numbers, numbers)) for factor in factors)]
        point = min((point for point in points if point is not None), key=lambda point: point[2], default=None)
        if point is None:
            return None
        for _ in range(steps):
            after = _gauss_newton_step(data, law, *point)
            if after is None:
                break
            before, point = point[2], after
            if before - point[2] < LEAST_FALL + LEAST_SHARE * before:
                break
        numbers, (readings, states), chi2 = point
        law, sizes = _law_with(law, numbers)
        if free:
            terms = (replace(t, exponent=float(round(t.exponent))) if t.place.relative else t for t in law.terms)
            law = Law(tuple(terms))
    gain = data.projector.chi2() - chi2
    return ClosedLoopFit(law, sizes, gain, gain - cost(law), readings[0], states)


#: numbers of a law, what they make, and its chi2
LoopPoint = tuple[np.ndarray, LoopSolution, float]


def _evaluate(data: SearchData, law: Law, numbers: np.ndarray, begin: States | None = None) -> LoopPoint | None:
    """What numbers make, and its chi2; None where the belt runs away."""
    now, projector = solve_loop(data, *_law_with(law, numbers[None]), begin), data.projector
    return None if now is None else (numbers, now, projector.chi2(projector.residual - now[0][0]))


def _gauss_newton_step(
    data: SearchData, law: Law, numbers: np.ndarray, now: LoopSolution, chi2: float
) -> LoopPoint | None:
    """Numbers after a Gauss-Newton step, the parameters that runs share being free, what they make, and its chi2; None
    where no step helps.

    Each shape number stays within a factor of two of the old one, each exponent within 1 of it, no length is longer
    than some records, and no wave shorter than the readings show.
    """
    projector, (readings, states), count = data.projector, now, sum(t.sizes for t in law.terms)
    nudges, sizes = np.full(len(numbers), NUDGE), np.abs(numbers[:count])
    nudges[:count] = NUDGE * np.maximum(sizes, 1e-3 * sizes.max() + 1e-12)
    others = solve_loop(data, *_law_with(law, numbers + np.diag(nudges)), states)
    if others is None:
        return None
    left = replace(projector, residual=projector.residual - readings[0])
    step = left.fit_sizes((others[0] - readings) / nudges[:, None, None])[1]
    names = [(t.form, n) for t in law.terms for n in t.form.numbers]
    low, top = numbers - np.inf, numbers + np.inf
    for k, (form, name) in enumerate(names, count):
        longest = np.inf if name == "knee" else np.log(LONGEST_LENGTH * float(data.states.s[-1]))
        shortest = np.log(data.shortest(form) if name == "at" else 1e-300)
        low[k] = max(numbers[k] - np.log(2.0), min(shortest, numbers[k]))
        top[k] = min(numbers[k] + np.log(2.0), max(longest, numbers[k]))
    end = count + len(names)
    low[end:], top[end:] = (np.clip(numbers[end:] + side, *STEEPEST) for side in (-1.0, 1.0))
    for k in range(STEP_HALVED):
        after = _evaluate(data, law, np.clip(numbers + step * 0.4**k, low, top), states)
        if after is not None and after[2] < chi2:
            return after
    return None


def _law_with(law: Law, numbers: np.ndarray) -> tuple[Law, np.ndarray]:
    """The law with shape numbers, and exponents where there are any, from ``numbers`` (p,), and its sizes (k,); of sets
    of numbers (F, p) the law has columns (F, 1), and sizes are (F, k)."""
    count, terms = sum(t.sizes for t in law.terms), []
    end = count + sum(len(t.form.numbers) for t in law.terms)
    values = np.concatenate([np.exp(numbers[..., count:end]), numbers[..., end:]], axis=-1)
    left = values.tolist() if values.ndim == 1 else list(values.T[..., None])
    for t in law.terms:
        changed: dict[str, Any] = {n: left.pop(0) for n in t.form.numbers}
        terms.append(replace(t, form=replace(t.form, **changed)))
    if left:
        terms = [replace(t, exponent=left.pop(0)) if t.place.relative else t for t in terms]
    return Law(tuple(terms)), numbers[..., :count]


def states_with(data: SearchData, acting: ClosedLoopFit | LatentInput) -> States:
    """All states with a law at work, whatever it reads, or with the mean of a latent input."""
    states = data.states
    if isinstance(acting, ClosedLoopFit):
        terms, read = _loop_inputs(data, acting.law, acting.sizes[None])
        at = _state_values(acting.states, read)
        inputs = [(one.channel, one.value(at)) for one in terms if one.channel in CHANNELS]
    else:
        place, u = acting.place, acting.inputs(states.s)
        parts = [part for part in place.parts if part[0] in CHANNELS]
        inputs = [(channel, states.channel_input(place, u, channel, p)[:, None]) for channel, p in parts]
    sensors = [k for k, s in enumerate(data.bench.samples.signals) if s.kind == "lateral"]
    reads = [(n, k) for n in ("y", "alpha", "kappa", "kappa_mean") for k in (0, 1)]
    reads += [("ends", k) for k in range(states.ends.shape[1])]
    reads += [(n, k) for k in sensors for n in ("reading", "reading_rate")]
    added = _responses_to(data, inputs, reads)
    return _replace_states(states, {r: x + added[r] for r, x in _state_values(states, reads).items()})
