"""Forms of laws, latent inputs, and what else a search for an unknown law works with beside a fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import blake2b
from typing import Any

import numpy as np

from belt_sim.campaign import Run
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.samples import Samples
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.discovery.responses import (
    DesignMatrices,
    ImpulseResponses,
    ResidualProjector,
    States,
    design_matrices,
    impulse_responses,
    residual_projector,
    span_changes,
    states_of,
)
from belt_sim.effects.law import (
    AT_PULLEYS,
    BY_THE_BELT,
    CARRIED,
    ONE_SIDED,
    PULLEYS,
    ROLLS,
    SENSOR,
    SPAN,
    SPANS,
    STIFFNESS,
    TENSION,
    TRAVEL,
    Form,
    Law,
    Place,
)

# The dictionary of forms that a search tries at a place, and their values along the runs.


WITH_KNEE = ("saturation", "dead_zone")  # shapes with a knee that are tried of what reads the state
STEADY = ("constant", "linear", "square_root")
#: kinds of places at which the usual forms do not depend on where the belt runs
COURSES_ONLY = (TENSION, TRAVEL, SPAN, *STIFFNESS)
SECTIONS = (0.05, 0.1, 0.2, 0.4)  # of the belt
WIDE = (0.05, 0.1, 0.2)  # of the record, how long something lasts
PARTS = 12  # of the record, for onsets
RISES = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)  # of the record
KNEES = (0.1, 0.25, 0.5, 0.75)  # of the largest size of a variable
FADES = (0.5, 1.5, 4.5)  # wavelengths, over which a wave decays
ENDLESS = 2.5  # records, over which a decay cannot be told from what stays
STICKS = (0.02, 0.05, 0.1, 0.25, 0.5)  # of the largest reading, how far something sticks
SAME_YAW = 0.02  # of the largest, within which yaws are one size: settings may be off by as much
RATIO = 1.3  # to the next wavelength of a decaying wave


def timed_form(form: Form, pace: float) -> Form:
    """The same form along time, lengths [m] taken as durations at so many s/m."""
    at, wide = (None if n is None else n * pace for n in (form.at, form.wide))
    return replace(form, at=at, wide=wide, timed=True)


def simpler_form(form: Form, end: float, cell: float) -> Form | None:
    """The plainer form that a form comes to when a length is beyond a record of ``end`` ([m]; of what is timed [s]), or
    within a cell of it: a straight rise, a wave, what is there from the start, what stays; None where it stays itself.
    """
    if form.course in ("rise", "step") and (form.at or 0.0) < cell:
        return replace(form, course="constant", at=None)
    if form.course == "rise" and (form.at or 0.0) > end:
        return replace(form, course="linear", at=None)
    if form.course == "decay" and (form.at or 0.0) > ENDLESS * end:
        return replace(form, course="constant", at=None)
    if form.course == "decaying_wave" and (form.wide or 0.0) > end:
        return replace(form, course="wave", wide=None)
    return None


def form_values(form: Form, states: States, part: int | None, signal: str | None) -> np.ndarray:
    """A form along every run, (R, J); part: the pulley, signal: the sensor."""
    x, s = variable(states, form.variable, part, signal), course_travel(states, form, part)
    with np.errstate(over="ignore"):  # of what has faded away
        return form.shape_value(x, s, np) * form.course_value(s, np)


def course_travel(states: States, form: Form, part: int | None) -> np.ndarray:
    """What a form's course goes with, (R, J), or (1, J) where all runs have the same; part: the pulley."""
    if form.is_carried:
        return states.belt_part[:, part or 0]
    s = states.since if form.since_yaw else states.s[None]
    return s / states.speed[:, None] if form.timed else s


def variable(states: States, name: str, part: int | None, signal: str | None) -> np.ndarray:
    """A variable along every run, (R, J)."""
    if name == "none":
        return np.ones_like(states.beta)
    if name == "sigma":
        return np.broadcast_to(states.tension[:, None], states.beta.shape)
    if name in ("beta", "yaw_set"):
        return getattr(states, name)
    if name in ("reading", "reading_rate"):
        return getattr(states, name)[:, states.signals.index(signal)]
    return getattr(states, name)[:, part]


def usual_forms(states: States, kind: str) -> list[Form]:
    """All forms to try at a kind of place; of a wave its cosine only."""
    end = float(states.s[-1])
    timed = [("rise", end * r) for r in RISES] + [("step", end * k / PARTS) for k in range(1, PARTS - 1)]
    courses = [(c, None) for c in STEADY] + timed
    forms = [Form("none", course=c, at=a) for c, a in courses] + waves(states, ("none",)) + intervals(states, ("none",))
    if kind in COURSES_ONLY:
        tensions = np.unique(np.round(states.tension, -4))
        if kind in STIFFNESS and len(tensions) > 2:  # enough to tell what begins at a tension from a power of it
            between = [float(x) for x in np.sqrt(tensions[1:] * tensions[:-1])]
            forms += [Form("sigma", shape=s, knee=x) for s in ("below", "above") for x in between]
        return forms
    if kind == "sensor":
        return forms + _state_forms(states, ("reading", "reading_rate"), [("constant", None), ("linear", None)])
    if np.any(states.beta):
        forms += [Form("beta", course=c, at=a) for c, a in courses]
        forms += waves(states, ("beta",)) + intervals(states, ("beta",))
        if _has_many_sizes(states.beta):
            forms += [Form("beta", shape=s) for s in ("signed_square", "square", "cube")]
    forms += intervals(states, ("alpha", "kappa"))
    fading = [("decay", end * r) for r in RISES[:4]]
    return forms + _state_forms(states, ("y", "alpha", "kappa"), courses + fading)


def _has_many_sizes(beta: np.ndarray) -> bool:
    """Whether yaws (R, J) are of more than one size."""
    sizes = np.abs(beta).max(axis=1)
    return bool(np.ptp(sizes) > SAME_YAW * sizes.max())


def rare_forms(states: States, kind: str, periods: Sequence[float]) -> list[Form]:
    """Forms for a law once it is known that something is missing.

    What begins when the yaw is set, either way, or as far whatever the yaw is; what goes or swings with time instead of
    travel; decaying waves after a step, and decay without a wave; what reads the state and comes back with ``periods``
    [m] of the machine; what sticks.
    """
    end = float(states.s[-1])
    found = [Form("none", course="quadratic")]
    late = bool(np.any(states.yaw_set < 1.0))
    if late:
        found += [Form("yaw_set", course=c, at=a) for c, a in _one_way_courses(end)]
    if len(np.unique(states.speed)) > 1:
        longest = end / float(np.min(states.speed))
        odd = kind not in (*COURSES_ONLY, "sensor") and bool(np.any(states.beta))
        names = [n for n, there in (("none", True), ("yaw_set", late), ("beta", odd)) if there]
        found += [Form(n, course=c, at=a, timed=True) for n in names for c, a in _one_way_courses(longest)[1:]]
        found += [timed_form(f, longest / end) for f in waves(states, ("none",))]
        found += [timed_form(f, longest / end) for f in decaying_waves(states, ("beta",))] if odd else []
    if kind == "sensor":
        largest = float(np.abs(states.reading).max())
        return found + [Form("reading", shape="stick", knee=b * largest) for b in STICKS]
    if kind in STIFFNESS:  # what grows with how far the belt goes or is bent, on either side alike; on one side only
        for n in ("y", "kappa", "kappa_mean"):
            knees = _knees(states, n)
            found += [Form(n, shape=s) for s in ("magnitude", "square")]
            found += [Form(n, shape="magnitude_beyond", knee=k) for k in knees]
            found += [Form(n, shape=s, knee=k) for s in ONE_SIDED for k in knees[:2]]
        return found
    if kind in COURSES_ONLY:
        return found
    if np.any(states.beta) and _has_many_sizes(states.beta):  # by direction alone: play and friction, used up
        knee = KNEES[1] * float(np.abs(states.beta).max())
        found += [Form("beta", shape="saturation", knee=knee, course=c, at=a) for c, a in _one_way_courses(end)]
    shortest = states.shortest_wave
    beta = ("beta",) if np.any(states.beta) else ()
    read = (*beta, "y", "alpha", "kappa")
    back = [Form(n, course="wave", at=at) for n in read for at in periods if shortest < at < 2.0 * end]
    creeping = [Form(n, course="decay", at=end * r) for n in beta for r in RISES]  # a strongly damped wave
    return found + decaying_waves(states, ("none", *beta)) + creeping + back


def _one_way_courses(end: float) -> list[tuple[str, float | None]]:
    """Courses that go one way, over a record of ``end``."""
    steady = [(c, None) for c in (*STEADY, "quadratic")]
    return [*steady, *((c, end * r) for c in ("rise", "decay") for r in RISES)]


def decaying_waves(states: States, names: tuple[str, ...]) -> list[Form]:
    """Waves that fade."""
    end, shortest = float(states.s[-1]), states.shortest_wave
    lengths = end / RATIO ** np.arange(0.0, np.log(end / shortest) / np.log(RATIO))
    return [
        Form(n, course="decaying_wave", at=float(at), wide=float(at * fade))
        for n in names
        for at in lengths
        for fade in FADES
        if at * fade < end
    ]


def intervals(states: States, names: tuple[str, ...]) -> list[Form]:
    """What acts for a while only."""
    end = float(states.s[-1])
    starts = [(w, at) for w in WIDE for at in np.arange(0.05, 0.97 - w, max(w, 0.1) / 1.5)]
    return [Form(n, course="interval", at=float(end * at), wide=end * w) for n in names for w, at in starts]


def belt_sections(kind: str) -> list[Form]:
    """What a section of the belt carries, all round it: grip that it lacks, stiffness, or a bend of its own."""
    names = ("none",) if kind in STIFFNESS else ("alpha", "kappa", *(("none",) if kind == "turn" else ()))
    places = [(float(at), wide) for wide in SECTIONS for at in np.arange(0.5, 1.5 - 1e-9, 0.5 * wide)]
    return [Form(n, course="belt_section", at=at, wide=wide) for n in names for at, wide in places]


def waves(states: States, names: tuple[str, ...]) -> list[Form]:
    """Waves from once in the record to the shortest that grid and readings carry, evenly spaced in wavenumber."""
    end = float(states.s[-1])
    count = np.arange(1.0, end / states.shortest_wave, 0.75)
    return [Form(n, course="wave", at=end / c) for n in names for c in count]


def _state_forms(states: States, names, courses) -> list[Form]:
    found = [Form(n, course=c, at=a) for n in names for c, a in courses]
    for n in names:
        found += [Form(n, shape=s) for s in ("signed_square", "square", "cube")]
        found += [Form(n, shape=s, knee=k) for s in WITH_KNEE for k in _knees(states, n)]
    return found


def _knees(states: States, name: str) -> list[float]:
    """The knees to try for a variable; none where it is zero throughout, as the curvature of a rope is."""
    largest = float(np.abs(getattr(states, name)).max())
    return [b * largest for b in KNEES] if largest else []


# Where something is missing: the marginal likelihood of a smooth unknown input at each place.
#
# u is a Gaussian process in travel (Matern 3/2), pooled over the runs of a tension and odd or even in yaw, or free run
# by run; its length and height are those of greatest evidence. Whitened columns make the evidence comparable.


KNOTS = 65
LENGTHS = {0.04: 1, 0.12: 1, 0.4: 2, 1.2: 4}  # of the record; each wants every so manieth knot
HEIGHTS = np.logspace(-1.0, 7.0, 17)  # of a^2 times the mean information of a knot


@dataclass(frozen=True)
class Basis:
    """A place's inputs on KNOTS knots, run by run: information (R, K, K), pull (R, K), shared (R, K, c)."""

    knots: np.ndarray
    information: np.ndarray
    pull: np.ndarray
    shared: np.ndarray

    def with_fewer_knots(self, apart: int) -> "Basis":
        """The same on every so manieth knot, which straight lines join."""
        if apart == 1:
            return self
        count = (len(self.knots) - 1) // apart + 1
        hats = np.maximum(0.0, 1.0 - np.abs(np.arange(count)[:, None] - np.arange(len(self.knots)) / apart))
        return Basis(self.knots[::apart], hats @ self.information @ hats.T, self.pull @ hats.T, hats @ self.shared)


@dataclass(frozen=True)
class LatentInput:
    """A place, how runs are pooled, its log evidence, and the posterior of u.

    gain: log evidence over that of no unknown; by_chance: chi2 that its mean explains of noise alone; weights (G, R):
    how much of each group's u a run feels; mean (G, K) and sd (G, K) of u at the knots (K,); length [m] and height of
    the prior.
    """

    place: Place
    pool: str
    gain: float
    length: float
    height: float
    knots: np.ndarray
    weights: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    by_chance: float

    def inputs(self, grid: np.ndarray) -> np.ndarray:
        """Posterior mean of u in every run on a grid, (R, J)."""
        on = np.stack([np.interp(grid, self.knots, row) for row in self.mean])
        return self.weights.T @ on


def basis_at(
    projector: ResidualProjector, design: DesignMatrices, place: Place, channel_input: Callable[..., np.ndarray]
) -> Basis:
    """Information of the readings on an input at a place; channel_input: ``States.channel_input``."""
    grid = design.grid
    knots = np.linspace(grid[0], grid[-1], KNOTS)
    hats = np.maximum(0.0, 1.0 - np.abs(grid[None] - knots[:, None]) / (knots[1] - knots[0]))
    plain = np.repeat(hats[:, None], len(projector.residual), axis=1)
    inputs = [channel_input(place, plain, *part) for part in place.parts]
    rows = design.place_columns(place, inputs).swapaxes(0, 1).astype(float)
    information = rows @ rows.swapaxes(1, 2)
    pull = np.einsum("rkm,rm->rk", rows, projector.residual)
    shared = rows @ projector.shared.swapaxes(0, 1).swapaxes(1, 2)
    return Basis(knots, information, pull, shared)


def pooling_weights(runs: Sequence[Run]) -> dict[str, np.ndarray]:
    """How runs may share an input: name -> weights (G, R).

    Odd ones go with the commanded yaw over the largest: the tail pulley's, or the head's if only that was turned.
    """
    keys = [(r.tension, r.direction) for r in runs]
    groups = np.array([[k == key for k in keys] for key in sorted(set(keys))], dtype=float)
    yaw = np.array([r.yaw for r in runs])
    yaw = yaw if np.any(yaw) else np.array([r.yaw_head for r in runs])
    pools = {
        "odd": groups * (yaw / max(float(np.abs(yaw).max()), 1e-12)),
        "even": groups,
        "each run": np.eye(len(runs)),
    }
    return {n: w[np.any(w != 0.0, axis=1)] for n, w in pools.items() if np.any(w)}


@dataclass(frozen=True)
class Spectrum:
    """How the readings bind an input whose prior has one length, by groups of runs: root (K, K) of the prior, unit:
    mean information of a knot; values (G, K), vectors (G, K, K): of the information, eigen-decomposed beside it."""

    root: np.ndarray
    unit: float
    values: np.ndarray
    vectors: np.ndarray


def _spectrum(basis: Basis, weights: np.ndarray, length: float) -> Spectrum:
    """The spectrum of runs pooled by ``weights`` (G, R), the prior of a ``length`` [m]."""
    information = np.einsum("gr,rkl->gkl", weights**2, basis.information)
    apart = np.sqrt(3.0) * np.abs(basis.knots[:, None] - basis.knots[None]) / length
    root = np.linalg.cholesky((1.0 + apart) * np.exp(-apart) + 1e-8 * np.eye(len(basis.knots)))
    unit = float(np.mean(np.einsum("gkk->gk", information))) + 1e-300
    values, vectors = np.linalg.eigh(root.T @ information @ root)
    return Spectrum(root, unit, np.maximum(values, 0.0), vectors)


#: of a place, what its information is, and its spectra by length and squares of the weights
Spectra = dict[Place, tuple[bytes, dict[tuple, Spectrum]]]


def latent_inputs(
    projector: ResidualProjector, basis: Basis, place: Place, runs: Sequence[Run], known: Spectra
) -> list[LatentInput]:
    """The likeliest input at a place for each way of pooling runs; known: spectra of each place, kept for those who ask
    next: an input adds the same to the readings whatever else does, unless that changes the belt's spans."""
    same = blake2b(np.ascontiguousarray(basis.information)).digest()
    if place not in known or known[place][0] != same:
        known[place] = same, {}
    spectra = known[place][1]
    found, bases = [], {share: basis.with_fewer_knots(apart) for share, apart in LENGTHS.items()}
    for pool, weights in pooling_weights(runs).items():
        of_lengths = []
        for share, fewer in bases.items():  # of the likeliest height, the length being a share of the record
            length = share * fewer.knots[-1]
            key = length, (weights**2).tobytes()
            spectrum = spectra[key] if key in spectra else spectra.setdefault(key, _spectrum(fewer, weights, length))
            pull = np.einsum("gr,rk->gk", weights, fewer.pull)
            shared = np.einsum("gr,rkc->gkc", weights, fewer.shared)
            squares = HEIGHTS / spectrum.unit
            gain, height, mean, sd, by_chance = _posterior(projector, spectrum, pull, shared, squares)
            of_lengths.append(LatentInput(place, pool, gain, length, height, fewer.knots, weights, mean, sd, by_chance))
        found.append(max(of_lengths, key=lambda c: c.gain))
    return found


def _posterior(projector: ResidualProjector, spectrum: Spectrum, pull, shared, squares):
    """(log evidence gain, height, mean, sd, by_chance) of the best height among ``squares`` (a^2).

    A mean is shrunk by 1 - h, h = a^2 v / (1 + a^2 v), along an eigenvector: of noise it explains 2 h - h^2 there.
    """
    root, values, vectors = spectrum.root, spectrum.values, spectrum.vectors
    onto = vectors.swapaxes(1, 2) @ root.T
    b, c = (onto @ pull[..., None])[..., 0], onto @ shared  # (G, K), (G, K, c)
    gram, along = projector.gram, projector.shared_residual
    at_none = 0.5 * along @ projector.inverse @ along - 0.5 * np.linalg.slogdet(gram)[1]
    shrink = squares[:, None, None] / (1.0 + squares[:, None, None] * values)  # (H, G, K)
    flat, each = shrink.reshape(len(squares), -1), c.reshape(-1, c.shape[-1])
    inner = gram - (flat @ (each[:, :, None] * each[:, None, :]).reshape(len(each), -1)).reshape(-1, *gram.shape)
    left = along - (flat * b.reshape(-1)) @ each
    common = np.linalg.solve(inner, left[..., None])[..., 0]
    gain = 0.5 * flat @ b.reshape(-1) ** 2 - 0.5 * np.log1p(squares[:, None, None] * values).sum(axis=(1, 2))
    gain += 0.5 * np.einsum("hc,hc->h", left, common) - 0.5 * np.linalg.slogdet(inner)[1] - at_none
    k = int(np.argmax(gain))
    best, square, shrink, common = gain[k], squares[k], shrink[k], common[k]
    back = root @ vectors
    mean = (back @ (shrink * (b - c @ common))[..., None])[..., 0]
    sd = np.sqrt(np.einsum("gik,gk->gi", back**2, shrink))
    by_chance = np.sum(1.0 - 1.0 / (1.0 + square * values) ** 2)
    return float(best), float(np.sqrt(square)), mean, sd, float(by_chance)


# What a search for an unknown law works with, beside a fit: projector, design matrices, states and places.


@dataclass(frozen=True)
class SearchData:
    """bench, fit: where the search begins; tension: the reference tension [Pa]; wide: whether forms and places are
    tried that are too many for a test of whether anything is missing; kept: what was computed already; spectra: as in
    ``latent_inputs``; for the rest see their modules."""

    bench: Workbench
    fit: Fit
    projector: ResidualProjector
    responses: ImpulseResponses
    design: DesignMatrices
    states: States
    places: tuple[Place, ...]
    tension: float
    wide: bool = False
    kept: dict = field(default_factory=dict)
    spectra: Spectra = field(default_factory=dict)

    @property
    def stated_tension(self) -> np.ndarray:
        """Tension of every run as it was set (R,) [Pa]."""
        return np.array([r.tension for r in self.bench.samples.runs])

    def weight(self, exponent: float) -> np.ndarray:
        """(tension / reference tension)^exponent of every run (R,)."""
        return (self.states.tension / self.tension) ** exponent

    def compute_once(self, key: tuple, made: Callable[[], Any], within: States | None = None) -> Any:
        """What ``made`` gives, computed once for a key; within: the states that it depends on, of which only the last
        are remembered."""
        found = self.kept
        if within is not None:
            if self.kept.get("within", (None,))[0] is not within:
                self.kept["within"] = within, {}
            found = self.kept["within"][1]
        if key not in found:
            found[key] = made()
        return found[key]

    def shortest(self, form: Form) -> float:
        """The least that ``at`` may be [m; s of what is timed]: of a wave that readings can tell from its aliases."""
        pace = float(np.min(self.states.speed)) if form.timed else 1.0
        return self.states.shortest_wave / pace if form.is_wave else 1e-300

    def forms(self, place: Place) -> tuple[list[Form], list[Form]]:
        """The forms to try at a place: the usual ones and the rare ones."""
        if place.is_carried:
            return belt_sections(place.kind), []
        rare = rare_forms(self.states, place.kind, self.periods) if self.wide else []
        return usual_forms(self.states, place.kind), rare

    @property
    def places_to_try(self) -> tuple[Place, ...]:
        """The places to try."""
        usual = tuple(p for p in self.places if p.kind not in (SPAN, TRAVEL) and not p.is_carried)
        return self.places if self.wide else usual

    @property
    def periods(self) -> tuple[float, ...]:
        """Travels [m] after which parts of the machine come back: the belt, and the pulleys."""
        rig = self.bench.samples.cases.rig
        turns = {2.0 * np.pi * float(r) for r in (rig.tail_radius, rig.head_radius)}
        return (float(rig.belt_length), *sorted(turns))

    def rows(self, place: Place, forms: list[Form]) -> np.ndarray:
        """Whitened columns (F, R, m) of forms of size 1 at a place, without dependence on tension."""
        inputs, states = [], self.states.variables_at(place)
        for channel, part in place.parts:
            if place.is_stretch:
                inputs.append(states.stretch_input(place, channel, int(part or 0), forms).swapaxes(0, 1))
                continue
            one = np.stack([form_values(f, states, part, channel) for f in forms])
            inputs.append(one * self.states.channel_gain(place, channel, part))
        return self.design.place_columns(place, inputs)

    def columns(self, law: Law) -> np.ndarray:
        """Whitened columns (k, R, m) of a law's terms; a wave has two."""
        found = []
        for t in law.terms:
            forms = [t.form, t.form.sine()] if t.form.is_wave else [t.form]
            found.append(self.rows(t.place, forms) * self.weight(t.exponent)[None, :, None])
        return np.concatenate(found).astype(float)

    def latent_inputs(self) -> list[LatentInput]:
        """The latent inputs of all places and ways of pooling runs, by evidence.

        Places carried by the belt have none: a smooth input there would take what a weld or a crooked edge does.
        """
        return list(self._latent_inputs)

    @cached_property
    def _latent_inputs(self) -> list[LatentInput]:
        found = [c for place in self.places if not place.is_carried for c in self.latent_inputs_at(place)]
        return sorted(found, key=lambda c: -c.gain)

    def latent_inputs_at(self, place: Place) -> list[LatentInput]:
        """The latent inputs of a place for all ways of pooling runs, by evidence."""
        basis = basis_at(self.projector, self.design, place, self.states.channel_input)
        found = latent_inputs(self.projector, basis, place, self.bench.samples.runs, self.spectra)
        return sorted(found, key=lambda c: -c.gain)


def campaign_places(samples: Samples) -> tuple[Place, ...]:
    """All places of a campaign: each pulley and both alike, the tension, the stiffness of the spans, each sensor and
    all alike, the encoder.

    What loads a span bends it where it runs up, on whichever pulley that is: where the belt has travelled both ways a
    span is a place of its own. What the belt carries meets both pulleys, one after the other, if it goes round once.
    """
    found = [Place(kind, where) for kind in AT_PULLEYS for where in (*PULLEYS, "both")]
    tilts = tuple((s.name, 0) for s in samples.signals if s.kind == "tilt")
    if samples.end > float(samples.cases.rig.belt_length):
        found += [Place(kind, CARRIED, tilts if kind in STIFFNESS else ()) for kind in BY_THE_BELT]
    found.append(Place(TENSION, sensors=tilts))
    for kind, (of_both, _) in STIFFNESS.items():
        found += [Place(kind, where, tilts) for where in (("both", *SPANS) if of_both else SPANS)]
    if len({r.direction for r in samples.runs}) > 1:
        found += [Place(SPAN, where) for where in SPANS]
        found += [Place("pull", where, tilts) for where in PULLEYS]  # tight and slack side of a driven belt
    sensors = tuple((s.name, int(s.at[-1])) for s in samples.signals if s.kind == "lateral")
    found += [Place(SENSOR, sensor[0], (sensor,)) for sensor in sensors]
    if len(sensors) > 1:
        found.append(Place(SENSOR, "all", sensors))
    if sensors:
        found.append(Place(TRAVEL, sensors=sensors))
    return tuple(found)


def search_data_of(bench: Workbench, fit: Fit, among: Sequence[str] = (), spectra: Spectra | None = None) -> SearchData:
    """The data for a search of what ``fit`` lacks; among: as in ``impulse_responses``; spectra: of searches beside
    other fits."""
    responses = impulse_responses(bench, fit, among)
    projector = residual_projector(bench, fit)
    design = design_matrices(bench, projector, responses, bench.forward.effects_at(fit.vector, fit.ids))
    states = states_of(bench, responses, span_changes(bench, fit, among))

    def is_visible(place: Place) -> bool:
        """Whether the readings show an input at a place at all, and the spans that it changes are bent."""
        bent = not place.relative or any(np.any(states.channel_gain(place, *part)) for part in place.parts)
        return bent and all(np.any(design.rows[channel]) for channel, _ in place.parts if channel not in ROLLS)

    places = tuple(filter(is_visible, campaign_places(bench.samples)))
    unit = float(np.exp(np.mean(np.log(states.tension))))
    unit = 1e6 * float(f"{unit / 1e6:.1g}")
    kept = {} if spectra is None else spectra
    return SearchData(bench, fit, projector, responses, design, states, places, unit, spectra=kept)
