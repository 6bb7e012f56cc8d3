"""Effects that only add to the readings, linearly: derivatives without a march, and as many of them as the data show.

An effect that declares itself ``linear`` (a free edge profile: eighty numbers) is fitted like any other, but its columns
come from travel and places alone, and only those parameters stand in the parameter vector that the record resolves.
Parameters must be declared in the order in which they are to be taken, in pairs (cosine, sine).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.diagnosis.samples import Samples
from belt_sim.effects.around_engine import true_travel
from belt_sim.effects.base import Effect, uses
from belt_sim.jax_setup import in_float64
from belt_sim.laws.sensor import Reading

SAMPLES_A_WAVE = 3.0  # below this a harmonic is not resolved
FEWEST = 3  # harmonics that are always asked for


def resolved(cls: type[Effect], samples: Samples) -> int:
    """How many harmonics of the belt length the samples resolve (not more than the effect has)."""
    spacing = min(float(np.median(np.diff(s[: np.argmax(s) + 1]))) for s in samples.travel if np.argmax(s) > 0)
    length = float(np.max(samples.cases.rig.belt_length))
    return int(np.clip(length / (SAMPLES_A_WAVE * spacing), FEWEST, len(cls.parameters) // 2))


def that_show(white: np.ndarray, residual: np.ndarray) -> int:
    """How many harmonics a whitened residual (N,) calls for, by Schwarz's criterion; white (2 H, N): their columns."""
    gains = np.cumsum(np.square(np.linalg.qr(white.T)[0].T @ residual))[1::2]
    harmonics = np.arange(1, len(gains) + 1)
    score = gains - 2 * harmonics * np.log(len(residual))
    return int(min(max(FEWEST, harmonics[np.argmax(score)]), len(gains)))


def fitted(cls: type[Effect], terms: Mapping[str, int]) -> list[str]:
    """Names of the parameters of an effect that stand in the parameter vector; terms: harmonics of linear effects."""
    names = list(cls.parameters)
    return names[: 2 * terms[cls.id]] if cls.linear and cls.id in terms else names


@in_float64
def columns(samples: Samples, cls: type[Effect], effects: Sequence[Effect]) -> np.ndarray:
    """Lateral readings (k, R, S, n) per unit of every parameter of ``cls``; effects: all that act, with their numbers.

    What encoder, delay and the sensors after it make of them is in it, and every sensor reads zero where the yaw is
    applied. Roll is not touched.
    """
    runs, signals, n = samples.y.shape
    shapes = np.zeros((len(cls.parameters), runs, signals, n))
    points = [(s, int(signal.at[-1]) - 1) for s, signal in enumerate(samples.signals) if signal.at.startswith("point")]
    for r in range(runs):
        settings = jax.tree.map(lambda x, r=r: x[r], samples.cases.settings)
        case = replace(samples.cases, settings=settings)
        shown = _shown(cls, effects, case, np.append(samples.travel[r], samples.yaw_at[r]))
        for s, point in points:
            shapes[:, r, s] = shown[:, point, :-1] - shown[:, point, -1:]
    return shapes


def _shown(cls: type[Effect], effects: Sequence[Effect], case: Case, stated: np.ndarray) -> np.ndarray:
    """Columns (k, 4, n) at encoder travels (n,) as the sensors after ``cls`` show them."""
    seen = true_travel(effects, case, jnp.asarray(stated))
    for e in uses(effects, "seen"):
        seen = e.seen(seen, case)
    own = cls.columns(seen, case)
    after = [e for e in uses(effects, "sensor") if type(e) is not cls]  # in proportion to y: gains, not offsets
    if not after:
        return np.asarray(own)

    def read(y):
        reading = Reading(travel=jnp.asarray(stated), seen=seen, time=0.0 * seen, y=y, tilt=jnp.zeros((2, len(stated))))
        for e in after:
            reading = e.sensor(reading, case)
        return reading.y

    return np.asarray(jax.vmap(read)(own) - read(jnp.zeros_like(own[0])))
