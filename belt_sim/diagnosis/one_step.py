"""What one more effect promises: one Gauss-Newton step, exact where it enters linearly.

A number that only shapes an effect (where a weld is) says nothing while that is null: a step from null tries its null
value alone, and an effect that is somewhere else promises next to nothing there. So a step is taken from each of the
best points of its grid as well, and the best counts.
"""

from dataclasses import replace

import numpy as np

from belt_sim.diagnosis.around import Around
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.workbench import Workbench


def projected(bench: Workbench, near: Around, name: str) -> Fit:
    """The best of what ``near`` is around with one more effect, one step from null and from points of its grid."""
    return min(map(_stepped, near.linear_starts(bench, name)), key=lambda fit: fit.chi2)


def _stepped(start: Fit) -> Fit:
    size = np.linalg.norm(start.columns, axis=1)
    scale = np.where(size > 1e-6, 1.0 / np.maximum(size, 1e-6), 0.0)
    step = scale * np.linalg.lstsq((start.columns * scale[:, None]).T, start.residual, rcond=1e-8)[0]
    vector = start.vector.copy()
    vector[start.free] += step
    residual = start.residual - step @ start.columns
    return replace(
        start,
        vector=vector,
        residual=residual,
        chi2=float(residual @ residual),
        values=start.values + np.einsum("k,krsn->rsn", step, start.slopes),
    )
