"""The menu of rig actions that a next run may be."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from belt_sim import si
from belt_sim.campaign import Run
from belt_sim.results.found import RunSettings

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
    return [_made(base, *c) for c in [*_changes(base), _LONGER]]


def twofold(template: Run) -> list[Action]:
    """Two changes at once: each on a record twice as long, and each tension with travel reversed."""
    base = _fresh(template)
    changes = {c[0]: c for c in _changes(base)}
    longer = [(c, _LONGER) for words, c in changes.items() if words != "turn the belt over"]
    back = [(c, changes["run with travel reversed"]) for words, c in changes.items() if "tension" in words]
    return [_made(base, *_both(one, other)) for one, other in longer + back]


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


def _made(base: Run, words: str, change: Callable[[Run], Run], more: dict[str, bool]) -> Action:
    run = change(base)
    return Action(f"{words} ({_settings(run)})", run, **more)


def _settings(run: Run) -> str:
    direction = "" if run.direction > 0 else ", reversed"
    yaw = f"yaw {run.yaw / si.DEGREE:+.3g} deg"
    return f"{run.tension / si.N_PER_MM2:.3g} N/mm2, {yaw}, {run.speed:g} m/s, {run.travel[-1]:.0f} m{direction}"
