"""Where an unknown may act in a campaign, and the columns of inputs there."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.effects.law_terms import (
    AT_PULLEYS,
    BY_THE_BELT,
    CARRIED,
    PULLEYS,
    SPANS,
    STIFFNESS,
    Place,
    pulley_place,
    sensor_place,
    span_place,
    stiffness_place,
    tension_place,
    travel_place,
)

if TYPE_CHECKING:
    from belt_sim.discovery.operators import Operators


def places_of(samples: Samples) -> tuple[Place, ...]:
    """All places of a campaign: each pulley and both alike, the tension, what bends the spans, each sensor and all
    alike, the encoder.

    What loads a span bends it where it runs up, on whichever pulley that is: where the belt has travelled both ways a
    span is a place of its own. What the belt carries meets both pulleys, one after the other, if it goes round once.
    """
    found: list[Place] = []
    for kind in AT_PULLEYS:
        found += [pulley_place(kind, where) for where in (*PULLEYS, "both")]
        if kind in BY_THE_BELT and samples.end > float(samples.cases.rig.belt_length):
            found.append(pulley_place(kind, CARRIED))
    found.append(tension_place())
    for kind, (of_both, _) in STIFFNESS.items():
        found += [stiffness_place(kind, where) for where in (("both", *SPANS) if of_both else SPANS)]
    if len({r.direction for r in samples.runs}) > 1:
        found += [span_place(where) for where in SPANS]
    points = {s.name: int(s.at[-1]) for s in samples.signals if s.kind == "lateral"}
    found += [sensor_place(name, {name: point}) for name, point in points.items()]
    if len(points) > 1:
        found.append(sensor_place("all", points))
    if points:
        found.append(travel_place(list(points)))
    return tuple(found)


def place_columns(ops: "Operators", place: Place, inputs: Sequence[np.ndarray]) -> np.ndarray:
    """Whitened columns (F, R, m) of inputs (F, R, J), one array a part of the place."""
    columns = [ops.columns(channel, one) for (channel, _), one in zip(place.parts, inputs, strict=True)]
    return columns[0] if len(columns) == 1 else np.sum(columns, axis=0)
