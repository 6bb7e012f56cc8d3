"""The decision by itself, on evidence that is written down: sets, their gains, and what they predict."""

from dataclasses import dataclass, field
from itertools import combinations

import pytest

from belt_sim.diagnosis.choice.decide import ODDS, TOO_LATE, compared, completed, decide, explanation, swapped
from belt_sim.results.found import Explanation, best_explanation

THRESHOLD = 10.0


@dataclass
class One:
    """A candidate beside a set."""

    id: str
    gain: float
    plausible: bool = True

    @property
    def score(self):
        return self.gain - THRESHOLD

    @property
    def passes(self):
        return self.score > 0.0 and self.plausible


@dataclass
class Written:
    """gain: set (letters) -> chi2 gain over nothing; worsens: sets that predict worse than some subset."""

    gain: dict[str, float]
    worsens: tuple[str, ...] = ()
    absurd: tuple[str, ...] = ()
    names: str = "abc"
    asked: list = field(default_factory=list)

    def _of(self, ids):
        return self.gain.get("".join(sorted(ids)), 0.0)

    def trials(self, ids):
        self.asked.append("".join(ids))
        others = [n for n in self.names if n not in ids]
        return [One(n, self._of((*ids, n)) - self._of(ids), self.plausible((*ids, n))) for n in others]

    def gains(self, sets):
        return [self._of(ids) for ids in sets]

    def threshold(self, name):
        return THRESHOLD

    def plausible(self, ids):
        return "".join(sorted(ids)) not in self.absurd

    def worse(self, larger, smaller):
        return ("density",) if "".join(sorted(larger)) in self.worsens and len(smaller) < len(larger) else ()

    def pair(self, seen):
        known = {frozenset(part) for ids in seen for k in (1, 2) for part in combinations(ids, k)}
        sets = [s for k in (1, 2) for s in combinations(self.names, k)]
        score = {s: self._of(s) - THRESHOLD * len(s) for s in sets}
        best = max((s for s in sets if len(s) == 2), key=lambda s: score[s])
        others = [v for s, v in score.items() if len(s) == 1 or frozenset(s) in known]
        return best if score[best] > max(others) else None

    def moved(self, ids):
        return self


def best_of_all(evidence, seen):
    """The effects that a comparison chooses."""
    return best_explanation(compared(evidence, seen)).effects


@pytest.mark.parametrize(
    ("evidence", "chosen"),
    [
        (Written({"a": 5, "b": 5, "c": 5}), ""),  # chance gives as much
        (Written({"a": 50, "b": 20}), "a"),
        (Written({"a": 50, "b": 20, "ab": 55}), "a"),  # b adds less than chance
        (Written({"a": 50, "b": 20, "ab": 63}), "a"),  # more than chance, but one fault more is ten times less likely
        (Written({"a": 50, "b": 20, "ab": 90}), "ab"),
        (Written({"a": 50, "b": 20, "ab": 63}, absurd=("a",)), "ab"),  # and a by itself is what no machine has
        (Written({"a": 50, "b": 45, "ab": 90}, worsens=("ab",)), "a"),  # the larger set predicts worse
        (Written({"a": 50, "b": 45}, worsens=("a",)), "b"),  # the first does, the second does not
        (Written({"a": 50}, worsens=("a",)), ""),
        (Written({"a": 50, "b": 45, "ab": 150}, worsens=("a", "b")), "ab"),  # each alone predicts worse, both do not
        (Written({"a": 50, "b": 45, "ab": 150}, worsens=("a", "b", "ab")), ""),
        (Written({"a": 8, "b": 8, "ab": 150}), ""),  # nothing stands out by itself
        (Written({"a": 50, "b": 48, "c": 47, "bc": 200, "ab": 70, "ac": 60, "abc": 201}), "bc"),  # a was in the way
        (Written({"a": 95, "b": 60, "c": 60, "bc": 118, "ab": 96, "ac": 96}), "bc"),  # a is their sum, nearly
        (Written({"a": 95, "b": 60, "c": 60, "bc": 104, "ab": 96, "ac": 96}), "a"),  # two explain no more than chance
    ],
)
def test_the_set_that_is_chosen(evidence, chosen):
    assert "".join(sorted(decide(evidence).ids)) == chosen


@dataclass
class Bent(Written):
    """Columns say little of what an effect does: the best pair, as they have it, is another."""

    def pair(self, seen):
        return ("a", "c") if len(seen) == 1 else None


def test_of_two_that_each_mislead_the_second_is_sought_beside_the_one_that_stands_out_most():
    gain = {"a": 50, "b": 5, "c": 45, "ab": 150, "ac": 60, "bc": 50, "abc": 151}
    assert set(decide(Bent(gain, worsens=("a", "c"))).ids) == {"a", "b"}
    assert decide(Bent(gain, worsens=("a", "c", "ab"))).ids == ()
    assert decide(Bent(gain, worsens=("a", "c"), absurd=("ab",))).ids == ()


def test_the_best_set_of_an_earlier_round_is_not_lost():
    """Two effects fit a little better than the one they pushed out, but not by what two cost."""
    gain = {"a": 60, "b": 5, "c": 5, "ab": 62, "ac": 62, "bc": 65, "abc": 66}
    assert best_of_all(Written(gain), [("a",), ("b", "c")]) == ("a",)
    assert best_of_all(Written(gain | {"bc": 95}), [("a",), ("b", "c")]) == ("b", "c")


def test_the_table_says_what_speaks_against_what_explains_more():
    gain = {"a": 60.0, "b": 40.0, "c": 12.0, "ab": 120.0, "ac": 62.0, "bc": 50.0, "abc": 160.0}
    table = compared(Written(gain, absurd=("abc",), worsens=("ab",)), [("a", "b", "c")])
    told = {"".join(e.effects): (e.worth, e.refused) for e in table}
    assert list(told)[:3] == ["abc", "ab", "a"]
    assert told["abc"] == (160.0 - 3 * THRESHOLD - 2 * ODDS, "no machine has such numbers")
    assert told["ab"][1] == "predicts what is held out worse than the base model does"
    assert told["a"] == (60.0 - THRESHOLD, "")
    assert told[""] == (0.0, "")
    needless = compared(Written(gain | {"a": 119.0, "ab": 150.0}, absurd=("a",)), [("a", "b")])
    assert [e.refused for e in needless if e.effects == ("a",)] == [""]  # below what is chosen nobody asks
    assert best_explanation(needless).effects == ("a", "b")


def test_what_is_seen_after_the_decision_stands_in_the_table_and_does_not_change_it():
    gain = {"a": 60.0, "b": 62.0, "c": 64.0, "ab": 63.0, "ac": 99.0}
    evidence = Written(gain, worsens=("b",))
    late = [explanation(evidence, tuple(s), gain[s]) for s in ("a", "b", "c", "ab")]
    table = completed(compared(evidence, [("a",)]), evidence, late)
    assert ["".join(e.effects) for e in table] == ["c", "b", "a", "ab", ""]
    assert [e.refused for e in table] == [
        TOO_LATE,
        "predicts what is held out worse than the base model does",
        "",
        "",
        "",
    ]
    assert best_explanation(table).effects == ("a",)


def test_the_answer_follows_from_a_table_by_arithmetic():
    def row(effects, gain, refused=""):
        return Explanation(effects=effects, gain=gain, by_chance=10.0 * len(effects), rarity=0.0, refused=refused)

    table = [row((), 0.0), row(("a",), 12.0), row(("a", "b"), 22.0), row(("b",), 50.0, "predicts worse")]
    assert best_explanation(table).effects == ("a",)  # of two worth the same the one of fewer effects
    assert best_explanation([row((), 0.0), row(("a",), 9.0)]).effects == ()


def test_a_set_with_an_absurd_number_is_never_the_answer():
    gain = {"a": 60, "b": 40, "ab": 120}
    assert best_of_all(Written(gain, absurd=("ab",)), [("a", "b")]) == ("a",)
    assert best_of_all(Written(gain, absurd=("a", "b", "ab")), [("a", "b")]) == ()


def test_an_effect_with_an_absurd_number_gives_way_to_its_look_alike():
    """Its number ran away when all was refitted: without the look-alike, which fits as well, a would stand alone."""
    gain = {"a": 60, "b": 5, "c": 5, "ab": 100.0, "ac": 99.8}
    assert swapped(Written(gain), ("a", "b")) == ("a", "b")
    assert swapped(Written(gain, absurd=("ab",)), ("a", "b")) == ("a", "c")


def test_no_more_effects_than_allowed():
    gain = {"a": 100, "b": 90, "c": 80, "ab": 200, "ac": 190, "bc": 180, "abc": 300}
    assert len(decide(Written(gain), limit=2).ids) == 2
    assert decide(Written(gain), limit=0).ids == ()


@dataclass
class Apart(Written):
    """Gains about a set may be others than about what was chosen on the way; about: set -> gains there."""

    about: dict[str, dict[str, float]] = field(default_factory=dict)

    def moved(self, ids):
        return Apart(self.about.get("".join(sorted(ids)), self.gain), about=self.about)


def test_what_a_set_does_not_need_about_itself_is_not_named():
    """Beside a and c settings are taken to have been others, for which b makes up once it has taken the place of c."""
    gain = {"a": 50, "b": 4, "c": 5, "ab": 55, "ac": 75, "bc": 9, "abc": 76}
    about = {"ac": gain | {"ab": 80, "ac": 76, "abc": 82}, "ab": gain}
    assert decide(Apart(gain, about={"ac": about["ac"]} | {"ab": about["ac"]})).ids == ("a", "b")
    found = decide(Apart(gain, about=about | {"a": gain}))
    assert found.ids == ("a",)
    assert found.evidence.gain == gain
