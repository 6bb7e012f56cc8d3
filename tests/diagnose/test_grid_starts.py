"""From which points of a grid a search begins."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.linearisation import ShapeGrid, best_of_grid
from belt_sim.effects.base import Parameter

N = 60
ONE, OTHER = np.eye(N)[:2]
EFFECT = SimpleNamespace(
    id="push",
    parameters={
        "force": Parameter(unit="N", meaning="a force", plausible=(-20.0, 20.0), scale=1.0),
        "place": Parameter(unit="1", meaning="its place", plausible=(0.0, 1.0), scale=1.0, modifier=True),
    },
)


def best(columns, residual, sides=(-np.inf, np.inf), most=2):
    """The best of points with a column (N,) each."""
    points = [((1, float(k)),) for k in range(len(columns))]
    forward = SimpleNamespace(
        slots=[Slot(EFFECT, "force"), Slot(EFFECT, "place")],
        sides=tuple(np.array([side, side]) for side in sides),
    )
    bench = SimpleNamespace(forward=forward, metric=SimpleNamespace(whiten=lambda rows: rows))
    fit = SimpleNamespace(columns=np.zeros((0, N)), free=[], residual=residual, vector=np.zeros(2))
    grid = ShapeGrid(points, [0], np.array(columns), np.arange(len(columns))[:, None])
    return best_of_grid(bench, fit, grid, most)


def test_points_that_do_the_same_are_one_start():
    """Beyond the end of a short span all places are its end: what stands elsewhere has its turn."""
    assert best([ONE, ONE, 0.5 * ONE, OTHER], 10.0 * ONE + 5.0 * OTHER) == [0, 3]


def test_of_points_that_do_the_same_one_is_taken_by_which_a_machine_could_have_it():
    """A force near a pulley has to be large to do what a small one does in the middle."""
    assert best([0.1 * ONE, ONE], 10.0 * ONE) == [1]
    assert best([ONE, 0.1 * ONE], 10.0 * ONE) == [0]


@pytest.mark.parametrize(("sides", "first"), [((-np.inf, np.inf), 0), ((0.0, np.inf), 1)])
def test_a_number_of_one_sign_promises_nothing_with_the_other(sides, first):
    assert best([ONE, OTHER], -10.0 * ONE + 5.0 * OTHER, sides)[0] == first
