"""A composition of laws, and its two spans during a march: curvature and roll from boundary values, loads, effects."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from belt_sim.case import Case
from belt_sim.curves import SensorPlace
from belt_sim.effects.base import AFTER_ENGINE, BEFORE_ENGINE, IN_MARCH, Effect, apply_hook, call_hook, overrides, uses
from belt_sim.errors import CannotRepresent
from belt_sim.line.influence import Bend, BoundaryValues, no_bend, place_row
from belt_sim.line.runup import Contact, RunOff, State, Yaw, sag_angle
from belt_sim.line.span import Response, Span, response

#: hooks that a march can apply
ALL_HOOKS = frozenset({*BEFORE_ENGINE, *IN_MARCH, *AFTER_ENGINE})


@dataclass(frozen=True, kw_only=True)
class Composition:
    """A named composition of laws; all share the run-up, wrap, drive and sensor laws.

    span: span law, Case -> Span; hooks: hooks of effects that it applies; contains: ids of effects that are part of its
    laws; built_in: effects that always act; moments: whether its spans carry bending moments.
    """

    name: str
    title: str
    span: Callable[[Case], Span]
    hooks: frozenset[str] = ALL_HOOKS
    contains: frozenset[str] = frozenset()
    built_in: tuple[Effect, ...] = ()
    moments: bool = True

    def refusal(self, effect: Effect | type[Effect]) -> str | None:
        """Return why this model cannot represent ``effect``; None if it can."""
        if effect.id in self.contains:
            return f"model {self.name} has {effect.id} built in already"
        if "sag" in effect.needs and "sag_roll" not in self.contains:
            return f"the spans of model {self.name} do not hang, and {effect.id} acts through their roll"
        if "moment" in effect.needs and not self.moments:
            return f"the spans of model {self.name} bear no moment for {effect.id} to answer to"
        missing = overrides(effect, sorted(ALL_HOOKS)) - self.hooks
        if missing:
            return f"model {self.name} has no {'/'.join(sorted(missing))} law for {effect.id} to change"
        return None

    def admit(self, effects: Sequence[Effect]) -> None:
        """Raise CannotRepresent for the first effect that this model cannot represent."""
        for effect in effects:
            reason = self.refusal(effect)
            if reason:
                raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out or use model=beam_th2 or strip")


@dataclass(frozen=True)
class Spans:
    """Both spans of one case while it is traced.

    answer: responses, rows (2, 5), the span up the tail pulley first; benders: effects with the hook ``bend``; known:
    the result of each one's ``influence``.
    """

    case: Case
    effects: tuple
    span: Span
    answer: Response
    benders: tuple
    known: tuple[Any, ...]

    @staticmethod
    def from_case(case: Case, effects: Sequence, span: Span) -> "Spans":
        """Condense the span, once per march."""
        benders = tuple(uses(effects, "bend"))
        known = tuple(e.influence(span, case) for e in benders)
        return Spans(case, tuple(effects), span, span_responses(case, effects, span), benders, known)

    def state(self, travel, since, y, alpha, off: RunOff, yaw: Yaw) -> State:
        """Return the state at this instant; since: travel [m] of the instant before."""
        span, case, answer = self.span, self.case, self.answer
        boundary = self.boundary_values(travel, y, alpha, off, yaw)
        bend = self.bend(boundary)
        bent, bent_off = _apply(answer.runup, boundary) + bend.runup, _apply(answer.runoff, boundary) + bend.runoff
        if span.limp:
            bent, bent_off = 0.0 * bent, 0.0 * bent_off
        moment, moment_off = span.bending * bent, span.bending * bent_off
        turned = boundary.ends[2] - boundary.ends[0] / span.length  # against the chord
        across = (moment - moment_off) / span.length + span.force * turned + bend.side_force
        return State(
            travel=travel,
            since=since + jnp.zeros(()),
            y=y,
            alpha=alpha,
            y_runoff=off.y,
            kappa=bent + bend.natural_runup,
            kappa_runoff=bent_off + bend.natural_runoff,
            moment=moment,
            moment_runoff=moment_off,
            side_force=across / (1.0 + span.force * span.shear),
            added=bend.runup + bend.natural_runup,
            stiffness=(0.0 if span.limp else 1.0) * answer.runup[:, 2],
            bending=span.bending + jnp.zeros(()),
            turned=jnp.stack([yaw.tail, yaw.head]),
            left=off.turned[::-1],
            sag_angle=(sag_angle(case) if span.limp else span.sag_curvature * span.length / 2.0) + jnp.zeros(()),
            direction=case.settings.direction + jnp.zeros(()),
        )

    def apply_slides(self, state: State, off: RunOff, yaw: Yaw) -> State:
        """Return the state after effects with the hook ``slide`` have moved the belt on the pulleys."""
        for e in uses(self.effects, "slide"):
            contact = call_hook(e, "slide", Contact(y=state.y, alpha=state.alpha), state, self.case)
            state = self.state(state.travel, state.since, contact.y, contact.alpha, off, yaw)
        return state

    def boundary_values(self, travel, y, alpha, off: RunOff, yaw: Yaw) -> BoundaryValues:
        """Return the boundary values of both spans."""
        start, theta_o = off.y[::-1] + yaw.aside_runoff, yaw.runoff + off.alpha[::-1]
        rows = [y + yaw.aside_runup - start, theta_o, yaw.runup + alpha, yaw.roll_runoff, yaw.roll_runup]
        return BoundaryValues(travel=travel, start=start, ends=jnp.stack(rows), direction=self.case.settings.direction)

    def slope(self, y, off: RunOff, yaw: Yaw) -> jax.Array:
        """Return the slopes of straight lines from run-off to run-up [rad], shape (2,)."""
        return (y + yaw.aside_runup - off.y[::-1] - yaw.aside_runoff) / self.span.length

    def bend(self, boundary: BoundaryValues) -> Bend:
        """Return what effects add inside the spans."""
        bend = no_bend()
        for e, known in zip(self.benders, self.known, strict=True):
            bend = call_hook(e, "bend", bend, boundary, known, self.case)
        return bend

    def shape_at(self, place: SensorPlace) -> Callable[[State, RunOff, Yaw], jax.Array]:
        """Return a function (state, run-offs, yaw) -> y [m] at a place inside a span, effects there not counted.

        On a wrap it is what the pulley's yaw moves the place by since the belt ran up.
        """
        if place.on_wrap:
            rig, tail = self.case.rig, place.where == "tail_wrap"
            around, radius = (rig.wrap_tail, rig.tail_radius) if tail else (rig.wrap_head, rig.head_radius)
            outwards = radius * jnp.sin(jnp.pi * place.distance / around)
            return lambda state, off, yaw: outwards * (yaw.tail if tail else -yaw.head)
        share, forward = place.distance / self.span.length, self.case.settings.direction > 0
        rows = jnp.stack([place_row(self.span, s) for s in (1.0 - share, share)])  # up the tail, up the head pulley
        which = jnp.where(forward == (place.where == "upper_span"), 0, 1)

        def read(state: State, off: RunOff, yaw: Yaw) -> jax.Array:
            boundary = self.boundary_values(state.travel, state.y, state.alpha, off, yaw)
            return (boundary.start + _apply(rows, boundary))[which]

        return read

    def tilt(self, state: State, off: RunOff, yaw: Yaw) -> jax.Array:
        """Return the roll of both spans at mid-span [rad], shape (2,)."""
        boundary = self.boundary_values(state.travel, state.y, state.alpha, off, yaw)
        return _apply(self.answer.mid_tilt, boundary) + self.bend(boundary).tilt


def span_responses(case: Case, effects: Sequence, span: Span) -> Response:
    """Return the responses of both spans, rows (2, 5), after effects with the hook ``hold``."""
    answer = jax.tree.map(lambda row: jnp.stack([row, row]), response(span))
    return apply_hook(effects, "hold", answer, span, case)


def _apply(rows, boundary: BoundaryValues) -> jax.Array:
    """Multiply rows (2, 5) of a response by the boundary values of each span, shape (2,)."""
    return jnp.sum(rows * boundary.ends.T, axis=1)
