"""Effects that only add to the readings, linearly: derivatives without a march, and as many of them as the data show.

An effect that declares itself ``linear`` (a free edge profile: eighty numbers) is fitted like any other, but its
columns come from travel and places alone, and only those harmonics stand in the parameter vector that show. It must
declare its parameters in the order in which they are to be taken, in pairs (cosine, sine) of 1, 2, ... waves a belt
length. Of short waves the mean over a bin of readings shows less (``shown_by_bins``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import BSpline
from scipy.special import chdtrc

from belt_sim.campaign.types import elsewhere
from belt_sim.case import Case
from belt_sim.diagnosis.readings.added_readings import READ_BY
from belt_sim.diagnosis.readings.elsewhere import passes_earlier, places_of, sensed
from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.effects.base import Effect, apply_hook, overrides, uses
from belt_sim.effects.pipeline import true_travel
from belt_sim.jax_setup import in_float64
from belt_sim.laws.drive import Reading

READINGS_A_NUMBER = 6.0  # at least; samples may be fewer than two a wave: what they show of it is known all the same
KEPT = 8  # sets of columns, at once
FEWEST = 3  # harmonics that are always asked for
SMOOTH = 6.0  # knots a belt length: slower movements are the belt's, and must not count as harmonics


def resolved(cls: type[Effect], samples: Samples) -> int:
    """How many harmonics of the belt length the lateral readings can be asked for (not more than the effect has)."""
    lateral = [k for k, s in enumerate(samples.signals) if s.kind == "lateral"]
    readings = np.isfinite(samples.y[:, lateral]).sum()
    return int(np.clip(readings / (2 * READINGS_A_NUMBER), FEWEST, len(cls.parameters) // 2))


def that_show(samples: Samples, roots: np.ndarray, shapes: np.ndarray, residual: np.ndarray) -> int:
    """How many harmonics a residual (R, S, n) calls for, beside all that moves slowly.

    Where there are any by less than one chance in as many as there are readings (of a single one that is Schwarz's
    criterion), Akaike's says how many predict best, and one further on that stands out alone is asked for as well: what
    is left out of a shape that is there would be taken for something unknown. Noise is no larger than what all of them
    leave.

    roots (R, S, n, n): whitening of each record; shapes (2 H, R, S, n): of the harmonics.
    """
    length = float(np.max(samples.cases.rig.belt_length))
    white, left, slow_ones = [], [], 0
    for r, travel in enumerate(samples.travel):
        slow = _slow(travel, length / SMOOTH)
        for root, shape, y in zip(roots[r], shapes[:, r].swapaxes(0, 1), residual[r], strict=True):
            known = np.isfinite(y)
            own = np.linalg.qr(root[:, known] @ slow[known])[0]
            rows = np.column_stack([root @ shape.T, root[:, known] @ y[known]])
            rows = rows - own @ (own.T @ rows)
            white.append(rows[:, :-1])
            left.append(rows[:, -1])
            slow_ones += own.shape[1]
    columns, residual = np.concatenate(white), np.concatenate(left)
    gains = np.cumsum(np.square(np.linalg.qr(columns)[0].T @ residual))[1::2]
    gains /= _too_much(residual @ residual - gains[-1], len(residual) - columns.shape[1] - slow_ones)
    harmonics = np.arange(1, len(gains) + 1)
    readings = np.isfinite(samples.y).sum()
    if not np.any(chdtrc(2 * harmonics, gains) < 1.0 / readings):
        return min(FEWEST, len(gains))
    alone = harmonics[np.diff(gains, prepend=0.0) > 2.0 * np.log(readings)]
    best = max([harmonics[np.argmax(gains - 2 * 2 * harmonics)], *alone])
    return int(min(max(FEWEST, best), len(gains)))


def _too_much(chi2_left: float, numbers: int) -> float:
    """By what factor noise was taken to have too much variance, if so: an edge that is there may have passed for it."""
    return min(1.0, max(chi2_left, 1e-3 * numbers) / numbers) if numbers > 0 else 1.0


def _slow(travel: np.ndarray, spacing: float) -> np.ndarray:
    """Cubic splines (n, k) with knots every ``spacing`` [m]."""
    low, high = float(np.min(travel)), float(np.max(travel))
    inner = np.linspace(low, high, max(2, round((high - low) / spacing) + 1))
    knots = np.concatenate([[low] * 3, inner, [high] * 3])
    return BSpline.design_matrix(travel, knots, 3).toarray()


def terms(classes: Sequence[type[Effect]], samples: Samples) -> dict[str, int]:
    """Harmonics of every linear effect that the samples resolve."""
    return {c.id: resolved(c, samples) for c in classes if c.is_additive()}


def fitted(cls: type[Effect], terms: Mapping[str, int]) -> list[str]:
    """Names of the parameters of an effect that stand in the parameter vector; terms: harmonics of linear effects."""
    names = list(cls.parameters)
    return names[: 2 * terms[cls.id]] if cls.is_additive() and cls.id in terms else names


@in_float64
def columns(samples: Samples, cls: type[Effect], effects: Sequence[Effect]) -> np.ndarray:
    """Lateral readings (k, R, S, n) per unit of every parameter of ``cls``; effects: all that act, with their numbers.

    What encoder, delay and the sensors after it make of them is in it, and every sensor reads zero where the yaw is
    applied. Roll is not touched.
    """
    runs, signals, n = samples.y.shape
    shapes = np.zeros((len(cls.parameters), runs, signals, n))
    by_bins = shown_by_bins([(cls, name) for name in cls.parameters], samples).T[:, :, None]

    others = places_of(samples)

    def one(settings, stated):
        return _shown(cls, effects, replace(samples.cases, settings=settings), stated, others)

    stated = np.concatenate([samples.travel, samples.yaw_at[:, None]], axis=1)
    shown = np.asarray(jax.vmap(one)(samples.cases.settings, stated)).swapaxes(0, 1)
    places = [*(f"point_{k}" for k in (1, 2, 3, 4)), *others]
    for s, signal in enumerate(samples.signals):
        if signal.kind == "lateral":
            rows = shown[:, :, places.index(elsewhere(signal.at) or signal.at)]
            shapes[:, :, s] = rows[..., :-1] * by_bins - rows[..., -1:]
    return shapes


def shown_by_bins(parameters: Sequence[tuple[type[Effect], str]], samples: Samples) -> np.ndarray:
    """How much of every parameter the readings of each run show, (R, k): of a harmonic what the mean over a bin leaves,
    of all else the whole."""
    places = {cls: {name: k for k, name in enumerate(cls.parameters)} for cls, _ in parameters if cls.is_additive()}
    harmonics = [1 + places[cls][name] // 2 if cls.is_additive() else 0 for cls, name in parameters]
    return samples.averaged(np.array(harmonics))


def _shown(cls: type[Effect], effects: Sequence[Effect], case: Case, stated: np.ndarray, others) -> jax.Array:
    """Columns (k, 4 + j, n) at encoder travels (n,), at points 1-4 and j others, as the sensors after ``cls`` show
    them."""
    seen = apply_hook(effects, "seen", true_travel(effects, case, jnp.asarray(stated)), case)
    own = cls.columns(seen, case)
    beside = [cls.columns(seen + passes_earlier(p, case), case)[:, p.point] for p in others]
    after = [e for e in uses(effects, "sensor") if type(e) is not cls]  # in proportion to y: gains, not offsets
    if not after:
        return jnp.concatenate([own, *(rows[:, None] for rows in beside)], axis=1)

    def read(y):
        reading = Reading(travel=jnp.asarray(stated), seen=seen, time=0.0 * seen, y=y, tilt=jnp.zeros((2, len(stated))))
        return apply_hook(after, "sensor", reading, case).y

    def read_beside(place, y):
        return sensed(place, y, case, after, jnp.asarray(stated), seen, 0.0 * seen)

    found = [jax.vmap(read)(own) - read(jnp.zeros_like(own[0]))]
    for place, rows in zip(others, beside, strict=True):
        one = partial(read_beside, place)
        found.append((jax.vmap(one)(rows) - one(jnp.zeros_like(rows[0])))[:, None])
    return jnp.concatenate(found, axis=1)


def slopes(forward, vector: np.ndarray, directions: np.ndarray, samples: Samples) -> np.ndarray:
    """Derivatives (C, R, S, n) of the readings at parameter vectors (C, size) along directions (C, size) that touch
    nothing but linear effects; forward: a ``Forward``."""
    found = np.zeros((len(vector), *samples.y.shape))
    points, of = np.unique(vector, axis=0, return_inverse=True)
    for k, point in enumerate(points):
        acting = forward.effects_at(point, [c.id for c in forward.classes])
        rows = np.flatnonzero(of.reshape(-1) == k)
        for cls in (c for c in forward.classes if c.is_additive()):
            own = forward.index(cls.id)
            sizes = directions[np.ix_(rows, own)] * [forward.slots[j].scale for j in own]
            found[rows] += np.tensordot(sizes, _kept(forward, samples, cls, acting)[: len(own)], axes=1)
    return found


def _kept(forward, samples: Samples, cls: type[Effect], acting: Sequence[Effect]) -> np.ndarray:
    """``columns``, once for all points at which encoder and sensors are alike."""
    if samples is not forward.samples:
        return columns(samples, cls, acting)
    key = cls, *(e for e in acting if overrides(e, ("encoder", "seen") if type(e) is cls else READ_BY))
    known = forward.columns
    found = known.get(key)
    if found is None:  # other threads may ask as well, and forget what is kept
        found = columns(samples, cls, acting)
        if len(known) >= KEPT:
            known.clear()
        known[key] = found
    return found


def as_they_show(forward, samples: Samples, roots: np.ndarray, values: np.ndarray) -> dict[str, int]:
    """Harmonics of every linear effect that the readings call for beside predictions ``values`` (R, S, n)."""
    acting = forward.effects_at(forward.null(), [c.id for c in forward.classes])
    return {
        c.id: that_show(samples, roots, columns(samples, c, acting)[: len(forward.index(c.id))], samples.y - values)
        for c in forward.classes
        if c.is_additive()
    }
