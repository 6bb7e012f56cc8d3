"""What a latent input explains by chance."""

from dataclasses import replace

import numpy as np
import pytest
from small_discovery import at_few_places, surveyed

from belt_sim.discovery.responses import CHOSEN, ResidualProjector, posterior_modes
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
        projector = ResidualProjector(None, noise[None], none, np.ones(1))
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


def test_precision_is_never_below_that_of_the_prior():
    """Guard: where effects are sums of what an input does, rounding left -1e-7 of it, and 10,000 of evidence."""
    prior = np.array([1.0, 1e-8, 1e-8])
    rounded = np.diag(prior) + np.array([[1.0, 0.0, 0.0], [0.0, -1.2e-7, 3e-9], [0.0, 3e-9, 1e-12]])
    values, modes = posterior_modes(rounded, prior)
    assert values.min() == 1.0
    assert np.linalg.eigvalsh((modes / values) @ modes.T) == pytest.approx([0.5, 1e8, 1e8], rel=0.2)


def test_rounding_is_no_evidence_beside_effects_that_an_input_imitates():
    """Of readings changed by 1e-9, beside effects that are nearly sums of each other."""
    data = at_few_places(surveyed("yaw_creep"), "yaw_tail")
    place = next(p for p in data.places if p.name == "yaw_tail")
    rng, old = np.random.default_rng(1), data.projector
    columns = data.columns_at("yaw_tail", np.cumsum(rng.standard_normal((3, 1, len(data.states.s))), axis=2))
    made = (columns[:1] + 1e-3 * columns).astype(float)
    made /= np.sqrt(np.sum(made**2, axis=(1, 2), keepdims=True))
    found = list[list[float]]()
    for seed in range(4):
        residual = old.residual * (1.0 + 1e-9 * np.random.default_rng(seed).standard_normal(old.residual.shape))
        shared, prior = np.concatenate([old.shared, made]), np.concatenate([old.prior, np.full(3, CHOSEN)])
        beside = replace(data, projector=replace(old, residual=residual, shared=shared, prior=prior), kept={})
        found.append([c.gain for c in beside.latent_inputs_at(place)])
        assert max(found[-1]) < 0.5 * beside.projector.chi2()
        assert found[-1] == pytest.approx(found[0], rel=1e-6)
