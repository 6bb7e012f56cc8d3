"""The menu of rig actions that a next run may be."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from belt_sim import si
from belt_sim.campaign import Run

SAMPLES = 120
OPPOSITE_YAW = 0.042 * si.DEGREE


@dataclass(frozen=True)
class Action:
    """A further run: its settings; whether sensors stand at all four points; whether the belt is turned over."""

    words: str
    run: Run
    all_points: bool = False
    turned_over: bool = False


def menu(template: Run) -> list[Action]:
    """Actions derived from one run of the campaign, on a record as long as that run's unless said otherwise."""
    end = float(template.travel[-1])
    base = replace(template, travel=np.linspace(0.0, end, SAMPLES), time=None, signals={}, repeat_of=None, use="fit")
    yaw = template.yaw if template.yaw else OPPOSITE_YAW
    tension = template.tension / si.N_PER_MM2
    low, high = 0.6 * tension, 1.7 * tension

    def at(change: Callable[[Run], Run], words: str, **more) -> Action:
        return Action(f"{words} ({_settings(change(base))})", change(base), **more)

    return [
        at(lambda r: replace(r, yaw=-yaw), "run at opposite yaw"),
        at(lambda r: replace(r, yaw=0.0), "run at zero yaw"),
        at(lambda r: replace(r, yaw=2 * yaw), "run at twice the yaw"),
        at(lambda r: replace(r, tension=low * si.N_PER_MM2), "run at lower tension"),
        at(lambda r: replace(r, tension=high * si.N_PER_MM2), "run at higher tension"),
        at(lambda r: replace(r, direction=-r.direction), "run with travel reversed"),
        at(lambda r: replace(r, speed=2 * r.speed), "run at twice the speed"),
        at(lambda r: replace(r, speed=0.5 * r.speed), "run at half the speed"),
        at(lambda r: r, "put sensors at all four points", all_points=True),
        at(lambda r: r, "turn the belt over", turned_over=True),
        at(lambda r: replace(r, travel=np.linspace(0.0, 2 * end, SAMPLES)), "run twice as long"),
    ]


def _settings(run: Run) -> str:
    direction = "" if run.direction > 0 else ", reversed"
    yaw = f"yaw {run.yaw / si.DEGREE:+.3g} deg"
    return f"{run.tension / si.N_PER_MM2:.3g} N/mm2, {yaw}, {run.speed:g} m/s, {run.travel[-1]:.0f} m{direction}"
