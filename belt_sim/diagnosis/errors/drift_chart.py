"""The parameter-drift chart: the same parameter, fitted tension by tension, should not move."""

from dataclasses import replace

import numpy as np

from belt_sim import si
from belt_sim.diagnosis.fits.fit import fit_sets
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import metric_of
from belt_sim.results.drawings import Drift

GPA = 1e9
LIMIT = 3.0  # a model that asks for more than three times the stated value, or less than a third, is shown there


def stiffness_drift(bench: Workbench, vector: np.ndarray, name: str = "Young's modulus") -> Drift | None:
    """Young's modulus [GPa] that each tension asks for by itself; None with fewer than two tensions.

    Only F/EI enters a beam: a wrong tension, width or thickness shows here as well.
    """
    stress = np.array([r.tension for r in bench.samples.runs])
    tensions = np.unique(stress)
    if len(tensions) < 2 or not bench.forward.model.moments:
        return None
    stated = bench.campaign.belt.youngs_modulus
    value, u = [], []
    position = len(bench.forward.slots)
    for t in tensions:
        y = np.where((stress == t)[:, None, None], bench.fitted.y, np.nan)
        metric = metric_of(replace(bench.fitted, y=y), bench.levels, bench.shapes, 0.0 * bench.shared)
        fit = fit_sets(bench.forward, metric, [bench.start((), vector, free=[position])])[0]
        factor = np.clip(1.0 + fit.vector[position], 1.0 / LIMIT, LIMIT)
        value.append(factor * stated.value / GPA)
        beyond = factor in (1.0 / LIMIT, LIMIT)  # no interval is drawn about a value off the chart
        u.append(0.0 if beyond else min(np.sqrt(fit.covariance[0, 0]), 0.5 * factor) * stated.value / GPA)
    return Drift(
        parameter=name,
        unit="GPa",
        tension=tensions / si.N_PER_MM2,
        value=np.array(value),
        u=np.array(u),
        stated=stated.value / GPA,
        u_stated=stated.u / GPA,
    )
