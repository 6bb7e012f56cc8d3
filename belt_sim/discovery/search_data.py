"""What a search for an unknown law works with, beside a fit: projector, design matrices, states and places."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.discovery.design import (
    DesignMatrices,
    ResidualProjector,
    design_matrices,
    residual_projector,
)
from belt_sim.discovery.form_dictionary import belt_sections, form_values, rare_forms, usual_forms
from belt_sim.discovery.impulse_responses import ImpulseResponses, impulse_responses, span_changes
from belt_sim.discovery.latent_input import LatentInput, basis_at, latent_inputs
from belt_sim.discovery.states import States, states_of
from belt_sim.effects.law import (
    AT_PULLEYS,
    BY_THE_BELT,
    CARRIED,
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


@dataclass(frozen=True)
class SearchData:
    """bench, fit: where the search begins; tension: the reference tension [Pa]; wide: whether forms and places are
    tried that are too many for a test of whether anything is missing; kept: what was computed already; for the rest see
    their modules."""

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
        found = [c for place in self.places if not place.is_carried for c in self.latent_inputs_at(place)]
        return sorted(found, key=lambda c: -c.gain)

    def latent_inputs_at(self, place: Place) -> list[LatentInput]:
        """The latent inputs of a place for all ways of pooling runs, by evidence."""
        basis = basis_at(self.projector, self.design, place, self.states.channel_input)
        return sorted(latent_inputs(self.projector, basis, place, self.bench.samples.runs), key=lambda c: -c.gain)


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


def search_data_of(bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> SearchData:
    """The data for a search of what ``fit`` lacks; among: as in ``impulse_responses``."""
    responses = impulse_responses(bench, fit, among)
    projector = residual_projector(bench, fit)
    design = design_matrices(bench, projector, responses, bench.forward.effects_at(fit.vector, fit.ids))
    states = states_of(bench, responses, span_changes(bench, fit))

    def is_visible(place: Place) -> bool:
        """Whether the readings show an input at a place at all, and the spans that it changes are bent."""
        bent = not place.relative or any(np.any(states.channel_gain(place, *part)) for part in place.parts)
        return bent and all(np.any(design.rows[channel]) for channel, _ in place.parts if channel not in ROLLS)

    places = tuple(filter(is_visible, campaign_places(bench.samples)))
    unit = float(np.exp(np.mean(np.log(states.tension))))
    unit = 1e6 * float(f"{unit / 1e6:.1g}")
    return SearchData(bench, fit, projector, responses, design, states, places, unit)
