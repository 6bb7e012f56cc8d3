"""A campaign laid out for its linear response: what a small size of every effect does to its readings."""

import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.covariance import Levels
from belt_sim.diagnosis.noise.levels import LevelFinder
from belt_sim.diagnosis.noise.metric import metric_of, nuisance_shapes
from belt_sim.diagnosis.readings.forward import NUISANCES, Forward
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.effects.base import Effect


def lay_out(
    campaign: Campaign, model: Composition, classes: list[type[Effect]], *, planned: bool
) -> tuple[Workbench, Fit]:
    """The campaign on the workbench with nothing wrong, and the derivatives of its readings along every parameter.

    Noise is as stated; of a measured campaign with repeats, as these show it.
    """
    samples = samples_of(campaign)
    forward = Forward(samples, model, classes)
    null, every = forward.null(), np.eye(forward.size)
    values, slopes = forward.values_and_slopes(np.repeat(null[None], forward.size, axis=0), every)
    shapes, shared = nuisance_shapes(campaign, samples, values[0], slopes[-len(NUISANCES) :])
    finder = LevelFinder(samples, shapes)
    levels = finder(samples.y - values[0]) if finder.repeats and not planned else Levels()
    bench = Workbench(
        campaign=campaign,
        samples=samples,
        fitted=samples,
        forward=forward,
        levels=levels,
        finder=finder,
        shapes=shapes,
        shared=shared,
        metric=metric_of(samples, levels, shapes, shared),
    )
    free = list(range(len(forward.slots)))
    own = slopes[: len(free)]
    columns = bench.metric.whiten(own) if free else np.zeros((0, 1))
    fit = Fit(ids=(), free=free, vector=null, columns=columns, slopes=own, values=values[0])
    return bench, fit
