"""The two spans during a march: what their ends, and what effects do between them, make of their curvature."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from belt_sim.case import Case
from belt_sim.effects.base import uses
from belt_sim.laws.inside import Bend, BoundaryValues, no_bend
from belt_sim.laws.runup import Contact, State, Yaw
from belt_sim.laws.span import Response, Span, response
from belt_sim.laws.wrap import RunOff


@dataclass(frozen=True)
class Spans:
    """One case while it is traced.

    answer: rows (2, 5), the span up the tail pulley first; known: what each effect of ``benders`` worked out of the
    span beforehand.
    """

    case: Case
    effects: tuple
    span: Span
    answer: Response
    benders: tuple
    known: tuple[Any, ...]

    @staticmethod
    def of(case: Case, effects: Sequence, span: Span) -> "Spans":
        """Condense the span, once a march."""
        benders = tuple(uses(effects, "bend"))
        known = tuple(e.influence(span, case) for e in benders)
        return Spans(case, tuple(effects), span, held_answers(case, effects, span), benders, known)

    def state(self, travel, since, y, alpha, off: RunOff, yaw: Yaw) -> State:
        """Everything that effects may ask of this instant; since: travel [m] of the one before."""
        span, case, answer = self.span, self.case, self.answer
        boundary = self.boundary_values(travel, y, alpha, off, yaw)
        bend = self.bend(boundary)
        bent, bent_off = _of(answer.runup, boundary) + bend.runup, _of(answer.runoff, boundary) + bend.runoff
        if span.limp:
            bent, bent_off = 0.0 * bent, 0.0 * bent_off
        return State(
            travel=travel,
            since=since + jnp.zeros(()),
            y=y,
            alpha=alpha,
            kappa=bent + bend.natural_runup,
            kappa_runoff=bent_off + bend.natural_runoff,
            moment=span.bending * bent,
            moment_runoff=span.bending * bent_off,
            added=bend.runup + bend.natural_runup,
            stiffness=(0.0 if span.limp else 1.0) * answer.runup[:, 2],
            bending=span.bending + jnp.zeros(()),
            turned=jnp.stack([yaw.tail, yaw.head]),
            left=off.turned[::-1],
            direction=case.settings.direction + jnp.zeros(()),
        )

    def slid(self, state: State, off: RunOff, yaw: Yaw) -> State:
        """The instant after the belt has turned on the pulleys, where effects let it."""
        for e in uses(self.effects, "slide"):
            contact = e.slide(Contact(y=state.y, alpha=state.alpha), state, self.case)
            state = self.state(state.travel, state.since, contact.y, contact.alpha, off, yaw)
        return state

    def boundary_values(self, travel, y, alpha, off: RunOff, yaw: Yaw) -> BoundaryValues:
        """Boundary values of both spans."""
        start, theta_o = off.y[::-1] + yaw.aside_runoff, yaw.runoff + off.alpha[::-1]
        rows = [y + yaw.aside_runup - start, theta_o, yaw.runup + alpha, yaw.roll_runoff, yaw.roll_runup]
        return BoundaryValues(travel=travel, start=start, ends=jnp.stack(rows), direction=self.case.settings.direction)

    def slope(self, y, off: RunOff, yaw: Yaw) -> jax.Array:
        """Of straight lines from run-off to run-up [rad], shape (2,)."""
        return (y + yaw.aside_runup - off.y[::-1] - yaw.aside_runoff) / self.span.length

    def bend(self, boundary: BoundaryValues) -> Bend:
        """What effects do between the ends."""
        bend = no_bend()
        for e, known in zip(self.benders, self.known, strict=True):
            bend = e.bend(bend, boundary, known, self.case)
        return bend

    def tilt(self, state: State, off: RunOff, yaw: Yaw) -> jax.Array:
        """Roll of both spans at their middle [rad], shape (2,)."""
        boundary = self.boundary_values(state.travel, state.y, state.alpha, off, yaw)
        return _of(self.answer.mid_tilt, boundary) + self.bend(boundary).tilt


def held_answers(case: Case, effects: Sequence, span: Span) -> Response:
    """What both spans answer to their ends as the pulleys hold them, rows (2, 5)."""
    answer = jax.tree.map(lambda row: jnp.stack([row, row]), response(span))
    for e in uses(effects, "hold"):
        answer = e.hold(answer, span, case)
    return answer


def _of(rows, boundary: BoundaryValues) -> jax.Array:
    """Rows (2, 5) of an answer times each span's boundary values, shape (2,)."""
    return jnp.sum(rows * boundary.ends.T, axis=1)
