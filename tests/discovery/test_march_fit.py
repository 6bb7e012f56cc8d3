"""Which laws are put into the march, and which are told beside the one that wins there."""

from types import SimpleNamespace

import pytest
from small_discovery import surveyed

from belt_sim.discovery import selection
from belt_sim.discovery.linear_search import ScoredLaw, cost
from belt_sim.discovery.selection import (
    LawChoice,
    MarchTrials,
    _laws_at_other_places,
    best_in_march,
    law_places,
    laws_of_the_encoder,
)
from belt_sim.effects.law import Form, Law, Term
from belt_sim.results.errors import Change, Errors

WAVE = 5.0  # m


@pytest.fixture(scope="module")
def data():
    return surveyed("yaw_creep")


def law(data, *terms):
    at = {p.name: p for p in data.places}
    return Law(tuple(Term(at[name], form) for name, form in terms))


def scored(made, score):
    return ScoredLaw(made, score + cost(made), score)


def fitted(s, score):
    """A law as the march has it, without one."""
    made = {"scored": s, "gain": score + cost(s.law), "worth": score, "bench": None, "fit": s.law}
    return SimpleNamespace(**made, sizes_are_certain=lambda sigmas: True)


def likely(data, name):
    return next(c for c in data.latent_inputs if c.place.name == name)


def chosen(*judged):
    return LawChoice(judged[0], judged, judged[0], judged[0].gain)


def test_a_law_of_the_encoder_that_promises_half_is_tried(data):
    best = scored(law(data, ("drift_tail", Form("alpha", course="linear"))), 200.0)
    for score, count in ((150.0, 1), (50.0, 0)):
        other = scored(law(data, ("travel", Form("none", course="quadratic"))), score)
        assert len(laws_of_the_encoder(chosen(best, other), likely(data, "drift_tail"))) == count


def test_several_courses_of_the_encoder_are_tried(data):
    """Against an edge's short waves a long way is far from what the first order makes of it."""
    forms = [Form("none", course=c, at=a) for c, a in (("wave", WAVE), ("step", WAVE), ("quadratic", None))]
    choice = chosen(*(scored(law(data, ("travel", f)), 200.0 - 60.0 * k) for k, f in enumerate(forms)))
    tried = laws_of_the_encoder(choice, likely(data, "drift_tail"))
    assert [s.law.terms[0].form.course for s in tried] == ["wave", "step", "quadratic"]


def test_what_wins_in_the_march_is_told_with_the_best_of_other_places_first(data):
    kappa, y, one = (Form(v) for v in ("kappa", "y", "none"))
    best = scored(law(data, ("turn_tail", kappa)), 200.0)
    pair = scored(law(data, ("turn_tail", kappa), ("yaw_tail", y)), 199.0)
    same = scored(law(data, ("turn_tail", y)), 198.0)
    close = scored(law(data, ("yaw_tail", kappa)), 195.0)
    far = scored(law(data, ("shift_tail", kappa)), 150.0)
    first_order = scored(law(data, ("tension", one)), 100.0)
    march = MarchTrials(data, chosen(best, pair, same, close, far, first_order), 0.0)
    for s, score in ((best, 210.0), (first_order, 212.0)):
        march.tried[s.law.family, (0.0,), (0,)] = fitted(s, score)
    won = march.acceptable()[0]
    assert won.scored is first_order
    told = march.indistinguishable(won)
    assert [c.scored for c in told] == [best, close, same]
    assert [c.less for c in told] == pytest.approx([2.0, 7.0, 4.0])
    assert won.worth == 212.0


def test_terms_of_one_place_are_moved_together(data):
    wave, root = Form("none", course="wave", at=WAVE), Form("none", course="square_root")
    two = law(data, ("yaw_tail", wave), ("yaw_tail", root))
    moved = _laws_at_other_places(data, two.terms, range(2))
    assert all(len(law_places(m)) == 1 for m in moved)
    assert {"yaw_head", "drift_tail"} <= {m.terms[0].place.name for m in moved}
    assert not any(m.terms[0].place.name in ("yaw_tail", "sensor_y1") for m in moved)


def test_a_close_law_is_told_where_the_first_predicts_worse_than_none(data, monkeypatch):
    """A law at another place is tried as well, and one that predicts unseen runs worse than none is no law."""
    first, second, far = (scored(law(data, (n, Form("kappa"))), 200.0) for n in ("turn_tail", "yaw_tail", "yaw_head"))
    worth = {first.law: 200.0, second.law: 195.0, far.law: 150.0}
    monkeypatch.setattr(selection, "fit_law_in_march", lambda data, s: fitted(s, worth[s.law]))
    for falling, told in (((first, second), first), ((second, far), second), ((far,), None)):

        def errors_of(bench, fit, other, law, falling=falling):
            change = Change(before=1.0, after=0.9 if law in [s.law for s in falling] else 1.1)
            return Errors(noise_floor=0.5, held_out=change)

        monkeypatch.setattr(selection, "errors_of", errors_of)
        made, close = best_in_march(data, chosen(first, second, far), likely(data, "drift_tail"), 0.0)
        assert (made and made.scored) is told
        assert [c.scored for c in close] == ([] if told is None else [second if told is first else first])
