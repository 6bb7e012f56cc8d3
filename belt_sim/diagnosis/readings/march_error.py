"""The step of the march: as short as its own error asks for, by halving it on the campaign's own runs."""

from dataclasses import dataclass

import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.diagnosis.readings.forward import STEP, Forward
from belt_sim.diagnosis.readings.samples import Samples

WANTED = 0.1  # length of the march's error, whitened over the whole campaign: noise alone has one per reading
HALVINGS = 3
ORDER = 4.0  # error of a step over that of half the step: the march is of second order


@dataclass(frozen=True, kw_only=True)
class MarchError:
    """step [m] that was taken; error (R, S, n) [m or rad] that it leaves; size: its length, whitened."""

    step: float
    error: np.ndarray
    size: float


def march_error(samples: Samples, model: Composition, whiten) -> MarchError:
    """The longest step, of STEP and its halves, whose error is no longer than WANTED; ``whiten`` as in ``Metric``."""
    finer = Forward(samples, model, (), STEP / 2)
    coarse, fine = (f.values(f.null()[None])[0] for f in (Forward(samples, model, (), STEP, like=finer), finer))
    error = (coarse - fine) * ORDER / (ORDER - 1.0)
    size = float(np.linalg.norm(whiten(error)))
    halvings = 0 if size <= WANTED else min(int(np.ceil(np.log(size / WANTED) / np.log(ORDER))), HALVINGS)
    part = ORDER**-halvings
    return MarchError(step=STEP / 2**halvings, error=part * error, size=part * size)
