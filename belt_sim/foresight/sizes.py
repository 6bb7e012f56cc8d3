"""The smallest size of an effect that the readings would show: seen nine times in ten, named by chance in one of twenty
campaigns."""

import math

import numpy as np
from scipy import stats

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.results.check import Visible

FALSE_ALARM, MISSED = 0.05, 0.1


def detectable_size(candidates: int) -> float:
    """Whitened size that shows: chance of all ``candidates`` together, and luck, allowed for."""
    chance = math.sqrt(float(stats.chi2.isf(FALSE_ALARM / max(candidates, 1), 1)))
    return chance + float(stats.norm.isf(MISSED))


def visible(bench: Workbench, fit: Fit) -> list[Visible]:
    """Every effect by the parameter that shows best, those that show best first."""
    least = detectable_size(len(bench.forward.classes))
    found = [_visible(bench, fit, cls.id, least) for cls in bench.forward.classes]
    return sorted(found, key=lambda v: v.share)


def best_column(bench: Workbench, fit: Fit, name: str) -> int:
    """Position of the parameter of an effect that shows best, for what a machine could have of it."""
    return min(bench.forward.index(name), key=lambda k: _share(bench, fit, k, 1.0))


def reach(bench: Workbench, position: int) -> float:
    """The largest plausible size of a parameter, in units of its scale, about null."""
    slot = bench.forward.slots[position]
    declared = slot.parameter
    return max(abs(bound - declared.null) for bound in declared.plausible) / slot.scale


def _share(bench: Workbench, fit: Fit, position: int, least: float) -> float:
    """Smallest visible size over the largest that a machine could have; infinite where nothing shows."""
    slot = bench.forward.slots[position]
    length = float(np.linalg.norm(fit.columns[position]))
    if slot.only_shapes or length < 1e-9 * least:
        return math.inf
    return least / (length * reach(bench, position))


def _visible(bench: Workbench, fit: Fit, name: str, least: float) -> Visible:
    best = best_column(bench, fit, name)
    slot = bench.forward.slots[best]
    declared, share = slot.parameter, _share(bench, fit, best, least)
    most = reach(bench, best) * slot.scale
    return Visible(
        effect=name,
        parameter=slot.name,
        unit=declared.unit,
        meaning=declared.meaning,
        smallest=share * most if math.isfinite(share) else None,
        largest_plausible=most,
        share=share,
    )
