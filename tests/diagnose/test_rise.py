"""Of effects that readings do not tell apart one is named with which the held-out error does not rise."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from belt_sim.diagnosis.choice import rise
from belt_sim.diagnosis.choice.decide import Decision, compared
from belt_sim.results.found import best_explanation

BASE = "what the base model leaves"
BEHIND = {"a": 0.0, "b": 1.0, "c": 2.0, "d": 9.0}  # chi2 behind the best, beside any others
EXPLAINED, THRESHOLD = 50.0, 10.0


@dataclass
class Alike:
    """Effects that explain about the same, about any set; rising: sets with which the error rises; absurd: effects
    that no machine has so; falls: sets that do not stand about themselves.
    """

    rising: tuple[str, ...] = ()
    absurd: tuple[str, ...] = ()
    falls: tuple[str, ...] = ()
    about: tuple[str, ...] = ()
    bench: None = None

    def _gain(self, ids):
        return sum(EXPLAINED - BEHIND[i] for i in ids)

    def trials(self, ids):
        scores = {n: EXPLAINED - THRESHOLD - b for n, b in BEHIND.items() if n not in ids}
        return [SimpleNamespace(id=n, score=s, passes=n not in self.absurd) for n, s in scores.items()]

    def gains(self, sets):
        return [0.0 if "".join(ids) in self.falls else self._gain(ids) for ids in sets]

    def threshold(self, name):
        return THRESHOLD

    def plausible(self, ids):
        return True

    def worse(self, larger, smaller):
        return ()

    def held_out(self, ids):
        return "more" if "".join(ids) in self.rising else "less"

    def moved(self, ids):
        return Alike(self.rising, self.absurd, self.falls, ids)


@pytest.fixture(autouse=True)
def as_written(monkeypatch):
    monkeypatch.setattr(rise, "rises", lambda bench, base, bare, held: ("it rises",) if held == "more" else ())


def taken(evidence, ids):
    """The evidence and the set that is taken, of a decision for ``ids``."""
    about, table = rise.without_a_rise(Decision(ids, evidence, (), compared(evidence, [ids])), BASE)
    return about, best_explanation(table).effects


@pytest.mark.parametrize(
    ("evidence", "kept"),
    [
        (Alike(), ("a",)),
        (Alike(rising=("a",)), ("b",)),
        (Alike(rising=("a", "b")), ("c",)),
        (Alike(rising=("a",), absurd=("b",)), ("c",)),
        (Alike(rising=("a",), falls=("b",)), ("c",)),  # about itself it is not needed
        (Alike(rising=("a", "b", "c")), ("a",)),  # d is no look-alike: the rise is told of the set that was chosen
    ],
)
def test_the_likeliest_look_alike_without_a_rise_is_taken(evidence, kept):
    about, ids = taken(evidence, ("a",))
    assert ids == kept
    assert about.about == (kept if kept != ("a",) else ())


def test_one_of_two_effects_is_exchanged_at_a_time():
    _, ids = taken(Alike(rising=("ad",)), ("a", "d"))
    assert set(ids) == {"a", "b"}  # it explains more than d, which the search had not seen about this set
    assert taken(Alike(rising=("",)), ())[1] == ()
