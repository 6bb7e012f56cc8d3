"""The next run: which action on the rig would tell two explanations apart best.

Each action is predicted with both explanations; each is refitted to everything the other would give, and what then
remains at least, in units of the noise, is the separation. All actions are judged in the linear range, and those that
promise something again by numbers that march: a crown far from its null follows a soft pulley where no derivative says
so. Where no single change promises enough, two at once are tried.
"""

from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim.campaign import Run, case_of
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.noise import Metric, metric_of, nuisance_shapes
from belt_sim.diagnosis.samples import Samples, join_cases
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.jax_setup import map_in_threads
from belt_sim.results.diagnosis import RESOLVED, SURE_APART, NextRun, RunSettings
from belt_sim.units import DEGREE, N_PER_MM2

SAMPLES = 120
OPPOSITE_YAW = 0.042 * DEGREE


@dataclass(frozen=True)
class Action:
    """A further run: in words, as a run without readings, and its settings for who follows the advice."""

    words: str
    run: Run
    settings: RunSettings


TRAVEL_REVERSED, LONGER, BELT_TURNED = "run with travel reversed", "run twice as long", "turn the belt over"


def menu(template: Run, *, twofold: bool = False) -> list[Action]:
    """Actions derived from one run of the campaign, on a record as long as that run's unless said otherwise.

    twofold: two changes at once, each on a record twice as long, and each tension with travel reversed.
    """
    travel = np.linspace(0.0, float(template.travel[-1]), SAMPLES)
    base = replace(template, travel=travel, time=None, signals={}, repeat_of=None, use="fit")
    yaw = base.yaw if base.yaw else OPPOSITE_YAW
    changes: dict[str, dict[str, Any]] = {  # in words, and the fields of a run or an action that it sets
        "run at opposite yaw": {"yaw": -yaw},
        "run at zero yaw": {"yaw": 0.0},
        "run at twice the yaw": {"yaw": 2 * yaw},
        "run at lower tension": {"tension": 0.6 * base.tension},
        "run at higher tension": {"tension": 1.7 * base.tension},
        TRAVEL_REVERSED: {"direction": -base.direction},
        "run at twice the speed": {"speed": 2 * base.speed},
        "run at half the speed": {"speed": 0.5 * base.speed},
        "put sensors at all four points": {"all_points": True},
        BELT_TURNED: {"turned_over": True},
        LONGER: {"travel": 2.0 * base.travel},
    }
    if twofold:
        pairs = [(one, LONGER) for one in changes if one not in (LONGER, BELT_TURNED)]
        pairs += [(one, TRAVEL_REVERSED) for one in changes if "tension" in one]
        changes = {f"{a}, {b.removeprefix('run ')}": changes[a] | changes[b] for a, b in pairs}
    actions = []
    for words, change in changes.items():
        others = {name: change[name] for name in ("all_points", "turned_over") if name in change}
        run = replace(base, **{name: x for name, x in change.items() if name not in others})
        stated: dict[str, Any] = {name: float(getattr(run, name)) for name in ("tension", "yaw", "speed", "direction")}
        settings = RunSettings(**stated, travel=float(run.travel[-1]), **others)
        told = f"{run.tension / N_PER_MM2:.3g} N/mm2, yaw {run.yaw / DEGREE:+.3g} deg, {run.speed:g} m/s, "
        told += f"{run.travel[-1]:.0f} m{'' if run.direction > 0 else ', reversed'}"
        actions.append(Action(f"{words} ({told})", run, settings))
    return actions


REFIT_STEPS = 8  # of a refit
AFTER_TOO_FAR = 0.3  # a step that went too far, the next time
SEARCH_SETTLED = 0.98  # of what remains, from one step to the next


@dataclass(frozen=True)
class Rival:
    """``other`` in the place of ``effect`` fits almost as well; sigma: the ``separation`` of the two fits."""

    effect: str
    other: str
    sigma: float
    fit: Fit


def separation(bench: Workbench, a: Fit, b: Fit) -> float:
    """By how many sigma the fitted runs tell two fits apart: what of their difference a refit of either must leave."""
    known = bench.metric.whiten(a.values - b.values)
    return min(_rest(known, fit.columns.reshape(len(fit.free), known.size)) for fit in (a, b))


def next_runs(bench: Workbench, chosen: Fit, pairs: list[Rival], keep: int = 3) -> list[NextRun]:
    """The best actions for every pair, best first; two changes at once where no single one tells a pair apart."""

    def march_pair(outlook: Outlook, pair: Rival, k: int, before: float, sigma: float) -> NextRun:
        if sigma >= RESOLVED:
            alone, both = outlook.single(k), ((chosen, pair.fit), (pair.fit, chosen))
            sigma = min(sigma, *(alone.separation_after_refit(right, other) for right, other in both))
        action = outlook.actions[k]
        return NextRun(action.words, (pair.effect, pair.other), before, sigma, action.settings)

    advice, asked = list[NextRun](), pairs
    for twofold in (False, True):
        if not asked:
            break
        outlook, promised = Outlook(bench, chosen, twofold=twofold), []
        for pair in asked:
            before, after = outlook.separations(chosen, pair.fit)
            promised += [(outlook, pair, k, before, float(after[k])) for k in np.argsort(-after)[:keep]]
        advice += map_in_threads(lambda one: march_pair(*one), promised)  # marches of a few rows leave a core idle
        best = {
            pair: max(a.sigma_after for a in advice if a.separates == pair) for pair in {a.separates for a in advice}
        }
        asked = [p for p in asked if best[p.effect, p.other] < SURE_APART]
    advice.sort(key=lambda a: -a.sigma_after)
    return [a for k, a in enumerate(advice) if sum(a.separates == b.separates for b in advice[:k]) < keep]


class Outlook:
    """All actions of the menu, laid out like a campaign of its own."""

    def __init__(self, bench: Workbench, chosen: Fit, *, twofold: bool = False) -> None:
        """The actions are variations of the run in which the chosen effects show most: these promise most."""
        self.bench, self.chosen, runs = bench, chosen, bench.samples.runs
        shown = np.zeros(len(runs))
        if chosen.free:
            shown = np.sum(chosen.columns.reshape(len(chosen.free), len(runs), -1) ** 2, axis=(0, 2))
        self.actions = menu(runs[int(np.argmax(shown))], twofold=twofold)
        # samples of the menu: measured places, and the missing points for the action that adds sensors
        own, here = bench.forward, bench.samples.signals
        pattern = next((s for s in here if s.kind == "lateral"), here[0])
        extra = [at for at in (f"point_{k}" for k in (1, 2, 3, 4)) if at not in {s.at for s in here}]
        travel = np.stack([a.run.travel for a in self.actions])
        y = np.zeros((len(travel), len(here) + len(extra), travel.shape[1]))
        y[[not a.settings.all_points for a in self.actions], len(here) :] = np.nan
        samples = Samples(
            runs=tuple(a.run for a in self.actions),
            signals=(*here, *(replace(pattern, name=at, at=at, kind="lateral") for at in extra)),
            cases=join_cases([case_of(bench.campaign, a.run) for a in self.actions]),
            travel=travel,
            time=travel / np.array([[a.run.speed] for a in self.actions]),
            y=y,
            yaw_at=np.array([a.run.yaw_at for a in self.actions]),
            per_bin=np.ones(len(travel)),
        )
        self.forward = Forward(samples, own.model, own.classes, own.step, own.terms)
        self.metric = self._metric()

    def separations(self, a: Fit, b: Fit) -> tuple[float, np.ndarray]:
        """sigma without a further run, and with each action (actions,), whichever of the two is right.

        One that can follow the other through a run tells nothing about it there, though the other cannot follow it; nor
        does a run in which the belt leaves its pulleys.
        """
        known = self.bench.metric.whiten(a.values - b.values)
        predicted = [self.predict(fit, fit.free) for fit in (a, b)]
        readings = [x for values, along in predicted for x in (values, *along)]
        stays = np.logical_and.reduce([np.isfinite(x).all(axis=(1, 2)) for x in readings])
        there, along = stays[:, None, None], [x for both in predicted for x in both]
        there_a, along_a, there_b, along_b = (np.where(there, x, 0.0) for x in along)
        new, further = self.white(there_a - there_b), [self.white(along_a), self.white(along_b)]
        own = [fit.columns.reshape(len(fit.free), known.size) for fit in (a, b)]
        before = separation(self.bench, a, b)
        after = np.full(len(self.actions), before)
        for r in np.flatnonzero(stays):
            apart = np.concatenate([known, new[r]])
            along = [np.concatenate([x, more[:, r]], axis=1) for x, more in zip(own, further, strict=True)]
            after[r] = min(_rest(apart, columns) for columns in along)
        return before, after

    def single(self, action: int) -> "Outlook":
        """One of the actions by itself."""
        one = copy(self)
        one.actions, one.forward = [self.actions[action]], self.forward.of_runs(np.array([action]))
        one.metric = one._metric()
        return one

    def separation_after_refit(self, right: Fit, other: Fit) -> float:
        """sigma with all actions that refitting ``other`` leaves, were ``right`` right: by numbers that march."""
        there, least, fit, step = self.predict(right, [])[0], np.inf, other, np.zeros(len(other.free))
        for _ in range(REFIT_STEPS):
            vector = fit.vector.copy()
            vector[fit.free] += step
            tried = replace(fit, vector=vector, settled=False) if step.any() else fit
            values, slopes = self.here(tried)
            new, along = self.predict(tried, tried.free)
            size = np.inf
            if all(np.isfinite(x).all() for x in (values, slopes, there, new, along)):
                gaps = self.bench.metric.whiten(right.values - values), self.white(there - new).ravel()
                size = float(np.linalg.norm(rest := np.concatenate(gaps)))
            if not size < SEARCH_SETTLED * least:
                if size <= least or not step.any():
                    return min(size, least)
                step = AFTER_TOO_FAR * step
                continue
            least, fit = size, tried
            columns = np.concatenate(
                [self.bench.metric.whiten(slopes), self.white(along).reshape(len(step), -1)], axis=1
            )
            step = np.linalg.lstsq(columns.T, rest, rcond=1e-9)[0]
        return least

    def here(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Values (R, S, n) and slopes (k, R, S, n) of the campaign's own runs; a fit that has ended has them."""
        return (fit.values, fit.slopes) if fit.is_converged else self.bench.forward.expand(fit.vector, fit.free)

    def predict(self, fit: Fit, free: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """Values (R, S, n) and slopes (k, R, S, n) of every action; a belt turned over carries its effects along."""
        values, slopes = self.forward.expand(fit.vector, free)
        over = np.flatnonzero([a.settings.turned_over for a in self.actions])
        sign = np.ones(self.forward.size)
        sign[[k for k, s in enumerate(self.forward.slots) if s.effect.on_belt and not s.parameter.modifier]] = -1.0
        there, along = self.forward.of_runs(over).expand(sign * fit.vector, free)
        values[over], slopes[:, over] = there, sign[free, None, None, None] * along
        return values, slopes

    def white(self, x: np.ndarray) -> np.ndarray:
        """Whitened action by action: (..., actions, m)."""
        white = self.metric.whiten(x)
        return white.reshape(*white.shape[:-1], len(self.actions), white.shape[-1] // len(self.actions))

    def _metric(self) -> Metric:
        values, slopes = self.forward.expand(self.chosen.vector, self.forward.nuisances)
        samples = self.forward.samples
        # none of actions in which the belt leaves its pulleys
        stays = np.logical_and.reduce([np.isfinite(x).all(axis=(1, 2)) for x in (values, *slopes)])[:, None, None]
        values, slopes = np.where(stays, values, 0.0), np.where(stays, slopes, 0.0)
        shapes, shared = nuisance_shapes(self.bench.campaign, samples, values, slopes)
        return metric_of(samples, self.bench.levels, shapes, 0.0 * shared)


def _rest(residual: np.ndarray, columns: np.ndarray) -> float:
    """Length of what refitting ``columns`` leaves of ``residual``."""
    step = np.linalg.lstsq(columns.T, residual, rcond=1e-9)[0] if columns.size else np.zeros(len(columns))
    return float(np.linalg.norm(residual - step @ columns))
