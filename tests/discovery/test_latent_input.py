"""What a latent input explains by chance."""

from dataclasses import replace

import numpy as np
import pytest
from small_discovery import at_few_places, surveyed

from belt_sim.discovery.responses import ResidualProjector
from belt_sim.discovery.search_data import Spectrum, _posterior

KNOTS, READINGS, DRAWS = 20, 300, 200


@pytest.mark.parametrize("height", [0.05, 0.3, 3.0])
def test_what_its_mean_explains_of_noise_is_what_is_said(height):
    rng = np.random.default_rng(1)
    rows, root = (
        rng.standard_normal((KNOTS, READINGS)),
        np.linalg.cholesky(0.9 ** np.abs(np.subtract.outer(*[range(KNOTS)] * 2))),
    )
    explained, said = [], 0.0
    for _ in range(DRAWS):
        noise = rng.standard_normal(READINGS)
        none = np.zeros((1, 1, READINGS))  # no parameter is shared
        projector = ResidualProjector(None, noise[None], none, np.eye(1), np.eye(1))
        spectrum = Spectrum(root, 1.0, *np.linalg.eigh(root.T @ (rows @ rows.T)[None] @ root))
        pull, shared = (rows @ noise)[None], np.zeros((1, KNOTS, 1))
        *_, mean, _, said = _posterior(projector, spectrum, pull, shared, np.array([height**2 / READINGS]))
        explained.append(np.sum(noise**2) - np.sum((noise - mean[0] @ rows) ** 2))
    assert np.mean(explained) == pytest.approx(said, abs=3.0 * np.std(explained) / np.sqrt(DRAWS))


def test_spectra_that_are_known_change_nothing():
    """Beside another fit, and where they are of another belt."""
    data = at_few_places(surveyed("yaw_creep"), "yaw_tail", "torsion_both", "sensor_y1")
    twice = replace(data, kept={})  # the spectra are shared, the answer is not
    other = replace(data, design=lambda name: 1.5 * data.design(name), kept={})
    alone = replace(other, spectra={})
    for known, fresh in ((twice, replace(data, spectra={}, kept={})), (other, alone)):
        assert data.latent_inputs
        for one, same in zip(known.latent_inputs, fresh.latent_inputs, strict=True):
            assert (one.place, one.pool, one.gain) == (same.place, same.pool, same.gain)
