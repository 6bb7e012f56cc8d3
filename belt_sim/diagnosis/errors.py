"""Errors of a model on a campaign: on left-out conditions, run by run, where they are largest; and drawn."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from statistics import NormalDist

import numpy as np

from belt_sim.curves import Curves, late_rates
from belt_sim.diagnosis.fit import Fit, bounded_step, fit_sets, step_bounds
from belt_sim.diagnosis.noise import metric_of, zero_sigmas
from belt_sim.diagnosis.plausibility import prior_sigma
from belt_sim.diagnosis.samples import Samples, zero_is_read
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.jax_setup import map_in_threads
from belt_sim.results.errors import (
    UNIT_OF_KIND,
    Change,
    Drawings,
    Drift,
    Errors,
    FailureMap,
    OwnChange,
    Panel,
    RunError,
    Where,
    Worst,
)
from belt_sim.results.words import KILO
from belt_sim.units import DEGREE, N_PER_MM2

# Held-out error: whole conditions (a tension, a sign of yaw) are left out, the rest is refitted, they are predicted.
#
# Refits are one Gauss-Newton step from the joint fit, which is exact for effects that enter linearly. Before any
# reading a parameter is known as well as a real machine allows (plausibility.prior_sigma), and harmonics as well as
# they fall (prior_of_fit): what only the left-out runs show falls back to null; a condition is untestable where the
# rest does not know what the effects do to it.

HARMONIC_SIZES = np.geomspace(1e-3, 1e3, 121)  # of harmonics, that are tried beside a typical number and its sigma
# what the numbers do to left-out readings is known from the other runs when its u is below this share of what it was
# before any, and below its size: what may as well be nothing, or twice as much, says nothing
KNOWN_EFFECT = 0.5
LARGEST_YAW_SHARE = 0.9  # of the largest yaw, from which a yaw counts as the largest
ALL_RUNS = "all"  # the one condition of runs that are alike, which leaves none to predict them
VISIBLE = 2.0  # sigma by which left-out readings have to be uncertain before anybody asks who knows them


@dataclass(frozen=True)
class Condition:
    """One condition left out: -2 log of the density that the rest predicted for it (surprise; without free parameters
    the squared length of the whitened error), its runs out (R,), all their errors (r, S, n), those of lateral readings
    (m,) [m], and whether the rest knows what the numbers do there: else leaving it out tests nothing.
    """

    surprise: float
    out: np.ndarray
    errors: np.ndarray
    lateral: np.ndarray
    testable: bool


def lateral_rms(left_out: Iterable[Condition]) -> float:
    """rms [m] of the lateral errors of some conditions; nan where there are none."""
    errors = np.concatenate([c.lateral for c in left_out])
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")


def conditions(bench: Workbench) -> dict[str, np.ndarray]:
    """Name -> which runs (R,) it leaves out: every tension, every sign of yaw, the largest yaws where there are smaller
    ones, and the runs marked hold_out.

    The lowest and the highest tension and the largest yaw ask for an extrapolation, in which a wrong law shows first.
    """
    runs = bench.samples.runs
    fitted = np.array([r.use == "fit" for r in runs])
    tension = np.array([r.tension for r in runs])
    sign = np.array([np.sign(r.yaw) for r in runs])
    found = {f"{t / 1e6:g} N/mm2": (tension == t) & fitted for t in np.unique(tension)}
    found |= {f"yaw {'+' if s > 0 else '-' if s < 0 else '0'}": (sign == s) & fitted for s in np.unique(sign)}
    size = np.abs([r.yaw for r in runs])
    large = size > LARGEST_YAW_SHARE * np.max(size[fitted], initial=0.0)
    if np.any(fitted & ~large & (size > 0.0)):
        found["largest yaw"] = large & fitted
    kept = {n: m for n, m in found.items() if m.any() and not m[fitted].all()}
    if not fitted.all():
        kept["hold_out"] = ~fitted
    return kept or {ALL_RUNS: fitted}


def held_out(bench: Workbench, fit: Fit) -> dict[str, Condition]:
    """Prediction error of ``fit`` on each condition when that condition is left out."""
    samples, count = bench.samples, len(fit.free)
    allowed, sigma, away = prior_of_fit(bench, fit)
    space = step_bounds(fit, bench.forward.sides)
    blocks = fit.residual.reshape(len(samples.runs), -1)
    columns = fit.columns.reshape(count, *blocks.shape)
    lateral = np.array([s.kind == "lateral" for s in samples.signals])
    found = {}
    for name, out in conditions(bench).items():
        here, rest = (columns[:, m].reshape(count, blocks[m].size) for m in (out, ~out))
        # A step to the fit of the other runs with the prior, and a root of its covariance: rows are what one sigma of
        # independent combinations adds to the numbers. What a machine has on one side of null only stays there.
        scale = 1.0 / np.sqrt(np.sum(rest**2, axis=1) + sigma**-2.0)
        information = (rest @ rest.T + np.diag(sigma**-2.0)) * np.outer(scale, scale)
        values, vectors = np.linalg.eigh(information)
        root = (vectors / np.sqrt(np.maximum(values, 1e-12))).T * scale
        along = rest @ blocks[~out].ravel() - away / sigma**2
        step = root.T @ (root @ along)
        if np.any((step < space[0]) | (step > space[1])):
            step = scale * bounded_step(information, scale * along, space[0] / scale, space[1] / scale)

        # r^T (I + S^T S)^-1 r + log det(I + S^T S) of whitened errors r, to which one sigma of each combination adds S
        seen, left = root @ here, blocks[out].ravel() - step @ here
        total, along = np.eye(len(seen)) + seen @ seen.T, seen @ left
        errors = samples.y[out] - fit.values[out] - np.einsum("k,krsn->rsn", step, fit.slopes[:, out])
        found[name] = Condition(
            surprise=float(left @ left - along @ np.linalg.solve(total, along) + np.linalg.slogdet(total)[1]),
            out=out,
            errors=errors,
            lateral=errors[np.isfinite(samples.y[out]) & lateral[None, :, None]],
            testable=_is_known(here, root, allowed, away, [bench.forward.slots[k].effect.id for k in fit.free]),
        )
    return found


def prior_of_fit(bench: Workbench, fit: Fit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the free numbers (k,) of a fit: one sigma before any reading, the same as harmonics fall, and how far off null
    they are; all in units of their scales.

    The many harmonics of a linear effect fall as their scales do, all together. Nobody knows how straight a belt's edge
    is, but a belt of which thirty numbers hardly show has none of millimetres: refits that may take each number for
    anything a machine allows predict such an edge worse than no edge at all. So they are Gaussian with a common size,
    that at which the numbers as they were fitted are likeliest.
    """
    allowed = prior_sigma(bench.forward, fit.free)
    away = fit.vector[fit.free] - bench.forward.null()[fit.free]
    slots, sigma = [bench.forward.slots[k] for k in fit.free], allowed.copy()
    for cls in {s.effect for s in slots if s.effect.is_additive()}:
        rows = np.array([s.effect is cls for s in slots])
        square, own = away[rows] ** 2, np.diag(fit.covariance)[rows]
        tried = HARMONIC_SIZES * np.sqrt(np.median(own) + np.median(square))
        total = tried[:, None] ** 2 + own
        size = tried[np.argmin(np.sum(square / total + np.log(total), axis=1))]
        sigma[rows] = np.minimum(allowed[rows], size)
    return allowed, sigma, away


def _is_known(here: np.ndarray, root: np.ndarray, sigma: np.ndarray, away: np.ndarray, owners: Sequence[str]) -> bool:
    """Whether the other runs know what the numbers do to the left-out readings ``here`` (k, m): better than any machine
    does, and better than to within the whole of it.

    Numbers that are known together only (an offset and a gain of the tension) may each be unknown in that. But what
    every effect does has to be known, of which the numbers ``owners`` (k,) are, or else all of them together as well as
    that: beside an edge of a thousand sigma nobody sees that the others know nothing of a crown.
    """
    off = float(np.linalg.norm(root @ here))
    if off < VISIBLE:
        return True
    for name in set(owners):
        own = np.array([o == name for o in owners])
        least = float(np.linalg.norm(root[:, own] @ here[own]))
        before = float(np.linalg.norm(sigma[own, None] * here[own]))
        whole = float(np.linalg.norm(away[own] @ here[own]))
        if least >= VISIBLE and min(off, least) >= min(KNOWN_EFFECT * before, whole):
            return False
    return True


# The error of a model against a campaign, run by run and over all, beside what the uncertainties alone make it; and
# where it fails, by tension, yaw sign, travel window and signal.
#
# ASME V&V 20: E = model - measurement; u_val from noise, zero, gain, settings, stiffness and the march's step; |E| <= k
# u_val means that the comparison cannot say more. k = 2 for one cell; a statement about many cells takes the k that all
# of them together exceed by chance in one comparison of twenty.


K = 2.0
WINDOWS = 6


@dataclass(frozen=True)
class ErrorMap:
    """Error E of predictions in every run, signal and travel window, each (R, S, W) and nan where nothing was measured.

    rms [m or rad]; ratio: of that to the rms of u_val, with the sign of the mean error; edges (W + 1,) of windows [m].
    """

    samples: Samples
    edges: np.ndarray
    rms: np.ndarray
    ratio: np.ndarray


def validation_uncertainty(bench: Workbench) -> np.ndarray:
    """u_val, one sigma, of every sample, shape (R, S, n) [m or rad]."""
    samples, noise = bench.samples, _noise_variance(bench)
    shapes = np.sum(bench.shapes**2, axis=0)
    for s, signal in enumerate(samples.signals):  # a zero that is read off the record is as uncertain as a reading
        read = zero_is_read(samples, signal)
        shapes[read, s] += (noise[:, s] - zero_sigmas(samples, signal) ** 2)[read, None]
    return np.sqrt(noise[..., None] + np.maximum(shapes, 0.0) + np.sum(bench.shared**2, axis=0) + bench.march_error**2)


def _noise_variance(bench: Workbench) -> np.ndarray:
    """Variance of the noise in every run and signal (R, S), white and wander."""
    samples, levels = bench.samples, bench.levels
    white = np.asarray(levels.white) * [s.white for s in samples.signals]
    wander = np.asarray(levels.wander) * [s.wander_sd for s in samples.signals]
    return white**2 / samples.per_bin[:, None] + wander**2


def error_map(bench: Workbench, values: np.ndarray) -> ErrorMap:
    """Where predictions ``values`` (R, S, n) are off."""
    samples, u_val = bench.samples, validation_uncertainty(bench)
    edges, errors = np.linspace(0.0, samples.end, WINDOWS + 1), values - samples.y
    rms, ratio = np.full((2, *samples.y.shape[:2], WINDOWS), np.nan)
    for r, s, w in np.ndindex(rms.shape):
        error, travel = errors[r, s], samples.travel[r]
        inside = (travel >= edges[w]) & (travel <= edges[w + 1]) & np.isfinite(error)
        if inside.any():
            rms[r, s, w] = _rms(error[inside])
            ratio[r, s, w] = np.copysign(rms[r, s, w] / _rms(u_val[r, s][inside]), np.mean(error[inside]))
    return ErrorMap(samples, edges, rms, ratio)


def locate_failure(found: ErrorMap, model: str, *, faulty: bool = False) -> Where:
    """The worst cell, the tension at which ``model`` (as a sentence begins with it) stops being adequate, and both in
    a sentence.

    faulty: a fault was found, which acts at every tension, so that the model is adequate at none.
    """
    there, ratio = np.isfinite(found.rms), np.abs(found.ratio)
    count = int(there.sum())
    r, s, w = np.unravel_index(np.nanargmax(ratio), ratio.shape)
    run, signal, worst = found.samples.runs[r], found.samples.signals[s], float(ratio[r, s, w])
    low, high = found.edges[w : w + 2].tolist()
    k = -NormalDist().inv_cdf(0.025 / count)  # no normal error of so many is larger, with probability 95 %
    sign = "> 0" if run.yaw > 0.0 else "< 0" if run.yaw < 0.0 else "= 0"
    travel = f"{low:.0f}-{high:.0f} m" if high - low > 1.0 else f"{low:.1f}-{high:.1f} m"
    place = f"{signal.name} of run {run.name} ({run.tension / N_PER_MM2:g} N/mm2, yaw {sign}, {travel})"
    if worst <= k:
        said = f"Nowhere beyond the uncertainty of the comparison; most in {place}: {worst:.1f} times the uncertainty, "
        said += f"as chance may give in one of {count} places."
    else:
        size = f"{KILO * found.rms[r, s, w]:.2g} {UNIT_OF_KIND[signal.kind]}"
        said = f"Worst in {place}: off by {size}, {worst:.0f} times the measurement uncertainty."

    tension = np.array([run.tension for run in found.samples.runs]) / N_PER_MM2
    tensions = np.unique(tension[there.any(axis=(1, 2))])
    ratios = np.array([np.nanmax(ratio[tension == t]) for t in tensions])
    good, at = ratios <= k, None
    span = " to ".join(f"{t:g}" for t in dict.fromkeys([tensions[0], tensions[-1]])) + " N/mm2"
    bad = ", ".join(f"{t:g}" for t, fits in zip(tensions, good, strict=True) if not fits)
    flips = np.flatnonzero(np.diff(good.astype(int)))
    if good.all():
        words = f"Cell by cell within the uncertainty of the comparison at every tension measured ({span})."
    elif not good.any():
        words = f"{model} is off at every tension measured ({span})."
    elif faulty:
        words = f"{model} is off beyond the uncertainty at {bad} N/mm2; what was found acts at every tension."
    elif len(flips) > 1:
        words = f"{model} is off at {bad} N/mm2."
    else:  # errors between two tensions by a power law
        n = int(flips[0])
        part = (np.log(k) - np.log(ratios[n])) / (np.log(ratios[n + 1]) - np.log(ratios[n]))
        at = float(np.exp(np.log(tensions[n]) + part * np.log(tensions[n + 1] / tensions[n])))
        off, rely = ("below", "above") if good[-1] else ("above", "below")
        limit = f"errors up to {k:.1f} times their uncertainty; measured at {span}"
        words = f"{model} is off {off} {at:.3g} N/mm2: rely on it {rely} only ({limit})."
    return Where(
        worst=Worst(run=run.name, signal=signal.name, travel=(low, high), ratio=worst),
        sentence=said,
        boundary=None if at is None else at * N_PER_MM2,
        boundary_sentence=words,
    )


# Errors of every run, and over all.

LEAST_READINGS = 5  # of a record that has a late rate
WORSE_THAN_FLOOR = 1.5  # a run counts as worse only beyond this many times its floor


def late_rate(travel: np.ndarray, y: np.ndarray) -> float | None:
    """Late rate of one record [m/m or rad/m] against travel [m], both (n,); None with too few readings."""
    read = np.isfinite(y)
    return float(late_rates(Curves(travel=travel[read], y=y[None, read]))[0]) if read.sum() >= LEAST_READINGS else None


def run_errors(bench: Workbench, before: np.ndarray, after: np.ndarray) -> tuple[RunError, ...]:
    """Every run and signal that was measured; before and after (R, S, n) are predictions."""
    floor = validation_uncertainty(bench)
    rows = []
    for r, (run, travel) in enumerate(zip(bench.samples.runs, bench.samples.travel, strict=True)):
        own = np.append(True, np.diff(travel) > 0.0)  # a shorter record is filled up with its last travel
        for s, signal in enumerate(bench.samples.signals):
            y = bench.samples.y[r, s]
            if not np.isfinite(y).any():
                continue
            first, then = (_rms(y - values[r, s]) for values in (before, after))
            least = _rms(np.where(np.isfinite(y), floor[r, s], np.nan))
            rows.append(
                RunError(
                    run=run.name,
                    signal=signal.name,
                    kind=signal.kind,
                    tension=run.tension,
                    yaw=run.yaw,
                    use=run.use,
                    before=first,
                    after=then,
                    floor=least,
                    worse=bool(then > first and then > WORSE_THAN_FLOOR * least),
                    measured_rate=late_rate(travel[own], y[own]),
                    modelled_rate=late_rate(travel[own], after[r, s, own]),
                )
            )
    return tuple(rows)


def overall_errors(bench: Workbench, before: np.ndarray, after: np.ndarray) -> Errors | None:
    """rms of the lateral signals before and after, over fitted and hold-out runs, and the noise floor.

    None when there is no lateral signal.
    """
    samples = bench.samples
    there = np.isfinite(samples.y) & np.array([s.kind == "lateral" for s in samples.signals])[None, :, None]
    if not there.any():
        return None
    fitted = np.array([r.use == "fit" for r in samples.runs])[:, None, None]
    first, then = samples.y - before, samples.y - after
    fit, held = (
        Change(before=_rms(first[kept]), after=_rms(then[kept])) if kept.any() else None
        for kept in (there & fitted, there & ~fitted)
    )
    return Errors(noise_floor=_rms(validation_uncertainty(bench)[there]), fit=fit, held_out=held)


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(x**2))) if x.size else float("nan")


# Errors once every run's own zero, gain and settings, and the belt's stiffness, are what they most likely are.
#
# A sensor's zero or a tension one sigma off moves a whole record by more than most effects do, and no effect can take
# that away: in plain rms a right effect may even make it larger. So what is told of an error before and after is what
# the readings do not ascribe to these, each within its stated uncertainty (the mean of its posterior, run by run); and
# the noise floor is what a perfect model would leave of it.


class ErrorsWithoutNuisances:
    """Nuisances of every run of a workbench, and what remains beside them.

    shapes (K, R, S, n): in units of one sigma; posterior (R, K, K): their covariance after readings; taken
    (R, K, S, n): how much of each a reading stands for; floor: rms of the lateral errors of a perfect model [m].
    """

    def __init__(self, bench: Workbench) -> None:
        samples, metric = bench.samples, bench.metric
        if any(r.use != "fit" for r in samples.runs):  # the metric is blind to runs that were held out
            metric = metric_of(samples, bench.levels, bench.shapes, bench.shared)
        self.shapes = np.concatenate([bench.shapes, bench.shared])
        columns = metric.noise_white(self.shapes).swapaxes(0, 1)  # (R, K, S * n)
        self.posterior = np.linalg.inv(columns @ columns.swapaxes(1, 2) + np.eye(len(self.shapes)))
        runs, signals, n = samples.y.shape
        onto = (self.posterior @ columns).reshape(runs, -1, signals, 1, n)
        each = zip(onto, metric.which, strict=True)
        self.taken = np.stack([np.matmul(own, metric.roots[which])[..., 0, :] for own, which in each])
        lateral = np.array([s.kind == "lateral" for s in samples.signals])
        self.there = np.isfinite(samples.y) & lateral[None, :, None]
        known = np.einsum("krsn,rkl,lrsn->rsn", self.shapes, self.posterior, self.shapes)
        variance = np.maximum(_noise_variance(bench)[..., None] - known, 0.0)
        self.floor = _rms(np.sqrt(variance + bench.march_error**2)[self.there])

    def remove_nuisances(self, errors: np.ndarray, runs: np.ndarray) -> np.ndarray:
        """Errors (r, S, n) of some runs (R,) without what their nuisances most likely make of them."""
        size = np.einsum("rksn,rsn->rk", self.taken[runs], np.where(np.isfinite(errors), errors, 0.0))
        return errors - np.einsum("rk,krsn->rsn", size, self.shapes[:, runs])

    def rms(self, left_out: Iterable[Condition]) -> float:
        """Of the lateral errors of held-out conditions [m]."""
        return _rms(np.concatenate([self.remove_nuisances(c.errors, c.out)[self.there[c.out]] for c in left_out]))


def errors_of(base_bench: Workbench, base: Fit, bench: Workbench, fit: Fit) -> Errors:
    """The fall of the error from ``base`` to ``fit``, each on its workbench, over conditions that hold-out can test."""
    over_all = overall_errors(bench, base.values, fit.values)
    assert over_all is not None  # a diagnosis has a lateral signal
    own, without, left_out = ErrorsWithoutNuisances(bench), held_out(base_bench, base), held_out(bench, fit)
    untestable = tuple(name for name, c in left_out.items() if not c.testable)
    tested = [name for name in left_out if name not in untestable] or list(left_out)
    before, after = ([held[name] for name in tested] for held in (without, left_out))
    return replace(
        over_all,
        held_out=Change(before=lateral_rms(before), after=lateral_rms(after)),
        by_condition={
            name: Change(before=lateral_rms([without[name]]), after=lateral_rms([c])) for name, c in left_out.items()
        },
        untestable=untestable,
        own=OwnChange(before=own.rms(before), after=own.rms(after), floor=own.floor),
    )


# What a comparison or a diagnosis has to draw, in the units people read: overlays, maps, drift charts.


def overlays(bench: Workbench, base: np.ndarray, final: np.ndarray | None) -> tuple[Panel, ...]:
    """One panel a run and signal; base and final (R, S, n) are predictions before and after."""
    band = K * validation_uncertainty(bench)
    panels = []
    for r, run in enumerate(bench.samples.runs):
        for s, signal in enumerate(bench.samples.signals):
            keep = np.isfinite(bench.samples.y[r, s])
            if not keep.any():
                continue
            title = f"{run.name} {signal.name}, {run.tension / N_PER_MM2:g} N/mm², {run.yaw / DEGREE:+.3g}°"
            panels.append(
                Panel(
                    run=run.name,
                    title=title + ("" if run.use == "fit" else ", held out"),
                    travel=bench.samples.travel[r][keep],
                    measured=bench.samples.y[r, s][keep] * KILO,
                    base=base[r, s][keep] * KILO,
                    band=band[r, s][keep] * KILO,
                    final=None if final is None else final[r, s][keep] * KILO,
                    unit=UNIT_OF_KIND[signal.kind],
                )
            )
    return tuple(panels)


#: Tensions that a map or a chart tells apart.
MOST_LEVELS = 12


def tension_levels(tension: np.ndarray) -> np.ndarray:
    """Tension (n,) that each is drawn at: its own, or of more than MOST_LEVELS the mean of those close to it."""
    if len(np.unique(tension)) <= MOST_LEVELS:
        return tension
    edges = np.geomspace(tension.min(), tension.max(), MOST_LEVELS + 1)[1:-1]
    level = np.searchsorted(edges, tension)
    number = np.maximum(np.bincount(level), 1)
    return (np.bincount(level, weights=tension) / number)[level]


def drawings(
    bench: Workbench, before: np.ndarray, after: np.ndarray | None, mapped: np.ndarray, *drifts: Drift | None
) -> Drawings:
    """before, after: predictions (R, S, n) without and with effects; mapped: predictions that the maps judge, E/u_val
    over tension and travel windows, one map a signal and yaw sign; drifts: as of ``stiffness_drift``."""
    found, runs, maps = error_map(bench, mapped), bench.samples.runs, []
    there, level = np.isfinite(found.rms), np.full(found.rms.shape, np.nan)
    level[there] = tension_levels(np.array([runs[r].tension / N_PER_MM2 for r in np.nonzero(there)[0]]))
    signs, ways = np.sign([run.yaw for run in runs]), ((1, "yaw > 0"), (-1, "yaw < 0"), (0, "yaw = 0"))
    for (s, signal), (sign, name) in product(enumerate(bench.samples.signals), ways):
        own = there[:, s] & (signs == sign)[:, None]
        tensions = np.unique(level[:, s][own])
        if not len(tensions):
            continue
        worst = np.full((len(tensions), WINDOWS), np.nan)
        for r, w in np.argwhere(own):
            row = np.searchsorted(tensions, level[r, s, w])
            if not abs(worst[row, w]) > abs(found.ratio[r, s, w]):  # of repeated runs
                worst[row, w] = found.ratio[r, s, w]
        maps.append(FailureMap(title=f"{signal.name}, {name}", tension=tensions, edges=found.edges, ratio=worst))
    drifted, machine = tuple(drift for drift in drifts if drift is not None), bench.machine
    return Drawings(overlays=overlays(bench, before, after), maps=tuple(maps), drifts=drifted, machine=machine)


GPA = 1e9
LIMIT = 3.0  # a model that asks for more than three times the stated value, or less than a third, is shown there


def stiffness_drift(bench: Workbench, vector: np.ndarray) -> Drift | None:
    """Young's modulus [GPa] that each level of tension asks for by itself; None with fewer than two tensions.

    Only F/EI enters a beam: a wrong tension, width or thickness shows here as well.
    """
    stress = tension_levels(np.array([r.tension for r in bench.samples.runs]))
    tensions = np.unique(stress)
    if len(tensions) < 2 or not bench.forward.model.moments:
        return None
    stated = bench.campaign.belt.youngs_modulus
    position = len(bench.forward.slots)

    def fitted(t: float) -> tuple[float, float]:
        which = np.flatnonzero(stress == t)
        own = bench.fitted.of_runs(which)
        metric = metric_of(own, bench.levels, bench.shapes[:, which], 0.0 * bench.shared[:, which])
        fit = fit_sets(bench.forward.of_runs(which), metric, [bench.start((), vector, free=[position])])[0]
        factor = np.clip(1.0 + fit.vector[position], 1.0 / LIMIT, LIMIT)
        beyond = factor in (1.0 / LIMIT, LIMIT)  # no interval is drawn about a value off the chart
        return factor, 0.0 if beyond else min(np.sqrt(fit.covariance[0, 0]), 0.5 * factor)

    # marches of a few rows leave a core idle
    value, u = (np.array(map_in_threads(fitted, tensions)) * stated.value / GPA).T
    return Drift(
        parameter="Young's modulus",
        unit="GPa",
        tension=tensions / N_PER_MM2,
        value=value,
        u=u,
        stated=stated.value / GPA,
        u_stated=stated.u / GPA,
    )
