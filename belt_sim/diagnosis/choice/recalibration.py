"""Chance asked again beside a set of effects that has changed what noise is taken to be.

Thresholds are made at the base model. Where that is far off and no run was repeated, what it leaves says little of the
noise, and chance is judged by far too much of it; beside the effect that takes it away the levels are known, and so is
what chance gives further candidates there.
"""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.diagnosis.choice.chance import chance_of
from belt_sim.diagnosis.choice.decide import Ids
from belt_sim.diagnosis.choice.refits import Refits
from belt_sim.diagnosis.fits.around import around
from belt_sim.diagnosis.left_over.null import NullGains, null_gains
from belt_sim.diagnosis.noise.noise import Levels
from belt_sim.diagnosis.noise.signal_levels import LEVEL_SPREAD


@dataclass(frozen=True)
class Recalibration:
    """How thresholds are made: bootstrap replicates, seed, false alarms of all candidates together; levels: of the
    noise, at which those in use were made.
    """

    count: int
    seed: int
    level: float
    levels: Levels

    def __call__(self, refits: Refits, ids: Ids) -> Refits:
        """``refits`` with the chance of the others beside ``ids``, where the noise there is another."""
        bench = refits.bench
        others = [n for n in refits.names if n not in ids]
        if not others or not _apart(self.levels, bench.levels, len(bench.samples.signals)):
            return refits
        fit = refits.fit(ids)
        near = around(bench, fit, others, refits.near)
        shapes = {n: near.shapes(bench, n) for n in others}
        null = null_gains(bench, shapes, fit.slopes, fit.values, count=self.count, seed=self.seed)
        return replace(
            refits,
            null=_beside(refits.null, null),
            critical=null.critical(others, self.level),
            chance=chance_of(bench, bench.samples.y - fit.values, self.seed + 1),
            tried={},
            recalibrated=replace(self, levels=bench.levels),
        )


def _apart(one: Levels, other: Levels, signals: int) -> bool:
    """Whether white noise or slow noise of a signal differ by more than those of a data sheet may."""
    sizes = [[_sizes(levels, s) for s in range(signals)] for levels in (one, other)]
    return bool(np.max(np.abs(np.log(sizes[0]) - np.log(sizes[1]))) > LEVEL_SPREAD)


def _sizes(levels: Levels, s: int) -> tuple[float, float]:
    """Factors on white noise and on wander, as slow effects see it."""
    white, wander, reach = levels.of(s)
    return white, wander * float(np.sqrt(reach.length))


def _beside(old: NullGains, new: NullGains) -> NullGains:
    """The law of ``new`` for all that it knows, of ``old`` for the effects beside which it was made, and for what does
    nothing beside them that they do not do themselves: it may stand in the place of one of them all the same.
    """
    known = {n for n, dof in new.dof.items() if dof > 0}
    alone = {n: x for n, x in old.alone.items() if n not in known}
    return NullGains(
        {**old.gains, **{n: x for n, x in new.gains.items() if n in known}},
        {**old.dof, **{n: x for n, x in new.dof.items() if n in known}},
        alone | {n: x for n, x in new.alone.items() if n in known},
    )
