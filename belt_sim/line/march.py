"""The march in travel: a belt's run-up points, step by step, for any linear span law and any set of effects.

The span is solved implicitly (trapezoidal rule) and effects in a predictor-corrector pair, so the march is of second
order in its step and stable for any stiffness of the span. Everything is float64 JAX: jitted once per composition of
laws, vmapped over cases, differentiable in every number of a case and of an effect.
"""

import math
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves, SensorPlace
from belt_sim.errors import InputError, SimulationError
from belt_sim.jax_setup import PROGRAMS, StoredProgram, in_float64, program_key
from belt_sim.line import runup as drive
from belt_sim.line.hooks import apply_hook, as_driven, as_numpy, call_hook, uses, where_acting
from belt_sim.line.runup import RunOff, RunUp, Yaw
from belt_sim.line.spans import Composition, Spans
from belt_sim.units import N_PER_MM2

MARCH_STEP = 0.05  # [m]; error of y_1 below 1e-4 on the test rig, see tests/convergence
KEEP = 0.1  # [m]
FURTHEST_WIDTHS = 100.0  # belt widths off the middle: no march goes on beyond
ROOMS = (1024, 4096)  # records that code is compiled for: one travel's serves all shorter ones, as 1024 take 1 ms
BEFORE_START = -1.0  # [m]: the instant before the start
POINT_ROWS, SPAN_ROWS = ((0, 2, 1, 3), (2, 0, 3, 1)), ((0, 1), (1, 0))  # their rows in ``_observe``; on reversed travel
RETURNED = ("travel", "y", "angle", "moment", "moment_runoff", "edge_stress", "tilt", "sag")  # of Curves


def march_case(
    case: Case,
    model: Composition,
    effects=(),
    *,
    travel: float,
    step: float = MARCH_STEP,
    keep: float = KEEP,
    driven: bool = False,
) -> Curves:
    """Return the true curves of one case, before encoder and sensors (``AnalyticModel.run`` adds those).

    Args:
        case: the case as commanded, or ``driven``: with actual settings, after effects on the drive.
        model: the composition of laws.
        effects: effects on the belt; those of encoder and sensors have no influence here.
        travel: length of the run [m].
        step: longest step [m]; keep: distance of records [m]; both are rounded down so that they divide the travel.

    Raises:
        CannotRepresent: if the model cannot represent an effect.
        InputError: if the step is longer than a wrap, or effects leave no tension.
        SimulationError: if the belt runs ``FURTHEST_WIDTHS`` widths off, or the result is not finite.
    """
    model.admit(effects)
    if not driven:
        case = in_float64(as_driven)(case, effects)
    plan = plan_steps(case, travel=travel, step=step, keep=keep)
    tension = float(case.settings.tension)
    if not tension > 0:
        raise InputError("tension", f"{tension / N_PER_MM2:g}", "N/mm2", "effects leave none; make them weaker")
    refuse_short_waves(case, effects, step)
    records, stride, slots = plan
    size = 2 ** (math.ceil(math.log2(records)) - 2) if records > ROOMS[-1] else 1
    room = next((room for room in ROOMS if records <= room), size * math.ceil(records / size))
    spacing, roomy = travel / (records * stride), (room, stride, 32 * math.ceil(slots / 32))
    rows = _compile_march(model, roomy, tuple(map(type, effects)))(case, tuple(effects), spacing)
    whole = as_numpy(Curves(**dict(zip(RETURNED, rows, strict=True))))
    curves = replace(whole, **{n: getattr(whole, n)[..., : records + 1] for n in RETURNED if n != "sag"})
    far = ~(np.abs(curves.y) <= FURTHEST_WIDTHS * case.belt.width).all(axis=0)
    if far.any():
        named = f"effects = {', '.join(e.id for e in effects)}: weaken them, or " if effects else ""
        most = FURTHEST_WIDTHS * float(case.belt.width)
        raise SimulationError(
            f"y is more than {FURTHEST_WIDTHS:g} belt widths ({most:g} m) off after "
            f"{float(curves.travel[np.argmax(far)]):.3g} m of travel, the belt runs away; {named}shorten travel"
        )
    unfit = [n for n in RETURNED if not np.isfinite(getattr(curves, n)).all()]
    if unfit:
        raise SimulationError(f"{', '.join(unfit)} is not finite: weaken the effects or shorten model.step")
    return curves


def refuse_short_waves(case: Case, effects, step: float) -> None:
    """Raise InputError for a wave of an effect that steps [m] of a march would take for a constant."""
    for e in effects:
        for name, (value, unit, length) in e.waves(case).items():
            if length < 2.0 * step:
                short = f"a wave of {length:.3g} m is shorter than two steps of {step:g} m"
                raise InputError(name, f"{value:g}", unit, f"{short}; lengthen it or shorten step")


def march_traced(case: Case, effects, travel, *, model: Composition, plan) -> Curves:
    """Apply effects on the drive and march, for use inside jit and vmap; ``plan`` comes from ``plan_steps``."""
    records, stride, _ = plan
    spacing = travel / (records * stride)
    return _steps_traced(as_driven(case, effects), effects, spacing, model=model, plan=plan)


def march_open(
    case: Case,
    effects,
    spacing,
    steps,
    *,
    model: Composition,
    room: int,
    slots: int,
    only: tuple[str, ...] = ("y", "tilt"),
    inside: tuple[SensorPlace, ...] = (),
) -> Curves:
    """Like ``march_traced``, with traced ``steps`` and ``spacing`` [m]: one compilation serves any travel and step.

    Args:
        room: number of records returned, more than ``steps``; those after the last step repeat it.
        slots: length of the wrap's history.
        only: names of the curves returned, of y, angle, moment and tilt.
        inside: places in the spans and on the wraps; ``extra`` has ``Spans.shape_at`` of each under its name.
    """
    case = as_driven(case, effects)
    spans = Spans.from_case(case, (*model.built_in, *effects), model)
    advance = partial(_advance, spans, spacing)

    start = _start(spans, slots)
    shapes = [spans.shape_at(place) for place in inside]

    def read(carry):
        now = _observe(carry, spans, start)
        between = {str(place): shape(*carry[1:])[None] for place, shape in zip(inside, shapes, strict=True)}
        return {n: _by_place(now[n], case) for n in only} | between

    def one(k, loop):
        carry, rows = loop
        carry = advance(carry, k)
        return carry, {n: rows[n].at[k + 1].set(row) for n, row in read(carry).items()}

    rows = {n: jnp.zeros((room, *row.shape)).at[0].set(row) for n, row in read(start).items()}
    carry, rows = jax.lax.fori_loop(0, steps, one, (start, rows))
    beyond = jnp.arange(room)[:, None] > steps
    curves = {n: jnp.where(beyond, row, rows[n]).T for n, row in read(carry).items()}
    extra: Any = {str(place): curves.pop(str(place))[0] for place in inside}
    return Curves(**({"travel": spacing * jnp.arange(room)} | curves), extra=extra or None)


def _steps_traced(case: Case, effects, spacing, *, model: Composition, plan) -> Curves:
    records, stride, slots = plan
    spans = Spans.from_case(case, (*model.built_in, *effects), model)
    advance = partial(_advance, spans, spacing)

    def record(carry, k):
        if stride == 1:
            carry = advance(carry, k)
        else:
            carry = jax.lax.fori_loop(0, stride, lambda i, carry: advance(carry, k * stride + i), carry)
        return carry, _observe(carry, spans, start)

    start = _start(spans, slots)
    _, rows = jax.lax.scan(record, start, jnp.arange(records))
    first = _observe(start, spans, start)
    rows = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), first, rows)
    found = {name: _by_place(row.T, case) for name, row in rows.items()}
    largest = jnp.maximum(jnp.abs(found["moment"]), jnp.abs(found["moment_runoff"]))
    edge = found.pop("tension") - largest * 6.0 / (case.belt.width**2 * case.belt.thickness)
    sag = case.sag_curvature * spans.span.length**2 / 8.0
    travel = spacing * stride * jnp.arange(records + 1)
    return Curves(travel=travel, **found, edge_stress=edge, sag=jnp.stack([sag, sag]))


@lru_cache(PROGRAMS)
def _compile_march(model: Composition, plan, effects: tuple[type, ...]):
    """Return a compiled function (case, effects, spacing) -> arrays of RETURNED."""

    def rows(*args):
        curves = _steps_traced(*args, model=model, plan=plan)
        return tuple(getattr(curves, name) for name in RETURNED)

    return StoredProgram(rows, program_key("curves", model, effects, plan), brief=True)  # a run of 400 m takes 5 ms


def _advance(spans, spacing, carry, k):
    """Return the march after step ``k``; carry: ring (slots, 6): y, alpha, moment of the tail, then of the head, step i
    in row i modulo slots; the state, the run-offs and the yaw."""
    case, effects, (ring, now, off, _) = spans.case, spans.effects, carry
    shapers = uses(effects, "yaw") + uses(effects, "runup") + uses(effects, "bend")
    slots, s0, values = ring.shape[0], k * spacing, []  # values that ran up one wrapped arc ago
    for pulley, arc in enumerate((case.rig.wrap_tail, case.rig.wrap_head)):
        back = arc / spacing
        whole = jnp.floor(back).astype(int)
        part = back - whole
        near, far = ring[(k + 1 - whole) % slots], ring[(k - whole) % slots]
        values.append(((1 - part) * near + part * far)[3 * pulley : 3 * pulley + 3])
    both = jnp.stack(values)
    off1 = RunOff(y=both[:, 0], alpha=both[:, 1], moment=both[:, 2])
    off1 = apply_hook(effects, "wrap", off1, replace(now, travel=s0 + spacing), case)
    commanded = _yaw(case, drive.mean_angle, s0, s0 + spacing)

    def correct(_, guess):
        then = replace(guess[0], travel=s0 + spacing)  # keeps what depends on travel alone out of the loop
        yaw, push = _average_forcing(effects, commanded, case, now, then)
        y, alpha = _solve(now, off, off1, yaw, push, spans, spacing)
        yaw_end = apply_hook(effects, "yaw", _yaw(case, drive.angle_at, s0 + spacing), then, case)
        then = spans.state(s0 + spacing, now.travel, y, alpha, off1, yaw_end)
        return spans.apply_slides(then, off1, yaw_end), yaw_end

    guess = (replace(now, travel=s0 + spacing), commanded)
    then, yaw_end = jax.lax.fori_loop(0, 2, correct, guess) if shapers else correct(0, guess)
    row = jnp.stack([then.y, then.alpha, then.moment], axis=1).ravel()
    return ring.at[(k + 1) % slots].set(row), then, off1, yaw_end


def _average_forcing(effects, commanded, case, now, then):
    """Average yaw and run-up terms of effects over the step, the yaw by Simpson's rule as pulleys may wobble."""
    between = _mean(now, then)
    yaw, push = commanded, RunUp(drift=jnp.zeros(2), turn=jnp.zeros(2))

    def turn(yaw, e):
        start, middle, end = (call_hook(e, "yaw", yaw, state, case) for state in (now, between, then))
        return jax.tree.map(lambda mean, mid: mean + 2.0 * (mid - mean) / 3.0, _mean(start, end), middle)

    def add(push, e):
        return _mean(call_hook(e, "runup", push, now, case), call_hook(e, "runup", push, then, case))

    for e in uses(effects, "yaw"):
        yaw = where_acting(e, partial(turn, e=e), yaw)
    for e in uses(effects, "runup"):
        push = where_acting(e, partial(add, e=e), push)
    return yaw, replace(push, turn=push.turn + between.added)


def _mean(a, b):
    return jax.tree.map(lambda x, y: 0.5 * (x + y), a, b)


def _yaw(case, angle, *where) -> Yaw:
    """Return the commanded yaw of both pulleys by ``angle`` (at a travel, or the mean over a step)."""
    settings = case.settings
    return Yaw(tail=angle(settings.yaw, *where), head=angle(settings.yaw_head, *where))


def _solve(now, off, off1, yaw, push, spans, h):
    """One trapezoidal step of dy/ds = -alpha + drift, dalpha/ds = -(kappa + turn), a 2x2 system by hand; of limp spans
    of dy/ds = theta_p - (y_u - y_o)/L (paper eq. 5, 6)."""
    if spans.span.limp:
        length = spans.span.length
        a = 0.5 * h / length
        partner = (off.y + off1.y)[::-1] + 2.0 * (yaw.aside_runoff - yaw.aside_runup)
        y = (now.y * (1 - a) + a * partner + h * (yaw.runup + push.drift)) / (1 + a)
        slope = (y + yaw.aside_runup - off1.y[::-1] - yaw.aside_runoff) / length  # of a straight line
        return y, slope - yaw.runup
    ky, ko, ku, ro, ru = spans.answer.runup.T
    a = 0.5 * h
    known = (
        ky * (yaw.aside_runup - yaw.aside_runoff - 0.5 * (off.y + off1.y)[::-1])
        + ku * yaw.runup
        + ko * (yaw.runoff + 0.5 * (off.alpha + off1.alpha)[::-1])
        + ro * yaw.roll_runoff
        + ru * yaw.roll_runup
    )
    right = now.alpha * (1 - a * ku + a * a * ky) - a * ky * (2 * now.y + h * push.drift) - h * (known + push.turn)
    alpha = right / (1 + a * ku - a * a * ky)
    y = now.y - a * (now.alpha + alpha) + h * push.drift
    return y, alpha


def _start(spans, slots):
    """The belt lies straight and sticks: y = 0 and alpha = 0 all round, whatever the yaw (paper eq. 11-13)."""
    zero = jnp.zeros(2)
    off = RunOff(y=zero, alpha=zero, moment=zero)
    yaw = _yaw(spans.case, drive.angle_at, 0.0)
    blank = spans.state(jnp.zeros(()), BEFORE_START, zero, zero, off, yaw)
    yaw = apply_hook(spans.effects, "yaw", yaw, blank, spans.case)
    now = spans.apply_slides(spans.state(jnp.zeros(()), BEFORE_START, zero, zero, off, yaw), off, yaw)
    history = jnp.zeros((slots, 6)).at[0].set(jnp.stack([now.y, now.alpha, now.moment], axis=1).ravel())
    return history, now, off, yaw


def _observe(carry, spans, start):
    """Return what is recorded of one instant, in the order (span up the tail, span up the head); y since the start."""
    (_, now, off, yaw), before = carry, start[3]
    y = jnp.concatenate([now.y + yaw.aside_runup, off.y + yaw.aside_runoff[::-1]])
    boundary = spans.boundary_values(now.travel, now.y, now.alpha, off, yaw)
    bend = spans.bend(boundary)
    return {
        "y": y - jnp.concatenate([before.aside_runup, before.aside_runoff[::-1]]),
        "angle": jnp.concatenate([yaw.runup + now.alpha, yaw.runoff[::-1] + off.alpha]),
        "moment": now.moment,
        "moment_runoff": now.moment_runoff,
        "tilt": jnp.sum(spans.answer.mid_tilt * boundary.ends.T, axis=1) + bend.tilt,  # roll at mid-span
        "tension": spans.case.settings.tension * (1.0 + bend.tension),
    }


def _by_place(rows, case: Case):
    """Rows (4, ...) of run-up tail, run-up head, run-off tail, run-off head as points 1-4; rows (2, ...) of the spans
    up the tail and up the head pulley as upper and lower span. On reversed travel the spans change places."""
    ahead, back = POINT_ROWS if len(rows) == len(POINT_ROWS[0]) else SPAN_ROWS
    forward = case.settings.direction > 0
    return jnp.stack([jnp.where(forward, rows[a], rows[b]) for a, b in zip(ahead, back, strict=True)])


def plan_steps(case: Case, *, travel: float, step: float, keep: float) -> tuple[int, int, int]:
    """Return (records, march steps a record, slots of the wrap's history) for a concrete case."""
    for name, length in (("travel", travel), ("step", step), ("keep", keep)):
        if not length > 0:
            raise InputError(name, length, "m", "give a positive length")
    records = max(1, math.ceil(travel / keep - 1e-9))
    stride = max(1, math.ceil(travel / records / step - 1e-9))
    spacing = travel / records / stride
    arcs = [np.max(case.rig.wrap_head), np.max(case.rig.wrap_tail)]
    if spacing > min(np.min(case.rig.wrap_head), np.min(case.rig.wrap_tail)):
        raise InputError("step", spacing, "m", "use a step shorter than the wrapped arc")
    slots = int(max(arcs) / spacing) + 3
    return records, stride, 8 * math.ceil(slots / 8)
