"""Faults that no catalogue lists, a row each: place, variable, form (of ``Fault``), its numbers, its formula."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.case import GRAVITY
from belt_sim.virtual_rig.faults import (
    ANY_PHASE,
    ANY_SEED,
    ON_HEAD_PULLEY,
    ON_TAIL_PULLEY,
    Fault,
    between,
    fault,
    log_uniform,
    on_tail,
    random_walk,
    shape,
    size,
    smooth_step,
    steady,
)
from belt_sim.virtual_rig.line import DOUBLINGS, Sections, unit_load

_UPPER, _LOWER = 1.0, -1.0
_MIDDLES = (np.arange(2**DOUBLINGS) + 0.5) / 2**DOUBLINGS  # of the elements, as shares of a span
_FIBRES = np.linspace(-1.0, 1.0, 401)  # places across half the width
_TURN = 2 * np.pi
_FULL = 1e-4  # [rad]: yaw from which on a step sets the rubber fully
_REFERENCE, _SMALLEST = 1e-4, 1e-5  # [rad] of contact angle


# Numbers of a row that are drawn for a plan.


def at_tension(default: float, of: Callable[[Any, float], float]) -> Any:
    """What ``of`` (plan, tension) says of a tension between the least and the largest of the plan, a fifth apart."""

    def draw(plan, rng) -> float:
        stresses = [run.tension for run in plan.runs]
        return of(plan, log_uniform(rng, min(stresses), max(max(stresses), 1.2 * min(stresses))))

    return shape(default, draw)


# Parts of formulas, and formulas of more than a line.


def _since(s, line):
    """Time since the yaw step [s]."""
    return np.maximum(s - line.yaw_at, 0.0) / line.speed


def _fading(f, s, line):
    """From 1 at the yaw step to 0, in a fault's ``time``."""
    return np.exp(-_since(s, line) / f.time)


def _flattened(x):
    """tanh(x)/x."""
    x = np.abs(x)
    return np.where(x > 1e-6, np.tanh(x) / np.maximum(x, 1e-6), 1.0)


def _greasy_stretch(f, s, line, alpha):
    """at, stretch: shares of the belt's length, from what runs up to the tail pulley at travel 0, backwards."""
    run = (np.stack([s + 0.0 * line.start, s - line.span_length - line.wrap_tail]) + line.start) / line.belt_length
    off = np.mod(run - f.at + 0.5, 1.0) - 0.5
    return 1 - f.share * np.where(np.abs(off) < f.stretch / 2, np.cos(np.pi * off / f.stretch) ** 2, 0.0)


def _sticky_gauge(f, value, place, s, line):
    if place != "point_1":
        return value
    shown = np.empty_like(value)
    last = value[0]
    for k, true in enumerate(value):
        last = shown[k] = np.clip(last, true - f.half, true + f.half)
    return shown


def _worn_travel(f, shown, line):
    root = np.sqrt(np.maximum(1 + 4 * f.c * shown, 0.05))
    return 2 * shown / (1 + root)


def _sticky_rest(f, s, line, load, free, kept):
    stiffness = f.stiffness / (1 + f.stiffness * load.give)
    held = np.clip(stiffness * (free - kept), -f.force, f.force)
    return -held, free - held / stiffness


def _one_long_edge(f, state, line, upper):
    """The stress at rest is amplitude P_3 across the width; fibres that it would press carry nothing, the rest all of
    F."""
    rest = np.multiply.outer(f.amplitude * np.ones_like(line.stress), (5 * _FIBRES**3 - 3 * _FIBRES) / 2)
    mean, low, high = line.stress, line.stress - 2 * np.abs(f.amplitude), line.stress
    for _ in range(50):  # the mean strain at which what is left carries the belt's force
        middle = (low + high) / 2
        too_much = np.maximum(middle[:, None] + rest, 0.0).mean(axis=1) > mean
        low, high = np.where(too_much, low, middle), np.where(too_much, middle, high)
    carries = high[:, None] + rest >= 0
    count = carries.sum(axis=1)
    off_centre = (carries * _FIBRES).sum(axis=1) / count
    left = (carries * (_FIBRES - off_centre[:, None]) ** 2).sum(axis=1) / np.sum(_FIBRES**2)
    return Sections(bending=left)


def _bend_of_cubic(f, s, line, to_tail, ends):
    """The bend of a beam without tension: L times the mean square curvature of a cubic between the ends."""
    y_off, off, y_up, up = ends
    chord = (y_up - y_off) / line.span_length
    q = ((up - off) ** 2 + 3 * (up + off - 2 * chord) ** 2) / np.square(f.bend)
    return q / (1 + q)


def at_share(left, line) -> Sections:
    """A span that has a share ``left`` (batch,) of its tension."""
    lost = (1 - left) * line.force * line.width**2 / 12
    return Sections(tension=left, sag=1 / left, torsion=1 - lost / line.torsion)


def _stretch(f, place: float, line, more):
    """The factor 1 + ``more`` (batch,) of every element on a stretch, whose middle is at a share ``place`` of the span,
    falling off to 1 at its ends."""
    off = np.subtract.outer(np.zeros(np.shape(f.stretch)) + place, _MIDDLES)
    width = np.asarray(f.stretch)[..., None]
    there = np.where(np.abs(off) < width / 2, np.cos(np.pi * off / width) ** 2, 0.0)
    return 1 + np.reshape(more, (-1, 1)) * there + 0 * line.stress[:, None]


def _passes(f, s, line, to_tail, ends):
    """Where a stretch is, as a share of the span behind its run-off, on its last way round."""
    ahead = np.where(line.direction > 0, f.at, 2 * line.span_length + line.wrap_tail - f.at)
    place = ahead + s + line.start - (0.0 if to_tail else line.span_length + line.wrap_tail)
    before = 0.25 * line.span_length
    return (np.mod(place + before, line.belt_length) - before) / line.span_length


#: what a row has of a stretch of the belt that is another while it passes a span
_PASSING: dict[str, Any] = {
    "span_states": tuple(np.linspace(-0.25, 1.25, 31)),
    "span_state": _passes,
    "at": between(3.0, 0.0, 1.0, "belt_length"),
    "stretch": between(0.2, 0.15, 0.5),
}


#: place -> hook and pulley of what is added there
_ADDED = {
    "yaw_tail": ("yaw", ON_TAIL_PULLEY),
    "yaw_head": ("yaw", ON_HEAD_PULLEY),
    "runup_tail": ("turn", ON_TAIL_PULLEY),
}


def row(where: str, words: str, *, amount: Callable | None = None, **given: Any) -> dict[str, Any]:
    """A row. where: "place | variable form, form; variable form", the first pair as it is; amount: (fault, s, line) ->
    what is added at the place, where it depends on nothing else; given: numbers, other hooks.

    What changes how spans twist does nothing on a base law whose spans are flat."""
    place, _, pairs = where.partition(" | ")
    forms = [
        (variable, form)
        for part in pairs.split("; ")
        for variable, _, names in [part.partition(" ")]
        for form in names.split(", ")
    ]
    (variable, form), *also = forms
    usual: dict[str, Any] = {"idle_on": ("beam_th2",) if place == "span_torsion" else ()}
    usual |= {"span_states": tuple(np.linspace(0.0, 1.0, 9))} if "span_state" in given else {}
    if amount is not None:
        hook, pulley = _ADDED[place]
        usual[hook] = on_tail(amount, pulley)
    return {"words": words, "place": place, "variable": variable, "form": form, "also": tuple(also), **usual, **given}


_TABLE: dict[str, dict[str, Any]] = {
    # Yaw of the pulleys.
    "progressive_yaw": row(
        "yaw_tail | yaw power, linear",
        "The steering's lever turns the pulley more than in proportion: share yaw |yaw|/1 mrad is added.",
        share=size("1", 0.3, 5.0),
        amount=lambda f, s, line: f.share * line.yaw * np.abs(line.yaw) / 1e-3 * (s >= line.yaw_at),
    ),
    "speed_bow": row(
        "yaw_tail | speed power, linear",
        "The frame bows under the drive: the tail pulley turns by c v^2.",
        c=size("rad s2/m2", 2e-4, 2e-2),
        amount=lambda f, s, line: f.c * line.speed**2,
    ),
    "frame_twist": row(
        "yaw_head | tension power, linear",
        "The frame twists under the pull more than in proportion: the head pulley turns by c (sigma/10 N/mm2)^2.",
        c=size("rad", 2e-5, 2e-3),
        amount=lambda f, s, line: f.c * (line.stress / 1e7) ** 2,
    ),
    "yaw_creep": row(
        "yaw_tail | time_since_step exponential, saturating; travel exponential",
        "The steering relaxes after its step: share (1 - exp(-t/time)) of the yaw is added in time.",
        share=size("1", 0.2, 3.0),
        time=between(25.0, 0.1, 0.5, "duration"),
        amount=lambda f, s, line: f.share * line.yaw * (1 - _fading(f, s, line)),
    ),
    "ringing_yaw": row(
        "yaw_tail | time_since_step exponential, periodic; wave periodic; travel exponential",
        "The steering swings about its new position after the step, by a share of it that dies out in time.",
        share=size("1", 0.3, 3.0),
        time=between(30.0, 0.1, 0.6, "duration"),
        period=between(20.0, 0.1, 0.4, "duration"),
        amount=lambda f, s, line: f.share * line.yaw * _fading(f, s, line) * np.sin(_TURN * _since(s, line) / f.period),
    ),
    "strange_wave": row(
        "yaw_tail | wave periodic",
        "The tail pulley's yaw swings with a wavelength that belongs to no part of the machine.",
        amplitude=size("rad", 1e-4, 5e-3),
        wavelength=between(7.3, 3.0, 9.0),
        phase=ANY_PHASE,
        amount=lambda f, s, line: f.amplitude * np.sin(_TURN * s / f.wavelength + f.phase),
    ),
    "beating_head": row(
        "yaw_head | wave periodic; travel periodic",
        "Two gears of nearly the same pitch turn the head pulley to and fro: its swing comes and goes.",
        amplitude=size("rad", 1e-4, 5e-3),
        wavelength=between(4.0, 2.5, 7.0),
        ratio=between(1.15, 1.08, 1.3),
        phase=ANY_PHASE,
        amount=lambda f, s, line: (
            f.amplitude * (np.sin(_TURN * s / f.wavelength + f.phase) + np.sin(_TURN * s / f.wavelength / f.ratio))
        ),
    ),
    "thermostat_head": row(
        "yaw_head | wave periodic; time_since_step periodic; travel periodic",
        "A fan cools the head pulley's bearing in turns: its yaw swings to and fro in straight strokes, in time.",
        amplitude=size("rad", 1e-4, 5e-3),
        period=between(40.0, 0.1, 0.5, "duration"),
        phase=ANY_PHASE,
        amount=lambda f, s, line: (
            f.amplitude * 2 / np.pi * np.arcsin(np.sin(_TURN * s / line.speed / f.period + f.phase))
        ),
    ),
    # Run-up: what turns the belt where it lands.
    "quadratic_contact": row(
        "runup_tail | y power",
        "The tail pulley turns the belt by c y^2 per metre.",
        c=size("1/m3", 0.05, 50.0),
        turn=lambda f, s, line, y, kappa: f.c * y**2 * ON_TAIL_PULLEY,
    ),
    "soft_shoulder": row(
        "runup_head | y saturating, power, threshold",
        "The head pulley has shoulders: off the middle it turns the belt back by kappa at most, kappa tanh(y/y0).",
        kappa=size("1/m", 3e-5, 2e-3),
        width=between(1e-3, 10**-3.7, 10**-2.5, log=True),
        turn=lambda f, s, line, y, kappa: -f.kappa * np.tanh(y / f.width) * ON_HEAD_PULLEY,
    ),
    "dead_zone": row(
        "runup_both | curvature threshold, saturating",
        "Curvature below kappa_d does not turn the belt on the pulley.",
        kappa_d=size("1/m", 1e-5, 5e-4, positive=True),
        turn=lambda f, s, line, y, kappa: -np.clip(kappa, -f.kappa_d, f.kappa_d),
    ),
    "square_moment": row(
        "runup_both | curvature power",
        "The cover gives way more than in proportion: both pulleys turn the belt by c kappa |kappa| more.",
        c=size("m", 800.0, 2e5),
        turn=lambda f, s, line, y, kappa: kappa * np.maximum(f.c * np.abs(kappa), -0.95),
    ),
    "bald_patch": row(
        "runup_tail | pulley_phase periodic; wave periodic; travel periodic",
        "The tail's lagging is gone on one side of a patch: a taper that acts while the patch takes the belt up.",
        kappa=size("1/m", 1e-4, 1e-2),
        phase=ANY_PHASE,
        narrow=between(3.0, 1.5, 5.0),
        amount=lambda f, s, line: (
            f.kappa * np.exp(f.narrow * (np.cos((s + line.start) / line.tail_radius - f.phase) - 1))
        ),
    ),
    "lagging_set": row(
        "runup_tail | time_since_step exponential; travel exponential; time_since_step saturating",
        "The tail's rubber stays askew after a yaw step and recovers in time: it turns the belt meanwhile.",
        kappa=size("1/m", 1e-4, 5e-3),
        time=between(20.0, 0.08, 0.5, "duration"),
        amount=lambda f, s, line: (  # fully from a yaw of _FULL on, not by an error of a microradian
            f.kappa * np.clip(line.yaw / _FULL, -1.0, 1.0) * np.where(s >= line.yaw_at, _fading(f, s, line), 0.0)
        ),
    ),
    "rut": row(
        "runup_tail | y linear; belt_phase linear, periodic",
        "The belt wears a rut into the tail pulley: it is turned as it lay there one revolution of the belt ago.",
        c=size("1/m2", 1e-2, 1.0),
        recall=lambda f, s, past: (
            f.c * past.state_at(s - past.line.belt_length + 0 * past.line.wraps)[:, 0] * ON_TAIL_PULLEY
        ),
    ),
    "walking_angle": row(
        "runup_tail | travel random",
        "The contact angle on the tail pulley takes a random walk of its own in every run.",
        size=size("rad/m^0.5", 5e-6, 1e-3, positive=True),
        seed=ANY_SEED,
        amount=lambda f, s, line: f.size * random_walk(f, s, line),
    ),
    # Run-up and wrap: how the belt follows its contact angle, and slides.
    "adhesion_loss": row(
        "runup_both | travel threshold, saturating; time_since_step threshold",
        "From travel ``after`` on, the belt climbs faster or slower sideways than it should by ``share``.",
        share=size("1", 0.15, 2.0),
        after=between(20.0, 0.15, 0.5, "length"),
        slide=lambda f, s, line, alpha: 1 + f.share * smooth_step(s, f.after, 4.0),
    ),
    "mid_stick": row(
        "runup_both | travel threshold; time_since_step threshold",
        "In mid run the belt runs straight for a while, sideways held by ``share``.",
        share=size("1", 0.5, 1.0, positive=True),
        begin=between(25.0, 0.15, 0.6, "length"),
        length=between(6.0, 0.1, 0.25, "length"),
        slide=lambda f, s, line, alpha: (
            1 - f.share * smooth_step(s, f.begin, 1) * (1 - smooth_step(s, f.begin + f.length, 1))
        ),
    ),
    "greasy_stretch": row(
        "runup_both | belt_phase periodic, threshold; wave periodic",
        "A stretch of the belt is greasy: while it runs up on a pulley, the belt follows its contact angle less.",
        share=size("1", 0.3, 1.0, positive=True),
        at=between(0.3, 0.0, 1.0),
        stretch=between(0.3, 0.15, 0.5),
        slide=_greasy_stretch,
    ),
    "follow_power": row(
        "runup_tail | contact_angle power",
        "On the tail pulley the belt climbs by a power of its contact angle, |alpha|^(1 + p), alike at 0.1 mrad.",
        p=size("1", 0.2, 1.5),
        slide=lambda f, s, line, alpha: np.where(  # the angle nowhere 0
            ON_TAIL_PULLEY > 0, (np.sqrt(alpha**2 + _SMALLEST**2) / _REFERENCE) ** f.p, 1.0
        ),
    ),
    "grip_limit": row(
        "runup_both | contact_angle saturating, power",
        "The belt follows its contact angle less and less, the larger it is: alpha becomes a tanh(alpha/a).",
        inverse_angle=size("1/rad", 2e3, 2e5, positive=True),
        slide=lambda f, s, line, alpha: _flattened(alpha * f.inverse_angle),
    ),
    "wrap_creep": row(
        "wrap | contact_angle linear",
        "Wrapped round both pulleys, the belt goes on sideways by a share of what its contact angle asks for.",
        share=size("1", 0.3, 5.0),
        creep=lambda f, s, line, alpha: -f.share * np.stack([line.wrap_tail * alpha[0], line.wrap_head * alpha[1]]),
    ),
    "wrap_slide": row(
        "wrap | contact_angle threshold, linear",
        "On the tail a belt that lies too much askew slides on: by ``length`` times the angle beyond a limit.",
        length=size("m", 0.5, 5.0, positive=True),
        limit=between(1e-4, 0.1, 0.4, "largest_yaw"),
        creep=lambda f, s, line, alpha: np.concatenate(
            [-f.length * (x := np.sign(alpha[:1]) * np.maximum(np.abs(alpha[:1]) - f.limit, 0.0)), np.zeros_like(x)]
        ),
    ),
    # Tension.
    "tension_decay": row(
        "tension | travel exponential, saturating; time_since_step exponential",
        "The belt loses ``share`` of its tension over ``length`` metres of travel.",
        share=size("1", 0.15, 0.6, positive=True),
        length=between(20.0, 0.15, 0.6, "length"),
        span_states=(-1.0, -0.5, 0.0),
        sections=lambda f, state, line, upper: at_share(1 + f.share * state, line),
        span_state=lambda f, s, line, to_tail, ends: np.expm1(-s / f.length),
    ),
    "ratchet_slip": row(
        "tension | travel threshold, constant; time_since_step threshold",
        "The take-up slips a tooth at travel ``at``: the belt loses a share of its tension at once.",
        share=size("1", 0.15, 0.6, positive=True),
        at=between(15.0, 0.15, 0.6, "length"),
        span_states=(-1.0, -0.5, 0.0),
        sections=lambda f, state, line, upper: at_share(1 + f.share * state, line),
        span_state=lambda f, s, line, to_tail, ends: -smooth_step(s, f.at, 1.0),
    ),
    "tension_beat": row(
        "tension | belt_phase periodic; wave periodic; travel periodic",
        "The tension swings by a share once a revolution of the belt, as a stiff splice goes round.",
        share=size("1", 0.1, 0.6, positive=True),
        phase=ANY_PHASE,
        span_states=(-1.0, 0.0, 1.0),
        sections=lambda f, state, line, upper: at_share(1 + f.share * state, line),
        span_state=lambda f, s, line, to_tail, ends: np.cos(_TURN * (s + line.start) / line.belt_length + f.phase),
    ),
    # Sensors and recorder.
    "sensor_cubic": row(
        "sensor_y1 | y power",
        "The sensor at point 1 shows y + c y^3.",
        c=size("1/m2", 1000.0, 1e5),
        read=lambda f, value, place, s, line: value + f.c * value**3 if place == "point_1" else value,
    ),
    "short_range": row(
        "sensor_all | y saturating, power",
        "The sensors' optics flatten towards the ends of their range: tanh(c y)/c instead of y.",
        c=size("1/m", 40.0, 2e3, positive=True),
        read=lambda f, value, place, s, line: value * _flattened(f.c * value) if place.startswith("point_") else value,
    ),
    "sticky_gauge": row(
        "sensor_y1 | y threshold, constant, saturating",
        "The feeler at point 1 sticks: it follows the belt only once it is ``half`` behind.",
        half=size("m", 1e-4, 1e-2, positive=True),
        read=_sticky_gauge,
    ),
    "warming_stand": row(
        "sensor_all | time_since_step power; travel power; time_since_step saturating",
        "The sensors' stand moves with the square root of time, as heat does.",
        c=size("m/s^0.5", 3e-5, 2e-3),
        read=lambda f, value, place, s, line: value + f.c * np.sqrt(np.maximum(s - line.yaw_at, 0) / line.speed),
    ),
    "wearing_wheel": row(
        "travel | travel power, linear",
        "The measuring wheel wears down while it runs: the recorder shows s + c s^2.",
        c=size("1/m", 5e-4, 2e-3),
        set=lambda f, line: replace(line, yaw_at=_worn_travel(f, line.yaw_at, line)),
        true_travel=_worn_travel,
    ),
    # Loads on the spans.
    "bent_idler": row(
        "span | wave periodic; travel periodic",
        "A bent idler under the lower span pushes it to and fro as it turns.",
        force=size("N", 1.0, 200.0),
        wavelength=between(2.2, 1.5, 4.5),
        phase=ANY_PHASE,
        share=between(0.5, 0.2, 0.8),
        loads=lambda f, line: (unit_load(line, False, "force", f.share),),
        push=steady(lambda f, s, line: f.force * np.cos(_TURN * s / f.wavelength + f.phase)),
    ),
    "sticky_rest": row(
        "span | y saturating, threshold, linear; contact_angle threshold, constant",
        "A rest under the upper span sticks to the belt up to a force, then slides with it: it remembers the belt.",
        force=size("N", 0.5, 100.0, positive=True),
        stiffness=between(5e3, 10**2.5, 10**4.5, log=True),
        share=between(0.5, 0.2, 0.8),
        loads=lambda f, line: (unit_load(line, True, "force", f.share),),
        push=_sticky_rest,
    ),
    "wind_steps": row(
        "span | travel random",
        "Wind presses on both spans, changing every 9 m: p bends a clamped span by p L^2/(12 EI) at its end.",
        pressure=size("N/m", 0.03, 5.0, positive=True),
        seed=ANY_SEED,
        turn=lambda f, s, line, y, kappa: np.broadcast_to(
            f.pressure * random_walk(f, s, line, 9.0) * line.span_length**2 / (12 * line.bending), y.shape
        ),
    ),
    # The spans themselves: EI, T, Z or F that are not what the sheet says, or change with what the belt does.
    "slack_softening": row(
        "span_bending | tension exponential, power, threshold, saturating, linear",
        "A slack belt ripples along its edges and bends more easily: EI (1 - share exp(-sigma/sigma_0)).",
        share=size("1", 0.3, 0.95, positive=True),
        stress=at_tension(1e7, lambda plan, tension: tension),
        sections=lambda f, state, line, upper: Sections(bending=1 - f.share * np.exp(-line.stress / f.stress)),
    ),
    "one_long_edge": row(
        "span_bending | tension threshold, power, exponential, linear, saturating",
        "One edge was rolled too long, and buckles where the tension does not straighten it: it bends no more.",
        amplitude=size("Pa", 1e7, 2e8, positive=True),
        sections=_one_long_edge,
    ),
    "slack_twist": row(
        "span_torsion | tension threshold, power, linear, exponential, saturating",
        "Below a tension the cross-section gives way: T falls by ``share`` of what the tension is short of it.",
        share=size("1", 0.4, 0.95, positive=True),
        onset=at_tension(3e7, lambda plan, tension: 1.5 * tension),
        sections=lambda f, state, line, upper: Sections(torsion=1 - f.share * np.clip(1 - line.stress / f.onset, 0, 1)),
    ),
    "torsion_creep": row(
        "span_torsion | time_since_step exponential, saturating; travel exponential, saturating",
        "After a yaw step the spans twist more and more easily: T (1 - share (1 - exp(-t/time))).",
        share=size("1", 0.4, 0.95, positive=True),
        time=between(30.0, 0.08, 0.4, "duration", log=True),
        sections=lambda f, state, line, upper: Sections(torsion=1 - f.share * state),
        span_state=lambda f, s, line, to_tail, ends: -np.expm1(-_since(s, line) / f.time),
    ),
    "edge_cracks": row(
        "span_bending | curvature threshold, saturating; yaw threshold, saturating; contact_angle threshold",
        "One edge is cracked: a span whose ends are turned so that the cracks open bends by ``share`` more easily.",
        share=size("1", 0.3, 0.95, positive=True),
        sign=shape(1.0, lambda plan, rng: rng.choice((-1.0, 1.0))),
        angle=between(1e-4, 0.05, 0.3, "largest_yaw"),
        sections=lambda f, state, line, upper: Sections(bending=1 - f.share * state),
        span_state=lambda f, s, line, to_tail, ends: (1 + np.tanh(f.sign * (ends[3] - ends[1]) / f.angle)) / 2,
    ),
    "fatigue_cracks": row(
        "span_bending | travel linear, saturating; time_since_step linear; travel exponential",
        "The belt is breaking up all round: its spans bend the more easily the further it has run.",
        span_states=tuple(np.linspace(0.0, 0.95, 20)),
        rate=size("1/m", 5e-3, 0.05, positive=True),
        sections=lambda f, state, line, upper: Sections(bending=1 - state),
        span_state=lambda f, s, line, to_tail, ends: np.clip(f.rate * s, 0.0, 0.95),
    ),
    "span_stiffening": row(
        "span_bending | curvature power, saturating; yaw power, saturating; y power, saturating",
        "A span stiffens with its amplitude: EI (1 + c q/(1 + q)), q the mean square of its bend over ``bend``.",
        c=size("1", 0.4, 10.0, positive=True),
        bend=between(5e-4, 0.5, 3.0, "largest_yaw", log=True),
        sections=lambda f, state, line, upper: Sections(bending=1 + f.c * state),
        span_state=_bend_of_cubic,
    ),
    "support_roller": row(
        "span_torsion | tension threshold, power, linear, exponential; travel constant",
        "A belt that sags by more than ``gap`` touches a roller at mid-span, which holds its cross-section level.",
        stiffness=size("N m/rad", 5.0, 1e4, positive=True),
        gap=at_tension(  # the sag at a tension a fifth higher
            0.05,
            lambda plan, tension: (
                plan.belt.density.value * GRAVITY / (1.2 * tension) * plan.machine.centre_distance.value**2 / 8
            ),
        ),
        side=shape(_LOWER, lambda plan, rng: rng.choice((_UPPER, _LOWER))),
        sections=lambda f, state, line, upper: Sections(
            roll_spring=f.stiffness
            * np.clip((line.sag_curvature * line.span_length**2 / 8 / f.gap - 1) / 0.1, 0.0, 1.0)
            * ((np.asarray(f.side) > 0) == upper)
        ),
    ),
    "thermal_crossbow": row(
        "span_torsion | travel exponential, saturating; time_since_step exponential, saturating",
        "Heat on one face bows the belt across its width while it runs above: T (1 + share (1 - exp(-t/time))).",
        share=size("1", 0.5, 20.0, positive=True),
        time=between(30.0, 0.08, 0.5, "duration", log=True),
        sections=lambda f, state, line, upper: Sections(torsion=1 + f.share * state * upper),
        span_state=lambda f, s, line, to_tail, ends: -np.expm1(-np.maximum(s, 0.0) / line.speed / f.time),
    ),
    "slack_side": row(
        "span_tension | tension linear; travel constant; tension power",
        "The head pulley drives against a brake: the span that leaves it has a share less tension than the other.",
        share=size("1", 0.15, 0.8, positive=True),
        sections=lambda f, state, line, upper: at_share(  # what leaves the head pulley runs to the tail
            np.where(upper == (line.direction > 0), 1 - f.share, 1.0), line
        ),
    ),
    "soft_joint": row(
        "span_bending | belt_phase periodic, threshold; wave periodic; travel periodic",
        "The belt bends more easily where it is joined: EI falls by ``share`` there, while the joint is in a span.",
        share=size("1", 0.6, 0.95, positive=True),
        **_PASSING,
        sections=lambda f, state, line, upper: Sections(bending=_stretch(f, state, line, -f.share)),
    ),
    "repair_plate": row(
        "span_torsion | belt_phase periodic, threshold; wave periodic; travel periodic",
        "A plate welded on stiffens a stretch of the belt against twisting: T (1 + c) there.",
        c=size("1", 5.0, 200.0, positive=True),
        **_PASSING,
        sections=lambda f, state, line, upper: Sections(torsion=_stretch(f, state, line, f.c)),
    ),
}
UNMODELLED: dict[str, type[Fault]] = {id: fault(id, __name__, **_TABLE[id]) for id in sorted(_TABLE)}
