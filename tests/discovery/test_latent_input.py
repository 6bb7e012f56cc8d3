"""What a latent input explains by chance."""

import numpy as np
import pytest

from belt_sim.discovery.responses import ResidualProjector
from belt_sim.discovery.search_data import _posterior

KNOTS, READINGS, DRAWS = 20, 300, 400


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
        projector = ResidualProjector(None, noise[None], none, np.eye(1))
        information, pull = (rows @ rows.T)[None], (rows @ noise)[None]
        *_, mean, _, said = _posterior(
            projector, root, information, pull, np.zeros((1, KNOTS, 1)), np.array([height**2 / READINGS])
        )
        explained.append(np.sum(noise**2) - np.sum((noise - mean[0] @ rows) ** 2))
    assert np.mean(explained) == pytest.approx(said, abs=3.0 * np.std(explained) / np.sqrt(DRAWS))
