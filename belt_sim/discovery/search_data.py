"""Forms of laws, latent inputs, and what else a search for an unknown law works with beside a fit."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from hashlib import blake2b
from threading import Lock
from typing import Any

import numpy as np

from belt_sim.diagnosis.examine import MANY_READINGS
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.samples import Samples
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.discovery.responses import (
    CHOSEN,
    ImpulseResponses,
    ResidualProjector,
    States,
    design_matrix,
    impulse_responses,
    is_shown,
    posterior_modes,
    single_precision,
    span_changes,
    states_of,
)
from belt_sim.effects.law import (
    AT_PULLEYS,
    BY_THE_BELT,
    ONE_SIDED,
    PULLEYS,
    ROLLS,
    SPAN_NAMES,
    STIFFNESS,
    WRAPPED,
    Form,
    Law,
    Place,
)
from belt_sim.jax_setup import in_float64
from belt_sim.line.hooks import true_travel

# The dictionary of forms that a search tries at a place, and their values along the runs.


WITH_KNEE = ("saturation", "dead_zone")  # shapes with a knee that are tried of what reads the state
STEADY = ("constant", "linear", "square_root")
#: kinds of places at which the usual forms do not depend on where the belt runs
COURSES_ONLY = ("tension", "travel", "span", *STIFFNESS)
SECTIONS = (0.05, 0.1, 0.2, 0.4)  # of the belt
WIDE = (0.05, 0.1, 0.2)  # of the record, how long something lasts
ONSETS = 12  # of the record, for onsets
RISES = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64)  # of the record
KNEES = (0.1, 0.25, 0.5, 0.75)  # of the largest size of a variable
FADES = (0.5, 1.5, 4.5)  # wavelengths, over which a wave decays
ENDLESS = 2.5  # records, over which a decay cannot be told from what stays
STICKS = (0.02, 0.05, 0.1, 0.25, 0.5)  # of the largest reading, how far something sticks
SAME_YAW = 0.02  # of the largest, within which yaws are one size: settings may be off by as much
RATIO = 1.3  # to the next wavelength of a decaying wave


def simpler_form(form: Form, end: float, cell: float) -> Form:
    """The plainer form that a form comes to when a length is beyond a record of ``end`` ([m]; of what is timed [s]), or
    within a cell of it: a straight rise, a wave, what is there from the start, what stays; else the form itself.
    """
    at, wide = form.at or 0.0, form.wide or 0.0
    if (form.course in ("rise", "step") and at < cell) or (form.course == "decay" and at > ENDLESS * end):
        return replace(form, course="constant", at=None)
    if form.course == "rise" and at > end:
        return replace(form, course="linear", at=None)
    return replace(form, course="wave", wide=None) if form.course == "decaying_wave" and wide > end else form


def form_inputs(states: States, forms: Sequence[Form], part: int | None, signal: str | None) -> np.ndarray:
    """Forms along every run, (R, F, J); part: the pulley, signal: the sensor."""
    found = np.empty((len(states.tension), len(forms), len(states.s)))
    shaped: dict[tuple, np.ndarray] = {}
    courses: dict[tuple, np.ndarray] = {}
    with np.errstate(over="ignore"):  # of what has faded away
        for k, f in enumerate(forms):
            what, when = (f.variable, f.shape, f.knee), (f.variable, f.course, f.at, f.wide, f.timed)
            if what not in shaped:
                shaped[what] = f.shape_value(variable(states, f.variable, part, signal), states.s, np)
            if when not in courses:
                courses[when] = f.course_value(course_travel(states, f, part), np)
            np.multiply(shaped[what], courses[when], out=found[:, k])
    return found


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
    return getattr(states, name)[:, part if part is not None else states.signals.index(signal)]


def _forms(names: Iterable[str], courses: Iterable[tuple], **more: Any) -> list[Form]:
    """Forms of variables with courses, (course, at, wide) each."""
    return [Form(n, course=c, at=at, wide=wide, **more) for n in names for c, at, wide in courses]


def _courses(states: States, end: float, *kinds: str) -> list[tuple]:
    """Courses over a record of ``end``: steady ones, rises, onsets (step), what acts for a while only (interval), what
    goes one way (one_way), waves from once in the record to the shortest that grid and readings carry, evenly spaced in
    wavenumber, and waves that fade; of a wave its cosine only."""
    shortest = states.shortest_wave
    lengths = end / RATIO ** np.arange(0.0, np.log(end / shortest) / np.log(RATIO))
    starts = [(w, at) for w in WIDE for at in np.arange(0.05, 0.97 - w, max(w, 0.1) / 1.5)]
    grids: dict[str, list[tuple]] = {
        "steady": [(c, None, None) for c in STEADY],
        "quadratic": [("quadratic", None, None)],
        "rise": [("rise", end * r, None) for r in RISES],
        "decay": [("decay", end * r, None) for r in RISES],
        "step": [("step", end * k / ONSETS, None) for k in range(1, ONSETS - 1)],
        "wave": [("wave", end / c, None) for c in np.arange(1.0, end / shortest, 0.75)],
        "interval": [("interval", float(end * at), end * w) for w, at in starts],
        "decaying_wave": [
            ("decaying_wave", float(at), float(at * fade)) for at in lengths for fade in FADES if at * fade < end
        ],
    }
    return [course for kind in kinds for course in grids[kind]]


def usual_forms(states: States, kind: str) -> list[Form]:
    """All forms to try at a kind of place; of a wave its cosine only."""
    end = float(states.s[-1])
    courses, passing = _courses(states, end, "steady", "rise", "step"), _courses(states, end, "wave", "interval")
    forms = _forms(("none",), [*courses, *passing])
    if kind in COURSES_ONLY:
        tensions = np.unique(np.round(states.tension, -4))
        if kind in STIFFNESS and len(tensions) > 2:  # enough to tell what begins at a tension from a power of it
            between = [float(x) for x in np.sqrt(tensions[1:] * tensions[:-1])]
            forms += [Form("sigma", shape=s, knee=x) for s in ("below", "above") for x in between]
        return forms
    names: tuple[str, ...] = ("reading", "reading_rate")
    along: list[tuple] = [("constant", None, None), ("linear", None, None)]
    if kind != "sensor":
        if np.any(states.beta):
            forms += _forms(("beta",), [*courses, *passing])
            sizes = np.abs(states.beta).max(axis=1)
            if np.ptp(sizes) > SAME_YAW * sizes.max():
                forms += [Form("beta", shape=s) for s in ("signed_square", "square", "cube")]
        forms += _forms(("alpha", "kappa"), _courses(states, end, "interval"))
        names, along = ("y", "alpha", "kappa"), [*courses, *_courses(states, end, "decay")[:4]]
    forms += _forms(names, along)
    for n in names:
        largest = float(np.abs(getattr(states, n)).max())  # 0 throughout of the curvature of a rope: it has no knee
        forms += [Form(n, shape=s) for s in ("signed_square", "square", "cube")]
        forms += [Form(n, shape=s, knee=b * largest) for s in WITH_KNEE for b in KNEES if largest]
    return forms


def rare_forms(states: States, kind: str, periods: Sequence[float]) -> list[Form]:
    """Forms for a law once it is known that something is missing.

    What begins when the yaw is set, either way, or as far whatever the yaw is; what goes or swings with time instead of
    travel; decaying waves after a step, and decay without a wave; what reads the state and comes back with ``periods``
    [m] of the machine; what sticks.
    """
    end, turned = float(states.s[-1]), bool(np.any(states.beta))
    found = [Form("none", course="quadratic")]
    late = ("yaw_set",) if np.any(states.yaw_set < 1.0) else ()
    one_way = ("steady", "quadratic", "rise", "decay")
    found += _forms(late, _courses(states, end, *one_way))
    if len(np.unique(states.speed)) > 1:
        longest = end / float(np.min(states.speed))
        odd = ("beta",) if turned and kind not in (*COURSES_ONLY, "sensor") else ()
        found += _forms(("none", *late, *odd), _courses(states, longest, *one_way)[1:], timed=True)
        for names, course in ((("none",), "wave"), (odd, "decaying_wave")):  # lengths [m] as durations
            pace = longest / end
            times = [(c, at * pace, wide and wide * pace) for c, at, wide in _courses(states, end, course)]
            found += _forms(names, times, timed=True)
    if kind == "sensor":
        largest = float(np.abs(states.reading).max())
        return found + [Form("reading", shape="stick", knee=b * largest) for b in STICKS]
    if kind in STIFFNESS:  # what grows with how far the belt goes or is bent, on either side alike; on one side only
        for n in ("y", "kappa", "kappa_mean"):
            largest = float(np.abs(getattr(states, n)).max())
            knees = [b * largest for b in KNEES] if largest else []
            found += [Form(n, shape=s) for s in ("magnitude", "square")]
            found += [Form(n, shape="magnitude_beyond", knee=k) for k in knees]
            found += [Form(n, shape=s, knee=k) for s in ONE_SIDED for k in knees[:2]]
    if kind in COURSES_ONLY:
        return found
    sizes = np.abs(states.beta).max(axis=1)
    if np.ptp(sizes) > SAME_YAW * sizes.max():  # by direction alone: play and friction, used up
        knee = KNEES[1] * float(sizes.max())
        found += _forms(("beta",), _courses(states, end, *one_way), shape="saturation", knee=knee)
    beta = ("beta",) if turned else ()
    back = [("wave", at, None) for at in periods if states.shortest_wave < at < 2.0 * end]
    found += _forms(("none", *beta), _courses(states, end, "decaying_wave"))
    found += _forms(beta, _courses(states, end, "decay"))  # a strongly damped wave
    return found + _forms((*beta, "y", "alpha", "kappa"), back)


# Where something is missing: the marginal likelihood of a smooth unknown input at each place.
#
# u is a Gaussian process in travel (Matern 3/2), pooled over the runs of a tension and odd or even in yaw, or free run
# by run; its length and height are those of greatest evidence. Whitened columns make the evidence comparable.


KNOTS = 65
INPUT_LENGTHS = {0.04: 1, 0.12: 1, 0.4: 2, 1.2: 4}  # of the record; each wants every so manieth knot
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
        return self.weights.T @ np.stack([np.interp(grid, self.knots, row) for row in self.mean])


@dataclass(frozen=True)
class Spectrum:
    """How the readings bind an input whose prior has one length, by groups of runs: root (K, K) of the prior, unit:
    mean information of a knot; values (G, K), vectors (G, K, K): of the information, eigen-decomposed beside it, with
    all their digits: values span ten powers of ten, and weak modes drown in the rounding of strong ones."""

    root: np.ndarray
    unit: float
    values: np.ndarray
    vectors: np.ndarray


ONE_BY_ONE = Lock()  # searches beside several fits share spectra
#: of a place, what its information is, and its spectra by length and squares of the weights
Spectra = dict[Place, tuple[bytes, dict[tuple, Spectrum]]]


def _posterior(projector: ResidualProjector, spectrum: Spectrum, pull, shared, squares):
    """(log evidence gain, height, mean, sd, by_chance) of the best height among ``squares`` (a^2).

    A mean is shrunk by 1 - h, h = a^2 v / (1 + a^2 v), along an eigenvector: of noise it explains 2 h - h^2 there.
    """
    root, values, vectors = spectrum.root, spectrum.values, spectrum.vectors
    onto = vectors.swapaxes(1, 2) @ root.T
    b, c = (onto @ pull[..., None])[..., 0], onto @ shared  # (G, K), (G, K, c)
    gram, prior, along = projector.gram, projector.prior, projector.shared_residual
    shrink = squares[:, None, None] / (1.0 + squares[:, None, None] * values)  # (H, G, K)
    flat, each = shrink.reshape(len(squares), -1), c.reshape(-1, c.shape[-1])
    inner = gram - (flat @ (each[:, :, None] * each[:, None, :]).reshape(len(each), -1)).reshape(-1, *gram.shape)
    left = along - (flat * b.reshape(-1)) @ each
    precision, modes = posterior_modes(inner, prior)
    common = (modes @ ((left[:, None] @ modes)[:, 0] / precision)[..., None])[..., 0]
    gain = 0.5 * flat @ b.reshape(-1) ** 2 - 0.5 * np.log1p(squares[:, None, None] * values).sum(axis=(1, 2))
    gain += 0.5 * (np.einsum("hc,hc->h", left, common) - np.log(precision).sum(axis=1) - projector.shared_evidence)
    k = int(np.argmax(gain))
    square, shrink, back = squares[k], shrink[k], root @ vectors
    mean = (back @ (shrink * (b - c @ common[k]))[..., None])[..., 0]
    sd = np.sqrt(np.einsum("gik,gk->gi", back**2, shrink))
    by_chance = np.sum(1.0 - 1.0 / (1.0 + square * values) ** 2)
    return float(gain[k]), float(np.sqrt(square)), mean, sd, float(by_chance)


# What a search for an unknown law works with, beside a fit: projector, design matrices, states and places.


@dataclass(frozen=True)
class SearchData:
    """bench, fit: where the search begins; design: name -> ``design_matrix``, by an ``lru_cache``; tension: the
    reference tension [Pa]; wide: whether forms and places are tried that are too many for a test of whether anything is
    missing; kept: what was computed already; spectra: of each place, kept for those who ask next: an input adds the
    same to the readings whatever else does, unless that changes the belt's spans; for the rest see their modules."""

    bench: Workbench
    fit: Fit
    projector: ResidualProjector
    responses: ImpulseResponses
    design: Any
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

    def forget_inputs(self) -> None:
        """Drop what takes most memory and little time: forms along every run, and their columns."""
        self.kept.pop("within", None)
        for key in [k for k in self.kept if k[0] in ("inputs", "single")]:
            del self.kept[key]

    def pace(self, form: Form) -> float:
        """What turns travels [m] into what a form's course goes with: the slowest speed of what is timed, else 1."""
        return float(np.min(self.states.speed)) if form.timed else 1.0

    def shortest(self, form: Form) -> float:
        """The least that ``at`` may be [m; s of what is timed]: of a wave that readings can tell from its aliases."""
        return self.states.shortest_wave / self.pace(form) if form.is_wave else 1e-300

    def forms(self, place: Place) -> tuple[list[Form], list[Form]]:
        """The forms to try at a place: the usual ones and the rare ones."""
        if place.is_carried:  # by a section of the belt, all round it: grip that it lacks, stiffness, a bend of its own
            own = [("belt_section", float(at), w) for w in SECTIONS for at in np.arange(0.5, 1.5 - 1e-9, 0.5 * w)]
            names = ("none",) if place.kind in STIFFNESS else ("alpha", "kappa")
            return _forms((*names, "none") if place.kind == "turn" else names, own), []
        rig = self.bench.samples.cases.rig  # travels after which parts of the machine come back: the belt, the pulleys
        turns = {2.0 * np.pi * float(r) for r in (rig.tail_radius, rig.head_radius)}
        periods = (float(rig.belt_length), *sorted(turns))
        return usual_forms(self.states, place.kind), rare_forms(self.states, place.kind, periods) if self.wide else []

    @property
    def places_to_try(self) -> tuple[Place, ...]:
        """The places to try."""
        usual = tuple(p for p in self.places if p.kind not in ("span", "travel") and not p.is_carried)
        return self.places if self.wide else usual

    def columns_at(self, channel: str, inputs: np.ndarray) -> np.ndarray:
        """Whitened columns (F, R, m) of inputs (F, R, J) at a channel."""
        op = self.design(channel)
        return np.matmul(single_precision(inputs).swapaxes(0, 1), op.swapaxes(0, 1)).swapaxes(0, 1)

    def rows(self, place: Place, forms: list[Form]) -> np.ndarray:
        """Whitened columns (F, R, m) of forms of size 1 at a place, without dependence on tension."""
        found, states = [], self.states.at_landing if place.kind in WRAPPED else self.states
        for channel, part in place.parts:
            if place.is_stretch:
                inputs = states.stretch_input(place, channel, int(part or 0), forms).swapaxes(0, 1)
            else:
                one = form_inputs(states, forms, part, channel).swapaxes(0, 1)
                inputs = one * self.states.channel_gain(place, channel, part)
            found.append(self.columns_at(channel, inputs))
        return found[0] if len(found) == 1 else np.sum(found, axis=0)

    def columns(self, law: Law) -> np.ndarray:
        """Whitened columns (k, R, m) of a law's terms; a wave has two."""
        found = [
            self.rows(t.place, list(t.form.halves.values())) * self.weight(t.exponent)[None, :, None] for t in law.terms
        ]
        return np.concatenate(found).astype(float)

    @cached_property
    def latent_inputs(self) -> list[LatentInput]:
        """The latent inputs of all places and ways of pooling runs, by evidence.

        Places carried by the belt have none: a smooth input there would take what a weld or a crooked edge does.
        """
        found = [c for place in self.places if not place.is_carried for c in self.latent_inputs_at(place)]
        return sorted(found, key=lambda c: -c.gain)

    def basis_at(self, place: Place) -> Basis:
        """Information of the readings on an input at a place."""
        g, grid = self.projector, self.states.s
        knots = np.linspace(grid[0], grid[-1], KNOTS)
        hats = np.maximum(0.0, 1.0 - np.abs(grid[None] - knots[:, None]) / (knots[1] - knots[0]))
        plain = np.repeat(hats[:, None], len(g.residual), axis=1)
        parts = [self.columns_at(part[0], self.states.channel_input(place, plain, *part)) for part in place.parts]
        rows = (parts[0] if len(parts) == 1 else np.sum(parts, axis=0)).swapaxes(0, 1).astype(float)
        shared = rows @ g.shared.swapaxes(0, 1).swapaxes(1, 2)
        return Basis(knots, rows @ rows.swapaxes(1, 2), np.einsum("rkm,rm->rk", rows, g.residual), shared)

    def latent_inputs_at(self, place: Place) -> list[LatentInput]:
        """The likeliest input at a place for each way of pooling runs, by evidence."""
        basis = self.basis_at(place)
        same = blake2b(basis.information.tobytes()).digest()
        with ONE_BY_ONE:
            if place not in self.spectra or self.spectra[place][0] != same:
                self.spectra[place] = same, {}
            spectra = self.spectra[place][1]
        # how runs may share an input: weights (G, R); odd ones go with the commanded yaw over the largest, of the tail
        # pulley or, if only that was turned, of the head pulley
        runs = self.bench.samples.runs
        keys = [(r.tension, r.direction) for r in runs]
        groups = np.array([[k == key for k in keys] for key in sorted(set(keys))], dtype=float)
        yaw = np.array([r.yaw for r in runs])
        yaw = yaw if np.any(yaw) else np.array([r.yaw_head for r in runs])
        odd = groups * (yaw / max(float(np.abs(yaw).max()), 1e-12))
        pools = {"odd": odd, "even": groups, "each run": np.eye(len(runs))}

        found, bases = [], {share: basis.with_fewer_knots(apart) for share, apart in INPUT_LENGTHS.items()}
        for pool, weights in ((n, w[np.any(w != 0.0, axis=1)]) for n, w in pools.items() if np.any(w)):
            of_lengths = []
            for share, fewer in bases.items():  # of the likeliest height, the length being a share of the record
                length = share * fewer.knots[-1]
                key = length, (weights**2).tobytes()
                with ONE_BY_ONE:  # who asks next for the same has it
                    if key not in spectra:
                        information = np.einsum("gr,rkl->gkl", weights**2, fewer.information)
                        apart = np.sqrt(3.0) * np.abs(fewer.knots[:, None] - fewer.knots[None]) / length
                        root = np.linalg.cholesky((1.0 + apart) * np.exp(-apart) + 1e-8 * np.eye(len(fewer.knots)))
                        unit = float(np.mean(np.einsum("gkk->gk", information))) + 1e-300
                        values, vectors = np.linalg.eigh(root.T @ information @ root)
                        spectra[key] = Spectrum(root, unit, np.maximum(values, 0.0), vectors)
                    spectrum = spectra[key]
                pull = np.einsum("gr,rk->gk", weights, fewer.pull)
                shared = np.einsum("gr,rkc->gkc", weights, fewer.shared)
                gain, height, *rest = _posterior(self.projector, spectrum, pull, shared, HEIGHTS / spectrum.unit)
                of_lengths.append(LatentInput(place, pool, gain, length, height, fewer.knots, weights, *rest))
            found.append(max(of_lengths, key=lambda c: c.gain))
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
        found += [Place(kind, "carried", tilts if kind in STIFFNESS else ()) for kind in BY_THE_BELT]
    found.append(Place("tension", sensors=tilts))
    for kind in STIFFNESS:
        found += [Place(kind, where, tilts) for where in (SPAN_NAMES if kind == "pull" else ("both", *SPAN_NAMES))]
    if len({r.direction for r in samples.runs}) > 1:
        found += [Place("span", where) for where in SPAN_NAMES]
        found += [Place("pull", where, tilts) for where in PULLEYS]  # tight and slack side of a driven belt
    sensors = tuple((s.name, int(s.at[-1])) for s in samples.signals if s.kind == "lateral")
    found += [Place("sensor", sensor[0], (sensor,)) for sensor in sensors]
    found += [Place("sensor", "all", sensors)] if len(sensors) > 1 else []
    return (*found, Place("travel", sensors=sensors)) if sensors else tuple(found)


FEW_CHANNELS = 6  # whose responses are kept where there are many readings: those of a kind of place, or of a few laws


def has_many_readings(bench: Workbench) -> bool:
    """Whether memory counts for more than time."""
    return bench.samples.y.size > MANY_READINGS


def projector_of(bench: Workbench, fit: Fit) -> ResidualProjector:
    """Inner products beside what runs share: columns of the bench, and of the free parameters of the fit, which have no
    prior."""
    metric = replace(bench.metric, shared=(bench.metric.shared[0][:0], bench.metric.shared[1][:0]))
    shapes = np.concatenate([bench.shared, fit.slopes]) if len(fit.free) else bench.shared
    runs, chosen = len(bench.samples.runs), np.arange(len(shapes)) >= len(bench.shared)
    shared = metric.whiten(shapes).reshape(len(shapes), runs, -1)
    size = np.maximum(np.sqrt(np.sum(shared**2, axis=(1, 2))), 1e-12)
    shared = shared * np.where(chosen, 1.0 / size, 1.0)[:, None, None]
    residual = metric.whiten(bench.fitted.y - fit.values).reshape(runs, -1)
    return ResidualProjector(metric, residual, shared, np.where(chosen, CHOSEN, 1.0))


def search_data_of(bench: Workbench, fit: Fit, among: Sequence[str] = (), spectra: Spectra | None = None) -> SearchData:
    """The data for a search of what ``fit`` lacks; among: as in ``impulse_responses``; spectra: of searches beside
    other fits."""
    projector = projector_of(bench, fit)
    responses = impulse_responses(bench, fit, among)
    effects, samples = bench.forward.effects_at(fit.vector, fit.ids), bench.samples
    shown = np.concatenate([samples.travel, samples.yaw_at[:, None]], axis=1)
    true = np.asarray(in_float64(true_travel)(effects, samples.cases, shown.T)).T if effects else shown
    made = partial(design_matrix, bench, projector, responses, true)
    states = states_of(bench, responses, span_changes(bench, fit, among))
    found = campaign_places(samples)
    channels = {channel for p in found for channel, _ in p.parts}
    seen = {c for c in channels if c in ROLLS or is_shown(samples, responses, c)}
    places = [p for p in found if seen.issuperset(channel for channel, _ in p.parts)]
    bent = [p for p in places if not p.relative or any(np.any(states.channel_gain(p, *part)) for part in p.parts)]
    unit = float(f"{np.exp(np.mean(np.log(states.tension))) / 1e6:.1g}") * 1e6
    return SearchData(
        bench, fit, projector, responses, lru_cache(FEW_CHANNELS if has_many_readings(bench) else None)(made), states,
        tuple(bent), unit, spectra={} if spectra is None else spectra,
    )  # fmt: skip
