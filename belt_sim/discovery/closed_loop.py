"""The closed loop without a march: a law that reads the state which it moves, solved with the impulse responses.

At fixed tension the march is linear in small inputs, so that state = base + responses(u(state)): a Volterra equation.
A change of a span's tension or stiffness, however large, is such an input too: the curvature that it adds by how the
span's ends stand. Fixed-point iteration solves it along every run for many sets of numbers at once; each iteration is a
convolution.
Gauss-Newton steps fit the numbers. A law is judged by what it does, not by how well it goes with the measured state,
which holds the work of the unknown itself. Arrays are (R, F, J): runs, sets of numbers, cells.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from belt_sim.discovery.design import curve_row, single_precision, span_ends
from belt_sim.discovery.form_dictionary import travel_of, variable
from belt_sim.discovery.impulse_responses import CHANNELS, MOMENT, drift_at
from belt_sim.discovery.linear_search import ScoredLaw, cost, exponents_of, fit_sizes
from belt_sim.discovery.search_data import SearchData
from belt_sim.discovery.states import States
from belt_sim.effects.law_terms import ROLLS, WRAPPED, Form, Law, Term, stop

ITERATIONS = 60  # at most; those of a Volterra equation converge
DAMPING = 0.3  # share of a step, where whole steps do not converge
CLOSE = 1e-5  # of the largest state, between iterations
FURTHEST = 10.0  # times the largest state: a belt that has run away
STEPS = 8  # of the fit
LEAST_FALL, LEAST_SHARE = 0.05, 1e-4  # chi2 and share of it, between steps
SHORTER = 4  # halvings of a step
NUDGE = 1e-3  # of a number, for derivatives
LONGEST = 3.0  # records, of a length
STEEPEST = (-4.0, 4.0)  # exponents of the tension
LARGE = (-0.9, -0.75, -0.5, 1.0, 4.0)  # relative changes of a span where a fit may begin: chi2 has several minima
NUMBERS = ("knee", "at", "wide")

#: a law with some shape numbers, and its sizes
LawAndSizes = tuple[Law, np.ndarray]
#: whitened readings (F, R, m) of sets of numbers, and the states with the first
LoopSolution = tuple[np.ndarray, States]
#: a variable, and the pulley or signal where it is read
Variable = tuple[str, int]


@dataclass(frozen=True)
class LoopResponses:
    """The spectra of the impulse responses of what laws read, kept once they are computed."""

    data: SearchData
    kept: dict = field(default_factory=dict)

    def spectra(self, reads: tuple[Variable, ...], channel: str) -> np.ndarray:
        """Spectra (k, R, 1, w) of what an input in one cell of a channel adds to variables at pulleys or sensors."""
        key = (reads, channel)
        if key not in self.kept:
            runs = range(len(self.data.states.tension))
            rows = np.stack([[self._row(r, *read, channel) for r in runs] for read in reads])
            self.kept[key] = rfft(single_precision(rows), self.length)[:, :, None]
        return self.kept[key]

    @property
    def length(self) -> int:
        """Length of the transforms: no end of a record reaches its beginning."""
        return next_fast_len(2 * len(self.data.design.grid), real=True)

    def _row(self, run: int, name: str, where: int, channel: str) -> np.ndarray:
        s, grid = self.data, self.data.design.grid
        row = where if name != "kappa" else MOMENT + where
        if name == "reading":
            row = curve_row(s.bench.samples.signals[where].at, s.bench.samples.runs[run].direction)
        pulse = s.responses.pulses[run, CHANNELS.index(channel)]
        ends, seen, cases = span_ends(pulse[None])[0], pulse[row], s.bench.samples.cases
        if name == "ends":
            seen = ends[where]
        elif name == "kappa_mean":
            seen = (ends[3 * where + 2] - ends[3 * where + 1]) / float(cases.rig.span_length)
        elif name == "kappa":
            seen = seen / float(cases.belt.bending_stiffness)
        return s.responses.cell_responses(seen, grid + grid[1] - grid[0])[:, 1]


def solve_loop(loop: LoopResponses, laws: Sequence[LawAndSizes], begin: States | None = None) -> LoopSolution | None:
    """Whitened readings that a law makes with each set of its numbers, and the states with the first; None where a belt
    runs away. begin: states that the iteration starts from."""
    data, law = loop.data, laws[0][0]
    base, reads = data.states, _law_variables(law, data.states)
    inputs = _inputs(data, laws)
    largest = {r: float(np.abs(getattr(base, r[0])).max()) + 1e-12 for r in reads if r[0] != "reading_rate"}
    at = {read: _state_values(begin or base, read) for read in reads}
    still = _responses_to(loop, _channel_inputs(law, inputs(at), coupled=False), reads)
    unread = {read: _state_values(base, read) + still[read] for read in reads}

    def next_states(at: dict[Variable, np.ndarray]) -> dict[Variable, np.ndarray]:
        added = _responses_to(loop, _channel_inputs(law, inputs(at), coupled=True), reads)
        return {read: unread[read] + added[read] for read in reads}

    settled = _solve_fixed_point(next_states, at, largest)
    if settled is None:
        return None
    felt = inputs(settled)
    readings = np.zeros((len(laws), *data.projector.residual.shape))
    for term, parts in zip(law.terms, felt, strict=True):
        whole = [np.broadcast_to(u, (len(base.tension), len(laws), len(base.s))).swapaxes(0, 1) for u in parts]
        readings += data.design.place_columns(term.place, whole)
    return readings, _replace_states(base, {r: x[:, 0] for r, x in settled.items()})


def _solve_fixed_point(
    next_states: Callable[[dict], dict], at: dict[Variable, np.ndarray], largest: dict[Variable, float]
) -> dict | None:
    """What is read, once iterations have converged; None where a belt runs away.

    For a law that steers against what it reads by as much or more, whole steps swing ever further though the belt does
    not: then they are damped.
    """
    if not at:
        return at
    whole = _iterate(next_states, at, largest, 1.0)
    return whole if whole is not None else _iterate(next_states, at, largest, DAMPING)


def _iterate(
    next_states: Callable[[dict], dict], at: dict[Variable, np.ndarray], largest: dict[Variable, float], part: float
):
    """What is read after damped steps; None where it goes too far, or does not converge."""
    for _ in range(int(ITERATIONS / part)):
        step = {read: x - at[read] for read, x in next_states(at).items()}
        off = _largest({r: step[r] for r in largest}, largest)
        at = {read: at[read] + part * step[read] for read in at}
        if not _largest(at, largest) < FURTHEST:
            return None
        if off < CLOSE:
            return at
    return None


def states_with_law(loop: LoopResponses, law: Law, sizes: np.ndarray, states: States) -> States:
    """All states with a law at work, whatever the law reads; states: those that it reads."""
    data = loop.data
    felt = _inputs(data, [(law, sizes)])({r: _state_values(states, r) for r in _law_variables(law, states)})
    sensors = [k for k, s in enumerate(data.bench.samples.signals) if s.kind == "lateral"]
    reads = [(n, k) for n in ("y", "alpha", "kappa", "kappa_mean") for k in (0, 1)]
    reads += [("ends", k) for k in range(states.ends.shape[1])]
    reads += [(n, k) for k in sensors for n in ("reading", "reading_rate")]
    added = _responses_to(loop, _channel_inputs(law, felt), reads)
    return _replace_states(data.states, {r: _state_values(data.states, r)[:, 0] + added[r][:, 0] for r in reads})


def _inputs(
    data: SearchData, laws: Sequence[LawAndSizes]
) -> Callable[[dict[Variable, np.ndarray]], list[list[np.ndarray]]]:
    """A function that gives the input (R, F, J) of every part of every term, from what the law reads."""
    first = laws[0][0]
    left, sizes = 0, np.stack([s for _, s in laws])
    factors: list[list[np.ndarray]] = []
    for k, t in enumerate(first.terms):
        count = t.sizes
        forms, own = [law.terms[k].form for law, _ in laws], sizes[:, left : left + count]
        left += count
        weight = np.stack([data.weight(law.terms[k].exponent) for law, _ in laws], axis=1)
        factors.append([_independent_factor(data, t, forms, own, weight, *part) for part in t.place.parts])

    def inputs(at: dict[Variable, np.ndarray]) -> list[list[np.ndarray]]:
        found = []
        for k, (t, own) in enumerate(zip(first.terms, factors, strict=True)):
            forms = [law.terms[k].form for law, _ in laws]
            found.append(
                [
                    _coupled_input(data.states, t, forms, u, at, *part)
                    for u, part in zip(own, t.place.parts, strict=True)
                ]
            )
        return found

    return inputs


def _independent_factor(
    data: SearchData, t: Term, forms: list[Form], sizes: np.ndarray, weight: np.ndarray, channel: str, part: int | None
):
    """Everything in a term's input (R, F, J) that does not depend on the state; weight (R, F): by the tension. Of a
    change of a span that does not either: what it adds per unit of each of the span's ends (3, R, F, J)."""
    states = data.states
    if t.place.is_stretch:
        at, wide = (np.asarray(_number_column(forms, n)) for n in ("at", "wide"))
        return states.stretch_per_end(t.place, channel, int(part or 0), (weight * sizes[:, 0])[..., None], at, wide)
    s = travel_of(states, t.form, part)[:, None]
    halves = [t.form, t.form.sine()][: sizes.shape[1]]
    with np.errstate(over="ignore"):  # of what has faded away
        course = sum(
            size[:, None] * half.course_value(s, np, _number_column(forms, "at"), _number_column(forms, "wide"))
            for half, size in zip(halves, sizes.T, strict=True)
        )
    found = course * weight[:, :, None]
    share = states.span_share(t.place, part)
    gain = np.asarray(share if t.place.relative else states.channel_gain(t.place, channel, part))
    found = found * (gain[:, None] if gain.ndim else gain)
    if t.form.reads_belt:
        return found
    found = found * _shape_values(forms, variable(states, t.form.variable, part, channel)[:, None])
    return _per_end(states, t, found, channel) if t.place.relative else found


def _per_end(states: States, t: Term, change: np.ndarray, channel: str) -> np.ndarray:
    """What a change of a span adds to a channel per unit of each of the span's ends, (3, R, F, J)."""
    return states.changes[t.place.relative].per_end(change, int(channel in ROLLS))


def _coupled_input(
    states: States, t: Term, forms: list[Form], u: np.ndarray, at: dict[Variable, np.ndarray], channel, part
):
    """A factor u times the shape of what the term reads; of a relative change, what it adds to the span it changes."""
    if t.form.reads_belt:
        x = at[_variable_read(t, states, channel, part)]
        u = u * _shape_values(forms, states.delay(x, part) if t.place.kind in WRAPPED and part is not None else x)
    if not t.place.relative:
        return u
    if not _acts(states, t, part):
        return np.zeros_like(u[..., :1, :1] if t.form.reads_belt else u[0, :, :1, :1])
    per_end = _per_end(states, t, u, channel) if t.form.reads_belt else u
    return sum(factor * at[read] for factor, read in zip(per_end, _ends_of(part), strict=True))


def _shape_values(forms: list[Form], x: np.ndarray) -> np.ndarray:
    """The shape of what is read (R, F, J), or (R, 1, J) where every set reads the same."""
    if forms[0].shape == "stick":
        rows = np.broadcast_to(x, (len(x), len(forms), x.shape[-1]))
        return np.stack([stop(rows[:, f], form.knee or 0.0) for f, form in enumerate(forms)], axis=1)
    return forms[0].shape_value(x, None, np, _number_column(forms, "knee"))


def _number_column(forms: list[Form], number: str) -> np.ndarray | None:
    values = [getattr(f, number) for f in forms]
    return None if values[0] is None else np.array(values)[:, None]


def _is_coupled(t: Term) -> bool:
    """Whether what a term does depends on the state: it reads that, or acts where the belt is bent."""
    return t.form.reads_belt or bool(t.place.relative)


def _variable_read(t: Term, states: States, channel: str, part: int | None) -> Variable:
    """The variable of the belt that a term reads at a part of its place."""
    return t.form.variable, states.signals.index(channel) if part is None else part


def _ends_of(pulley: int | None) -> list[Variable]:
    """The boundary values of the span that runs up a pulley."""
    return [("ends", 3 * int(pulley or 0) + k) for k in range(3)]


def _acts(states: States, t: Term, pulley: int | None) -> bool:
    """Whether the span that a term acts on runs up a pulley in any run."""
    return bool(np.any(states.span_share(t.place, pulley)))


def _law_variables(law: Law, states: States) -> list[Variable]:
    """What a law reads; with the rate of a signal the signal itself."""
    parts = [(t, part) for t in law.terms for part in t.place.parts]
    found = dict.fromkeys(_variable_read(t, states, *part) for t, part in parts if t.form.reads_belt)
    changed = [pulley for t, (_, pulley) in parts if t.place.relative and _acts(states, t, pulley)]
    found |= dict.fromkeys(read for pulley in changed for read in _ends_of(pulley))
    return list(dict.fromkeys([*found, *(("reading", where) for name, where in found if name == "reading_rate")]))


def _largest(x: dict[Variable, np.ndarray], unit: dict[Variable, float]) -> float:
    """The largest of what is read, in units; nan where one is."""
    return float(np.max([np.abs(x[read]).max() / size for read, size in unit.items()], initial=0.0))


def _state_values(states: States, read: Variable) -> np.ndarray:
    return getattr(states, read[0])[:, read[1], None]


def _channel_inputs(
    law: Law, felt: list[list[np.ndarray]], coupled: bool | None = None
) -> list[tuple[str, np.ndarray]]:
    """The channels of the march at which a law acts, and its inputs; coupled: of terms that depend on the state, or
    not."""
    return [
        (channel, u)
        for t, parts in zip(law.terms, felt, strict=True)
        if coupled is None or _is_coupled(t) == coupled
        for u, (channel, pulley) in zip(parts, t.place.parts, strict=True)
        if pulley is not None and channel in CHANNELS and np.any(u)
    ]


def _responses_to(
    loop: LoopResponses, acting: list[tuple[str, np.ndarray]], reads: Sequence[Variable]
) -> dict[Variable, np.ndarray]:
    """What inputs (R, F, J) add to what is read, (R, F, J)."""
    states, cells = loop.data.states, len(loop.data.states.s)
    if not acting or not reads:
        return dict.fromkeys(reads, np.zeros((len(states.tension), 1, cells)))
    spacing, found = states.s[1] - states.s[0], {}
    first = np.where(np.arange(cells) > 0, 1.0, 0.5).astype(np.float32)  # half a cell
    rows = tuple(dict.fromkeys(("y" if name == "alpha" else name, k) for name, k in reads if name != "reading_rate"))
    whole = sum(rfft(single_precision(u) * first, loop.length) * loop.spectra(rows, channel) for channel, u in acting)
    responses = dict(zip(rows, irfft(whole, loop.length)[..., :cells], strict=True))
    for name, where in reads:
        if name == "alpha":  # dy/ds = -alpha + drift
            drift = sum(u for channel, u in acting if channel == drift_at(where))
            found[name, where] = drift - np.gradient(responses["y", where], spacing, axis=-1)
        elif name != "reading_rate":
            found[name, where] = responses[name, where]
        if ("reading_rate", where) in reads and name == "reading":
            found["reading_rate", where] = (
                np.gradient(found[name, where], spacing, axis=-1) * states.speed[:, None, None]
            )
        if name == "reading":
            found[name, where] = found[name, where] - _at_zero(loop.data, found[name, where])
    return found


def _at_zero(data: SearchData, added: np.ndarray) -> np.ndarray:
    """What is added where a sensor reads zero, (R, F, 1)."""
    grid, runs = data.design.grid, data.bench.samples.runs
    place = np.clip(np.array([r.yaw_at for r in runs]) / (grid[1] - grid[0]), 0.0, len(grid) - 1.001)
    low = place.astype(int)
    part, rows = (place - low)[:, None], np.arange(len(runs))
    return ((1.0 - part) * added[rows, :, low] + part * added[rows, :, low + 1])[..., None]


def _replace_states(base: States, found: dict[Variable, np.ndarray]) -> States:
    """The states with some of them changed (R, J)."""
    changed: dict[str, Any] = {name: getattr(base, name).copy() for name, _ in found}
    for (name, where), x in found.items():
        changed[name][:, where] = x
    return replace(base, **changed)


@dataclass(frozen=True)
class ClosedLoopFit:
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
    def scored_law(self) -> ScoredLaw:
        """As the search has it."""
        return ScoredLaw(self.law, self.gain, self.score, tuple(self.sizes))


def fit_closed_loop(loop: LoopResponses, law: Law, sizes, steps: int = STEPS) -> ClosedLoopFit | None:
    """The law fitted in closed loop from ``sizes``; None where the belt runs away however small they are made.

    What a large change of a span does goes with the tension otherwise than the linear range has it: its exponent is
    fitted, and then held at the nearest whole number.
    """
    if any(t.place.relative for t in law.terms) and len(exponents_of(loop.data)) > 1:
        made = _fit_numbers(loop, law, np.array([*_numbers(law, sizes), *_exponents(law)]), steps)
        if made is None:
            return None
        terms = [replace(t, exponent=float(round(t.exponent))) if t.place.relative else t for t in made.law.terms]
        law, sizes = Law(tuple(terms)), made.sizes
    return _fit_numbers(loop, law, _numbers(law, sizes), steps)


def _fit_numbers(loop: LoopResponses, law: Law, numbers: np.ndarray, steps: int) -> ClosedLoopFit | None:
    projector = loop.data.projector
    none = projector.chi2()
    start = _start(loop, law, numbers)
    if start is None:
        return None
    numbers, now, chi2 = start
    for _ in range(steps):
        found = _gauss_newton_step(loop, law, numbers, now, chi2)
        if found is None:
            break
        before = chi2
        numbers, now, chi2 = found
        if before - chi2 < LEAST_FALL + LEAST_SHARE * before:
            break
    law, sizes = _law_with(law, numbers)
    return ClosedLoopFit(law, sizes, none - chi2, now[0][0], now[1])


#: numbers of a law, what they make, and its chi2
Point = tuple[np.ndarray, LoopSolution, float]


def _start(loop: LoopResponses, law: Law, numbers: np.ndarray) -> Point | None:
    """Where a fit begins: the numbers, with sizes halved until the belt does not run away. A steady change of a span
    begins with the size that explains most, of that, half and a quarter of it and LARGE."""
    halved = (_evaluate(loop, law, _scale_sizes(law, numbers, 0.5**k)) for k in range(2 * SHORTER))
    first = next((point for point in halved if point is not None), None)
    largest = _largest_change(loop.data, law, numbers[: _sizes(law)])
    factors = [0.5, 0.25, *(change / largest for change in LARGE)] if largest else []
    points = [first, *(_evaluate(loop, law, _scale_sizes(law, numbers, factor)) for factor in factors)]
    return min((point for point in points if point is not None), key=lambda point: point[2], default=None)


def _evaluate(loop: LoopResponses, law: Law, numbers: np.ndarray) -> Point | None:
    """What numbers make; None where the belt runs away."""
    now, projector = _solve_sets(loop, law, numbers[None]), loop.data.projector
    return None if now is None else (numbers, now, projector.chi2(projector.residual - now[0][0]))


def _scale_sizes(law: Law, numbers: np.ndarray, factor: float) -> np.ndarray:
    return np.concatenate([factor * numbers[: _sizes(law)], numbers[_sizes(law) :]])


def _largest_change(data: SearchData, law: Law, sizes: np.ndarray) -> float:
    """The steady relative change of a span that is a law's whole work, at the tension where it is largest; else 0."""
    term = law.terms[0]
    steady = len(law.terms) == 1 and bool(term.place.relative) and term.form.family == Form("none").family
    return float(sizes[0] * np.max(data.weight(term.exponent))) if steady else 0.0


def _gauss_newton_step(
    loop: LoopResponses, law: Law, numbers: np.ndarray, now: LoopSolution, chi2: float
) -> Point | None:
    """Numbers after a Gauss-Newton step, what they make, and its chi2; None where no step helps."""
    projector = loop.data.projector
    moved = _perturb_numbers(law, numbers)
    others = _solve_sets(loop, law, moved, now[1])
    if others is None:
        return None
    slopes = (others[0] - now[0]) / np.diagonal(moved - numbers)[:, None, None]
    step = _step(loop.data, projector.residual - now[0][0], slopes)
    for k in range(SHORTER):
        tried = _limit_step(loop.data, law, numbers, numbers + step * 0.4**k)
        after = _solve_sets(loop, law, tried[None], now[1])
        left = np.inf if after is None else projector.chi2(projector.residual - after[0][0])
        if after is not None and left < chi2:
            return tried, after, left
    return None


def _step(data: SearchData, residual: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """The Gauss-Newton step of the numbers, with the parameters that runs share free."""
    beside = replace(data, projector=replace(data.projector, residual=residual))
    return fit_sizes(beside, slopes)[1]


def _numbers(law: Law, sizes) -> np.ndarray:
    """Sizes of all terms, then logarithms of their shape numbers."""
    shapes = [getattr(t.form, n) for t in law.terms for n in NUMBERS]
    return np.array([*sizes, *(np.log(v) for v in shapes if v is not None)], dtype=float)


def _exponents(law: Law) -> list[float]:
    """The exponents of the tension that are fitted: those of terms that change a span."""
    return [t.exponent for t in law.terms if t.place.relative]


def _sizes(law: Law) -> int:
    return sum(t.sizes for t in law.terms)


def _perturb_numbers(law: Law, numbers: np.ndarray) -> np.ndarray:
    """Sets of numbers (p, p), each with one of them moved a little."""
    count = _sizes(law)
    step = np.full(len(numbers), NUDGE)
    step[:count] = NUDGE * np.maximum(np.abs(numbers[:count]), 1e-3 * np.abs(numbers[:count]).max() + 1e-12)
    return numbers + np.diag(step)


def _limit_step(data: SearchData, law: Law, old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """New numbers: each shape number within a factor of two of the old one, each exponent within 1 of it, and no length
    longer than some records."""
    count, names = _sizes(law), [n for t in law.terms for n in NUMBERS if getattr(t.form, n) is not None]
    longest = np.array([np.inf if n == "knee" else np.log(LONGEST * float(data.states.s[-1])) for n in names])
    end = count + len(names)
    shape, exponents = old[count:end], np.clip(np.clip(new[end:], old[end:] - 1.0, old[end:] + 1.0), *STEEPEST)
    top = np.minimum(shape + np.log(2.0), np.maximum(longest, shape))
    return np.concatenate([new[:count], np.clip(new[count:end], shape - np.log(2.0), top), exponents])


def _law_with(law: Law, numbers: np.ndarray) -> tuple[Law, np.ndarray]:
    """The law with shape numbers, and exponents where there are any, from ``numbers``, and its sizes."""
    count, terms = _sizes(law), []
    left = list(numbers[count:])
    for t in law.terms:
        changed: dict[str, Any] = {n: float(np.exp(left.pop(0))) for n in NUMBERS if getattr(t.form, n) is not None}
        terms.append(replace(t, form=replace(t.form, **changed)))
    if left:
        terms = [replace(t, exponent=float(left.pop(0))) if t.place.relative else t for t in terms]
    return Law(tuple(terms)), numbers[:count]


def _solve_sets(loop: LoopResponses, law: Law, sets: np.ndarray, begin: States | None = None) -> LoopSolution | None:
    return solve_loop(loop, [_law_with(law, numbers) for numbers in sets], begin)


def states_of_fit(loop: LoopResponses, found: ClosedLoopFit) -> States:
    """All states with a law at work, whatever the law reads."""
    return states_with_law(loop, found.law, found.sizes, found.states)
