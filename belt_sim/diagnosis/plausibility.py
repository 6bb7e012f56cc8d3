"""Numbers of a fit: whether a real machine could have them, and their intervals."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr

from belt_sim.diagnosis.fit import Fit, covariance_of, covariance_root, step_bounds
from belt_sim.diagnosis.forward import Forward, Slot
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.results.estimates import COVERAGE_95, Estimate

# One set of effects as a candidate explanation: its numbers, and whether a real machine could have them.


DIVERGED = 1e4  # times a parameter's scale: no optimum but a direction in which the readings say nothing
ROUNDED = 1e-9  # share of a bound, by which a number that a fit put there may have come out beside it
PLAUSIBLE_FACTOR = 2.0  # what a machine could have is a judgement, good to this factor


def estimates(forward: Forward, fit: Fit, *, every: bool = False) -> dict[str, dict[str, Estimate]]:
    """Effect id -> parameter -> Estimate, where the readings say more of a number than its plausible range does; every:
    of all numbers, whatever the readings say of them.
    """
    told: dict[str, dict[str, Estimate]] = {i: {} for i in fit.ids}
    slots, spread = [forward.slots[p] for p in fit.free], np.sqrt(np.diag(fit.covariance))
    for slot, estimate in _judge(slots, fit.vector[fit.free], spread):
        if every or is_constrained(slot, estimate):
            told[slot.effect.id][slot.name] = estimate
    return told


def is_constrained(slot: Slot, estimate: Estimate) -> bool:
    """Whether readings exclude something of what a machine could have."""
    (low, high), (least, most) = slot.parameter.plausible, estimate.interval_95
    return least > low or most < high


def _judge(slots: Sequence[Slot], values: np.ndarray, spread: np.ndarray) -> list[tuple[Slot, Estimate]]:
    """Numbers and their sigmas, given in units of their scales, each with whether a real machine could have it.

    What the only size of an effect is, its gain comes from. One of several may be hardly bound by the readings and far
    out at the best fit by chance, as what only shapes others: what a machine has then fits as well.
    """
    found = []
    sizes = Counter(s.effect.id for s in slots if not s.parameter.modifier)
    for slot, x, u in zip(slots, values, spread, strict=True):
        declared, (lowest, highest) = slot.parameter, plausible_bounds(slot)
        one_of_several = declared.modifier or sizes[slot.effect.id] > 1
        reach = COVERAGE_95 * u if one_of_several else 0.0
        there = lowest - reach <= x <= highest + reach or abs(x - declared.null / slot.scale) <= 2.0 * u
        found.append((slot, Estimate(float(x * slot.scale), float(u * slot.scale), declared.unit, bool(there))))
    return found


def plausible_bounds(slot: Slot) -> tuple[float, float]:
    """Lowest and highest that a number of a real machine could be, in units of its scale."""
    low, high = (bound - slot.parameter.null for bound in slot.parameter.plausible)
    lowest = low * PLAUSIBLE_FACTOR if low < 0.0 else low / PLAUSIBLE_FACTOR
    highest = high * PLAUSIBLE_FACTOR if high > 0.0 else high / PLAUSIBLE_FACTOR
    return (slot.parameter.null + lowest) / slot.scale, (slot.parameter.null + highest) / slot.scale


def is_plausible(forward: Forward, fit: Fit) -> bool:
    """True when all numbers could be met on a real machine: those that were found by what is known of them, the others
    as they are (``prefer_plausible`` fits them so where it can); none diverged.

    That an effect is there says its gain. Its numbers need not be known for that: of two that do the same only their
    sum is, of one that saturates only that it is large.
    """
    slots, spread = [forward.slots[p] for p in fit.free], np.sqrt(np.diag(fit.covariance))
    return not has_diverged(fit) and is_possible(slots, fit.vector[fit.free], spread, everywhere=True)


def is_possible(slots: Sequence[Slot], values: np.ndarray, spread: np.ndarray, everywhere: bool = False) -> bool:
    """The same of numbers (k,) and their sigmas (k,) in units of their scales; of what was not found only where
    ``everywhere``: in the linear range it may be anything as well.
    """
    seen = spread > 0.0
    for slot, e in _judge([s for s, there in zip(slots, seen, strict=True) if there], values[seen], spread[seen]):
        low, high = plausible_bounds(slot)
        lost = ROUNDED * max(abs(low), abs(high))  # on the way to a bound
        within = low - lost <= e.value / slot.scale <= high + lost
        if not (e.plausible if is_constrained(slot, e) else within or not everywhere):
            return False
    return True


def has_diverged(fit: Fit) -> bool:
    """True where a fit has left the range of numbers: what it says is no finding."""
    numbers = [fit.vector[fit.free], fit.values, np.array([fit.chi2])]
    return bool(any(not np.isfinite(x).all() for x in numbers) or np.any(np.abs(fit.vector[fit.free]) > DIVERGED))


def prior_sigma(forward: Forward, free: Sequence[int]) -> np.ndarray:
    """What is known of parameters before any reading: one sigma (k,) about null in units of their scales, from what a
    real machine could have.
    """
    declared = [forward.slots[position].parameter for position in free]
    return np.array([max(abs(bound - p.null) for bound in p.plausible) / p.scale for p in declared])


# Whether a machine that could be real explains the readings as well as the best fit does.
#
# Several numbers of an effect may be known only together: at one tension a load cell's gain does what its zero does, at
# three nearly. One that saturates is known from below only: a cover that is soft enough does the same as a softer one.
# The best fit then lies anywhere along a valley, mostly far from all machines. What counts is whether the valley passes
# where they are: such a fit is made anew with every number held within what a machine could have, and taken where chi2
# rises no further than truth does once in twenty.

SELDOM = 0.05  # of campaigns, in which truth is further from the best fit


def prefer_plausible(bench: Workbench, fits: Sequence[Fit]) -> list[Fit]:
    """``fits``, each as a machine could have it where that explains the readings as well."""
    low, high = (np.array(side) for side in bench.forward.sides)
    for k, (lowest, highest) in enumerate(map(plausible_bounds, bench.forward.slots)):
        low[k], high[k] = max(low[k], lowest), min(high[k], highest)
    again = []  # fits with impossible numbers, but not the well-known one of an effect that has no other
    for k, fit in enumerate(fits):
        down, up = step_bounds(fit, (low, high))
        if not has_diverged(fit) and (np.any(down > 0.0) or np.any(up < 0.0)):
            known = estimates(bench.forward, fit)
            single = [i for i in fit.ids if len(bench.forward.index(i)) == 1]
            again += [k] if all(e.plausible for i in single for e in known[i].values()) else []
    if not again:
        return list(fits)
    from scipy.special import chdtri  # a comparison needs none

    begun = []
    for fit in (fits[k] for k in again):
        # the point along the valley, as the derivatives have it, where numbers are least for what machines have
        vector, away = fit.vector.copy(), (fit.vector - bench.forward.null())[fit.free]
        sigma = prior_sigma(bench.forward, fit.free)
        # by least squares in sigmas: two numbers that do the same make the normal equations singular
        rows = np.concatenate([(fit.columns * sigma[:, None]).T, np.eye(len(sigma))])
        vector[fit.free] += sigma * np.linalg.lstsq(rows, np.concatenate([fit.residual, -away / sigma]))[0]
        begun.append(bench.start(fit.ids, np.clip(vector, low, high), fit.free))
    found = list(fits)
    for k, inner in zip(again, bench.fit(begun, sides=(low, high)), strict=True):
        beyond = np.sum((fits[k].vector < low) | (fits[k].vector > high))
        if inner.is_converged and inner.chi2 - fits[k].chi2 < chdtri(max(beyond, 1), SELDOM):
            found[k] = inner
    return found


def estimates_of_single_sizes(bench: Workbench, fit: Fit, name: str) -> Mapping[str, Estimate]:
    """What each size of an effect would be if its other sizes were nothing, for those that explain as much so."""
    own = [k for k in bench.forward.index(name) if not bench.forward.slots[k].parameter.modifier]
    if len(own) < 2:
        return {}
    from scipy.special import chdtri

    null, begun = bench.forward.null(), []
    for kept in own:
        others = [k for k in own if k != kept]
        vector = fit.vector.copy()
        vector[others] = null[others]
        begun.append(bench.start(fit.ids, vector, [k for k in fit.free if k not in others]))
    found = {}
    for kept, alone in zip(own, bench.fit(begun), strict=True):
        if alone.is_converged and alone.chi2 - fit.chi2 < chdtri(len(own) - 1, SELDOM):
            slot, u = bench.forward.slots[kept], np.sqrt(np.diag(covariance_of(alone.columns)))[alone.free.index(kept)]
            told = float(alone.vector[kept] * slot.scale), float(u * slot.scale)
            found[slot.name] = Estimate(*told, slot.parameter.unit, True)
    return found


# What a fit leaves open, as its report says it.

WORST, PART_OF_PIVOT = 1e8, 1e-3  # condition of the pivots; share of a pivot's sensitivity, below which it has no part
BLIND = 1.0  # of what a machine could have: a direction in which a number goes further than that is not bound
CORRELATED = 0.9


@dataclass(frozen=True)
class Inseparable:
    """Numbers, by place, that a fit knows together only; sums: weights (k,) of those sums of them that it knows."""

    members: tuple[int, ...]
    sums: tuple[np.ndarray, ...]


def inseparable_numbers(forward: Forward, fit: Fit) -> list[Inseparable]:
    """Groups of free numbers that the readings cannot tell apart, each known on its own if the others were.

    The blind directions of the covariance are brought to the form in which each has one number (its pivot) to itself;
    every other number less its share of the pivots is a sum that the readings know.
    """
    known = prior_sigma(forward, fit.free)
    root = covariance_root(fit.columns)
    blind = np.abs(root / known[:, None]).max(axis=0, initial=0.0) > BLIND
    alone = 1.0 / np.maximum(fit.sensitivity, 1e-30) < known  # what moves no reading is not bound, and no partner
    if not (blind.any() and alone.sum() > 1):
        return []
    directions = root[:, blind] / np.linalg.norm(root[:, blind], axis=0)
    weight = np.where(alone, fit.sensitivity, 0.0)[:, None] * directions
    _, _, order = qr(weight.T, pivoting=True, mode="economic")
    pivots = order[: directions.shape[1]]
    if np.linalg.cond(weight[pivots]) > WORST:
        return []
    share = directions @ np.linalg.inv(directions[pivots])  # (k, b), the unit matrix at the pivots
    found: list[Inseparable] = []
    for k in np.flatnonzero(alone):
        strong = np.abs(share[k]) * fit.sensitivity[k] > PART_OF_PIVOT * fit.sensitivity[pivots]
        if k in pivots or not strong.any():
            continue
        known_sum = np.eye(len(share))[k]
        known_sum[pivots[strong]] -= share[k, strong]
        members, sums = {int(k), *pivots[strong].tolist()}, [known_sum]
        for other in [group for group in found if members & {*group.members}]:
            found.remove(other)
            members, sums = members | {*other.members}, [*other.sums, *sums]
        found.append(Inseparable(tuple(sorted(members)), tuple(sums)))
    return found


# Intervals of fitted numbers by likelihood: as far either way as chi2 stays below what truth exceeds once in twenty.
#
# About the best fit chi2 is a parabola in whatever enters linearly, and value +- 1.96 u says it all. A place along a
# span, a gap or a time constant does not: its readings change faster on one side than on the other. So every number is
# tried 1.96 u off, the others as they then have to be; only where chi2 comes out otherwise is the number held at
# further places and the others refitted, until its rise is known (profile likelihood).


LINEAR = 0.15  # share by which the root of a rise may differ from the parabola's
ROOT_ROUNDS = 4  # places tried either way
FARTHEST = 3.0  # times as far from one place to the next, at most
ROOT_TOLERANCE = 0.1  # how near the root of a rise comes to what it should be
LEAST_WAY = 0.3  # share of the way to a place where chi2 is far too large, at least

Found = Mapping[str, Mapping[str, Estimate]]


def profile_intervals(bench: Workbench, fit: Fit, found: Found) -> dict[str, dict[str, Estimate]]:
    """The estimates ``found`` of a fit, with intervals of their own where 1.96 u either way is not what chi2 says; only
    those of which the readings then say something.
    """
    slots, covariance = [bench.forward.slots[p] for p in fit.free], covariance_of(fit.columns)
    rows = [k for k, s in enumerate(slots) if s.name in found.get(s.effect.id, {})]
    sides = [_Side(fit, k, slots[k], covariance[k], way) for k in rows for way in (-1.0, 1.0)]
    if not sides:
        return {i: dict(numbers) for i, numbers in found.items()}
    values = bench.forward.values(np.stack([side.parabola for side in sides]))
    with np.errstate(over="ignore", invalid="ignore"):  # a step too far may end anywhere
        chi2 = np.where(np.isfinite(values).all(axis=(1, 2, 3)), bench.metric.chi2(bench.fitted.y - values), np.inf)
    rises = np.sqrt(np.maximum(chi2 - fit.chi2, 0.0))  # roots, as those of a parabola are in proportion to the way
    at_first = [side.at / max(side.u, 1e-300) for side in sides]  # what a parabola has there
    off = np.abs(rises - at_first) >= LINEAR * COVERAGE_95
    crooked = {sides[k].row for k in np.flatnonzero(off)}
    for _ in range(ROOT_ROUNDS if crooked else 0):
        held, due = [], [side for side in sides if side.row in crooked and not side.is_bracketed]
        for side in due:  # from the farthest place that is within, the number held at the next
            nearest = side.inside.copy()
            nearest[side.position] = side.value + side.way * side.at
            held.append(bench.start(fit.ids, nearest, [p for p in fit.free if p != side.position]))
        for side, other in zip(due, bench.fit(held) if held else [], strict=True):
            side.record(np.sqrt(max(other.chi2 - fit.chi2, 0.0)), other.vector)
    told = {i: dict(numbers) for i, numbers in found.items()}
    for low, high in zip(sides[::2], sides[1::2], strict=True):
        slot = slots[low.row]
        own = told[slot.effect.id]
        if low.row in crooked:
            ends = sorted(float(side.end * slot.scale) for side in (low, high))
            own[slot.name] = replace(own[slot.name], interval_95=(ends[0], ends[1]))
        if not is_constrained(slot, own[slot.name]):
            del own[slot.name]
    return told


class _Side:
    """One number of a fit on one side of its value, in units of its scale: what rise of chi2 is known where.

    parabola: the point at which a parabola has the rise that ends the interval, or the bound of what machines have;
    is_bracketed: whether that rise has been met, or cannot be; end: where the interval ends, at the bound of what a
    machine could have where the readings set none.
    """

    def __init__(self, fit: Fit, row: int, slot: Slot, covariance: np.ndarray, way: float) -> None:
        """covariance (k,): of this number with all."""
        self.row, self.position, self.way, self.inside = row, fit.free[row], way, fit.vector
        self.value, self.u = float(fit.vector[self.position]), float(np.sqrt(covariance[row]))
        bound = way * (slot.parameter.plausible[int(way > 0)] / slot.scale - self.value)
        self.most = bound if bound > 0.0 else COVERAGE_95 * self.u  # what no machine has needs no interval
        self.at = min(COVERAGE_95 * self.u, self.most)
        self.parabola = fit.vector.copy()
        self.parabola[fit.free] += way * self.at * covariance / max(covariance[row], 1e-300)
        self.rises: list[tuple[float, float]] = [(0.0, 0.0)]
        self.is_bracketed, self.end = False, self.value + way * self.most

    def record(self, rise: float, vector: np.ndarray) -> None:
        """Root of the rise of chi2 at the place asked for; the next place follows from all that are known."""
        self.rises.append((self.at, rise))
        self.is_bracketed = abs(rise - COVERAGE_95) < ROOT_TOLERANCE or (self.at >= self.most and rise < COVERAGE_95)
        if rise <= COVERAGE_95:
            self.inside = max(self.inside, vector, key=lambda v: self.way * v[self.position])
        # where the rise reaches that of the interval: between two places, or beyond the last
        below = max((p for p in self.rises if p[1] <= COVERAGE_95), key=lambda p: p[0])
        beyond = [p for p in sorted(self.rises) if p[1] > COVERAGE_95 and p[0] > below[0]]
        if beyond:
            share = (COVERAGE_95 - below[1]) / (beyond[0][1] - below[1])
            there = below[0] + max(share, LEAST_WAY) * (beyond[0][0] - below[0])
        else:
            there = below[0] * float(np.clip(COVERAGE_95 / max(below[1], 1e-9), 1.0, FARTHEST))
        self.at = min(there, self.most)
        open_ended = all(rise < COVERAGE_95 - ROOT_TOLERANCE for _, rise in self.rises)
        self.end = self.value + self.way * (self.most if open_ended else self.at)
