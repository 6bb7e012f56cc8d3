"""A survey: everything the search for an unknown works with, laid out beside a fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.discovery.evidence import Course, basis_of, courses
from belt_sim.discovery.forms import dictionary, form_values, seldom, stretches
from belt_sim.discovery.ground import Ground, ground_of
from belt_sim.discovery.operators import Operators, operators, shapes
from belt_sim.discovery.places import place_columns, places_of
from belt_sim.discovery.responses import Responses, relative_answers, responses
from belt_sim.discovery.states import States, states_of
from belt_sim.effects.law_terms import SPAN, TRAVEL, Form, Law, Place


@dataclass(frozen=True)
class Survey:
    """bench, fit: where the search begins; tension: the unit of tension [Pa]; wide: whether forms and
    places are tried that are too many for a test of whether anything is missing; kept: what was worked out already; the
    rest see their modules."""

    bench: Workbench
    fit: Fit
    ground: Ground
    answers: Responses
    ops: Operators
    states: States
    places: tuple[Place, ...]
    tension: float
    wide: bool = False
    kept: dict = field(default_factory=dict)

    @property
    def stated_tension(self) -> np.ndarray:
        """Tension of every run as it was set (R,) [Pa]."""
        return np.array([r.tension for r in self.bench.samples.runs])

    def weight(self, exponent: float) -> np.ndarray:
        """(tension / unit)^exponent of every run (R,)."""
        return (self.states.tension / self.tension) ** exponent

    def once(self, key: tuple, made: Callable[[], Any], within: States | None = None) -> Any:
        """What ``made`` gives, worked out once by this key; within: states on which it rests, of which only the last
        are remembered."""
        found = self.kept
        if within is not None:
            if self.kept.get("within", (None,))[0] is not within:
                self.kept["within"] = within, {}
            found = self.kept["within"][1]
        if key not in found:
            found[key] = made()
        return found[key]

    def forms(self, place: Place) -> tuple[list[Form], list[Form]]:
        """The forms to try at a place: the dictionary, and what is seldom."""
        if place.carried:
            return stretches(place.kind), []
        rare = seldom(self.states, place.kind, self.periods) if self.wide else []
        return dictionary(self.states, place.kind), rare

    @property
    def tried(self) -> tuple[Place, ...]:
        """The places to try."""
        return (
            self.places if self.wide else tuple(p for p in self.places if not (p.kind in (SPAN, TRAVEL) or p.carried))
        )

    @property
    def periods(self) -> tuple[float, ...]:
        """Travels [m] after which parts of the machine come back: the belt, and the pulleys."""
        rig = self.bench.samples.cases.rig
        turns = {2.0 * np.pi * float(r) for r in (rig.tail_radius, rig.head_radius)}
        return (float(rig.belt_length), *sorted(turns))

    def rows(self, place: Place, forms: list[Form]) -> np.ndarray:
        """Whitened columns (F, R, m) of forms of size 1 at a place, without dependence on tension."""
        inputs, states = [], self.states.read_at(place)
        for channel, part in place.parts:
            one = np.stack([form_values(f, states, part, channel) for f in forms])
            inputs.append(one * self.states.lever(place, channel, part))  # forms know which part of the belt is there
        return place_columns(self.ops, place, inputs)

    def readings(self, place: Place, inputs: np.ndarray) -> np.ndarray:
        """What inputs (k, R, J) at a place add to the readings, (k, R, S, n)."""
        found = 0.0
        for channel, part in place.parts:
            felt = self.states.felt(place, inputs, channel, part)
            cells = shapes(self.bench, self.answers, self.ops.true, channel)
            found = found + np.einsum("krj,jrsn->krsn", felt, cells, optimize=True)
        return np.asarray(found)

    def columns(self, law: Law) -> np.ndarray:
        """Whitened columns (k, R, m) of a law's terms; a wave has two."""
        found = []
        for t in law.terms:
            forms = [t.form, t.form.sine()] if t.form.is_wave else [t.form]
            found.append(self.rows(t.place, forms) * self.weight(t.exponent)[None, :, None])
        return np.concatenate(found).astype(float)

    def courses(self) -> list[Course]:
        """The courses of all places and ways of pooling, by evidence.

        Not of what the belt carries: a smooth course there takes what known effects of the belt, a weld or an edge, do.
        """
        found = [c for place in self.places if not place.carried for c in self.courses_at(place)]
        return sorted(found, key=lambda c: -c.gain)

    def courses_at(self, place: Place) -> list[Course]:
        """The courses of a place and all ways of pooling, by evidence."""
        basis = basis_of(self.ground, self.ops, place, self.states)
        return sorted(courses(self.ground, basis, place, self.bench.samples.runs), key=lambda c: -c.gain)

    def informed(self, course: Course) -> "Survey":
        """The survey with states as the data show them, a smooth input being at work."""
        return replace(self, states=states_of(self.bench, self.answers, self.states.relative, course))


def survey_of(bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> Survey:
    """Lay out the search for what ``fit`` lacks; among: as in ``responses``."""
    answers = responses(bench, fit, among)
    ground = ground_of(bench, fit)
    ops = operators(bench, ground, answers, bench.forward.effects_at(fit.vector, fit.ids))
    states = states_of(bench, answers, relative_answers(bench, fit))
    places = tuple(p for p in places_of(bench.samples) if _felt(ops, states, p))
    unit = float(np.exp(np.mean(np.log(states.tension))))
    unit = 1e6 * float(f"{unit / 1e6:.1g}")
    return Survey(bench, fit, ground, answers, ops, states, places, unit)


def _felt(ops: Operators, states: States, place: Place) -> bool:
    """Whether the readings feel an input at a place at all, and what it changes bends the spans."""
    bent = not place.relative or bool(np.any(states.bent[place.relative]))
    return bent and all(np.any(ops.rows[channel]) for channel, _ in place.parts)
