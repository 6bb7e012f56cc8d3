"""Impulse responses of every run: what a short pulse of input at every channel of the march does to it.

A channel is an elementary entry of the march that takes an input u(travel). At fixed tension the march is linear in
small inputs and does not change with travel, so one pulse a run and channel gives the whole operator.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.programs import ROWS, room_for
from belt_sim.effects.base import Effect, effect, parameter
from belt_sim.effects.law import AT_PULLEYS, BY_THE_BELT, PULLEYS, RELATIVE
from belt_sim.jax_setup import PROGRAMS, StoredProgram, in_float64, program_key
from belt_sim.line.hooks import apply_hook, as_driven, overrides, true_travel
from belt_sim.line.influence import StretchResponse, stretch_response
from belt_sim.line.march import march_open, plan_steps
from belt_sim.line.span import log_of_change, response_by_change

#: every kind of input at the tail and at the head pulley
CHANNELS = tuple(f"{kind}_{pulley}" for kind in AT_PULLEYS for pulley in PULLEYS)

CELLS = 240  # of the input along the longest run, at most
OUTSIDE_MARCH = {"encoder", "sensor_travel", "sensor", "scene"}  # hooks that a march does not call
Y, MOMENT, TILT = 0, 8, 10  # first rows of what is kept, see ImpulseResponses
_SCALES = {"rad": 1e-4, "1/m": 1e-5, "m": 1e-4}


def drift_at(pulley: int) -> str:
    """The channel of sideways drift where the belt runs up a pulley (0: tail, 1: head)."""
    return f"drift_{PULLEYS[pulley]}"


def _height(unit: str):
    return parameter(unit, "height of the pulse", plausible=(-1.0, 1.0), scale=_SCALES[unit])


def _length(meaning: str):
    return parameter("m", meaning, plausible=(0.0, 1e3), scale=1.0, null=1.0, modifier=True)


@effect
class Pulse(Effect):
    """A triangular pulse of input at every channel: yaw of a pulley's surface, turn and drift at the run-ups, shift and
    twist over the wrapped arcs."""

    law = "run-up"
    reference = "none: an input to take impulse responses with"
    yaw_tail: float = _height("rad")
    yaw_head: float = _height("rad")
    turn_tail: float = _height("1/m")
    turn_head: float = _height("1/m")
    drift_tail: float = _height("rad")
    drift_head: float = _height("rad")
    shift_tail: float = _height("m")
    shift_head: float = _height("m")
    twist_tail: float = _height("rad")
    twist_head: float = _height("rad")
    middle: float = _length("travel at its height")
    half: float = _length("travel from its height to its foot")

    def _pulse_height(self, state, name):
        height = jnp.stack([getattr(self, f"{name}_tail"), getattr(self, f"{name}_head")])
        return height * jnp.maximum(0.0, 1.0 - jnp.abs(state.travel - self.middle) / self.half)

    def yaw(self, yaw, state, case):
        tail, head = self._pulse_height(state, "yaw")
        return replace(yaw, tail=yaw.tail + tail, head=yaw.head + head)

    def runup(self, runup, state, case):
        return replace(
            runup,
            turn=runup.turn + self._pulse_height(state, "turn"),
            drift=runup.drift + self._pulse_height(state, "drift"),
        )

    def wrap(self, runoff, state, case):
        return replace(
            runoff,
            y=runoff.y + self._pulse_height(state, "shift"),
            alpha=runoff.alpha + self._pulse_height(state, "twist"),
        )


@dataclass(frozen=True, kw_only=True)
class ImpulseResponses:
    """What the march of every run does with an input.

    grid (J,): travels [m] at which an input is given, linear in between; fine (n,): travels of the records;
    curves (R, 12, n): y and angle at run-up tail, run-up head, run-off tail, run-off head, then moment and tilt of the
    span up the tail and up the head; pulses (R, channels, 12, n): what a pulse of height 1 at grid[1] adds.
    """

    grid: np.ndarray
    fine: np.ndarray
    curves: np.ndarray
    pulses: np.ndarray

    def cell_responses(self, rows: np.ndarray, where: np.ndarray) -> np.ndarray:
        """Responses to inputs in every cell: rows (..., n) of pulses -> (..., len(where), J) at travels ``where``."""
        step = self.grid[1] - self.grid[0]
        back = where[:, None] - self.grid[None, :] + step  # travel since the pulse's foot
        return _interpolate(rows, self.fine[1] - self.fine[0], back)


def _interpolate(rows: np.ndarray, spacing: float, where: np.ndarray) -> np.ndarray:
    """Rows (..., n), zero before their start, at ``where`` (a, J); the first cell is half a pulse."""
    place = np.clip(where / spacing, 0.0, rows.shape[-1] - 1.001)
    low = place.astype(int)
    part = (place - low).astype(rows.dtype)
    found = rows[..., low] * (1.0 - part) + rows[..., low + 1] * part
    found[..., 0] *= 0.5
    return found


def impulse_responses(bench: Workbench, fit: Fit, among: Sequence[str] = ()) -> ImpulseResponses:
    """Responses with the effects of a fit at work; among: ids of all that are at work in any of several fits, which
    then share compiled code."""
    forward = bench.forward
    samples, effects = forward.samples, forward.effects_at(fit.vector, (*fit.ids, *among))
    true_end = np.max(in_float64(true_travel)(effects, samples.cases, samples.end))  # whatever the encoder says
    far = max(float(true_end), samples.end)
    step = forward.step * max(2, int(np.ceil(far / CELLS / forward.step)))
    cells = int(np.ceil(far / step)) + 1
    travel = step * (cells + 1)
    steps, _, slots = plan_steps(samples.cases, travel=travel, step=forward.step, keep=forward.step)
    acting = tuple(e for e in effects if overrides(e) - OUTSIDE_MARCH)
    march = _compile_march(forward.model, tuple(map(type, acting)), *room_for(steps, slots))
    runs = np.arange(-(-len(samples.runs) // ROWS) * ROWS).clip(max=len(samples.runs) - 1)
    found = []
    for rows in runs.reshape(-1, ROWS):
        settings = jax.tree.map(lambda x, rows=rows: np.asarray(x)[rows], samples.cases.settings)
        found.append(march(acting, replace(samples.cases, settings=settings), step, travel / steps, steps))
    curves, pulses = (np.concatenate(rows)[: len(samples.runs), ..., : steps + 1] for rows in zip(*found, strict=True))
    return ImpulseResponses(
        grid=step * np.arange(cells), fine=np.linspace(0.0, travel, steps + 1), curves=curves, pulses=pulses
    )


@lru_cache(PROGRAMS)
def _compile_march(model, classes, room: int, history: int):
    one = partial(_respond, model=model, room=room, history=history)
    axes = (None, Case(rig=None, belt=None, settings=0), None, None, None)  # type: ignore[arg-type]
    key = program_key("impulse responses", model, classes, room, history)
    return StoredProgram(jax.vmap(one, in_axes=axes), key, brief=True)


def _respond(effects: tuple[Effect, ...], case: Case, step, spacing, steps, *, model, room, history):
    """Rows (12, n) of one run, and what a pulse at each channel adds (channels, 12, n)."""

    def rows(heights):
        pulse = Pulse(**dict(zip(CHANNELS, heights, strict=True)), middle=step, half=step)
        march = partial(march_open, model=model, room=room, slots=history, only=("y", "angle", "moment", "tilt"))
        return _sort_by_pulley(march(case, (*effects, pulse), spacing, steps), case)

    none = jnp.zeros(len(CHANNELS))
    along = jax.vmap(lambda d: jax.jvp(rows, (none,), (d,)))(jnp.eye(len(CHANNELS)))
    return along[0][0], along[1]


def _sort_by_pulley(curves, case):
    """Rows (12, n): from points 1-4 back to run-up tail, run-up head, run-off tail, run-off head."""
    forward = case.settings.direction > 0
    places = jnp.where(forward, jnp.array([0, 2, 1, 3]), jnp.array([1, 3, 0, 2]))
    spans = jnp.where(forward, jnp.array([0, 1]), jnp.array([1, 0]))
    return jnp.concatenate([curves.y[places], curves.angle[places], curves.moment[spans], curves.tilt[spans]])


@dataclass(frozen=True)
class SpanChange:
    """What a relative change of tension or of a stiffness adds to a span: coefficients (R, 7, 2, 3) of powers 1 to 7 of
    log(1 + change), of the curvature at the run-up and of the roll at mid-span, per unit of ``span_ends``; stretch
    (R, ...): what the same does on a stretch of the belt; None of tension."""

    coefficients: np.ndarray
    stretch: StretchResponse | None

    def per_change(self, ends: np.ndarray, row: int) -> np.ndarray:
        """What a small change adds per unit (R, J), by the ends of a span (R, 3, J); row: 0 curvature, 1 roll."""
        return np.einsum("ri,rij->rj", self.coefficients[:, 0, row], ends)

    def per_end(self, change: np.ndarray, row: int) -> np.ndarray:
        """What a change (R, F, J) adds, however large, per unit of each of the three ends, (3, R, F, J)."""
        x = log_of_change(change, np)
        found = np.zeros((self.coefficients.shape[-1], *x.shape))
        for c in self.coefficients[:, ::-1, row].swapaxes(0, 1):
            found = (found + c.T[:, :, None, None]) * x
        return found


def span_changes(bench: Workbench, fit: Fit) -> dict[str, SpanChange]:
    """What relative changes of tension, bending and torsion do, with the effects of a fit at work."""
    forward = bench.forward
    effects = tuple(e for e in forward.effects_at(fit.vector, fit.ids) if overrides(e) & {"settings", "span"})
    runs = len(bench.samples.runs)
    rows = np.arange(-(-runs // ROWS) * ROWS).clip(max=runs - 1)
    settings = jax.tree.map(lambda x: np.asarray(x)[rows], forward.samples.cases.settings)
    cases = replace(forward.samples.cases, settings=settings)
    made = _compile_changes(forward.model, tuple(map(type, effects)))(effects, cases)
    made = jax.tree.map(lambda x: np.asarray(x)[:runs], made)
    return {k: SpanChange(rows, StretchResponse(**s) if s else None) for k, (rows, s) in made.items()}


@lru_cache(PROGRAMS)
def _compile_changes(model, classes):
    def one(effects, case):
        case = as_driven(case, effects)
        span = apply_hook((*model.built_in, *effects), "span", model.span(case), case)
        at, ends = jnp.array([0, 2]), slice(0, 3)  # run-up and middle; the ends of a belt do not roll
        return {
            k: (
                response_by_change(span, case, k)[:, at, ends],
                vars(stretch_response(span, k)) if k in BY_THE_BELT else {},
            )
            for k in dict.fromkeys(RELATIVE.values())
        }

    many = jax.vmap(one, in_axes=(None, Case(rig=None, belt=None, settings=0)))  # type: ignore[arg-type]
    return StoredProgram(many, program_key("span changes", model, classes), brief=True)
