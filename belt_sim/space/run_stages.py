"""The commands of a run, step by step: rest, tensioning, and running with a stop for every yaw step.

A stage yields the command of every step and reads the state that results. Yaw steps are made while the belt stands
still, yaw ramps over travel.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from belt_sim.case import Numbers as Array
from belt_sim.case import Schedule, Settings
from belt_sim.space.loop import smoothstep
from belt_sim.space.machine import SceneLayout
from belt_sim.space.options import REST_DRAG, accelerate
from belt_sim.space.tensioning import FRICTION
from belt_sim.space.wrap import TAIL


class Command(NamedTuple):
    """Boundary values of a step, at its end; of many steps with a leading axis of steps.

    travel [m]: of the belt; yaw [rad], (2,): commanded, head and tail; share [1]: of yaw offsets, cants, camber and
    loads that acts; speed [m/s], acceleration [m/s2]: of the belt, along its direction; drag [1/s], (2,): of the belt
    per unit of its mass, along x and across it; friction [1], inf = sticking; tail_motion, (2,): speed of the tail
    pulley's slide and how much faster than the belt its rim steadily goes [m/s], None = it follows the forces.
    engine=quasi_static reads the first three alone, engine=mjx the first six.
    """

    travel: Array
    yaw: Array
    share: Array
    speed: Array = None
    acceleration: Array = None
    drag: Array = None
    friction: Array = None
    tail_motion: Array = None


def apply_command(state: Any, command: Command, dt: float) -> None:
    """Set travel, speed, time, yaw and share of a state to those of the end of a step of ``dt`` [s]."""
    state.time += dt
    state.travel, state.speed, state.yaw, state.share = command.travel, command.speed, command.yaw, command.share


#: entries of a schedule: at [m], over [m], change [rad]
_Entries = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class YawPlan:
    """The yaw schedules of the head and the tail pulley, whose steps are made while the belt stands still."""

    head: _Entries
    tail: _Entries

    @staticmethod
    def from_settings(settings: Settings, step_over: float = 0.0) -> "YawPlan":
        """step_over [m]: travel over which a step is made, 0 = it is made at rest."""

        def entries(schedule: Schedule) -> _Entries:
            at, over, change = (np.asarray(v, float) for v in (schedule.at, schedule.over, schedule.change))
            over = np.where(over > 0.0, over, step_over)
            return tuple(zip(at.tolist(), over.tolist(), change.tolist(), strict=True))

        return YawPlan(entries(settings.yaw_head), entries(settings.yaw))

    def stops(self, until: float) -> set[float]:
        """Travels [m] of the steps within the run."""
        return {at for at, over, change in (*self.head, *self.tail) if over <= 0.0 and change and at < until}

    def angles(self, travel: float, done: float) -> np.ndarray:
        """Yaw [rad] of both at ``travel`` [m] when the steps up to travel ``done`` [m] have been made, shape (2,)."""

        def share(at: float, over: float) -> float:
            return min(max((travel - at) / over, 0.0), 1.0) if over > 0.0 else float(at <= done)

        return np.array([sum(c * share(at, over) for at, over, c in entries) for entries in (self.head, self.tail)])

    def angles_during_step(self, travel: float, done: float, share: float) -> np.ndarray:
        """Yaw [rad] of both when ``share`` (0..1) of the step at ``travel`` [m] has been made, shape (2,)."""
        before = self.angles(travel, done)
        return before + share * (self.angles(travel, travel) - before)


class Stage(NamedTuple):
    """A part of a run. commands(state): one for each of its steps, ``state`` being that after the steps before;
    is_recorded: it belongs to the run-in and the run; frame [m]: travel between frames if it does not."""

    commands: Callable[[Any], Iterator[Command]]
    is_recorded: bool = False
    frame: float = math.inf


_FRAMES = 40  # while the pulleys move apart


def run_stages(scene: SceneLayout, load: float, travel: float) -> list[Stage]:
    """The stages of a run over ``travel`` [m]; load [N]: force that the tail pulley is to carry.

    The belt laid at its tension rests; the one laid slack gets it by Koller's procedure before it rests.
    """
    run, friction = Stage(partial(_run, scene, travel), is_recorded=True), scene.parts.friction
    if scene.koller is None:
        return [Stage(partial(_rest, scene, friction)), run]
    friction = min(friction, FRICTION)
    return [
        Stage(partial(_rest, scene, friction, tail_motion=(0.0, 0.0))),
        Stage(partial(_tension_by_koller, scene, friction, load), frame=scene.koller.travel / _FRAMES),
        Stage(partial(_rest, scene, friction, reset_slip=True)),
        run,
    ]


def _rest(
    scene: SceneLayout, friction: float, state: Any, tail_motion: Array = None, reset_slip: bool = False
) -> Iterator[Command]:
    """The spans hang to rest and the tail pulley finds its place; in the first half the belt sticks.

    reset_slip: afterwards the belt counts as never having slipped.
    """
    steps, drag = math.ceil(scene.options.settle / scene.options.dt), (REST_DRAG, REST_DRAG)
    for k in range(steps):
        coulomb = friction if 2 * k > steps else math.inf
        yield Command(state.travel, np.zeros(2), 0.0, 0.0, 0.0, drag, coulomb, tail_motion)
    if reset_slip:
        state.slip = jax.tree.map(np.zeros_like, state.slip)


def _tension_by_koller(scene: SceneLayout, friction: float, load: float, state: Any) -> Iterator[Command]:
    """Koller's procedure: the slack belt is driven slowly while the tail pulley moves out, until its load is there.

    Meanwhile the belt slides on the pulleys: if it stuck, the stretch of its wraps would stay what it was when the
    belt was slack, and stations would leave the pulleys with a jerk. load [N]: of the tail pulley.
    """
    options, apart = scene.options, scene.koller
    assert apart is not None
    until, top = -options.run_in, min(apart.speed, options.run_speed)
    start, moves, drag = until - apart.travel, True, (0.0, options.damping)
    while state.travel < until:
        before = apart.places_at(state.travel - start)
        travel, speed = accelerate(state.travel, state.speed, until, top, options.acceleration, options.dt)
        moves = moves and -state.loads[TAIL, 0] < load and travel < until
        slide, lead = (apart.places_at(travel - start) - before) / options.dt
        acceleration = (speed - state.speed) / options.dt
        yield Command(travel, np.zeros(2), 0.0, speed, acceleration, drag, friction, (slide, lead) if moves else None)


def _run(scene: SceneLayout, end: float, state: Any) -> Iterator[Command]:
    """The run-in and the run over ``end`` [m] of travel; the belt stands still for a yaw step, and a while after it.

    At travel 0 yaw offsets, cants and camber set in, as a yaw step does.
    """
    options, parts, plan = scene.options, scene.parts, YawPlan.from_settings(scene.case.settings)
    drag, done = (0.0, options.damping), -math.inf
    for stop in [*sorted(plan.stops(end) | ({0.0} if parts.sets_in else set())), math.inf]:
        arrived = False
        while not arrived and state.travel < end + 0.5 * options.sample:
            fastest = options.run_speed, options.acceleration
            travel, speed = accelerate(state.travel, state.speed, stop, *fastest, options.dt)
            acceleration, arrived = (speed - state.speed) / options.dt, travel == stop
            yaw, share = plan.angles(travel, done), float(done >= 0.0)
            yield Command(travel, yaw, share, speed, acceleration, drag, parts.friction)
        if not arrived:
            return
        begun = state.time
        while (passed := state.time + options.dt - begun) < options.yaw_time + 0.5 * options.settle:
            part = smoothstep(passed / options.yaw_time)
            share = 1.0 if done >= 0.0 else part if stop >= 0.0 else 0.0
            yield Command(stop, plan.angles_during_step(stop, done, part), share, 0.0, 0.0, drag, parts.friction)
        done = stop
