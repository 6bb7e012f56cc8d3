"""Columns of laws, made from impulse responses, against the march with the written effect in it."""

from dataclasses import replace

import numpy as np
import pytest
from small_discovery import effect_of, fitted, forward_with, surveyed

from belt_sim.discovery.responses import Pulse
from belt_sim.effects.law import Form, Law, Term

SAME = 0.999  # cosine; cells of 0.2 m against steps of 0.1 m leave a few per mille
SIZE = 0.01
RATE = 0.99  # the same where a reading is differentiated over its samples, half a metre apart
TERMS = {
    "yaw_tail": Form("beta", course="rise", at=8.0),
    "turn_both": Form("kappa", shape="saturation", knee=1e-5),
    "drift_head": Form("alpha", course="step", at=12.0),
    "shift_head": Form("alpha"),
    "twist_both": Form("kappa", course="interval", at=10.0, wide=6.0),
    "tension": Form("none", course="rise", at=10.0),
    "travel": Form("none", course="linear"),
    "turn_tail": Form("beta", course="decaying_wave", at=9.0, wide=12.0),
    "drift_tail": Form("yaw_set", course="decay", at=20.0, timed=True),
    "sensor_y4": Form("reading", shape="stick", knee=2e-4),
    "sensor_all": Form("reading_rate"),
}


@pytest.fixture(scope="module")
def marched():
    """Derivatives of the march along the size of every written effect: place -> (k, R, S, n)."""
    data, classes = surveyed("yaw_creep"), {}
    places = {p.name: p for p in data.places}
    for name, form in TERMS.items():
        law = Law((Term(places[name], form, -1.0),))
        classes[name] = effect_of(data, law, [1.0] * law.terms[0].sizes, f"found_{name}")
    bench = replace(data.bench, forward=forward_with(data.bench, *classes.values()))
    null, found = bench.forward.null(), {}
    for name, cls in classes.items():
        index = bench.forward.index(cls.id)
        sizes = [k for k in index if bench.forward.slots[k].name in ("size", "cos", "sin")]
        scale = np.array([bench.forward.slots[k].scale for k in sizes])
        found[name] = bench.forward.expand(null, sizes)[1] / scale[:, None, None, None]
    return found


@pytest.mark.parametrize("name", TERMS)
def test_columns_are_those_of_the_march_with_the_written_effect(name, marched):
    data = surveyed("yaw_creep")
    place = next(p for p in data.places if p.name == name)
    own = data.columns(Law((Term(place, TERMS[name], -1.0),))).reshape(len(marched[name]), -1)
    there = data.projector.whiten(marched[name]).reshape(len(own), -1)
    for a, b in zip(own, there, strict=True):
        same = RATE if TERMS[name].variable == "reading_rate" else SAME
        assert a @ b > same * np.linalg.norm(a) * np.linalg.norm(b)
        assert np.linalg.norm(a) == pytest.approx(np.linalg.norm(b), rel=SIZE + 1.0 - same)


def test_the_march_answers_late_as_it_answers_early():
    """A pulse at 11 m does what the pulse at the first cell does, shifted."""
    data = surveyed("yaw_creep")
    bench = replace(data.bench, forward=forward_with(data.bench, Pulse))
    names = [s.name for s in bench.forward.slots]
    cell = 55
    vector = bench.forward.null()
    vector[names.index("middle")] = data.states.s[cell]
    vector[names.index("half")] = data.states.s[1]
    for name in ("yaw_tail", "turn_head", "shift_tail"):
        k = names.index(name)
        slope = bench.forward.expand(vector, [k])[1] / bench.forward.slots[k].scale
        late = data.projector.whiten(slope)[0]
        own = data.design(name)[cell]
        assert np.linalg.norm(late - own) < SIZE * np.linalg.norm(late)


def test_chosen_effects_and_stiffness_are_taken_out():
    data = surveyed("yaw_creep")
    assert data.projector.chi2() == pytest.approx(fitted("yaw_creep")[1].chi2, rel=1e-9)
