"""Readings of lateral sensors that stand at none of points 1-4: inside a span, or on a wrap.

A belt that sticks passes a place on a wrap as it ran up, a while before; inside a span the law of the span says where
it is (``march_open``). Instruments act there as at the nearest point of the tail or head pulley, and the belt's edge
passes the place earlier or later than it passes that point.
"""

from collections.abc import Sequence

import jax.numpy as jnp

from belt_sim.campaign.types import SignalSheet, sensor_place
from belt_sim.case import Case
from belt_sim.curves import Curves, SensorPlace
from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.effects.base import Effect
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.line.hooks import apply_hook, looked_up, overrides, true_travel
from belt_sim.line.runup import Reading
from belt_sim.line.spans import Composition

BEFORE = 0.5  # [m] of travel before the yaw, over which a sensor that moves with it is seen at rest
INSIDE = ("bend", "hold")  # hooks of effects that shape a span between its ends, which readings there would show


def places_of(samples: Samples) -> tuple[SensorPlace, ...]:
    """Places of the signals that stand at none of the points, each once."""
    found = (sensor_place(s.at) for s in samples.signals)
    return tuple(dict.fromkeys(place for place in found if place is not None))


def shapes_a_span(effect: Effect | type[Effect]) -> bool:
    """Whether an effect shapes a span between its ends, so that a sensor there would see what is not computed."""
    return bool(overrides(effect, INSIDE))


def first_place_inside_span(signals: Sequence[SignalSheet]) -> SensorPlace | None:
    """The first place of a sensor inside a span; None where none stands there."""
    return next((place for place in (sensor_place(s.at) for s in signals) if place and not place.on_wrap), None)


def shows_places(signals: Sequence[SignalSheet], model: Composition) -> bool:
    """Whether a model says what sensors inside the spans read."""
    return first_place_inside_span(signals) is None or not any(shapes_a_span(e) for e in model.built_in)


def check_places(samples: Samples, model: Composition, classes: Sequence[type[Effect]]) -> None:
    """Raise CannotRepresent where a sensor inside a span would see an effect that is computed at the ends only, and
    InputError where a record begins with the yaw, which moves spans and wraps at once."""
    places = places_of(samples)
    late = next((r for r in samples.runs if places and (r.yaw or r.yaw_head) and r.yaw_at < BEFORE), None)
    if late:
        remedy = f"a sensor at = {places[0]} moves at once with the yaw: begin the record {BEFORE:g} m before it"
        raise InputError(f"runs.csv, {late.name}: yaw_at_m", late.yaw_at, "m", remedy)
    inside = first_place_inside_span(samples.signals)
    acting: Sequence[Effect | type[Effect]] = (*model.built_in, *classes)
    unfit = [e.id for e in acting if shapes_a_span(e)]
    if inside and unfit:
        raise CannotRepresent(
            f"signals at = {inside}: {unfit[0]} shapes the span between its ends, which a sensor inside it would see; "
            "leave the effect out, take model=strip, or leave the signal out"
        )


def travel_lead(place: SensorPlace, case: Case):
    """Travel [m] by which the belt passes the place before it passes the point that belongs to it; negative: after."""
    sign = 1.0 if place.where in ("upper_span", "head_wrap") else -1.0
    return sign * case.settings.direction * place.distance


def reading_at(place: SensorPlace, curves: Curves, case: Case, effects: Sequence[Effect], shown, time):
    """Reading [m] at encoder travels ``shown`` [m] and times [s], both (n,); curves: of ``march_open``."""
    seen = apply_hook(effects, "sensor_travel", true_travel(effects, case, shown), case)
    assert curves.extra is not None
    row = curves.extra[str(place)] + (_wrap_position(place, curves, case) if place.on_wrap else 0.0)
    return indicate_place(place, looked_up(curves.travel, row[None], seen)[0], case, effects, shown, seen, time)


def indicate_place(place: SensorPlace, y, case: Case, effects: Sequence[Effect], shown, seen, time):
    """What the instruments make of true positions y (n,) at a place."""
    four = jnp.broadcast_to(y, (4, len(shown)))
    earlier = seen + travel_lead(place, case)
    reading = Reading(travel=shown, sensor_travel=earlier, time=time, y=four, tilt=jnp.zeros((2, len(shown))))
    return apply_hook(effects, "sensor", reading, case).y[place.point]


def _wrap_position(place: SensorPlace, curves: Curves, case: Case):
    """True positions (records,) on a wrap: as the belt ran up, and the pulley's own way from one point to the other."""
    tail = place.where == "tail_wrap"
    around = case.rig.wrap_tail if tail else case.rig.wrap_head
    upper, lower = (curves.y[0], curves.y[1]) if tail else (curves.y[3], curves.y[2])
    from_upper = (case.settings.direction > 0) == tail  # where the belt runs up
    up, off = jnp.where(from_upper, upper, lower), jnp.where(from_upper, lower, upper)
    arc = jnp.where(from_upper, place.distance, around - place.distance)
    share = 0.5 * (1.0 - jnp.cos(jnp.pi * arc / around))  # of the way across the pulley, for an axis that is not level
    before = [jnp.interp(curves.travel - way, curves.travel, up) for way in (arc, around)]
    return before[0] + share * (off - before[1])
