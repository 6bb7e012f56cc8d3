"""Where something is missing: the marginal likelihood of a smooth unknown input at each place.

u is a Gaussian process in travel (Matern 3/2), pooled over the runs of a tension and odd or even in yaw, or free run by
run; its length and height are those of greatest evidence. Whitened columns make the evidence comparable.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.campaign import Run
from belt_sim.discovery.design import DesignMatrices, ResidualProjector
from belt_sim.effects.law import Place

KNOTS = 65
LENGTHS = {0.04: 1, 0.12: 1, 0.4: 2, 1.2: 4}  # of the record; each wants every so manieth knot
HEIGHTS = np.logspace(-1.0, 7.0, 17)  # of a^2 times the mean information of a knot


@dataclass(frozen=True)
class Basis:
    """A place's inputs on KNOTS knots, run by run: information (R, K, K), pull (R, K), shared (R, K, c)."""

    knots: np.ndarray
    information: np.ndarray
    pull: np.ndarray
    shared: np.ndarray

    def with_fewer_knots(self, apart: int) -> "Basis":
        """The same on every so manieth knot, which straight lines join."""
        if apart == 1:
            return self
        count = (len(self.knots) - 1) // apart + 1
        hats = np.maximum(0.0, 1.0 - np.abs(np.arange(count)[:, None] - np.arange(len(self.knots)) / apart))
        return Basis(self.knots[::apart], hats @ self.information @ hats.T, self.pull @ hats.T, hats @ self.shared)


@dataclass(frozen=True)
class LatentInput:
    """A place, how runs are pooled, its log evidence, and the posterior of u.

    gain: log evidence over that of no unknown; by_chance: chi2 that its mean explains of noise alone; weights (G, R):
    how much of each group's u a run feels; mean (G, K) and sd (G, K) of u at the knots (K,); length [m] and height of
    the prior.
    """

    place: Place
    pool: str
    gain: float
    length: float
    height: float
    knots: np.ndarray
    weights: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    by_chance: float

    def inputs(self, grid: np.ndarray) -> np.ndarray:
        """Posterior mean of u in every run on a grid, (R, J)."""
        on = np.stack([np.interp(grid, self.knots, row) for row in self.mean])
        return self.weights.T @ on


def basis_at(
    projector: ResidualProjector, design: DesignMatrices, place: Place, channel_input: Callable[..., np.ndarray]
) -> Basis:
    """Information of the readings on an input at a place; channel_input: ``States.channel_input``."""
    grid = design.grid
    knots = np.linspace(grid[0], grid[-1], KNOTS)
    hats = np.maximum(0.0, 1.0 - np.abs(grid[None] - knots[:, None]) / (knots[1] - knots[0]))
    plain = np.repeat(hats[:, None], len(projector.residual), axis=1)
    inputs = [channel_input(place, plain, *part) for part in place.parts]
    rows = design.place_columns(place, inputs).swapaxes(0, 1).astype(float)
    information = rows @ rows.swapaxes(1, 2)
    pull = np.einsum("rkm,rm->rk", rows, projector.residual)
    shared = rows @ projector.shared.swapaxes(0, 1).swapaxes(1, 2)
    return Basis(knots, information, pull, shared)


def pooling_weights(runs: Sequence[Run]) -> dict[str, np.ndarray]:
    """How runs may share an input: name -> weights (G, R).

    Odd ones go with the commanded yaw over the largest: the tail pulley's, or the head's if only that was turned.
    """
    keys = [(r.tension, r.direction) for r in runs]
    groups = np.array([[k == key for k in keys] for key in sorted(set(keys))], dtype=float)
    yaw = np.array([r.yaw for r in runs])
    yaw = yaw if np.any(yaw) else np.array([r.yaw_head for r in runs])
    pools = {
        "odd": groups * (yaw / max(float(np.abs(yaw).max()), 1e-12)),
        "even": groups,
        "each run": np.eye(len(runs)),
    }
    return {n: w[np.any(w != 0.0, axis=1)] for n, w in pools.items() if np.any(w)}


def latent_inputs(projector: ResidualProjector, basis: Basis, place: Place, runs: Sequence[Run]) -> list[LatentInput]:
    """The likeliest input at a place for each way of pooling runs."""
    found, bases = [], {share: basis.with_fewer_knots(apart) for share, apart in LENGTHS.items()}
    for pool, weights in pooling_weights(runs).items():
        of_lengths = [_of_best_height(projector, fewer, place, pool, weights, share) for share, fewer in bases.items()]
        found.append(max(of_lengths, key=lambda c: c.gain))
    return found


def _of_best_height(
    projector: ResidualProjector, basis: Basis, place: Place, pool: str, weights: np.ndarray, share: float
) -> LatentInput:
    """The latent input of the likeliest height, its length being a share of the record."""
    information = np.einsum("gr,rkl->gkl", weights**2, basis.information)
    pull = np.einsum("gr,rk->gk", weights, basis.pull)
    shared = np.einsum("gr,rkc->gkc", weights, basis.shared)
    length = share * basis.knots[-1]
    unit = np.mean(np.einsum("gkk->gk", information)) + 1e-300
    root = np.linalg.cholesky(_matern(basis.knots, length))
    gain, height, mean, sd, by_chance = _posterior(projector, root, information, pull, shared, HEIGHTS / unit)
    return LatentInput(place, pool, gain, length, height, basis.knots, weights, mean, sd, by_chance)


def _matern(knots: np.ndarray, length: float) -> np.ndarray:
    apart = np.sqrt(3.0) * np.abs(knots[:, None] - knots[None]) / length
    return (1.0 + apart) * np.exp(-apart) + 1e-8 * np.eye(len(knots))


def _posterior(projector: ResidualProjector, root, information, pull, shared, squares):
    """(log evidence gain, height, mean, sd, by_chance) of the best height among ``squares`` (a^2).

    A mean is shrunk by 1 - h, h = a^2 v / (1 + a^2 v), along an eigenvector: of noise it explains 2 h - h^2 there.
    """
    values, vectors = np.linalg.eigh(root.T @ information @ root)
    values = np.maximum(values, 0.0)
    onto = vectors.swapaxes(1, 2) @ root.T
    b, c = (onto @ pull[..., None])[..., 0], onto @ shared  # (G, K), (G, K, c)
    gram, along = projector.gram, projector.shared_residual
    at_none = 0.5 * along @ projector.inverse @ along - 0.5 * np.linalg.slogdet(gram)[1]
    shrink = squares[:, None, None] / (1.0 + squares[:, None, None] * values)  # (H, G, K)
    flat, each = shrink.reshape(len(squares), -1), c.reshape(-1, c.shape[-1])
    inner = gram - (flat @ (each[:, :, None] * each[:, None, :]).reshape(len(each), -1)).reshape(-1, *gram.shape)
    left = along - (flat * b.reshape(-1)) @ each
    common = np.linalg.solve(inner, left[..., None])[..., 0]
    gain = 0.5 * flat @ b.reshape(-1) ** 2 - 0.5 * np.log1p(squares[:, None, None] * values).sum(axis=(1, 2))
    gain += 0.5 * np.einsum("hc,hc->h", left, common) - 0.5 * np.linalg.slogdet(inner)[1] - at_none
    k = int(np.argmax(gain))
    best, square, shrink, common = gain[k], squares[k], shrink[k], common[k]
    back = root @ vectors
    mean = (back @ (shrink * (b - c @ common))[..., None])[..., 0]
    sd = np.sqrt(np.einsum("gik,gk->gi", back**2, shrink))
    by_chance = np.sum(1.0 - 1.0 / (1.0 + square * values) ** 2)
    return float(best), float(np.sqrt(square)), mean, sd, float(by_chance)
