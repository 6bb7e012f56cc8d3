"""Random errors of a campaign: settings, machine data, and what the sensors add."""

import math

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.virtual_rig.observe import Errors, stated_data
from belt_sim.virtual_rig.plan import Noise, Plan

_TAIL_FREEDOM = 3  # degrees of freedom of the heavy-tailed noise; its variance is nu/(nu - 2)


def draw_errors(plan: Plan, noise: Noise, rng: np.random.Generator) -> Errors:
    """One machine, and one setting of each run, drawn from their stated uncertainties."""
    machine = {name: float(q.u * rng.standard_normal()) for name, q in stated_data(plan).items()}
    runs = len(plan.runs)
    return Errors(
        machine=machine,
        tension_rel=noise.tension_rel * rng.standard_normal(runs),
        yaw=noise.yaw_u * rng.standard_normal(runs),
    )


def add_noise(values: np.ndarray, travel: np.ndarray, sheet: SignalSheet, noise: Noise, rng) -> np.ndarray:
    """Readings of one signal with gain, zero, wander and white noise; values shape (n, runs), travel (n,)."""
    runs = values.shape[1]
    gain = 1 + sheet.gain * rng.standard_normal(runs)
    zero = sheet.zero * rng.standard_normal(runs)
    length = sheet.wander_length if noise.true_length is None else noise.true_length
    course = smooth_wander if noise.smooth else wander
    drift = noise.scale * sheet.wander_sd * course(travel, length, runs, rng)
    return values * gain + zero + drift + noise.scale * sheet.white * _white(values.shape, noise, rng)


def wander(travel: np.ndarray, length: float, runs: int, rng) -> np.ndarray:
    """Ornstein-Uhlenbeck process of unit variance, correlation exp(-distance/length), shape (n, runs)."""
    draws = rng.standard_normal((len(travel), runs))
    path = np.empty_like(draws)
    path[0] = draws[0]
    for k in range(1, len(travel)):
        keep = math.exp(-(travel[k] - travel[k - 1]) / length)
        path[k] = keep * path[k - 1] + math.sqrt(1 - keep**2) * draws[k]
    return path


def smooth_wander(travel: np.ndarray, length: float, runs: int, rng) -> np.ndarray:
    """A process of unit variance with a slope: correlation (1 + r) exp(-r), r = sqrt(3) distance/length."""
    apart = math.sqrt(3) * np.abs(travel[:, None] - travel) / length
    root = np.linalg.cholesky((1 + apart) * np.exp(-apart) + 1e-9 * np.eye(len(travel)))
    return root @ rng.standard_normal((len(travel), runs))


def _white(shape, noise: Noise, rng) -> np.ndarray:
    if noise.heavy_tails:
        return rng.standard_t(_TAIL_FREEDOM, shape) / math.sqrt(_TAIL_FREEDOM / (_TAIL_FREEDOM - 2))
    return rng.standard_normal(shape)
