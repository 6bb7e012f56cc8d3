"""A span that is loaded is bent where it runs up: on one pulley forwards, on the other in reverse."""

from dataclasses import replace

import numpy as np
from small_discovery import at_few_places, both_ways, marched, surveyed

from belt_sim.discovery.closed_loop import solve_loop
from belt_sim.discovery.search_data import SearchData
from belt_sim.discovery.selection import choose_law
from belt_sim.effects.law import Form, Law, Term

WAVE = Form("none", course="wave", at=3.0)
SIZES = [2e-6, 1e-6]


def law_of(data: SearchData, place: str) -> Law:
    return Law((Term(next(p for p in data.places if p.name == place), WAVE),))


def made_by(data: SearchData, law: Law) -> np.ndarray:
    """Whitened readings (R, m) of a law, at first order."""
    return np.tensordot(SIZES, data.columns(law), axes=1)


def test_spans_are_places_where_the_belt_has_travelled_both_ways():
    assert not [p for p in surveyed("yaw_creep").places if p.kind == "span"]
    assert [p.where for p in both_ways()[1].places if p.kind == "span"] == ["upper", "lower"]


def test_a_span_is_bent_on_the_pulley_that_it_runs_up():
    _, data = both_ways()
    forward = np.array([r.direction > 0 for r in data.bench.samples.runs])
    upper, lower, tail, head = (
        made_by(data, law_of(data, p)) for p in ("span_upper", "span_lower", "turn_tail", "turn_head")
    )
    assert np.array_equal(upper, np.where(forward[:, None], tail, head))
    assert np.array_equal(lower, np.where(forward[:, None], head, tail))


def test_the_file_of_a_law_of_a_span_does_in_the_march_what_the_search_says():
    _, data = both_ways()
    law = law_of(data, "span_lower")
    whole, search = marched(data, law, SIZES), made_by(data, law)
    assert np.linalg.norm(search - whole) < 0.05 * np.linalg.norm(whole)


def test_the_slack_side_of_a_driven_belt_goes_with_its_direction():
    """The span that runs up the tail pulley: the upper one forwards, the lower one in reverse."""
    _, data = both_ways()
    forward = data.states.forward

    def pulled(place: str) -> np.ndarray:
        law = Law((Term(next(p for p in data.places if p.name == place), Form("none")),))
        return solve_loop(data, law, np.array([[-0.3]]))[0][0]

    tail, upper, lower = (pulled(f"pull_{where}") for where in ("tail", "upper", "lower"))
    assert np.allclose(tail, np.where(forward[:, None], upper, lower), atol=1e-4 * np.abs(tail).max())
    assert not [p for p in surveyed("yaw_creep").places if p.name == "pull_tail"]
    noise = np.random.default_rng(0).standard_normal(tail.shape)
    residual = noise + 30.0 * tail / np.linalg.norm(tail)
    few = at_few_places(data, "pull_tail", "pull_upper", "pull_lower", "bending_both", "tension", "turn_tail")
    hidden = replace(few, projector=replace(data.projector, residual=residual))
    found = choose_law(hidden, hidden.latent_inputs[0], pairs=False).best  # the row is not of its size any more
    assert [term.place.name for term in found.law.terms] == ["pull_tail"]


def test_a_load_on_a_span_is_told_from_what_a_pulley_does():
    _, data = both_ways()
    row = made_by(data, law_of(data, "span_lower"))
    noise = np.random.default_rng(0).standard_normal(row.shape)
    few = at_few_places(data, "span_lower", "span_upper", "turn_tail", "turn_head", "yaw_head")
    hidden = replace(few, projector=replace(data.projector, residual=noise + 30.0 * row / np.linalg.norm(row)))
    (term,) = choose_law(hidden, hidden.latent_inputs[0]).best.law.terms
    assert term.family == ("span_lower", "none", "linear", "wave")
