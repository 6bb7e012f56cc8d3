"""How many harmonics of an edge are fitted."""

from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.forward import significant_harmonics

LENGTH, N, RUNS, HARMONICS = 12.0, 240, 4, 12
NOISE = 1.0


def told(seed, sizes, taken):
    """How many harmonics are asked for where noise is taken for ``taken`` times what it is."""
    travel = np.tile(np.linspace(0.0, 60.0, N), (RUNS, 1))
    phase = 2.0 * np.pi * travel / LENGTH
    shapes = np.stack([f(k * phase) for k in range(1, HARMONICS + 1) for f in (np.cos, np.sin)])[:, :, None]
    y = np.tensordot(sizes, shapes, axes=1) + NOISE * np.random.default_rng(seed).normal(size=(RUNS, 1, N))
    roots = np.tile(np.eye(N) / (taken * NOISE), (RUNS, 1, 1, 1))
    samples = SimpleNamespace(travel=travel, y=y, cases=SimpleNamespace(rig=SimpleNamespace(belt_length=LENGTH)))
    return significant_harmonics(samples, roots, shapes, y)


@pytest.mark.parametrize("taken", [1.0, 4.0])
def test_an_edge_that_passed_for_noise_does_not_hide_its_own_short_waves(taken):
    """Before any edge is fitted, noise may be taken for several times what it is."""
    sizes = np.zeros(2 * HARMONICS)
    sizes[:4], sizes[16:18] = 30.0, 0.4
    assert told(4, sizes, taken) == 9


@pytest.mark.parametrize("taken", [1.0, 4.0])
def test_noise_alone_calls_for_the_fewest_however_large_it_was_taken(taken):
    assert told(5, np.zeros(2 * HARMONICS), taken) == 3
