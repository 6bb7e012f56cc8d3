"""Which effects are missing: forward with joint refits, swaps, backward; at most four.

An effect is taken when its chi2 gain beats a bootstrap threshold (family-wise over all candidates), its numbers are
plausible, and the error on held-out conditions falls. Every candidate tried is kept for the ranking.
"""

from dataclasses import dataclass, field

import numpy as np

from belt_sim.diagnosis.around import Around, around
from belt_sim.diagnosis.candidate import is_plausible
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.heldout import HeldOut, held_out
from belt_sim.diagnosis.null import NullGains, null_gains
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.errors import RunFailed

MAX_EFFECTS = 4
FAMILY_LEVEL = 0.025  # false alarms a step, all candidates together; the open-set test spends the rest of 5 %
NESTING = 1.0  # a super-model may not fit worse than its sub-model by more than this in chi2


@dataclass
class Trial:
    """A candidate beside (or instead of) what was there: its joint fit, gain over the reference, threshold."""

    id: str
    fit: Fit
    gain: float
    threshold: float
    plausible: bool
    held_out: HeldOut

    @property
    def passes(self) -> bool:
        return self.gain > self.threshold and self.plausible

    @property
    def score(self) -> float:
        """Gain above what chance would give an effect with as many parameters."""
        return self.gain - self.threshold if np.isfinite(self.threshold) else -np.inf


@dataclass
class Selection:
    """The chosen fit, the base fit, the first round over all candidates, and every round's trials."""

    bench: Workbench
    base: Fit
    chosen: Fit
    base_held_out: HeldOut
    held_out: HeldOut
    rounds: list[list[Trial]] = field(default_factory=list)
    swaps: dict[str, list[Trial]] = field(default_factory=dict)
    null: NullGains | None = None


def select(
    bench: Workbench,
    *,
    bootstraps: int,
    seed: int,
    limit: int = MAX_EFFECTS,
    tell=lambda text: None,
    tick=lambda n: None,
) -> Selection:
    """Choose up to ``limit`` effects; ``tell`` hears what is being done, ``tick`` counts bootstrap replicates."""
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    current, found = base, Selection(bench, base, base, held_out(bench, base), held_out(bench, base))
    seen = {frozenset(current.ids)}
    while len(current.ids) < min(limit, len(bench.forward.classes)):
        tell(f"candidates beside {', '.join(current.ids) or 'the base model'}")
        count = bootstraps if not current.ids else max(200, bootstraps // 4)
        trials, null = _round(bench, current, count, seed + len(current.ids), tick)
        found.rounds.append(trials)
        found.null = found.null or null
        better = [t for t in trials if t.passes and t.held_out.chi2 < held_out(bench, current).chi2]
        if not better:
            break
        larger = max(better, key=lambda t: t.score).fit
        moved = bench.moved_to(larger.vector)
        larger = moved.fit([moved.start(larger.ids, larger.vector)])[0]
        larger = _pruned(moved, _swapped(moved, larger, found, tell), found)
        if frozenset(larger.ids) in seen:  # what came in went out again
            break
        seen.add(frozenset(larger.ids))
        bench, current = moved, larger
    found.bench, found.chosen, found.held_out = bench, current, held_out(bench, current)
    if set(found.swaps) != set(current.ids):
        _swapped(bench, current, found, tell)
    return found


def _round(bench: Workbench, current: Fit, count: int, seed: int, tick) -> tuple[list[Trial], NullGains]:
    """Every candidate beside ``current``."""
    ids = [c.id for c in bench.forward.classes if c.id not in current.ids]
    near = around(bench, current, ids)
    shapes = {i: near.shapes(bench, i) for i in ids}
    null = null_gains(bench, shapes, current.slopes, current.values, count=count, seed=seed, tick=tick)
    critical = null.critical(ids, FAMILY_LEVEL)
    fits = best_of(bench, near, ids)
    return [_trial(bench, i, fits[i], current, null, critical) for i in ids if i in fits], null


def _trial(bench, name, fit, current, null, critical) -> Trial:
    gain = current.chi2 - fit.chi2
    if gain < -NESTING:
        raise RunFailed(f"refit of {name} beside {current.ids}: chi2 rose by {-gain:.3g}; the optimiser failed")
    return Trial(
        id=name,
        fit=fit,
        gain=max(gain, 0.0),
        threshold=null.threshold(name, critical),
        plausible=is_plausible(bench.forward, fit),
        held_out=held_out(bench, fit),
    )


def best_of(bench: Workbench, near: Around, ids) -> dict[str, Fit]:
    """The best joint fit of what ``near`` is around with each of ``ids``; several starts for nonlinear effects."""
    starts, owners = [], []
    for name in ids:
        starts.append(near.with_effect(bench, name))  # from null, so that no super-model ends above its sub-model
        owners.append(name)
        for position, value in near.weak.get(name, ()):
            vector = near.fit.vector.copy()
            vector[position] = value
            starts.append(bench.start((*near.fit.ids, name), vector))
            owners.append(name)
    best: dict[str, Fit] = {}
    for name, fit in zip(owners, bench.fit(starts), strict=True):
        if name not in best or fit.chi2 < best[name].chi2:
            best[name] = fit
    return best


def _swapped(bench: Workbench, current: Fit, found: Selection, tell) -> Fit:
    """Replace single effects while that fits better; keeps what each could be replaced by (confusables)."""
    for _ in range(MAX_EFFECTS):
        found.swaps = {}
        best = current
        for name in current.ids:
            rest = tuple(i for i in current.ids if i != name)
            others = [c.id for c in bench.forward.classes if c.id not in current.ids]
            vector = current.vector.copy()
            vector[bench.forward.index(name)] = bench.forward.null()[bench.forward.index(name)]
            without = bench.fit([bench.start(rest, vector)])[0]
            if without.chi2 < current.chi2:  # the larger set stopped in a worse valley: go on from the better one
                best = best_of(bench, around(bench, without, [name]), [name])[name]
                break
            fits = best_of(bench, around(bench, without, others), others) | {name: current}
            assert found.null is not None
            critical = found.null.critical(list(found.null.dof), FAMILY_LEVEL)
            trials = [_trial(bench, i, f, without, found.null, critical) for i, f in fits.items()]
            found.swaps[name] = sorted(trials, key=lambda t: -t.score)
            own = next(t for t in trials if t.id == name)
            winner = max((t for t in trials if t.plausible or t.id == name), key=lambda t: t.score)
            if winner.score > own.score + NESTING and winner.fit.chi2 < best.chi2 + winner.threshold:
                tell(f"{winner.id} explains more than {name}")
                best = winner.fit
                break
        if best is current:
            return current
        current = best
    return current


def _pruned(bench: Workbench, current: Fit, found: Selection) -> Fit:
    """Drop effects that later ones made superfluous."""
    for name, trials in found.swaps.items():
        own = next((t for t in trials if t.id == name), None)
        if len(current.ids) > 1 and own is not None and own.gain < own.threshold:
            vector = current.vector.copy()
            vector[bench.forward.index(name)] = bench.forward.null()[bench.forward.index(name)]
            found.swaps = {}
            return bench.fit([bench.start([i for i in current.ids if i != name], vector)])[0]
    return current
