"""From which points of a grid a search begins: the best of those that say different things.

Where a guide stands beyond the end of a short span, or where a force acts on a stiff one, several points of a grid do
the same to the readings. A search from each of them ends at the same place, and those that say something else never get
their turn. One of them is enough: if they do not all ask for the same numbers, one by which a machine could have them.
"""

from collections.abc import Sequence

import numpy as np

from belt_sim.diagnosis.fits.alternatives import Alternatives, Point
from belt_sim.diagnosis.fits.candidate import is_possible
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.numerics.bounded import inside
from belt_sim.diagnosis.numerics.products import inverse

ALIKE = 0.5  # chi2 between two predictions, below which they say the same


def best_of_grid(
    bench: Workbench, fit: Fit, name: str, alternatives: Alternatives, tried: Sequence[Point], most: int
) -> list[int]:
    """At most so many points of an effect's grid by what they promise in the linear range, best first, no two alike.

    tried: the points themselves. A number that a machine has on one side of null only promises nothing on the other.
    """
    columns = bench.metric.whiten(alternatives.columns)
    own = fit.columns.reshape(len(fit.free), columns.shape[1])
    onto = columns @ own.T @ inverse((own @ own.T)[None])[0][0]
    gram, pull = columns @ columns.T - onto @ (own @ columns.T), columns @ fit.residual - onto @ (own @ fit.residual)
    choices = np.stack(alternatives.choices)
    free = [k for k in bench.forward.index(name) if k not in bench.forward.grids(name)]
    steps, sigma = _steps(bench, fit, free, gram[choices[:, :, None], choices[:, None, :]], pull[choices])
    does = np.zeros((len(choices), len(gram)))
    np.add.at(does, (np.arange(len(choices))[:, None], choices), steps)
    gains = 2.0 * does @ pull - np.sum((does @ gram) * does, axis=1)

    def alike(k: int, j: int) -> bool:
        apart = does[k] - does[j]
        return bool(apart @ gram @ apart < ALIKE)

    def possible(k: int) -> bool:
        slots = [bench.forward.slots[p] for p in free]
        return is_possible(slots, fit.vector[free] + steps[k], sigma[k])

    found: list[int] = []
    for k in np.argsort(-gains, kind="stable").tolist():
        same = next((i for i, j in enumerate(found) if alike(k, j)), None)
        if same is None and len(found) < most:
            found.append(k)
        elif same is not None and not possible(found[same]) and possible(k):
            found[same] = k
    return found


def _steps(
    bench: Workbench, fit: Fit, free: Sequence[int], gram: np.ndarray, pull: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The best numbers (p, k) at every point, on the side of null where a machine has them, and their sigmas."""
    inverted, _ = inverse(gram)
    steps = np.einsum("pkl,pl->pk", inverted, pull)
    low, high = (side[list(free)] - fit.vector[list(free)] for side in bench.forward.sides)
    for k in np.flatnonzero(np.any((steps < low) | (steps > high), axis=1)):
        steps[k] = inside(gram[k], pull[k], low, high)
    return steps, np.sqrt(np.maximum(np.diagonal(inverted, axis1=1, axis2=2), 0.0))
