"""The stages of a run in order: rest, tensioning, and running with a stop for every yaw step.

A stage gives the machine's command (Drive) step by step, and reads the state that results. Yaw steps are made while the
belt stands still, yaw ramps over travel.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from belt_sim.case import Schedule, Settings
from belt_sim.mujoco3d.machine import SceneLayout
from belt_sim.mujoco3d.options import REST_DRAG, Options, accelerate
from belt_sim.mujoco3d.state import RunState
from belt_sim.mujoco3d.tensioning import FRICTION, KollerPlan
from belt_sim.mujoco3d.wrap import TAIL


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Boundary values of a step, at its end.

    travel [m], speed [m/s], acceleration [m/s2]: of the belt, along its direction; yaw [rad], shape (2,): commanded,
    head and tail; share: how much of yaw offsets, cants and camber acts; slide_speed [m/s]: of a tail pulley that is
    moved, 0 = fixed, None = it follows the forces; lead [m/s]: how much faster than the belt the tail pulley's rim
    steadily goes; friction [1], inf = sticking; drag [1/s]: of the belt per unit of its mass, along x and across it.
    """

    travel: float
    speed: float = 0.0
    acceleration: float = 0.0
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    share: float = 0.0
    slide_speed: float | None = None
    lead: float = 0.0
    friction: float
    drag: tuple[float, float]


#: entries of a schedule: at [m], over [m], change [rad]
_Entries = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class YawPlan:
    """What the head and the tail pulley are to be turned by."""

    head: _Entries
    tail: _Entries

    @staticmethod
    def from_settings(settings: Settings) -> "YawPlan":
        """As it is set."""
        return YawPlan(_schedule_entries(settings.yaw_head), _schedule_entries(settings.yaw))

    def stops(self, until: float) -> set[float]:
        """Travels [m] of the steps within the run."""
        return {at for at, over, change in (*self.head, *self.tail) if over <= 0.0 and change and at < until}

    def angles(self, travel: float, done: float) -> np.ndarray:
        """Yaw [rad] of both at ``travel`` [m] when the steps up to travel ``done`` [m] have been made, shape (2,)."""
        return np.array([_yaw_angle(entries, travel, done) for entries in (self.head, self.tail)])

    def angles_during_step(self, travel: float, done: float, share: float) -> np.ndarray:
        """Yaw [rad] of both when ``share`` (0..1) of the step at ``travel`` [m] has been made, shape (2,)."""
        before = self.angles(travel, done)
        return before + share * (self.angles(travel, travel) - before)


def _schedule_entries(schedule: Schedule) -> _Entries:
    columns = (np.asarray(v, float).tolist() for v in (schedule.at, schedule.over, schedule.change))
    return tuple(zip(*columns, strict=True))


def _yaw_angle(entries: _Entries, travel: float, done: float) -> float:
    total = 0.0
    for at, over, change in entries:
        if over <= 0.0:
            total += change if at <= done else 0.0
        else:
            total += change * min(max((travel - at) / over, 0.0), 1.0)
    return total


def smoothstep(u: float) -> float:
    """From 0 at u = 0 to 1 at 1 and beyond, 3 u^2 - 2 u^3."""
    u = min(u, 1.0)
    return u * u * (3.0 - 2.0 * u)


_FRAMES = 40  # while the pulleys move apart
_NEVER = math.inf


class Stage(Protocol):
    """A part of a run. is_recorded: it belongs to the run-in and the run; frame [m]: travel between frames if not."""

    @property
    def is_recorded(self) -> bool: ...

    @property
    def frame(self) -> float: ...

    def drives(self, state: RunState) -> Iterator[Drive]:
        """One for each of its steps; ``state`` is that after the steps before."""


def run_stages(scene: SceneLayout, load: float, travel: float) -> list[Stage]:
    """What a run over ``travel`` [m] consists of; load [N]: force that the tail pulley is to carry."""
    options, parts = scene.options, scene.parts
    plan, end = YawPlan.from_settings(scene.case.settings), travel + 0.5 * options.sample
    order, done = _tensioning_stages(scene, load), -math.inf
    for stop in sorted(plan.stops(travel) | ({0.0} if parts.sets_in else set())):
        order.append(RunStage(options, parts.friction, plan, done, until=stop))
        order.append(YawStage(options, parts.friction, plan, done, at=stop))
        done = stop
    return [*order, RunStage(options, parts.friction, plan, done, until=_NEVER, end=end)]


def _tensioning_stages(scene: SceneLayout, load: float) -> list[Stage]:
    """The belt laid at its tension rests; the one laid slack gets it by Koller's procedure."""
    options, friction = scene.options, scene.parts.friction
    if scene.koller is None:
        return [RestStage(options, friction)]
    friction = min(friction, FRICTION)
    fixed, moved = RestStage(options, friction, slide_speed=0.0), KollerStage(options, friction, scene.koller, load)
    return [fixed, moved, RestStage(options, friction, forgets=True)]


@dataclass
class RestStage:
    """The spans hang to rest and the tail pulley finds its place; in the first half the belt sticks.

    slide_speed [m/s]: of the tail pulley, None = it follows the forces; forgets: it counts as never having slipped.
    """

    options: Options
    friction: float
    slide_speed: float | None = None
    forgets: bool = False
    is_recorded = False
    frame = _NEVER

    def drives(self, state: RunState) -> Iterator[Drive]:
        steps = math.ceil(self.options.settle / self.options.dt)
        for k in range(steps):
            yield Drive(
                travel=state.travel,
                slide_speed=self.slide_speed,
                friction=self.friction if 2 * k > steps else math.inf,
                drag=(REST_DRAG, REST_DRAG),
            )
        if self.forgets:
            state.slip[:] = 0.0
            for increments in state.slip_increments:
                increments[:] = 0.0


@dataclass
class KollerStage:
    """Koller's procedure: the slack belt is driven slowly while the tail pulley moves out, until its load is there.

    Meanwhile the belt slides on the pulleys: if it stuck, the stretch of its wraps would stay what it was when the
    belt was slack, and stations would leave the pulleys with a jerk. load [N]: of the tail pulley.
    """

    options: Options
    friction: float
    koller: KollerPlan
    load: float
    is_recorded = False

    @property
    def frame(self) -> float:
        return self.koller.travel / _FRAMES

    def drives(self, state: RunState) -> Iterator[Drive]:
        options, apart = self.options, self.koller
        until, top = -options.run_in, min(apart.speed, options.run_speed)
        start, led = until - apart.travel, True
        while state.travel < until:
            place = apart.places_at(state.travel - start)
            travel, speed = accelerate(state.travel, state.speed, until, top, options.acceleration, options.dt)
            led = led and -state.loads[TAIL, 0] < self.load and travel < until
            slide, lead = (apart.places_at(travel - start) - place) / options.dt
            yield Drive(
                travel=travel,
                speed=speed,
                acceleration=(speed - state.speed) / options.dt,
                slide_speed=slide if led else None,
                lead=lead if led else 0.0,
                friction=self.friction,
                drag=(0.0, options.damping),
            )


@dataclass
class RunStage:
    """The belt runs until it stands still at a stop, or for good to ``end`` [m].

    done [m]: travel up to which the yaw steps have been made; until [m]: the stop ahead.
    """

    options: Options
    friction: float
    plan: YawPlan
    done: float
    until: float
    end: float = math.inf
    is_recorded = True
    frame = _NEVER

    def drives(self, state: RunState) -> Iterator[Drive]:
        options, arrived = self.options, False
        while not arrived and state.travel < self.end:
            travel, speed = accelerate(
                state.travel, state.speed, self.until, options.run_speed, options.acceleration, options.dt
            )
            arrived = travel == self.until
            yield Drive(
                travel=travel,
                speed=speed,
                acceleration=(speed - state.speed) / options.dt,
                yaw=self.plan.angles(travel, self.done),
                share=float(self.done >= 0.0),
                friction=self.friction,
                drag=(0.0, options.damping),
            )


@dataclass
class YawStage:
    """The belt stands still for a yaw step, and a while after it; at travel 0 yaw offsets, cants and camber come in."""

    options: Options
    friction: float
    plan: YawPlan
    done: float
    at: float
    is_recorded = True
    frame = _NEVER

    def drives(self, state: RunState) -> Iterator[Drive]:
        options, since = self.options, state.time
        while (passed := state.time + options.dt - since) < options.yaw_time + 0.5 * options.settle:
            share = smoothstep(passed / options.yaw_time)
            yield Drive(
                travel=self.at,
                yaw=self.plan.angles_during_step(self.at, self.done, share),
                share=1.0 if self.done >= 0.0 else share if self.at >= 0.0 else 0.0,
                friction=self.friction,
                drag=(0.0, options.damping),
            )
