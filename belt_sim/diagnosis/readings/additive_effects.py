"""Effects that only add to the readings, linearly: their readings without a march, and as many as the data show.

An additive effect (a free edge profile: eighty numbers) is fitted like any other, but its columns come from travel and
places alone, so that its harmonics make no march another program, and only those harmonics stand in the parameter
vector that show. It must declare its parameters in the order in which they are to be taken, in pairs (cosine, sine) of
1, 2, ... waves a belt length. Of short waves the mean over a bin of readings shows less (``bin_attenuation``).
"""

from collections.abc import Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import BSpline
from scipy.special import chdtrc

from belt_sim.campaign.types import sensor_place
from belt_sim.case import Case
from belt_sim.diagnosis.readings.candidates import AFFINE
from belt_sim.diagnosis.readings.parameter_vector import NUISANCES, Slot, actual_case
from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.diagnosis.readings.sensor_places import indicate_place, places_of, travel_lead
from belt_sim.effects.base import Effect
from belt_sim.jax_setup import jit_float64
from belt_sim.line.hooks import apply_hook, overrides, true_travel
from belt_sim.line.runup import Reading

READINGS_A_NUMBER = 6.0  # at least; samples may be fewer than two a wave: what they show of it is known all the same
FEWEST = 3  # harmonics that are always asked for
SMOOTH = 6.0  # knots a belt length: slower movements are the belt's, and must not count as harmonics


def significant_harmonics(samples: Samples, roots: np.ndarray, shapes: np.ndarray, residual: np.ndarray) -> int:
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
        slow = _slow_splines(travel, length / SMOOTH)
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
    if (free := len(residual) - columns.shape[1] - slow_ones) > 0:  # an edge that is there may have passed for noise
        gains /= np.clip((residual @ residual - gains[-1]) / free, 1e-3, 1.0)
    harmonics = np.arange(1, len(gains) + 1)
    readings = np.isfinite(samples.y).sum()
    if not np.any(chdtrc(2 * harmonics, gains) < 1.0 / readings):
        return min(FEWEST, len(gains))
    alone = harmonics[np.diff(gains, prepend=0.0) > 2.0 * np.log(readings)]
    best = max([harmonics[np.argmax(gains - 2 * 2 * harmonics)], *alone])
    return int(min(max(FEWEST, best), len(gains)))


def _slow_splines(travel: np.ndarray, spacing: float) -> np.ndarray:
    """Cubic splines (n, k) with knots every ``spacing`` [m]."""
    low, high = float(np.min(travel)), float(np.max(travel))
    inner = np.linspace(low, high, max(2, round((high - low) / spacing) + 1))
    knots = np.concatenate([[low] * 3, inner, [high] * 3])
    return BSpline.design_matrix(travel, knots, 3).toarray()


def harmonics_of(classes: Sequence[type[Effect]], samples: Samples) -> dict[str, int]:
    """Harmonics of the belt length that the lateral readings can be asked for, of every linear effect (not more than it
    has)."""
    lateral = [k for k, s in enumerate(samples.signals) if s.kind == "lateral"]
    most = np.isfinite(samples.y[:, lateral]).sum() / (2 * READINGS_A_NUMBER)
    return {c.id: int(np.clip(most, FEWEST, len(c.parameters) // 2)) for c in classes if c.is_additive()}


def columns(
    samples: Samples, cls: type[Effect], effects: Sequence[Effect] = (), nuisances: np.ndarray | None = None
) -> np.ndarray:
    """Lateral readings (k, R, S, n) per unit of every parameter of ``cls``.

    What encoder, delay and the sensors after it make of them is in it, and every sensor reads zero where the yaw is
    applied. Roll is not touched. effects: all others that act, with their numbers; nuisances: as at the end of a
    parameter vector, by default none.
    """
    runs, signals, n = samples.y.shape
    shapes = np.zeros((len(cls.parameters), runs, signals, n))
    by_bins = bin_attenuation([Slot(cls, name) for name in cls.parameters], samples).T[:, :, None]
    others, off = places_of(samples), np.zeros(len(NUISANCES)) if nuisances is None else nuisances
    stated = np.concatenate([samples.travel, samples.yaw_at[:, None]], axis=1)
    given = samples.cases.settings, stated, samples.cases.rig, samples.cases.belt, tuple(effects), off
    shown = np.asarray(_columns_of_runs(*given, cls=cls, others=others)).swapaxes(0, 1)
    places = [*(f"point_{k}" for k in (1, 2, 3, 4)), *others]
    for s, signal in enumerate(samples.signals):
        if signal.kind == "lateral":
            rows = shown[:, :, places.index(sensor_place(signal.at) or signal.at)]
            shapes[:, :, s] = rows[..., :-1] * by_bins - rows[..., -1:]
    return shapes


@partial(jit_float64, brief=True, static_argnames=("cls", "others"))
def _columns_of_runs(settings, travel, rig, belt, effects, nuisances, *, cls: type[Effect], others) -> jax.Array:
    """Columns (R, k, 4 + j, n) at encoder travels (R, n), at points 1-4 and j others, as the sensors show them."""

    def one_run(settings, travel):
        case = actual_case(Case(rig=rig, belt=belt, settings=settings), nuisances)
        seen = apply_hook(effects, "sensor_travel", true_travel(effects, case, travel), case)
        at_others = [cls.columns(seen + travel_lead(place, case), case)[:, place.point, None] for place in others]
        own = jnp.concatenate([cls.columns(seen, case), *at_others], axis=1)
        none = jnp.zeros((2, len(travel)))

        def read(y):
            reading = Reading(travel=travel, sensor_travel=seen, time=0.0 * seen, y=y[:4], tilt=none)
            rows = [
                indicate_place(place, row, case, effects, travel, seen, 0.0 * seen)[None]
                for place, row in zip(others, y[4:], strict=True)
            ]
            return jnp.concatenate([apply_hook(effects, "sensor", reading, case).y, *rows])

        return jax.vmap(read)(own) - read(jnp.zeros_like(own[0]))  # in proportion to y: gains, not offsets

    return jax.vmap(one_run)(settings, travel)


def bin_attenuation(slots: Sequence[Slot], samples: Samples, others: int = 0) -> np.ndarray:
    """How much of every parameter, and of so many ``others`` behind them, the readings of each run show, (R, k): of a
    harmonic what the mean over a bin leaves, of all else the whole."""
    harmonics = [1 + list(s.effect.parameters).index(s.name) // 2 if s.effect.is_additive() else 0 for s in slots]
    return samples.bin_attenuation(np.array([*harmonics, *[0] * others]))


def select_addable(classes: Sequence[type[Effect]]) -> tuple[type[Effect], ...]:
    """Those of ``classes`` whose readings can be added to those of a march without them, by their ``columns``.

    That is exact where every other sensor law shows a gain times the reading and an offset; beside any other law, one
    of a gauge that sticks for instance, an additive effect is compiled into the march.
    """
    sensors = [c for c in classes if overrides(c, ("sensor",))]
    simple = all(c.is_additive() or c.id in AFFINE for c in sensors)
    return tuple(c for c in classes if c.is_additive()) if simple else ()
