"""The next run: which action on the rig would tell two explanations apart best.

Each action is predicted with both explanations; each is refitted to everything the other would give, and what then
remains at least, in units of the noise, is the separation. All actions are judged in the linear range, and those that
promise something again by numbers that march: a crown far from its null follows a soft pulley where no derivative says
so. Where no single change promises enough, two at once are tried.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from belt_sim import si
from belt_sim.campaign import Run, SignalSheet, case_of
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.noise.metric import Metric, metric_of, nuisance_shapes
from belt_sim.diagnosis.readings.forward import NUISANCES, Forward
from belt_sim.diagnosis.readings.samples import Samples, stack_cases
from belt_sim.jax_setup import map_in_threads
from belt_sim.results.findings import APART, RESOLVED, NextRun, RunSettings

SAMPLES = 120
OPPOSITE_YAW = 0.042 * si.DEGREE


@dataclass(frozen=True)
class Action:
    """A further run: its settings; whether sensors stand at all four points; whether the belt is turned over."""

    words: str
    run: Run
    all_points: bool = False
    turned_over: bool = False

    @property
    def settings(self) -> RunSettings:
        """The same without words, for who follows the advice."""
        run = self.run
        return RunSettings(
            tension=float(run.tension),
            yaw=float(run.yaw),
            speed=float(run.speed),
            direction=float(run.direction),
            travel=float(run.travel[-1]),
            all_points=self.all_points,
            turned_over=self.turned_over,
        )


def menu(template: Run) -> list[Action]:
    """Actions derived from one run of the campaign, on a record as long as that run's unless said otherwise."""
    base = _fresh(template)
    return [_make_action(base, *c) for c in [*_changes(base), _LONGER]]


def twofold(template: Run) -> list[Action]:
    """Two changes at once: each on a record twice as long, and each tension with travel reversed."""
    base = _fresh(template)
    changes = {c[0]: c for c in _changes(base)}
    longer = [(c, _LONGER) for words, c in changes.items() if words != "turn the belt over"]
    back = [(c, changes["run with travel reversed"]) for words, c in changes.items() if "tension" in words]
    return [_make_action(base, *_both(one, other)) for one, other in longer + back]


Change = tuple[str, Callable[[Run], Run], dict[str, bool]]
_LONGER: Change = "run twice as long", lambda r: replace(r, travel=2.0 * r.travel), {}


def _changes(base: Run) -> list[Change]:
    """Words of every change, what it does to a run, and what else it takes."""
    yaw = base.yaw if base.yaw else OPPOSITE_YAW
    tension = base.tension
    return [
        ("run at opposite yaw", lambda r: replace(r, yaw=-yaw), {}),
        ("run at zero yaw", lambda r: replace(r, yaw=0.0), {}),
        ("run at twice the yaw", lambda r: replace(r, yaw=2 * yaw), {}),
        ("run at lower tension", lambda r: replace(r, tension=0.6 * tension), {}),
        ("run at higher tension", lambda r: replace(r, tension=1.7 * tension), {}),
        ("run with travel reversed", lambda r: replace(r, direction=-r.direction), {}),
        ("run at twice the speed", lambda r: replace(r, speed=2 * r.speed), {}),
        ("run at half the speed", lambda r: replace(r, speed=0.5 * r.speed), {}),
        ("put sensors at all four points", lambda r: r, {"all_points": True}),
        ("turn the belt over", lambda r: r, {"turned_over": True}),
    ]


def _both(one: Change, other: Change) -> Change:
    words = f"{one[0]}, {other[0].removeprefix('run ')}"
    return words, lambda r: other[1](one[1](r)), one[2] | other[2]


def _fresh(template: Run) -> Run:
    """A run like another, without readings."""
    end = float(template.travel[-1])
    travel = np.linspace(0.0, end, SAMPLES)
    return replace(template, travel=travel, time=None, signals={}, repeat_of=None, use="fit")


def _make_action(base: Run, words: str, change: Callable[[Run], Run], more: dict[str, bool]) -> Action:
    run = change(base)
    return Action(f"{words} ({_settings(run)})", run, **more)


def _settings(run: Run) -> str:
    direction = "" if run.direction > 0 else ", reversed"
    yaw = f"yaw {run.yaw / si.DEGREE:+.3g} deg"
    return f"{run.tension / si.N_PER_MM2:.3g} N/mm2, {yaw}, {run.speed:g} m/s, {run.travel[-1]:.0f} m{direction}"


STEPS = 8  # of a refit
SHORTER = 0.3  # a step that went too far, the next time
SETTLED = 0.98  # of what remains, from one step to the next


@dataclass(frozen=True)
class Rival:
    """``other`` in the place of ``effect`` fits almost as well: sigma = sqrt of the chi2 between the two fits."""

    effect: str
    other: str
    sigma: float
    fit: Fit


def next_runs(bench: Workbench, chosen: Fit, pairs: list[Rival], keep: int = 3) -> list[NextRun]:
    """The best actions for every pair, best first."""
    if not pairs:
        return []
    template = bench.samples.runs[_liveliest(bench, chosen)]
    advice = _best(Outlook(bench, chosen, menu(template)), chosen, pairs, keep)
    unsure = [p for p in pairs if max(a.sigma_after for a in advice if _separates(a, p)) < APART]
    if unsure:
        advice += _best(Outlook(bench, chosen, twofold(template)), chosen, unsure, keep)
    advice = sorted(advice, key=lambda a: -a.sigma_after)
    return [a for k, a in enumerate(advice) if sum(a.separates == b.separates for b in advice[:k]) < keep]


def _separates(advice: NextRun, pair: Rival) -> bool:
    return advice.separates == (pair.effect, pair.other)


def _best(outlook: "Outlook", chosen: Fit, pairs: list[Rival], keep: int) -> list[NextRun]:
    """The best actions of one outlook for every pair; marches of a few rows leave a core idle, so that two go on."""
    promised = []
    for pair in pairs:
        before, after = outlook.separations(chosen, pair.fit)
        promised += [(pair, k, before, float(after[k])) for k in np.argsort(-after)[:keep]]

    def march_pair(pair: Rival, k: int, before: float, sigma: float) -> NextRun:
        if sigma >= RESOLVED:
            alone, both = outlook.single(k), ((chosen, pair.fit), (pair.fit, chosen))
            sigma = min(sigma, *(alone.separation_after_refit(right, other) for right, other in both))
        action = outlook.actions[k]
        return NextRun(action.words, (pair.effect, pair.other), before, sigma, action.settings)

    return map_in_threads(lambda one: march_pair(*one), promised)


class Outlook:
    """All actions of the menu, laid out like a campaign of its own."""

    def __init__(self, bench: Workbench, chosen: Fit, actions: list[Action] | None = None) -> None:
        """actions: by default those of the menu."""
        self.bench = bench
        self.actions = actions or menu(bench.samples.runs[_liveliest(bench, chosen)])
        self.samples = _hypothetical(bench, self.actions)
        forward = bench.forward
        self.forward = Forward(
            self.samples, forward.model, forward.classes, forward.step, forward.terms, brief=forward.brief
        )
        self.chosen = chosen
        self.metric = self._metric(chosen.vector)

    def separations(self, a: Fit, b: Fit) -> tuple[float, np.ndarray]:
        """sigma without a further run, and with each action (actions,), whichever of the two is right.

        One that can follow the other through a run tells nothing about it there, though the other cannot follow it; nor
        does a run in which the belt leaves its pulleys.
        """
        known = self.bench.metric.whiten(a.values - b.values)
        predicted = [self.predict(fit, fit.free) for fit in (a, b)]
        stays = np.logical_and.reduce([_finite(x) for values, along in predicted for x in (values, *along)])
        (there_a, along_a), (there_b, along_b) = ([_where(stays, x) for x in both] for both in predicted)
        new = self.white(there_a - there_b)
        refitted = [
            (fit.columns.reshape(len(fit.free), known.size), self.white(along))
            for fit, along in ((a, along_a), (b, along_b))
        ]
        before = min(_rest(known, columns) for columns, _ in refitted)
        after = [
            min(
                _rest(np.concatenate([known, new[r]]), np.concatenate([columns, further[:, r]], axis=1))
                for columns, further in refitted
            )
            if stays[r]
            else before
            for r in range(len(self.actions))
        ]
        return before, np.array(after)

    def single(self, action: int) -> "Outlook":
        """One of the actions by itself."""
        one = copy(self)
        one.actions, one.samples = [self.actions[action]], self.samples.of_runs(np.array([action]))
        one.metric = one._metric(self.chosen.vector)
        return one

    def separation_after_refit(self, right: Fit, other: Fit) -> float:
        """sigma with all actions that refitting ``other`` leaves, were ``right`` right: by numbers that march."""
        there, least, fit, step = self.predict(right, [])[0], np.inf, other, np.zeros(len(other.free))
        for _ in range(STEPS):
            values, slopes = self.here(tried := _with_step(fit, step) if step.any() else fit)
            new, along = self.predict(tried, tried.free)
            size = np.inf
            if all(np.isfinite(x).all() for x in (values, slopes, there, new, along)):
                gaps = self.bench.metric.whiten(right.values - values), self.white(there - new).ravel()
                size = float(np.linalg.norm(rest := np.concatenate(gaps)))
            if not size < SETTLED * least:
                if size <= least or not step.any():
                    return min(size, least)
                step = SHORTER * step
                continue
            least, fit = size, tried
            columns = np.concatenate(
                [self.bench.metric.whiten(slopes), self.white(along).reshape(len(step), -1)], axis=1
            )
            step = np.linalg.lstsq(columns.T, rest, rcond=1e-9)[0]
        return least

    def here(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Values (R, S, n) and slopes (k, R, S, n) of the campaign's own runs; a fit that has ended has them."""
        if fit.is_converged:
            return fit.values, fit.slopes
        directions = np.eye(self.bench.forward.size)[fit.free]
        values, slopes = self.bench.forward.values_and_slopes(
            np.repeat(fit.vector[None], len(directions), axis=0), directions
        )
        return values[0], slopes

    def predict(self, fit: Fit, free: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """Values (R, S, n) and slopes (k, R, S, n) of every action; a belt turned over carries its effects along."""
        count = max(1, len(free))
        directions = np.zeros((count, self.forward.size))
        for k, position in enumerate(free):
            directions[k, position] = 1.0
        flip = self._flip()
        values, slopes = self.forward.values_and_slopes(
            np.repeat(fit.vector[None], count, axis=0), directions, self.samples
        )
        turned = np.flatnonzero([a.turned_over for a in self.actions])
        samples, over = self.samples.of_runs(turned), np.repeat((fit.vector * flip)[None], count, axis=0)
        values[:, turned], slopes[:, turned] = self.forward.values_and_slopes(over, directions * flip, samples)
        return values[0], slopes[: len(free)]

    def _flip(self) -> np.ndarray:
        turns = [s.effect.on_belt and not s.only_shapes for s in self.forward.slots]
        signs = [-1.0 if t else 1.0 for t in turns]
        return np.array(signs + [1.0] * len(NUISANCES))

    def white(self, x: np.ndarray) -> np.ndarray:
        """Whitened action by action: (..., actions, m)."""
        white = self.metric.whiten(x)
        return white.reshape(*white.shape[:-1], len(self.actions), white.shape[-1] // len(self.actions))

    def _metric(self, vector: np.ndarray) -> Metric:
        directions = np.eye(self.forward.size)[-len(NUISANCES) :]
        vectors = np.repeat(vector[None], len(NUISANCES), axis=0)
        values, slopes = self.forward.values_and_slopes(vectors, directions, self.samples)
        stays = np.logical_and.reduce([_finite(x) for x in (values[0], *slopes)])
        values, slopes = _where(stays, values), _where(stays, slopes)
        shapes, shared = nuisance_shapes(self.bench.campaign, self.samples, values[0], slopes)
        return metric_of(self.samples, self.bench.levels, shapes, 0.0 * shared)


def _finite(x: np.ndarray) -> np.ndarray:
    """Which actions (actions,) of readings (actions, S, n) are predicted: none in which the belt leaves its pulleys."""
    return np.isfinite(x).all(axis=(1, 2))


def _where(stays: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Readings (..., actions, S, n), 0 in actions (actions,) that are not predicted."""
    return np.where(stays[:, None, None], x, 0.0)


def _liveliest(bench: Workbench, chosen: Fit) -> int:
    """The run in which the chosen effects show most: a variation of it promises most."""
    runs = len(bench.samples.runs)
    if not len(chosen.free):
        return 0
    strength = np.sum(chosen.columns.reshape(len(chosen.free), runs, -1) ** 2, axis=(0, 2))
    return int(np.argmax(strength))


def _hypothetical(bench: Workbench, actions: list[Action]) -> Samples:
    """Samples of the menu: measured places, and the missing points for the action that adds sensors."""
    have = {s.at for s in bench.samples.signals}
    pattern = next((s for s in bench.samples.signals if s.kind == "lateral"), bench.samples.signals[0])
    extra = [f"point_{k}" for k in (1, 2, 3, 4) if f"point_{k}" not in have]
    signals: list[SignalSheet] = [*bench.samples.signals]
    signals += [replace(pattern, name=at, at=at, kind="lateral") for at in extra]
    travel = np.stack([a.run.travel for a in actions])
    y = np.zeros((len(actions), len(signals), travel.shape[1]))
    for r, action in enumerate(actions):
        if not action.all_points:
            y[r, len(bench.samples.signals) :] = np.nan
    return Samples(
        runs=tuple(a.run for a in actions),
        signals=tuple(signals),
        cases=stack_cases([case_of(bench.campaign, a.run) for a in actions]),
        travel=travel,
        time=travel / np.array([[a.run.speed] for a in actions]),
        y=y,
        yaw_at=np.array([a.run.yaw_at for a in actions]),
        per_bin=np.ones(len(actions)),
    )


def _with_step(fit: Fit, step: np.ndarray) -> Fit:
    """A fit with its numbers a step (k,) further."""
    vector = fit.vector.copy()
    vector[fit.free] += step
    return replace(fit, vector=vector, settled=False)


def _rest(residual: np.ndarray, columns: np.ndarray) -> float:
    """Length of what refitting ``columns`` leaves of ``residual``."""
    if not columns.size:
        return float(np.linalg.norm(residual))
    step = np.linalg.lstsq(columns.T, residual, rcond=1e-9)[0]
    return float(np.linalg.norm(residual - step @ columns))
