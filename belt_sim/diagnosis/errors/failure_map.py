"""Where a model fails: error over validation uncertainty, by tension, yaw sign, travel window and signal.

ASME V&V 20: E = model - measurement; u_val from noise, zero, gain, settings, stiffness and the march's step; |E| <= k
u_val means that the comparison cannot say more. k = 2 for one cell; a statement about many cells takes the k that all
of them together exceed by chance in one comparison of twenty.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtri

from belt_sim import si
from belt_sim.campaign.types import Kind
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import zero_sigmas
from belt_sim.diagnosis.readings.samples import zero_is_read
from belt_sim.results.errors import UNITS, Where, Worst
from belt_sim.results.words import KILO

K = 2.0
WINDOWS = 6


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One tension, yaw sign, signal and travel window: rms of E over rms of u_val (ratio), and which run it came from;
    signed: the ratio with the sign of the mean error.
    """

    run: str
    signal: str
    tension: float
    sign: int
    window: tuple[float, float]
    ratio: float
    signed: float
    rms: float


def family_k(count: int) -> float:
    """k such that none of ``count`` independent normal errors exceeds k sigma, with probability 95 %."""
    return float(-ndtri(0.025 / max(count, 1)))


def validation_uncertainty(bench: Workbench) -> np.ndarray:
    """u_val, one sigma, of every sample, shape (R, S, n) [m or rad]."""
    samples, levels = bench.samples, bench.levels
    white = np.array([s.white for s in samples.signals])[None, :] / np.sqrt(samples.per_bin)[:, None]
    wander = np.array([s.wander_sd for s in samples.signals])[None, :]
    noise = (np.asarray(levels.white) * white) ** 2 + (np.asarray(levels.wander) * wander) ** 2
    shapes = np.sum(bench.shapes**2, axis=0)
    for s, signal in enumerate(samples.signals):  # a zero that is read off the record is as uncertain as a reading
        read = zero_is_read(samples, signal)
        shapes[read, s] += (noise[:, s] - zero_sigmas(samples, signal) ** 2)[read, None]
    return np.sqrt(noise[..., None] + np.maximum(shapes, 0.0) + np.sum(bench.shared**2, axis=0) + bench.march_error**2)


def cells(bench: Workbench, values: np.ndarray) -> list[Cell]:
    """The map's cells for predictions ``values`` (R, S, n)."""
    samples, u_val = bench.samples, validation_uncertainty(bench)
    edges = window_edges(bench)
    found = []
    for r, run in enumerate(samples.runs):
        for s, signal in enumerate(samples.signals):
            error = values[r, s] - samples.y[r, s]
            for low, high in pairwise(edges):
                inside = (samples.travel[r] >= low) & (samples.travel[r] <= high) & np.isfinite(error)
                if not inside.any():
                    continue
                rms = float(np.sqrt(np.mean(error[inside] ** 2)))
                floor = float(np.sqrt(np.mean(u_val[r, s][inside] ** 2)))
                found.append(
                    Cell(
                        run=run.name,
                        signal=signal.name,
                        tension=run.tension / si.N_PER_MM2,
                        sign=int(np.sign(run.yaw)),
                        window=(float(low), float(high)),
                        ratio=rms / floor,
                        signed=float(np.copysign(rms / floor, np.mean(error[inside]))),
                        rms=rms,
                    )
                )
    return found


def window_edges(bench: Workbench) -> np.ndarray:
    """Edges of the travel windows [m]."""
    return np.linspace(0.0, bench.samples.end, WINDOWS + 1)


def worst_sentence(c: Cell, count: int, kinds: Mapping[str, Kind]) -> str:
    """The worst of ``count`` cells in a sentence."""
    sign = {1: "> 0", -1: "< 0", 0: "= 0"}[c.sign]
    where = f"{c.signal} of run {c.run} ({c.tension:g} N/mm2, yaw {sign}, {c.window[0]:.0f}-{c.window[1]:.0f} m)"
    if c.ratio <= family_k(count):
        return f"Nowhere beyond the uncertainty of the comparison; closest in {where}: E = {c.ratio:.1f} u_val."
    size = f"{KILO * c.rms:.2g} {UNITS[kinds[c.signal]]}"
    return f"Worst in {where}: off by {size}, {c.ratio:.0f} times what the measurement leaves open."


def boundary(found: list[Cell]) -> tuple[float | None, str]:
    """The tension at which the model stops being adequate [N/mm2], where there is one, and a sentence."""
    tensions = sorted({c.tension for c in found})
    worst = np.array([max(c.ratio for c in found if c.tension == t) for t in tensions])
    k = family_k(len(found))
    good = worst <= k
    span = f"{tensions[0]:g} to {tensions[-1]:g} N/mm2"
    if good.all():
        return None, f"Cell by cell within the uncertainty of the comparison at every tension measured ({span})."
    if not good.any():
        return None, f"Inadequate at every tension measured ({span})."
    flips = np.flatnonzero(np.diff(good.astype(int)))
    if len(flips) > 1:
        bad = ", ".join(f"{t:g}" for t, fits in zip(tensions, good, strict=True) if not fits)
        return None, f"Inadequate at {bad} N/mm2."
    n = int(flips[0])
    part = (np.log(k) - np.log(worst[n])) / (np.log(worst[n + 1]) - np.log(worst[n]))
    at = float(np.exp(np.log(tensions[n]) + part * np.log(tensions[n + 1] / tensions[n])))
    side = "above" if good[-1] else "below"
    return at, f"Adequate {side} {at:.3g} N/mm2 (|E| <= {k:.1f} u_val; measured at {span})."


def locate_failure(bench: Workbench, values: np.ndarray) -> Where:
    """The worst cell, the boundary in tension, and both in a sentence, for predictions ``values`` (R, S, n)."""
    found = cells(bench, values)
    worst, (at, words) = max(found, key=lambda c: c.ratio), boundary(found)
    return Where(
        worst=Worst(run=worst.run, signal=worst.signal, travel=worst.window, ratio=worst.ratio),
        sentence=worst_sentence(worst, len(found), {s.name: s.kind for s in bench.samples.signals}),
        boundary=None if at is None else at * si.N_PER_MM2,
        boundary_sentence=words,
    )
