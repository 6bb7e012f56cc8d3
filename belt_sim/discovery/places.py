"""Places: where an unknown may act, as combinations of channels that belong together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from belt_sim.diagnosis.readings.samples import Samples
from belt_sim.discovery.channels import UNITS

if TYPE_CHECKING:
    from belt_sim.discovery.operators import Operators

#: kind of channel -> what people call it
KINDS = {
    "yaw": "yaw of {}",
    "turn": "turn of the belt where it runs up {}",
    "drift": "sideways drift where the belt runs up {}",
    "shift": "sideways shift over the wrap of {}",
    "twist": "twist over the wrap of {}",
}
PULLEYS = ("tail", "head")
TENSION = "tension"
TRAVEL = "travel"
SPAN = "span"
CARRIED = "carried"
#: kinds of what a stretch of belt can do where it runs up
BY_THE_BELT = ("turn", "drift")
#: kinds of what happens to a belt while it lies on a pulley
WRAPPED = ("shift", "twist")
#: kinds of relative change of a span's own stiffness -> what people call it, of both spans and of one
STIFFNESS = {
    "pull": ("", "tension of one span, the {} one"),
    "bending": ("bending stiffness of both spans", "bending stiffness of the {} span"),
    "torsion": ("torsional stiffness of both spans", "torsional stiffness of the {} span"),
}
#: kinds of places whose input is a relative change of what bends a span -> what that is
RELATIVE = {TENSION: TENSION, "pull": TENSION, "bending": "bending", "torsion": "torsion"}
SPANS = ("upper", "lower")  # the first runs up the tail pulley where the belt travels forwards


@dataclass(frozen=True)
class Place:
    """name; words: as people say it; unit of its input; parts: (channel, pulley 0 or 1, or None of a sensor)."""

    name: str
    words: str
    unit: str
    parts: tuple[tuple[str, int | None], ...]

    @property
    def kind(self) -> str:
        """yaw, turn, drift, shift, twist, span, tension, bending, torsion, pull, travel or sensor."""
        return self.name.split("_")[0]

    @property
    def pulleys(self) -> str:
        """tail, head, both, carried, upper or lower of a span, or the sensors' names."""
        return self.name.split("_")[-1]

    @property
    def carried(self) -> bool:
        """Whether the belt carries what acts here from pulley to pulley."""
        return self.pulleys == CARRIED and self.kind in BY_THE_BELT

    @property
    def relative(self) -> str:
        """What its input is a relative change of: tension, bending or torsion; empty: of nothing."""
        return RELATIVE.get(self.kind, "")

    @property
    def of_all_spans(self) -> "Place":
        """The same of both spans, where it is of one."""
        return replace(self, name=f"{self.kind}_both") if self.pulleys in SPANS else self

    @property
    def seldom(self) -> bool:
        """Whether it is tried only where something is known to be missing."""
        return self.kind in (SPAN, TRAVEL) or self.carried


def places_of(samples: Samples) -> tuple[Place, ...]:
    """All places of a campaign: each pulley and both alike, the tension, what bends the spans, each sensor and all
    alike, the encoder.

    What loads a span bends it where it runs up, on whichever pulley that is: where the belt has travelled both ways a
    span is a place of its own. What the belt carries meets both pulleys, one after the other, if it goes round once.
    """
    found = []
    for kind, words in KINDS.items():
        channels = [f"{kind}_{p}" for p in PULLEYS]
        for k, p in enumerate(PULLEYS):
            found.append(Place(channels[k], words.format(f"the {p} pulley"), UNITS[channels[k]], ((channels[k], k),)))
        both = tuple(zip(channels, (0, 1), strict=True))
        found.append(Place(f"{kind}_both", words.format("both pulleys alike"), UNITS[channels[0]], both))
        if kind in BY_THE_BELT and samples.end > float(samples.cases.rig.belt_length):
            there = words.format("both pulleys (as the belt carries it)")
            found.append(Place(f"{kind}_{CARRIED}", there, UNITS[channels[0]], both))
    runups = (("turn_tail", 0), ("turn_head", 1))
    found.append(Place(TENSION, "tension of the belt", "1", runups))
    for kind, (of_both, one) in STIFFNESS.items():
        found += [Place(f"{kind}_both", of_both, "1", runups)] if of_both else []
        found += [Place(f"{kind}_{s}", one.format(s), "1", runups) for s in SPANS]
    if len({r.direction for r in samples.runs}) > 1:
        words = "bend of the {} span where it runs up"
        found += [Place(f"{SPAN}_{s}", words.format(s), UNITS["turn_tail"], runups) for s in SPANS]
    sensors = [s for s in samples.signals if s.kind == "lateral"]
    for s in sensors:
        found.append(Place(f"sensor_{s.name}", f"reading of {s.name}", "m", ((s.name, None),)))
    if len(sensors) > 1:
        parts = tuple((s.name, None) for s in sensors)
        found.append(Place("sensor_all", "readings of all sensors alike", "m", parts))
    if sensors:
        found.append(Place(TRAVEL, "travel that the encoder shows", "m", tuple((s.name, None) for s in sensors)))
    return tuple(found)


def place_columns(ops: "Operators", place: Place, inputs: Sequence[np.ndarray]) -> np.ndarray:
    """Whitened columns (F, R, m) of inputs (F, R, J), one array a part of the place."""
    columns = [ops.columns(channel, one) for (channel, _), one in zip(place.parts, inputs, strict=True)]
    return columns[0] if len(columns) == 1 else np.sum(columns, axis=0)
