"""The neighbourhood of a fit: what every further candidate would do to the predictions, computed once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from belt_sim.diagnosis.alternatives import Alternatives, Point, best_of_grid, on_grids, shapes_at
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.workbench import Workbench

STARTS = 3  # points of a grid from which a refit starts


@dataclass(frozen=True)
class Around:
    """slopes: position in the parameter vector -> shape (R, S, n) per unit; where the derivative at null vanishes while
    a plausible size moves the readings, the secant to that size stands in its place, and weak (effect id -> points,
    each pairs of position and value) says from where a search may start. alternatives: effect id -> shapes of its
    parameters at every point of its grid; points: the best of them, which are starts as well.
    """

    fit: Fit
    slopes: dict[int, np.ndarray]
    weak: dict[str, list[Point]]
    alternatives: dict[str, Alternatives] = field(default_factory=dict)
    points: dict[str, list[Point]] = field(default_factory=dict)

    def shapes(self, bench: Workbench, name: str) -> np.ndarray | Alternatives:
        """Shapes (k, R, S, n) of one effect; of an effect with a grid, those at every point of it."""
        return self.alternatives.get(name) or self.here(bench, name)

    def here(self, bench: Workbench, name: str) -> np.ndarray:
        """Shapes (k, R, S, n) of all parameters of one effect where the fit stands."""
        return np.stack([self.slopes[k] for k in bench.forward.index(name)])

    def with_effect(self, bench: Workbench, name: str) -> Fit:
        """The fit with one more effect at null, evaluated already."""
        fit, shapes = self.fit, self.here(bench, name)
        white = bench.metric.whiten(shapes)
        return Fit(
            ids=(*fit.ids, name),
            free=[*fit.free, *bench.forward.index(name)],
            vector=fit.vector,
            chi2=fit.chi2,
            columns=np.concatenate([fit.columns.reshape(-1, white.shape[1]), white]),
            slopes=np.concatenate([fit.slopes.reshape(-1, *shapes.shape[1:]), shapes]),
            residual=fit.residual,
            values=fit.values,
        )


def around(bench: Workbench, fit: Fit, ids: Sequence[str], points: Mapping[str, list[Point]] | None = None) -> Around:
    """Derivatives of the predictions near ``fit`` along every parameter of the effects ``ids``.

    points: of grids, from where a search may start (``Around.points`` of another fit); by default grids are gone
    through anew.
    """
    positions = [k for i in ids for k in bench.forward.index(i)]
    if not positions:
        return Around(fit, {}, {})
    slopes, starts = shapes_at(bench, fit, positions)
    alternatives: dict[str, Alternatives] = {}
    if points is None:
        grids = on_grids(bench, fit, ids)
        alternatives = {i: found for i, (found, _) in grids.items()}
        points = {i: [at[k] for k in best_of_grid(bench, fit, found)[:STARTS]] for i, (found, at) in grids.items()}
    weak = {i: [(s,) for s in starts if s[0] in bench.forward.index(i)] + points.get(i, []) for i in ids}
    return Around(fit, slopes, {i: found for i, found in weak.items() if found}, alternatives, dict(points))
