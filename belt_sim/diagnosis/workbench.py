"""Everything a diagnosis works with: readings, the model with all candidates in reach, noise levels, metric."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.campaign import Campaign, case_of
from belt_sim.diagnosis.fit import EarlyStopping, Fit, Sides, fit_sets
from belt_sim.diagnosis.forward import NUISANCES, STEP, Forward, significant_harmonics
from belt_sim.diagnosis.noise import LevelFinder, Levels, Metric, length_sigma, metric_of, nuisance_shapes
from belt_sim.diagnosis.samples import Samples, samples_of
from belt_sim.effects.base import Effect
from belt_sim.line.spans import Composition
from belt_sim.results.estimates import MachineSizes


@dataclass(frozen=True, kw_only=True)
class Workbench:
    """A campaign laid out for a model.

    samples: every run; fitted: the same with hold-out runs blanked; shapes, shared: nuisances at the current point;
    metric judges the fitted runs; march_error (R, S, n): what the step of the march leaves; keeps_noise: levels are not
    read anew where it is moved to.
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
    march_error: np.ndarray | float = 0.0
    keeps_noise: bool = False

    @property
    def machine(self) -> MachineSizes:
        """The sizes of the machine in which people read numbers of effects."""
        case = case_of(self.campaign, self.samples.runs[0])
        rig = {n: float(getattr(case.rig, n)) for n in ("centre_distance", "tail_radius", "head_radius", "span_length")}
        return MachineSizes(width=float(case.belt.width), **rig)

    def moved_to(self, vector: np.ndarray) -> "Workbench":
        """The workbench with noise levels and nuisance shapes taken at ``vector``, and every run's settings near it.

        Itself where a belt runs away at ``vector``, or a hair beside it.
        """
        here = self.laid_out_by(self.forward, vector)
        likely = self.forward if here is self else expand_at_likely_settings(here, vector)
        return here if likely is here.forward else here.laid_out_by(likely, vector)

    def laid_out_by(self, forward: Forward, vector: np.ndarray) -> "Workbench":
        """The workbench with nuisances as they are at ``vector``: what settings did to one of two repeats is not noise.

        Itself where a belt runs away there.
        """
        shapes, shared, values = _nuisances_at(self.campaign, self.samples, forward, vector)
        if not all(np.isfinite(x).all() for x in (shapes, shared, values)):
            return self
        # one of two repeats may have been set 3 sigma off the other, and what they leave follows the shapes there
        own = self.finder
        finder = own if self.keeps_noise else LevelFinder(own.samples, shapes, own.columns, own.coming_round)
        levels = self.levels if self.keeps_noise else finder(self.samples.y - values)
        metric = metric_of(self.fitted, levels, shapes, shared)
        return replace(self, forward=forward, shapes=shapes, shared=shared, finder=finder, levels=levels, metric=metric)

    def start(self, ids: Sequence[str], vector: np.ndarray, free: Sequence[int] | None = None) -> Fit:
        """A fit of the effects ``ids`` to begin at ``vector``."""
        positions = [k for i in ids for k in self.forward.index(i)] if free is None else list(free)
        return Fit(ids=tuple(ids), free=positions, vector=np.array(vector))

    def fit(
        self, starts: Sequence[Fit], find_hopeless: EarlyStopping | None = None, sides: Sides | None = None
    ) -> list[Fit]:
        """Joint refits on the fitted runs."""
        return fit_sets(self.forward, self.metric, starts, find_hopeless, sides)


MARCH_ERROR = 0.1  # length of the march's error, whitened over the whole campaign: noise alone has one per reading
STEP_HALVINGS = 3
ORDER = 4.0  # error of a step over that of half the step: the march is of second order


def workbench(
    campaign: Campaign, model: Composition, classes: Sequence[type[Effect]], terms: Mapping[str, int] | None = None
) -> Workbench:
    """Lay out ``campaign`` for ``model`` with ``classes`` as candidates.

    terms: effect id -> harmonics that are fitted; by default as many as show.
    """
    samples = samples_of(campaign)
    still = np.zeros((1, *samples.y.shape))
    exact = metric_of(samples, Levels(), still, still)  # every setting is
    # The step is the longest, of STEP and its halves, whose error is no longer than MARCH_ERROR: with all effects null,
    # for the program that other predictions need as well, steps twice as long among them where no wrap is shorter.
    fine, wraps = Forward(samples, model, classes), (samples.cases.rig.wrap_head, samples.cases.rig.wrap_tail)
    if doubles := min(map(np.min, wraps)) > 2.0 * STEP:
        coarse = Forward(samples, model, classes, 2.0 * STEP, room=fine.room)
    else:
        coarse, fine = fine, Forward(samples, model, classes, STEP / 2.0)
    at_coarse, at_fine = (f.values(f.null()[None])[0] for f in (coarse, fine))
    error = (at_coarse - at_fine) / (ORDER - 1.0) * (1.0 if doubles else ORDER)
    size = float(np.linalg.norm(exact.whiten(error)))
    wanted = 0 if size <= MARCH_ERROR else int(np.ceil(np.log(size / MARCH_ERROR) / np.log(ORDER)))
    halvings = min(wanted, STEP_HALVINGS)
    step, error = STEP / 2**halvings, ORDER**-halvings * error
    forward = Forward(samples, model, classes, step, terms)
    null = forward.null()
    shapes, shared, values = _nuisances_at(campaign, samples, forward, null)
    # what candidates could do to the readings (k, R, S, n): derivatives, and what a plausible size of each does
    sizes = [k for k, s in enumerate(forward.slots) if not s.parameter.modifier]
    along = np.eye(forward.size)[sizes]
    sized = along[~forward.linear[sizes]]
    points = np.concatenate([np.repeat(null[None], len(along), axis=0), null + sized])
    there, slopes = forward.values_and_slopes(points, np.concatenate([along, 0.0 * sized]))
    secants = there[len(along) :] - there[0] if len(along) else slopes
    reachable = np.concatenate([slopes[: len(along)], secants[np.isfinite(secants).all(axis=(1, 2, 3))]])
    turned = [k for k, s in enumerate(sizes) if forward.slots[s].effect.comes_round]
    coming_round = reachable[turned] if any(run.start_u for run in samples.runs) else None
    finder = LevelFinder(samples, shapes, np.concatenate([shared, reachable]), coming_round)
    levels = finder(samples.y - values)
    blank = np.array([run.use != "fit" for run in samples.runs])
    fitted = replace(samples, y=np.where(blank[:, None, None], np.nan, samples.y))
    metric = metric_of(fitted, levels, shapes, shared)
    if terms is None:  # as many harmonics of every additive effect as the readings call for
        of_class = {c: forward.columns_of(c, null) for c in forward.classes if c.is_additive()}
        left, roots = fitted.y - values, metric.roots[metric.which]
        terms = {c.id: significant_harmonics(fitted, roots, shapes, left) for c, shapes in of_class.items()}
    if terms != forward.terms:
        forward = Forward(samples, model, classes, step, terms)
    bench = Workbench(
        campaign=campaign, samples=samples, fitted=fitted, forward=forward, levels=levels, finder=finder,
        shapes=shapes, shared=shared, metric=metric, march_error=error,
    )  # fmt: skip
    if not (np.isfinite(shapes).all() and np.isfinite(shared).all()):  # a belt runs away
        return bench
    likely = expand_at_likely_settings(bench, forward.null())
    return bench if likely is forward else bench.laid_out_by(likely, forward.null())


def linear_response(
    campaign: Campaign, model: Composition, classes: Sequence[type[Effect]], *, planned: bool
) -> tuple[Workbench, Fit]:
    """The campaign on the workbench with nothing wrong, and the derivatives of its readings along every parameter.

    Noise is as stated; of a measured campaign with repeats, as these show it.
    """
    samples = samples_of(campaign)
    forward = Forward(samples, model, classes)
    free = list(range(len(forward.slots)))
    values, slopes = forward.expand(forward.null(), range(forward.size))
    starts = start_shapes(forward, forward.null())
    shapes, shared = nuisance_shapes(campaign, samples, values, slopes[len(free) :], starts)
    finder = LevelFinder(samples, shapes)
    levels = finder(samples.y - values) if finder.repeats and not planned else Levels()
    bench = Workbench(
        campaign=campaign, samples=samples, fitted=samples, forward=forward, levels=levels, finder=finder,
        shapes=shapes, shared=shared, metric=metric_of(samples, levels, shapes, shared),
    )  # fmt: skip
    own = slopes[: len(free)]
    fit = Fit(ids=(), free=free, vector=forward.null(), columns=bench.metric.whiten(own), slopes=own, values=values)
    return bench, fit


def _nuisances_at(
    campaign: Campaign, samples: Samples, forward: Forward, vector: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shapes of nuisances at ``vector`` as in ``nuisance_shapes``, and the predictions (R, S, n) there."""
    asked = len(NUISANCES) if any(run.start_u for run in samples.runs) else NUISANCES.index("start")
    values, slopes = forward.expand(vector, forward.nuisances[:asked])
    slopes[1] /= 1.0 + forward.tension[:, None, None]
    return *nuisance_shapes(campaign, samples, values, slopes, start_shapes(forward, vector)), values


#: A belt that ran before its record leans as yaws of the tail left it: of these lengths before it [spans], each of any
#: size that a machine has (one sigma) [rad].
HISTORIES, START_YAW = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0), 2e-3


def start_shapes(forward: Forward, vector: np.ndarray, running: Collection[str] | None = None) -> list[np.ndarray]:
    """What the unknown state of a running belt at the beginning of a record does to readings (R, S, n) each, in sigmas.

    A span's free movement after a yaw of length d, taken off before the record, is h(s + d) - h(s), by the response h
    to a step. Movements after HISTORIES span those after anything else. running: names of the runs (None: those whose
    ``run_in`` is not known); none without any.
    """
    samples = forward.samples
    names = [r.name for r in samples.runs if np.isnan(r.run_in)] if running is None else running
    if not names:
        return []
    span, count = float(np.max(samples.cases.rig.centre_distance)), len(samples.runs)
    which = np.tile(np.arange(count), len(HISTORIES) + 1)
    later = samples.of_runs(which)
    later = replace(later, travel=later.travel + span * np.repeat((0.0, *HISTORIES), count)[:, None])
    longer = Forward(later, forward.model, forward.classes, forward.step, forward.terms)
    longer = longer.set_to(forward.tension[which], forward.yaw[which], forward.longer)
    _, (yaw,) = longer.expand(vector, [longer.nuisances[NUISANCES.index("yaw")]])
    first, *moved = np.split(yaw, len(HISTORIES) + 1)
    own = START_YAW * np.array([r.name in names for r in samples.runs])[:, None, None]
    return [own * (m - first - (m - first)[..., :1]) for m in moved]


# How runs were really set, within what the campaign leaves open: tension, yaw, and the belt's length (Gauss-Newton).
#
# Predictions are taken where the runs most likely stood, and carried back to what is stated along the derivatives
# there. Errors then enter linearly to a higher order: on wide belts the second order of the settings alone is seen, and
# after a dozen turns that of the length, in the short waves of an edge.

OFF_SETTINGS = ("tension", "yaw", "belt_length")
SETTING_ROUNDS = 2
FURTHEST_SETTING = 2.5  # sigma: further off, what the model lacks is taken for a setting
SECOND_ORDER_SEEN = 0.1  # whitened length, below which the second order does not matter


def expand_at_likely_settings(bench: Workbench, vector: np.ndarray) -> Forward:
    """The model expanded where the runs were most likely set, at ``vector``; itself where that changes nothing."""
    forward, metric, shared, y = bench.forward, bench.metric, bench.shared, bench.fitted.y
    length = length_sigma(bench.campaign, float(np.max(forward.samples.cases.rig.belt_length)))
    sigma = np.array([bench.campaign.settings.tension_rel, bench.campaign.settings.yaw_u, length])
    before = forward.values(vector[None])[0]
    expanded, values = forward, before
    others, by_length = (shared[:-1], shared[-1]) if length > 0.0 else (shared, np.zeros_like(before))
    for _ in range(SETTING_ROUNDS):
        there = [c for c in forward.classes if c.is_additive() and np.any(vector[forward.index(c.id)])]
        shapes = [expanded.columns_of(c, vector) for c in there]
        free = np.concatenate([np.zeros((0, *y.shape)), *shapes])  # fitted to the length as it is
        # the belt's length in sigmas after the errors and the prior, whatever sizes the shapes in ``free`` have
        bare = replace(metric, shared=(metric.shared[0][:0], np.zeros(0)))
        every = np.concatenate([others, by_length[None]])
        white = np.concatenate([bare.whiten(every), bare.whiten(y - values)[None]])
        taken = np.linalg.qr(bare.whiten(free).T)[0]
        white -= (white @ taken) @ taken.T
        longer = np.linalg.solve(white[:-1] @ white[:-1].T + np.eye(len(every)), white[:-1] @ white[-1])[-1]
        longer = float(np.clip(longer, -FURTHEST_SETTING, FURTHEST_SETTING))
        # tension and yaw (2, R) in sigmas after the errors and the prior, all nuisances free
        columns = metric.noise_white(bench.shapes).swapaxes(0, 1)
        residual = metric.noise_white(y - values - longer * by_length)
        normal = columns @ columns.swapaxes(1, 2) + np.eye(len(bench.shapes))
        found = np.linalg.solve(normal, columns @ residual[..., None])[..., 0]
        off = np.clip(found[:, :2].T, -FURTHEST_SETTING, FURTHEST_SETTING)
        tension, yaw = sigma[:2, None] * off
        moved = forward.set_to(tension, yaw, length * longer)
        _, slopes = moved.expand(vector, [moved.nuisances[NUISANCES.index(name)] for name in OFF_SETTINGS])
        slopes[0] /= 1.0 + moved.tension[:, None, None]
        slopes *= sigma[:, None, None, None]
        by_length = slopes[2]
        expanded = moved
        expanded.offset = np.einsum("kr,krsn->rsn", off, slopes[:2]) + longer * by_length
        values = expanded.values(vector[None])[0]
    if not np.isfinite(values).all() or np.linalg.norm(metric.noise_white(values - before)) < SECOND_ORDER_SEEN:
        return forward
    return expanded
