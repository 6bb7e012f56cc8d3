"""Held-out error: whole conditions (a tension, a sign of yaw) are left out, the rest is refitted, they are predicted.

Refits are one Gauss-Newton step from the joint fit, which is exact for effects that enter linearly. Before any reading
a parameter is known as well as a real machine allows (plausibility.prior_sigma), and harmonics as well as they fall
(shrink_harmonics): what only the left-out runs show falls back to null; a condition is untestable where
the rest does not know what the effects do to it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit, step_bounds
from belt_sim.diagnosis.fits.plausibility import prior_sigma
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.linear_algebra import bounded_step
from belt_sim.diagnosis.readings.parameter_vector import Slot

# How large the many harmonics of a linear effect are before a reading: they fall as their scales do, all together.
#
# Nobody knows how straight a belt's edge is, but a belt of which thirty numbers hardly show has none of millimetres.
# Refits that may take each number for anything a machine allows predict such an edge worse than no edge at all.

SIZES = np.geomspace(1e-3, 1e3, 121)  # that are tried, beside a typical number and its sigma


def shrink_harmonics(slots: Sequence[Slot], numbers: np.ndarray, variance: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """``sigma`` (k,), of numbers before any reading, where those of a linear effect are Gaussian with a common size:
    that at which numbers (k,) as they were fitted, of such variance (k,), are likeliest; all in units of their scales.
    """
    found = sigma.copy()
    for cls in {s.effect for s in slots if s.effect.is_additive()}:
        rows = np.array([s.effect is cls for s in slots])
        square, own = numbers[rows] ** 2, variance[rows]
        tried = SIZES * np.sqrt(np.median(own) + np.median(square))
        total = tried[:, None] ** 2 + own
        size = tried[np.argmin(np.sum(square / total + np.log(total), axis=1))]
        found[rows] = np.minimum(sigma[rows], size)
    return found


KNOWN = 0.5  # what the numbers do to left-out readings is known from the other runs when its u is below this share of
#             what it was before any, and below its size: what may as well be nothing, or twice as much, says nothing
LARGE = 0.9  # of the largest yaw, from which a yaw counts as the largest
VISIBLE = 2.0  # sigma by which left-out readings have to be uncertain before anybody asks who knows them


@dataclass(frozen=True)
class Condition:
    """One condition left out: -2 log of the density that the rest predicted for it (surprise; without free parameters
    the squared length of the whitened error), its runs out (R,), all their errors (r, S, n), those of lateral readings
    (m,) [m], and whether the rest knows what the numbers do there: else leaving it out tests nothing.
    """

    surprise: float
    out: np.ndarray
    errors: np.ndarray
    lateral: np.ndarray
    testable: bool


def lateral_rms(left_out: Iterable[Condition]) -> float:
    """rms [m] of the lateral errors of some conditions; nan where there are none."""
    errors = np.concatenate([c.lateral for c in left_out])
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")


def conditions(bench: Workbench) -> dict[str, np.ndarray]:
    """Name -> which runs (R,) it leaves out: every tension, every sign of yaw, the largest yaws where there are smaller
    ones, and the runs marked hold_out.

    The lowest and the highest tension and the largest yaw ask for an extrapolation, in which a wrong law shows first.
    """
    runs = bench.samples.runs
    fitted = np.array([r.use == "fit" for r in runs])
    tension = np.array([r.tension for r in runs])
    sign = np.array([np.sign(r.yaw) for r in runs])
    found = {f"{t / 1e6:g} N/mm2": (tension == t) & fitted for t in np.unique(tension)}
    found |= {f"yaw {'+' if s > 0 else '-' if s < 0 else '0'}": (sign == s) & fitted for s in np.unique(sign)}
    size = np.abs([r.yaw for r in runs])
    large = size > LARGE * np.max(size[fitted], initial=0.0)
    if np.any(fitted & ~large & (size > 0.0)):
        found["largest yaw"] = large & fitted
    kept = {n: m for n, m in found.items() if m.any() and not m[fitted].all()}
    if not fitted.all():
        kept["hold_out"] = ~fitted
    return kept or {"all": fitted}


def held_out(bench: Workbench, fit: Fit) -> dict[str, Condition]:
    """Prediction error of ``fit`` on each condition when that condition is left out."""
    before = prior_of_fit(bench, fit)
    return {name: _predict_left_out(bench, fit, out, *before) for name, out in conditions(bench).items()}


def prior_of_fit(bench: Workbench, fit: Fit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the free numbers (k,) of a fit: one sigma before any reading, the same as harmonics fall, and how far off null
    they are.
    """
    allowed = prior_sigma(bench.forward, fit.free)
    away = fit.vector[fit.free] - bench.forward.null()[fit.free]
    slots = [bench.forward.slots[k] for k in fit.free]
    variance = np.diag(fit.covariance) if any(s.effect.is_additive() for s in slots) else allowed
    return allowed, shrink_harmonics(slots, away, variance, allowed), away


def _predict_left_out(
    bench: Workbench, fit: Fit, out: np.ndarray, allowed: np.ndarray, sigma: np.ndarray, away: np.ndarray
) -> Condition:
    samples, count = bench.samples, len(fit.free)
    blocks = fit.residual.reshape(len(samples.runs), -1)
    columns = fit.columns.reshape(count, *blocks.shape)
    here, rest = (columns[:, m].reshape(count, blocks[m].size) for m in (out, ~out))
    step, root = _refit(rest, blocks[~out].ravel(), sigma, away, step_bounds(fit, bench.forward.sides))
    seen = root @ here
    errors = samples.y[out] - fit.values[out] - np.einsum("k,krsn->rsn", step, fit.slopes[:, out])
    lateral = np.array([s.kind == "lateral" for s in samples.signals])
    return Condition(
        surprise=_surprise(blocks[out].ravel() - step @ here, seen),
        out=out,
        errors=errors,
        lateral=errors[np.isfinite(samples.y[out]) & lateral[None, :, None]],
        testable=_is_known(here, root, allowed, away, [bench.forward.slots[k].effect.id for k in fit.free]),
    )


def _refit(columns: np.ndarray, residual: np.ndarray, sigma: np.ndarray, away: np.ndarray, space):
    """The step (k,) from a joint fit ``away`` from null to that of some runs with the prior, and a root (k, k) of its
    covariance: rows are what one sigma of independent combinations adds to the numbers.

    space: how far each number may go down and up (k,); what a machine has on one side of null only (a stiffness) some
    runs alone, which may hardly show it, do not put on the other.
    """
    scale = 1.0 / np.sqrt(np.sum(columns**2, axis=1) + sigma**-2.0)
    information = (columns @ columns.T + np.diag(sigma**-2.0)) * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(information)
    root = (vectors / np.sqrt(np.maximum(values, 1e-12))).T * scale
    along = columns @ residual - away / sigma**2
    step = root.T @ (root @ along)
    if np.any((step < space[0]) | (step > space[1])):
        step = scale * bounded_step(information, scale * along, space[0] / scale, space[1] / scale)
    return step, root


def _surprise(left: np.ndarray, seen: np.ndarray) -> float:
    """-2 log predictive density of whitened errors ``left`` (m,) when one sigma of each of k independent combinations
    of parameters adds ``seen`` (k, m): r^T (I + S^T S)^-1 r + log det(I + S^T S).
    """
    total, along = np.eye(len(seen)) + seen @ seen.T, seen @ left
    return float(left @ left - along @ np.linalg.solve(total, along) + np.linalg.slogdet(total)[1])


def _is_known(here: np.ndarray, root: np.ndarray, sigma: np.ndarray, away: np.ndarray, owners: Sequence[str]) -> bool:
    """Whether the other runs know what the numbers do to the left-out readings ``here`` (k, m): better than any machine
    does, and better than to within the whole of it.

    Numbers that are known together only (an offset and a gain of the tension) may each be unknown in that. But what
    every effect does has to be known, of which the numbers ``owners`` (k,) are, or else all of them together as well as
    that: beside an edge of a thousand sigma nobody sees that the others know nothing of a crown.
    """
    off = float(np.linalg.norm(root @ here))

    def knows(own: np.ndarray) -> bool:
        least = float(np.linalg.norm(root[:, own] @ here[own]))
        before = float(np.linalg.norm(sigma[own, None] * here[own]))
        whole = float(np.linalg.norm(away[own] @ here[own]))
        return least < VISIBLE or min(off, least) < min(KNOWN * before, whole)

    return off < VISIBLE or all(knows(np.array([o == name for o in owners])) for name in set(owners))
