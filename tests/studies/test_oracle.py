"""The oracle of studies/oracle.py on sets whose gains are written down."""

import numpy as np
import pytest

from belt_sim.diagnosis.decision.table import EvidenceTable, Row
from studies.oracle import Bound, bound, lines


def table(gains: dict[str, float], absurd: tuple[str, ...] = ()) -> EvidenceTable:
    """gains: set (letters) -> chi2 gain over nothing, numbers costing nothing; absurd: sets that no machine has."""

    def row(ids: str, gain: float) -> Row:
        none = np.zeros(0)
        return Row(
            ids=frozenset(ids), chi2=-gain, gram=np.zeros((0, 0)), away=none, sigma=none, owner=(),
            sized=none.astype(bool), plausible=ids not in absurd, held_out={},
        )  # fmt: skip

    rows = tuple(row(ids, gain) for ids, gain in ({"": 0.0} | gains).items())
    return EvidenceTable(candidates=4, inflation=1.0, damaged=False, rows=rows)


@pytest.mark.parametrize(
    ("hidden", "gain", "said"),
    [
        ("a", {"a": 60, "b": 30}, (True, True, 1, True)),
        ("a", {"a": 60, "b": 61}, (False, True, 2, True)),
        ("a", {"a": 50, "b": 61}, (False, False, 1, True)),
        ("a", {"a": 2}, (True, True, 1, False)),  # one of four candidates is as likely by chance
        ("ab", {"a": 60, "b": 40, "ab": 100, "ac": 70}, (True, True, 1, True)),
        ("ab", {"a": 60, "b": 40, "ab": 64, "ac": 50}, (True, True, 1, False)),  # the odds of one more are not paid
        ("ab", {"c": 99, "a": 40, "b": 40, "ab": 100, "cd": 100}, (True, True, 2, False)),  # one does as much as both
    ],
)
def test_what_the_oracle_knows(hidden, gain, said):
    found = bound(table(gain), frozenset(hidden), 1, "two" if len(hidden) > 1 else "library", 6.0)
    assert (found.first, found.held, found.told, found.pays) == said


def test_a_set_that_no_machine_has_is_not_the_oracles_answer():
    gain = {"a": 40, "b": 90}
    assert not bound(table(gain), frozenset("a"), 1, "library", 6.0).first
    assert bound(table(gain, absurd=("b",)), frozenset("a"), 1, "library", 6.0).first


def test_a_row_for_every_kind_and_size():
    found = [Bound(k, "two", 6.0, k == 0, True, 3, k < 2) for k in range(4)] + [Bound(9, "library", 12.0, *[True] * 4)]
    one, two = lines(found)
    assert (one[0], two[0]) == ("one effect, d = 12", "two effects, d = 6")
    assert [cell.partition(" (")[0] for cell in two[1:]] == ["1 of 4", "4 of 4", "3.0", "2 of 4", "2 of 4"]
