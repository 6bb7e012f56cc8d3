"""Laws that the search has to think of, in readings that were made with them."""

from dataclasses import replace

import numpy as np
import pytest
from small_discovery import surveyed

from belt_sim.discovery.choose import choose
from belt_sim.discovery.forms import Form
from belt_sim.discovery.survey import Law, Survey, Term


def made_with(*terms: tuple[str, Form, float]) -> Survey:
    """A survey whose readings are noise and terms of so many sigma."""
    survey = surveyed("yaw_creep")
    rows = [survey.columns(Law((term(survey, name, form),)))[0] for name, form, _ in terms]
    noise = np.random.default_rng(0).standard_normal(rows[0].shape)
    whole = sum(d * row / np.linalg.norm(row) for row, (_, _, d) in zip(rows, terms, strict=True))
    return replace(survey, ground=replace(survey.ground, residual=noise + whole), kept={})


def term(survey: Survey, name: str, form: Form) -> Term:
    return Term(next(p for p in survey.places if p.name == name), form)


def test_what_dies_away_after_a_step_without_a_swing_is_one_law():
    survey = made_with(("turn_tail", Form("beta", course="fade", at=9.0), 60.0))
    (best,) = choose(survey, survey.courses()[0]).best.law.terms
    assert best.says == ("turn_tail", "beta", "x", "fade")
    assert best.form.at == pytest.approx(9.0, rel=0.1)


def test_the_simple_law_is_tried_elsewhere_too_where_one_of_two_terms_is_ahead():
    survey = made_with(
        ("turn_tail", Form("beta", course="fade", at=9.0), 60.0),
        ("turn_tail", Form("one", course="wave", at=5.0), 20.0),
    )
    choice = choose(survey, survey.courses()[0])
    assert len(choice.best.law.terms) == 2
    laws = [s.law.terms[0] for s in choice.judged if len(s.law.terms) == 1]
    assert len({t.place.name for t in laws if t.says[1:] == ("beta", "x", "fade")}) > 4
