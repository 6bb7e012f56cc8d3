"""Dirty data: what goes wrong between the sensor and the file. All change one signal of one run in place."""

import numpy as np

_CLIP_SHARE = 0.5  # of the largest reading
_KNOCK = 0.05  # [m]
_LOST_SHARE = (0.4, 0.6)  # of the record


def unit_slip(readings: np.ndarray, signal: int, run: int) -> None:
    """Written in metres in a column of millimetres."""
    readings[signal, :, run] *= 1e-3


def clipped_sensor(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor's range ends half-way."""
    most = _CLIP_SHARE * np.abs(readings[signal, :, run]).max()
    readings[signal, :, run] = np.clip(readings[signal, :, run], -most, most)


def swapped_columns(readings: np.ndarray, signal: int, run: int) -> None:
    """Two plugs exchanged."""
    other = (signal + 1) % len(readings)
    readings[[signal, other], :, run] = readings[[other, signal], :, run]


def wrong_sign(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor looks from the other side."""
    readings[signal, :, run] *= -1


def dropout(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor shows 0 for a while."""
    count = readings.shape[1]
    readings[signal, int(_LOST_SHARE[0] * count) : int(_LOST_SHARE[1] * count), run] = 0.0


def shifted_run(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor was knocked before this run."""
    readings[signal, :, run] += _KNOCK


CORRUPTIONS = {f.__name__: f for f in (unit_slip, clipped_sensor, swapped_columns, wrong_sign, dropout, shifted_run)}
NEEDS_TWO = ("swapped_columns",)  # signals
