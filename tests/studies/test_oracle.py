"""The oracle of studies/oracle.py on sets whose gains are written down."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from studies.oracle import Bound, bound, lines

THRESHOLD = 10.0


@dataclass
class Written:
    """gain: set (letters) -> chi2 gain over nothing; absurd: sets that no machine has."""

    gain: dict[str, float]
    absurd: tuple[str, ...] = ()
    names: str = "abcd"
    null = SimpleNamespace(inflation=lambda name: 1.0)

    def gains(self, sets):
        return [self.gain.get("".join(sorted(ids)), 0.0) for ids in sets]

    def threshold(self, name):
        return THRESHOLD

    def plausible(self, ids):
        return "".join(sorted(ids)) not in self.absurd

    def trials(self, ids):
        here = self.gains([ids])[0]
        sets = [(*ids, n) for n in self.names if n not in ids]
        scores = [g - here - THRESHOLD for g in self.gains(sets)]
        return [
            SimpleNamespace(id=s[-1], score=x, plausible=self.plausible(s)) for s, x in zip(sets, scores, strict=True)
        ]

    def pairs_in_place(self, name, least):
        return []

    def moved(self, ids):
        return self


@pytest.mark.parametrize(
    ("hidden", "gain", "said"),
    [
        ("a", {"a": 60, "b": 30}, (True, True, 1, True)),
        ("a", {"a": 60, "b": 61}, (False, True, 2, True)),
        ("a", {"a": 50, "b": 61}, (False, False, 1, True)),
        ("a", {"a": 9}, (True, True, 1, False)),  # chance gives as much
        ("ab", {"a": 60, "b": 40, "ab": 100, "ac": 70}, (True, True, 1, True)),
        (
            "ab",
            {"a": 60, "b": 40, "ab": 72, "ac": 60},
            (True, True, 1, False),
        ),  # the odds of one fault more are not paid
        ("ab", {"c": 99, "a": 40, "b": 40, "ab": 100, "cd": 100}, (True, True, 2, False)),  # one does as much as both
    ],
)
def test_what_the_oracle_knows(hidden, gain, said):
    found = bound(Written(gain), tuple(hidden), 1, "two" if len(hidden) > 1 else "library", 6.0)
    assert (found.first, found.held, found.told, found.pays) == said


def test_a_set_that_no_machine_has_is_not_the_oracles_answer():
    gain = {"a": 40, "b": 90}
    assert not bound(Written(gain), ("a",), 1, "library", 6.0).first
    assert bound(Written(gain, absurd=("b",)), ("a",), 1, "library", 6.0).first


def test_a_row_for_every_kind_and_size():
    found = [Bound(k, "two", 6.0, k == 0, True, 3, k < 2) for k in range(4)] + [Bound(9, "library", 12.0, *[True] * 4)]
    one, two = lines(found)
    assert (one[0], two[0]) == ("one effect, d = 12", "two effects, d = 6")
    assert [cell.partition(" (")[0] for cell in two[1:]] == ["1 of 4", "4 of 4", "3.0", "2 of 4", "2 of 4"]
