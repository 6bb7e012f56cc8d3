"""Beside an unknown law only those effects keep their names without which no law does as well."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.answer import verdict as deciding
from belt_sim.diagnosis.choice.beside_a_law import needed_beside_laws
from belt_sim.diagnosis.left_over.unknown import InTheMarch

COUNT, THRESHOLD = 40, 10.0
ONES = np.ones((len(SPREAD), 1, 1))
ALONG = np.linspace(0.0, 1.0, COUNT) * ONES
SHAPES = {
    "edge": WHITE.white * (np.arange(COUNT) % 7 == 0) * ONES,
    "like": WHITE.white * (ALONG**2 + 0.3 * np.cos(40.0 * ALONG)),
    "law": WHITE.white * ALONG**2,
}


def seen(bench, ids, name, terms=1):
    """What a search has found: a law of a name beside effects; None of no name."""
    fit = bench.fit([bench.start((*ids, name), np.zeros(len(SHAPES)))])[0] if name else None
    return SimpleNamespace(law=lambda: None if fit is None else InTheMarch(bench, fit, name, terms))


def asked(sizes, ids, beside="law", without="law", terms=1):
    """What is needed of effects where the readings hold so much of everything, and these laws are found."""
    noise = WHITE.white * np.random.default_rng(1).normal(size=(len(SPREAD), 1, COUNT))
    bench = linear_bench(SPREAD, y=noise + sum(size * SHAPES[n] for n, size in sizes.items()), shapes=SHAPES)
    found = SimpleNamespace(bench=bench, threshold=lambda name: THRESHOLD)
    fit = bench.fit([bench.start(ids, np.zeros(len(SHAPES)))])[0]
    looked = []

    def look(bench, fit, failed, known):
        looked.append(fit.ids)
        return seen(bench, fit.ids, without, terms)

    return needed_beside_laws(found, fit, seen(bench, ids, beside), seen(bench, (), without, terms), look), looked


def test_an_effect_stays_that_no_law_replaces_and_one_goes_that_the_same_law_does_without():
    needed, looked = asked({"edge": 20.0, "law": 20.0}, ("edge", "like"))
    assert needed == ("edge",)
    assert not looked  # the law that is known says it by itself
    assert asked({"edge": 20.0, "law": 20.0, "like": 20.0}, ("edge", "like"))[0] == ("edge", "like")


@pytest.mark.parametrize(("terms", "needed"), [(1, ()), (2, ("like",))])
def test_another_law_of_no_more_terms_takes_an_effect_s_place(terms, needed):
    """Beside the effect another law was found than without it."""
    assert asked({"law": 20.0}, ("like",), beside="edge", terms=terms)[0] == needed


def test_a_law_that_is_nearly_right_leaves_as_much_as_forms_do():
    """What an effect takes of a hundredth of what a law explains is no sign of it."""
    assert asked({"law": 2.0, "like": 8.0}, ("like",))[0] == ("like",)
    assert asked({"law": 200.0, "like": 8.0}, ("like",))[0] == ()


def test_where_no_law_describes_what_is_left_names_stay_as_they_are():
    assert asked({"edge": 20.0, "law": 20.0}, ("edge", "like"), beside="")[0] == ("edge", "like")


@pytest.mark.parametrize(("again", "named"), [(True, ("edge",)), (False, None)])
def test_what_stays_is_looked_at_again_without_what_went(monkeypatch, again, named):
    """The law found beside more is tried beside less; what then misleads is not named."""
    bench = linear_bench(SPREAD, y=5.0 * SHAPES["edge"], shapes=SHAPES)
    stays = bench.fit([bench.start(("edge", "like"), np.zeros(len(SHAPES)))])[0]
    found = SimpleNamespace(bench=bench, chosen=stays)
    looked = []

    def look(bench, fit, failed, known):
        looked.append((fit.ids, known))
        return "second"

    monkeypatch.setattr(deciding, "needed_beside_laws", lambda found, fit, *seen: ("edge",))
    monkeypatch.setattr(deciding, "_misleads", lambda found, held: not again)
    fit, unknown = deciding._beside_laws(found, stays, "first", "bare", look)
    assert (fit and fit.ids) == named
    assert fit is None or fit.vector[1] == 0.0  # what went does nothing any more
    assert looked == ([(("edge",), "first")] if again else [])
    assert unknown == ("second" if again else "bare")
