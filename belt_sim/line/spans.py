"""A composition of laws, its two spans during a march, and their steady drift in closed form."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import SensorPlace
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.jax_setup import PROGRAMS, StoredProgram, in_float64, program_key
from belt_sim.line.hooks import (
    AFTER_ENGINE,
    BEFORE_ENGINE,
    IN_MARCH,
    Hooks,
    apply_hook,
    call_hook,
    overrides,
    uses,
    where_acting,
)
from belt_sim.line.runup import Contact, RunOff, State, Yaw, sag_angle
from belt_sim.line.span import (
    Bend,
    BoundaryValues,
    Response,
    Span,
    condense,
    dimensionless,
    place_row,
    response,
    span_fields,
)

NEAREST_PLACE = 1e-3  # of the length: nearer to an end, a span is as good as straight, and a piece of it too short
#: hooks that a march can apply
ALL_HOOKS = frozenset({*BEFORE_ENGINE, *IN_MARCH, *AFTER_ENGINE})


@dataclass(frozen=True, kw_only=True)
class Composition:
    """A named composition of laws, with its span law; all share the others. hooks: of effects that it applies;
    contains: ids of effects that are part of its laws; built_in: effects that always act; moments: whether spans carry
    them."""

    name: str
    title: str
    span: Callable[[Case], Span]
    hooks: frozenset[str] = ALL_HOOKS
    contains: frozenset[str] = frozenset()
    built_in: tuple[Hooks, ...] = ()
    moments: bool = True

    def refusal(self, effect: Hooks | type[Hooks]) -> str | None:
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

    def admit(self, effects: Sequence[Hooks]) -> None:
        """Raise CannotRepresent for the first effect that this model cannot represent."""
        for effect in effects:
            if reason := self.refusal(effect):
                others = " or ".join(name for name in ("beam_th2", "strip") if name != self.name)
                remedy = "leave it out" + ("" if effect.id in self.contains else f" or use model={others}")
                raise CannotRepresent(f"effects = {effect.id}: {reason}; {remedy}")

    def steady_rate(self, case: Case) -> float:
        """Return the late drift w = dy/ds of all four points [m/m] for the last yaw of both schedules, without effects:
        w = L (w1 - w0)(beta - beta_h) / (2 L + W_t + W_h); w1 - w0 is the mean of both spans'."""
        return float(steady_traced(case, self, sum(runup_weights(case, self)) / 2.0))


@dataclass(frozen=True)
class Spans:
    """Both spans of one case while it is traced; answer: responses, rows (2, 5), the span up the tail pulley first;
    benders: effects with the hook ``bend``; known: the result of each one's ``influence``."""

    case: Case
    effects: tuple
    span: Span
    answer: Response
    benders: tuple
    known: tuple[Any, ...]

    @staticmethod
    def from_case(case: Case, effects: Sequence, model: Composition) -> "Spans":
        """Condense the span of a case with actual settings, once per march."""
        span = apply_hook(effects, "span", model.span(case), case)
        benders = tuple(uses(effects, "bend"))
        bent, known = replace(span, fields=span_fields(span)) if benders else span, []
        for e in benders:
            needs, none = (lambda _, e=e: e.influence(bent, case)), None
            if e.acts is not None:  # zeros where the effect is null in a whole batch
                none = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(needs, None))
            known.append(where_acting(e, needs, none))
        return Spans(case, tuple(effects), span, span_responses(case, effects, span), benders, tuple(known))

    def state(self, travel, since, y, alpha, off: RunOff, yaw: Yaw) -> State:
        """Return the state at this instant; since: travel [m] of the instant before."""
        span, case, answer = self.span, self.case, self.answer
        boundary = self.boundary_values(travel, y, alpha, off, yaw)
        bend = self.bend(boundary)
        bent = jnp.sum(answer.runup * boundary.ends.T, axis=1) + bend.runup
        bent_off = jnp.sum(answer.runoff * boundary.ends.T, axis=1) + bend.runoff
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

            def slid(state, e=e):
                contact = call_hook(e, "slide", Contact(y=state.y, alpha=state.alpha), state, self.case)
                return self.state(state.travel, state.since, contact.y, contact.alpha, off, yaw)

            state = where_acting(e, slid, state)
        return state

    def boundary_values(self, travel, y, alpha, off: RunOff, yaw: Yaw) -> BoundaryValues:
        """Return the boundary values of both spans."""
        start, theta_o = off.y[::-1] + yaw.aside_runoff, yaw.runoff + off.alpha[::-1]
        rows = [y + yaw.aside_runup - start, theta_o, yaw.runup + alpha, yaw.roll_runoff, yaw.roll_runup]
        return BoundaryValues(travel=travel, start=start, ends=jnp.stack(rows), direction=self.case.settings.direction)

    def bend(self, boundary: BoundaryValues) -> Bend:
        """Return what effects add inside the spans."""
        bend = Bend()
        for e, known in zip(self.benders, self.known, strict=True):
            bend = where_acting(
                e, lambda x, e=e, known=known: call_hook(e, "bend", x, boundary, known, self.case), bend
            )
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
        span, forward = self.span, self.case.settings.direction > 0
        share, found = place.distance / span.length, []
        for s in (1.0 - share, share):  # y there less y at the run-off, up the tail, up the head pulley
            if span.limp:
                found.append(s * jnp.array([1.0, 0.0, 0.0, 0.0, 0.0]))
                continue
            within = jnp.clip(s, NEAREST_PLACE, 1.0 - NEAREST_PLACE)
            row = place_row(span, [condense(dimensionless(span)[0], part)[-1] for part in (within, 1.0 - within)])
            beyond = (s - within) * span.length  # along the angle of the end that is near
            found.append(row + beyond * jnp.where(s < 0.5, jnp.eye(5)[1], jnp.eye(5)[2]))
        rows = jnp.stack(found)
        which = jnp.where(forward == (place.where == "upper_span"), 0, 1)

        def read(state: State, off: RunOff, yaw: Yaw) -> jax.Array:
            boundary = self.boundary_values(state.travel, state.y, state.alpha, off, yaw)
            return (boundary.start + jnp.sum(rows * boundary.ends.T, axis=1))[which]

        return read


def span_responses(case: Case, effects: Sequence, span: Span) -> Response:
    """Return the responses of both spans, rows (2, 5), after effects with the hook ``hold``."""
    answer = jax.tree.map(lambda row: jnp.stack([row, row]), response(span))
    return apply_hook(effects, "hold", answer, span, case)


# Steady drift: linear spans (docs/theory.md) and Ritzinger's edge ropes (paper eq. 16-18).


LIMPEST = 20.0  # chord over twice the catenary's parameter: such a rope hangs 10^7 chords deep


@lru_cache(PROGRAMS)
def _at_runup(model: Composition) -> StoredProgram:
    """Rows at the run-up of a case, the built-in effects and a span; uncompiled it takes a second."""
    key = program_key("responses at the run-up", model, ())
    return StoredProgram(lambda case, effects, span: span_responses(case, effects, span).runup, key, brief=True)


@in_float64
def runup_weights(case: Case, model: Composition) -> tuple[float, float]:
    """Return w1 of y_u - y_o = L (w0 theta_o + w1 theta_u), w0 + w1 = 1, with kappa = 0 at the run-up [1], for the
    spans up the tail and the head pulley: rope 1, beam of first order 2/3, of second order Shelton's curvature
    factor."""
    span = model.span(case)
    if span.limp:
        return 1.0, 1.0
    rows = np.asarray(_at_runup(model)(case, model.built_in, span))
    tail, head = -rows[:, 2] / (rows[:, 0] * span.length)
    return float(tail), float(head)


def steady_traced(case: Case, model: Composition, w1: Any = None):
    """Like ``Composition.steady_rate``, for use inside jit and vmap; w1: where it is known, the mean of both spans."""
    rig, settings, span = case.rig, case.settings, model.span(case)
    if w1 is None and span.limp:
        w1 = 1.0
    elif w1 is None:
        rows = span_responses(case, model.built_in, span).runup
        w1 = jnp.mean(-rows[:, 2] / (rows[:, 0] * span.length))
    yaw = settings.yaw.last() - settings.yaw_head.last()
    return rig.span_length * (2 * w1 - 1) * yaw / (2 * rig.span_length + rig.wrap_tail + rig.wrap_head)


@dataclass(frozen=True, kw_only=True)
class RitzingerFormula:
    """Ritzinger's model of the steady rate: two catenary edge ropes."""

    name: str = "ritzinger"
    title: str = "Ritzinger's edge ropes"

    def refusal(self, effect) -> str | None:
        """Return why it cannot represent an effect: it reads none."""
        return f"model {self.name} is a formula for the steady rate and reads no effects"

    def steady_rate(self, case: Case) -> float:
        """Return w_ext = w_Th1 T_requ/T_belt [m/m] (paper eq. 18); the moments are even in yaw: the sign is w_Th1's.

        The belt's two edges are independent elastic catenaries. Yawing the pulley by beta lengthens one chord by
        b beta/2 and shortens the other; the difference of their tensions makes T_requ (eq. 16), to be compared with the
        beam's T_belt = 4 E I beta/a (eq. 17).

        The paper says that each rope carries half the weight, and nothing of its force and section. We read: the full
        force and the full section. Then the rate is 1.5 w_Th1/(1 + Lambda/4), which is what the paper says of it: like
        the beam of 2nd order at medium tension, much lower below. With half of both it would be
        0.75 w_Th1/(1 + Lambda), half of that beam at 40 N/mm2.
        """
        rig, belt = case.rig, case.belt
        if not float(rig.gravity) > 0.0:
            given = f"{float(rig.gravity):g}"
            raise InputError("rig.gravity", given, "m/s2", "Ritzinger's formula compares hanging edges")
        beta = float(case.settings.yaw.last() - case.settings.yaw_head.last())
        if beta == 0.0:
            return 0.0
        length = float(rig.span_length)
        first_order = length * beta / 3.0 / (2 * length + float(rig.wrap_head + rig.wrap_tail))
        tight, slack = edge_tensions(case, abs(beta))
        required = (tight - slack) * belt.width / 2.0
        return first_order * required / (4 * belt.bending_stiffness * abs(beta) / length)


def edge_tensions(case: Case, beta: float) -> tuple[float, float]:
    """Return the horizontal tensions F1, F2 [N] of the edge that a yaw beta > 0 [rad] lengthens, and of the other."""
    weight = float(case.weight_per_length) / 2.0
    stiffness = case.belt.youngs_modulus * case.belt.area
    stated, straight, b = float(case.tension_force), float(case.rig.span_length), case.belt.width
    if straight * weight / (2.0 * stated) > LIMPEST:
        remedy = f"no rope hangs so over {straight:g} m; raise the tension"
        raise InputError("tension", f"{stated:g}", "N an edge", remedy)

    def stretched_less(force: float, chord: float, unstretched: float) -> float:
        """Length of a catenary [m] with a horizontal tension over a chord, less that of the rope which it stretches."""
        c = force / weight
        return 2.0 * c * math.sinh(chord / (2.0 * c)) - unstretched * (1.0 + force / stiffness)

    from scipy.optimize import brentq  # slow to import, and only this model needs it

    unstretched, found = stretched_less(stated, straight, 0.0) / (1.0 + stated / stiffness), []
    for chord in (straight + b * beta / 2, straight - b * beta / 2):
        ends = max(stated * 0.02, chord * weight / (2.0 * LIMPEST)), stated * 50.0 + stiffness * 1e-3
        low, high = (stretched_less(end, chord, unstretched) for end in ends)
        if low * high > 0.0:
            remedy = "an edge cannot hang in equilibrium after this yaw; raise the tension or turn the pulley less"
            raise InputError("tension", f"{stated:g}", "N an edge", remedy)
        found.append(float(brentq(stretched_less, *ends, args=(chord, unstretched), xtol=1e-9 * stated)))
    return found[0], found[1]
