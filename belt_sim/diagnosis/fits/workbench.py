"""Everything a diagnosis works with: readings, the model with all candidates in reach, noise levels, metric."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.analytic.composition import Composition
from belt_sim.campaign import Campaign
from belt_sim.diagnosis.fits.fit import Fit, Race, Sides, fit_sets
from belt_sim.diagnosis.noise.covariance import Levels
from belt_sim.diagnosis.noise.levels import LevelFinder
from belt_sim.diagnosis.noise.metric import Metric, metric_of, nuisance_shapes
from belt_sim.diagnosis.noise.settings import expand_at_likely_settings
from belt_sim.diagnosis.readings.additive_effects import choose_harmonics
from belt_sim.diagnosis.readings.forward import NUISANCES, Forward, MarchError, march_error
from belt_sim.diagnosis.readings.samples import Samples, samples_of
from belt_sim.effects.base import Effect


@dataclass(frozen=True, kw_only=True)
class Workbench:
    """A campaign laid out for a model.

    samples: every run; fitted: the same with hold-out runs blanked; shapes, shared: nuisances at the current point;
    metric judges the fitted runs; march: the step of the march and the error that it leaves; keeps_noise: levels are
    not read anew where it is moved to.
    """

    campaign: Campaign
    samples: Samples
    fitted: Samples
    forward: Forward
    levels: Levels
    finder: LevelFinder
    shapes: np.ndarray
    shared: np.ndarray
    metric: Metric
    march: MarchError | None = None
    keeps_noise: bool = False

    def metric_at(self, levels: Levels) -> Metric:
        """The metric with other noise levels."""
        return metric_of(self.fitted, levels, self.shapes, self.shared)

    def moved_to(self, vector: np.ndarray) -> "Workbench":
        """The workbench with noise levels and nuisance shapes taken at ``vector``, and every run's settings near it.

        Itself where a belt runs away at ``vector``, or a hair beside it.
        """
        here = _shapes(self.campaign, self.samples, self.forward, vector)
        return self._with_shapes(self.forward, *here)._at_likely_settings(vector) if _finite(*here) else self

    def _at_likely_settings(self, vector: np.ndarray) -> "Workbench":
        """The workbench, laid out at ``vector``, with every run's settings where they most likely were."""
        forward = self.forward_at_likely_settings(vector)
        if forward is self.forward:
            return self
        there = _shapes(self.campaign, self.samples, forward, vector)
        return self._with_shapes(forward, *there) if _finite(*there) else self

    def forward_at_likely_settings(self, vector: np.ndarray) -> Forward:
        """The model with every run's settings where they most likely were; the workbench is laid out at ``vector``."""
        return expand_at_likely_settings(
            self.campaign, self.fitted, self.forward, self.metric, self.shapes, self.shared, vector
        )

    def _with_shapes(self, forward: Forward, shapes: np.ndarray, shared: np.ndarray, values: np.ndarray) -> "Workbench":
        """The workbench where nuisances have these shapes: what settings did to one of two repeats is not noise."""
        finder = self.finder if self.keeps_noise else self.finder.at_shapes(shapes)
        levels = self.levels if self.keeps_noise else finder(self.samples.y - values)
        metric = metric_of(self.fitted, levels, shapes, shared)
        return replace(self, forward=forward, shapes=shapes, shared=shared, finder=finder, levels=levels, metric=metric)

    def start(self, ids: Sequence[str], vector: np.ndarray, free: Sequence[int] | None = None) -> Fit:
        """A fit of the effects ``ids`` to begin at ``vector``."""
        positions = [k for i in ids for k in self.forward.index(i)] if free is None else list(free)
        return Fit(ids=tuple(ids), free=positions, vector=np.array(vector))

    def fit(
        self, starts: Sequence[Fit], y: np.ndarray | None = None, race: Race | None = None, sides: Sides | None = None
    ) -> list[Fit]:
        """Joint refits on the fitted runs."""
        return fit_sets(self.forward, self.metric, starts, y, race, sides)

    def slopes(self, vector: np.ndarray, positions: Sequence[int]) -> np.ndarray:
        """Derivatives of the predictions at ``vector`` along ``positions``, shape (k, R, S, n)."""
        directions = np.eye(self.forward.size)[list(positions)]
        return self.forward.values_and_slopes(np.repeat(vector[None], len(directions), axis=0), directions)[1]


def workbench(
    campaign: Campaign,
    model: Composition,
    classes: Sequence[type[Effect]],
    terms: Mapping[str, int] | None = None,
) -> Workbench:
    """Lay out ``campaign`` for ``model`` with ``classes`` as candidates.

    terms: effect id -> harmonics that are fitted; by default as many as show.
    """
    bench, _ = _lay_out_as_stated(campaign, model, classes, terms)
    return bench._at_likely_settings(bench.forward.null()) if _finite(bench.shapes, bench.shared) else bench


def predict_alone(campaign: Campaign, model: Composition) -> np.ndarray:
    """What ``model`` by itself says of all runs (R, S, n), their settings where they most likely were."""
    bench, stated = _lay_out_as_stated(campaign, model, ())
    if not _finite(bench.shapes, bench.shared):
        return stated
    found = bench.forward_at_likely_settings(bench.forward.null()).values(bench.forward.null()[None])[0]
    return found if np.isfinite(found).all() else stated


def _lay_out_as_stated(
    campaign: Campaign,
    model: Composition,
    classes: Sequence[type[Effect]],
    terms: Mapping[str, int] | None = None,
) -> tuple[Workbench, np.ndarray]:
    """The workbench with settings as they are stated, and what the model by itself says there."""
    samples = samples_of(campaign)
    march = march_error(samples, model, _noise_only(samples))
    forward = Forward(samples, model, classes, march.step, terms)
    vector = forward.null()
    shapes, shared, values = _shapes(campaign, samples, forward, vector)
    turned = [k for k, s in enumerate(_sizes(forward)) if forward.slots[s].effect.comes_round]
    reachable = _candidate_shapes(forward, vector)
    coming_round = reachable[turned] if any(run.start_u for run in samples.runs) else None
    finder = LevelFinder(samples, shapes, np.concatenate([shared, reachable]), coming_round)
    levels = finder(samples.y - values)
    blank = np.array([run.use != "fit" for run in samples.runs])
    fitted = replace(samples, y=np.where(blank[:, None, None], np.nan, samples.y))
    metric = metric_of(fitted, levels, shapes, shared)
    terms = choose_harmonics(forward, fitted, metric.roots, values) if terms is None else forward.terms
    if terms != forward.terms:
        forward = Forward(samples, model, classes, march.step, terms)
    bench = Workbench(
        campaign=campaign,
        samples=samples,
        fitted=fitted,
        forward=forward,
        levels=levels,
        finder=finder,
        shapes=shapes,
        shared=shared,
        metric=metric,
        march=march,
    )
    return bench, values


def _finite(*arrays: np.ndarray) -> bool:
    """Whether all are: a belt may run away."""
    return all(bool(np.isfinite(x).all()) for x in arrays)


def _noise_only(samples: Samples):
    """Whitening by the stated noise, every setting taken as exact."""
    still = np.zeros_like(samples.y)
    return metric_of(samples, Levels(), still[None], still[None]).whiten


def _shapes(
    campaign: Campaign, samples: Samples, forward: Forward, vector: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    directions = np.eye(forward.size)[-len(NUISANCES) :]
    asked = len(NUISANCES) if any(run.start_u for run in samples.runs) else NUISANCES.index("start")
    values, slopes = forward.values_and_slopes(np.repeat(vector[None], asked, axis=0), directions[:asked])
    slopes[1] /= 1.0 + forward.tension[:, None, None]
    return *nuisance_shapes(campaign, samples, values[0], slopes), values[0]


def _candidate_shapes(forward: Forward, vector: np.ndarray) -> np.ndarray:
    """What candidates could do to the readings (k, R, S, n): derivatives, and what a plausible size of each does."""
    sizes = _sizes(forward)
    along = np.eye(forward.size)[sizes]
    sized = along[~forward.linear[sizes]]
    starts, still = np.repeat(vector[None], len(along), axis=0), 0.0 * sized
    values, slopes = forward.values_and_slopes(np.concatenate([starts, vector + sized]), np.concatenate([along, still]))
    secants = values[len(along) :] - values[0] if len(along) else slopes
    return np.concatenate([slopes[: len(along)], secants[np.isfinite(secants).all(axis=(1, 2, 3))]])


def _sizes(forward: Forward) -> list[int]:
    """Positions of all numbers that do something by themselves."""
    return [k for k, s in enumerate(forward.slots) if not s.only_shapes]
