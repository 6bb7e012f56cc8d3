"""Where a search begins: from the best points of a grid, and from a delay beside a wave that comes round."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.linearisation import SHIFTS, ShapeGrid, _shifts, best_of_grid
from belt_sim.effects.base import Parameter
from belt_sim.effects.sensors import SensorDelay
from belt_sim.effects.yaw import Wobble

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


TRAVEL, SPEED, TURN = np.linspace(0.0, 40.0, 400), 0.5, 1.07
DELAY = 0.62  # [s]: more than a quarter of a turn of the pulley


def movement(delay: float) -> np.ndarray:
    """A belt that settles, under a wobble of the pulley, as sensors show it that are late."""
    s = TRAVEL - SPEED * delay
    return 5.0 * (1.0 - np.exp(-np.maximum(s, 0.0) / 3.0)) + 3.0 * np.sin(2.0 * np.pi * s / TURN)


def starts(classes, ids) -> list[float]:
    waves = np.stack([f(2.0 * np.pi * TRAVEL / TURN) for f in (np.cos, np.sin)])
    read, values = movement(DELAY), movement(0.0)
    settled = values - 3.0 * waves[1]
    values = settled + np.linalg.lstsq(waves.T, read - settled, rcond=None)[0] @ waves  # the wobble is fitted already
    residual = read - values

    def shown(points):
        of_wave = values - settled
        numbers = np.linalg.lstsq(waves.T, of_wave, rcond=None)[0]
        rows = []
        for (delay,) in 0.1 * points:
            phase = 2.0 * np.pi * (TRAVEL - SPEED * delay) / TURN
            late = movement(delay) - 3.0 * np.sin(phase)
            rows.append(late + numbers @ np.stack([np.cos(phase), np.sin(phase)]))
        return np.array(rows).reshape(-1, 1, 1, len(TRAVEL))

    forward = SimpleNamespace(
        slots=[Slot(SensorDelay, "delay")], sides=(np.zeros(1), np.full(1, np.inf)), values=shown, classes=classes
    )
    bench = SimpleNamespace(forward=forward, metric=SimpleNamespace(whiten=lambda x: x.reshape(len(x), -1)))
    fit = SimpleNamespace(
        ids=ids, columns=waves, residual=residual, chi2=float(residual @ residual), vector=np.zeros(1),
        values=values[None, None],
    )  # fmt: skip
    return [start.size for start in _shifts(bench, fit, [0])]


def test_a_delay_begins_near_its_size_beside_a_wobble():
    (size,) = starts((SensorDelay, Wobble), ("wobble",))
    assert size == min(SHIFTS, key=lambda s: abs(0.1 * s - DELAY))


@pytest.mark.parametrize("ids", [(), ("sensor_delay",)])
def test_without_what_comes_round_a_step_from_nothing_is_enough(ids):
    assert starts((SensorDelay, Wobble), ids) == []
