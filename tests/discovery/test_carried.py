"""What the belt carries meets the tail and the head pulley one after the other, forwards and in reverse."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_discovery import at_few_places, both_ways, marched

from belt_sim.discovery.closed_loop import solve_loop
from belt_sim.discovery.linear_search import ScoredLaw
from belt_sim.discovery.search_data import SearchData, campaign_places, form_inputs
from belt_sim.discovery.selection import _laws_at_other_places, choose_law
from belt_sim.discovery.words import _law_curve, formula, sentence
from belt_sim.effects.law import Form, Law, Term
from belt_sim.results.errors import Change, Errors
from studies.challenge.score import generator_place, pairs

GREASE = Form("alpha", course="belt_section", at=1.2, wide=0.1)
CARRIED = ["turn_carried", "drift_carried", "bending_carried", "torsion_carried"]
BENT = Form("none", course="belt_section", at=0.8, wide=0.1)


def law_of(data: SearchData, place: str, form: Form) -> Law:
    return Law((Term(next(p for p in data.places if p.name == place), form),))


def test_it_is_a_place_where_the_belt_goes_round_and_something_is_missing():
    bench, data = both_ways()
    assert [p.name for p in data.places if p.is_carried] == CARRIED
    assert not [p for p in data.places_to_try if p.is_carried]
    assert [p for p in replace(data, wide=True).places_to_try if p.is_carried]
    short = replace(bench.samples, travel=bench.samples.travel * 0.1)
    assert not [p for p in campaign_places(short) if p.is_carried]


def test_the_head_pulley_meets_what_the_tail_pulley_has_met_whichever_way_the_belt_goes():
    rig, states = both_ways()[0].samples.cases.rig, both_ways()[1].states
    for met in states.belt_part:
        tail, head = (np.interp(s, states.s, row) for s, row in zip((3.0, 3.0 + states.head_delay), met, strict=True))
        assert tail == pytest.approx(head)
    forward = states.belt_part[states.forward][0]
    reverse = states.belt_part[~states.forward][0]
    at_run_off = np.interp(float(rig.span_length), states.s, forward[0])  # of the head pulley at the start
    assert reverse[1, 0] == pytest.approx(at_run_off)  # which is its run-up in reverse


def test_a_course_is_felt_at_the_head_pulley_later_or_once_round():
    data = both_ways()[1]
    states, place = data.states, next(p for p in data.places if p.name == "drift_carried")
    u = np.broadcast_to(np.sin(2.0 * np.pi * states.s / states.belt_length), (len(states.tension), len(states.s)))
    tail, head = (states.channel_input(place, u, *part) for part in place.parts)
    assert np.array_equal(tail, u)
    assert np.allclose(head, np.sin(2.0 * np.pi * (states.s - states.head_delay) / states.belt_length), atol=0.01)


@pytest.mark.parametrize(
    ("name", "form", "size"),
    [
        ("drift_carried", GREASE, 0.02),
        ("torsion_carried", BENT, 0.01),
    ],
)
def test_the_file_of_such_a_law_does_in_the_march_what_the_search_says(name, form, size):
    data = both_ways()[1]
    law = law_of(data, name, form)
    whole = marched(data, law, [size])
    search = np.tensordot([size], data.columns(law), axes=1)
    assert np.linalg.norm(search - whole) < 0.05 * np.linalg.norm(whole)


def test_the_loop_has_a_stretch_however_soft():
    data, size = both_ways()[1], -0.6
    law = law_of(data, "bending_carried", BENT)
    whole = marched(data, law, [size])
    found = solve_loop(data, law, np.array([[size]]))[0][0]
    assert np.linalg.norm(found - whole) < 0.05 * np.linalg.norm(whole)
    assert np.linalg.norm(size * data.columns(law)[0] - whole) > 0.1 * np.linalg.norm(whole)  # far from linear


def test_what_the_belt_carries_is_found_and_told_from_what_either_pulley_does():
    _, data = both_ways()
    row = data.columns(law_of(data, "drift_carried", GREASE))[0]
    noise = np.random.default_rng(0).standard_normal(row.shape)
    few = at_few_places(data, "drift_carried", "turn_carried", "bending_carried", "drift_tail", "drift_head")
    hidden = replace(few, projector=replace(data.projector, residual=noise + 30.0 * row / np.linalg.norm(row)))
    (term,) = choose_law(hidden, hidden.latent_inputs[0]).best.law.terms
    assert term.family == ("drift_carried", "alpha", "linear", "belt_section")
    assert term.form.at % 1.0 == pytest.approx(GREASE.at % 1.0, abs=0.02)


def test_elsewhere_it_is_carried_past_one_pulley_and_nothing_else_is_carried():
    data = replace(both_ways()[1], wide=True)

    def moved(form: Form, name: str) -> set[str]:
        law = law_of(data, name, form)
        return {made.terms[0].place.name for made in _laws_at_other_places(data, law.terms, (0,))}

    assert moved(GREASE, "drift_carried") == {"drift_tail", "drift_head", "turn_tail", "turn_head", "turn_carried"}
    assert not {n for n in moved(Form("none"), "drift_tail") if n.endswith("carried")}


def test_a_free_course_of_what_the_belt_carries_is_kept_from_known_effects():
    _, data = both_ways()
    courses = tuple(data.latent_inputs)
    assert not [c for c in courses if c.place.is_carried]


def test_it_is_said_as_what_comes_with_the_belt():
    data = both_ways()[1]
    law = law_of(data, "drift_carried", GREASE)
    said = formula(law)
    assert said == "α once a revolution on 0.100 of the belt"
    assert ("belt_phase", "periodic") in pairs(f"(0.3 ± 0.1) × {said}")
    assert generator_place(law.terms[0].place.words) == "runup_both"


def test_its_sentence_says_where_on_the_belt_it_is():
    data = both_ways()[1]
    numbers = {"size": (0.02, 1e-3, "1"), "at": (1.2, 0.01, "1"), "wide": (0.1, 0.02, "1")}

    def least_squares_answer(law: Law) -> str:
        made = SimpleNamespace(scored=ScoredLaw(law, 0.0, 0.0), estimates=lambda: numbers, exponent=(0.0, 0.0))
        told = SimpleNamespace(parity="odd", looks_like="a stretch")
        return sentence(data, made, told, Errors(noise_floor=1e-5, fit=Change(before=2e-4, after=1e-4)))

    where = "the middle of the stretch runs up the tail pulley 0.200 ± 0.010 belt lengths after"
    assert where in least_squares_answer(law_of(data, "drift_carried", GREASE))
    assert "middle" not in least_squares_answer(law_of(data, "drift_tail", Form("alpha")))


def test_a_law_of_the_belt_alone_is_drawn_where_it_was_met():
    data = both_ways()[1]
    states, numbers = data.states, {"size": (1.0, 0.1, "")}
    for run in range(len(states.belt_part)):
        line = states.belt_length * (states.belt_part[run, 0] % 1.0)  # of the forward run's first turn
        drawn = _law_curve(BENT, numbers, states.belt_length, line, by_travel=True)
        assert np.allclose(drawn, form_inputs(states, [BENT], 0, None)[run, 0], atol=1e-6)
