"""Laws that the search has to think of, in readings that were made with them."""

from dataclasses import replace

import numpy as np
import pytest
from small_discovery import at_few_places, surveyed

from belt_sim.discovery.closed_loop import fit_closed_loop
from belt_sim.discovery.search_data import SearchData
from belt_sim.discovery.selection import choose_law, two_slope_laws
from belt_sim.effects.law import Form, Law, Term


def made_with(*terms: tuple[str, Form, float]) -> SearchData:
    """A survey whose readings are noise and terms of so many sigma."""
    data = surveyed("yaw_creep")
    rows = [data.columns(Law((term(data, name, form),)))[0] for name, form, _ in terms]
    noise = np.random.default_rng(0).standard_normal(rows[0].shape)
    whole = sum(d * row / np.linalg.norm(row) for row, (_, _, d) in zip(rows, terms, strict=True))
    return replace(data, projector=replace(data.projector, residual=noise + whole), kept={})


def term(data: SearchData, name: str, form: Form) -> Term:
    return Term(next(p for p in data.places if p.name == name), form)


def test_what_dies_away_after_a_step_without_a_swing_is_one_law():
    whole = made_with(("turn_tail", Form("beta", course="decay", at=9.0), 60.0))
    data = at_few_places(whole, "turn_tail", "turn_both", "yaw_tail", "drift_tail")
    (best,) = choose_law(data, data.latent_inputs[0]).best.law.terms
    assert best.family == ("turn_tail", "beta", "linear", "decay")
    assert best.form.at == pytest.approx(9.0, rel=0.1)


@pytest.mark.long
def test_the_simple_law_is_tried_elsewhere_too_where_one_of_two_terms_is_ahead():
    data = made_with(
        ("turn_tail", Form("beta", course="decay", at=9.0), 60.0),
        ("turn_tail", Form("none", course="wave", at=5.0), 20.0),
    )
    choice = choose_law(data, data.latent_inputs[0])
    assert len(choice.best.law.terms) == 2
    laws = [s.law.terms[0] for s in choice.judged if len(s.law.terms) == 1]
    assert len({t.place.name for t in laws if t.family[1:] == ("beta", "linear", "decay")}) > 4


def test_a_law_that_bends_is_sought_with_a_slope_on_either_side():
    """Neither of its terms by itself says much of it: they nearly cancel, and each is a poor start for the other."""
    data = surveyed("yaw_creep")
    knee = 0.2 * float(np.abs(data.states.alpha).max())
    straight, flat = Form("alpha"), Form("alpha", shape="saturation", knee=knee)
    terms = [term(data, "drift_tail", form) for form in (straight, flat)]
    made = fit_closed_loop(data, Law(tuple(terms)), [0.5, -1.2], steps=0)
    hidden = replace(data, projector=replace(data.projector, residual=made.readings), kept={})
    one = fit_closed_loop(hidden, Law((term(data, "drift_tail", replace(flat, shape="dead_zone")),)), [0.3])
    (found,) = two_slope_laws(hidden, [one])
    assert [t.form.shape for t in found.law.terms] == ["linear", "saturation"]
    assert found.gain > one.gain + 10.0
    assert found.sizes == pytest.approx([0.5, -1.2], rel=0.1)
    assert two_slope_laws(hidden, [fit_closed_loop(hidden, Law((terms[0],)), [0.3])]) == []
