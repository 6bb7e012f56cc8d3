"""The step of the march: as short as its own error asks for, by halving it on the campaign's own runs."""

import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.diagnosis.readings.forward import STEP, Forward
from belt_sim.diagnosis.readings.samples import Samples

WANTED = 0.1  # length of the march's error, whitened over the whole campaign: noise alone has one per reading
HALVINGS = 3
ORDER = 4.0  # error of a step over that of half the step: the march is of second order


def choose_step(samples: Samples, model: Composition, whiten) -> tuple[float, np.ndarray]:
    """The longest step [m], of STEP and its halves, whose error is no longer than WANTED, and that error (R, S, n)
    [m or rad]; ``whiten`` as in ``Metric``.
    """
    both = (Forward(samples, model, (), step) for step in (STEP, STEP / 2))
    coarse, fine = (f.values(f.null()[None])[0] for f in both)
    error = (coarse - fine) * ORDER / (ORDER - 1.0)
    size = float(np.linalg.norm(whiten(error)))
    halvings = 0 if size <= WANTED else min(int(np.ceil(np.log(size / WANTED) / np.log(ORDER))), HALVINGS)
    return STEP / 2**halvings, ORDER**-halvings * error
