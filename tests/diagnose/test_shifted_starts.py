"""Beside a wave that comes round, a delay is sought from where the wave's own numbers take its turned phase up."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.forward import Slot
from belt_sim.diagnosis.linearisation import SHIFTS, _shifts
from belt_sim.effects.sensors import SensorDelay
from belt_sim.effects.yaw import Wobble

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
