"""How a number of a result stands in a file, and how people at a machine read it: in degrees, mm at the pulley.

The types of results are plain dataclasses in SI. By the annotations of their fields (a name in files, a unit, whether
it is left out where it is empty) pydantic reads and writes files, and makes their JSON schemas.
"""

import math
import operator
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    InstanceOf,
    PlainSerializer,
    PlainValidator,
    SerializationInfo,
    ValidationInfo,
    WithJsonSchema,
    model_serializer,
)

from belt_sim.effects.base import Effect, library
from belt_sim.results import words
from belt_sim.results.simulation import effect_json
from belt_sim.units import round_digits, shop_unit

IN_SI = {"units": "SI"}  # context of reading a file that has our own names and SI throughout


def file_field(name: str, unit: float = 1.0, *, digits: int | None = None, omit_empty: bool = False) -> Any:
    """Return the annotation of a field that is called ``name`` in files, in units of ``unit`` (in SI).

    digits: significant digits that are written; omit_empty: an empty value (None, "", no entries) is not written.
    """
    info = Field(alias=name, exclude_if=operator.not_ if omit_empty else None)

    def to_file(value: float | None, serialization: SerializationInfo) -> float | None:
        if value is None or not serialization.by_alias:
            return value
        return value / unit if digits is None else round_digits(value / unit, digits)

    def from_file(value: float | None, validation: ValidationInfo) -> float | None:
        return value if value is None or validation.context == IN_SI else value * unit

    if unit != 1.0:
        info.metadata.append(AfterValidator(from_file))
        info.metadata.append(PlainSerializer(to_file, return_type=float | None))
    return info


#: an array of numbers, written as a list; NaN is written as null
Array = Annotated[
    np.ndarray,
    PlainValidator(lambda value: np.array(value, dtype=float)),
    PlainSerializer(lambda value: np.asarray(value, float).tolist(), return_type=list),
    WithJsonSchema({"type": "array"}),
]
#: ids of effects that act together; one text in files, a + b
EffectSet = Annotated[
    tuple[str, ...],
    BeforeValidator(lambda text: tuple(text.split(" + "))),
    PlainSerializer(" + ".join, return_type=str),
]
#: what has no layout of its own: names with whatever stands beside them
Free = Annotated[dict[str, Any], PlainValidator(dict), PlainSerializer(dict, return_type=dict[str, Any])]


StoredEffect = Annotated[InstanceOf[Effect], PlainSerializer(effect_json, return_type=dict[str, Any])]
COVERAGE_95 = 1.96


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter in SI: value, u (one sigma), unit, whether a real machine could have it, and where it lies
    in 95 of 100 campaigns, which is 1.96 u either way unless stated."""

    value: float
    u: float
    unit: str
    plausible: bool
    interval_95: tuple[float, float] = ()  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if not self.interval_95:
            even = self.value - COVERAGE_95 * self.u, self.value + COVERAGE_95 * self.u
            object.__setattr__(self, "interval_95", even)

    @model_serializer
    def _to_file(self, info: SerializationInfo) -> dict[str, Any]:
        row: dict[str, Any] = {name: getattr(self, name) for name in ("value", "u", "unit", "plausible")}
        return row | ({"interval_95": list(self.interval_95)} if info.by_alias else {})

    @property
    def is_range(self) -> bool:
        """Whether u says nothing, as readings stop to change somewhere or explanations disagree: it is an interval."""
        low, high = self.interval_95
        return COVERAGE_95 * self.u > high - low

    def shown_in(self, factor: float | None = None, unit: str = "") -> str:
        """Value and uncertainty in a unit of which ``factor`` make one of SI; None: in that of the shop."""
        factor, unit = shop_unit(self.unit) if factor is None else (factor, unit)
        low, high = self.interval_95
        if self.is_range:
            shown = f"{words.number(factor * low)} to {words.number(factor * high)}"
            return shown if unit in ("", "1") else f"{shown} {unit}"
        return words.with_u(factor * self.value, factor * self.u, unit)

    __str__ = shown_in


@dataclass(frozen=True, kw_only=True)
class MachineSizes:
    """What turns numbers into those of the shop: axes' distance, radii, the belt's width and the span's length [m]."""

    centre_distance: float
    tail_radius: float
    head_radius: float
    width: float
    span_length: float


def display_unit(effect: str, number: str, unit: str, machine: MachineSizes | None = None) -> tuple[float, str]:
    """How many of the units in which people read a number of an effect make one of its SI ``unit``, and their name; on
    a ``machine`` tapers and crowns are differences of diameter, turns of a pulley mm across the belt, places
    distances."""
    cls = library().get(effect)
    declared = cls.parameters.get(number) if cls is not None else None
    factor, name = (declared.shop if declared else None) or shop_unit(unit)
    if machine is None:
        return factor, name
    radius = machine.head_radius if number.endswith("_head") else machine.tail_radius
    across = {  # how the effect writes it -> what it is on this machine, in one of that
        "ppm of the radius per m of width": (2.0 * radius * machine.width, "µm of diameter across the belt's width"),
        "‰ of the radius 1 m from the middle": (
            0.5e3 * radius * machine.width**2,
            "µm of diameter, middle of the belt against its edges",
        ),
        "mm/m": (machine.width, "mm across the belt's width"),
    }
    for written, (more, shown) in across.items():
        if name.startswith(written) and effect not in BY_SPIRIT_LEVEL:
            return factor * more, shown + name.removeprefix(written)
    if declared and declared.meaning.startswith("share of the span's length"):
        return machine.span_length, "m"
    return factor, name


BY_SPIRIT_LEVEL = ("machine_tilt", "weld")  # slopes that are no turn of a pulley: mm/m says more
STEEL_EXPANSION = 12e-6  # [1/K], of unalloyed steel at room temperature


def number_texts(effect: str, numbers: Mapping[str, Estimate], machine: MachineSizes | None = None) -> dict[str, str]:
    """Numbers of an effect as people at the machine read them, by name; a periodic course (amplitudes cosK, sinK, whose
    errors are taken as independent) from its lowest to its highest point."""
    texts = {}
    if waves := {n: e for n, e in numbers.items() if re.fullmatch(r"(cos|sin)\d+", n)}:
        turn = np.linspace(0.0, 2.0 * np.pi, 1440, endpoint=False)
        shapes = [(np.cos if n.startswith("cos") else np.sin)(int(n[3:]) * turn) for n in waves]
        course = np.sum([e.value * shape for e, shape in zip(waves.values(), shapes, strict=True)], axis=0)
        top, bottom = int(np.argmax(course)), int(np.argmin(course))
        u = math.hypot(*(e.u * float(s[top] - s[bottom]) for e, s in zip(waves.values(), shapes, strict=True)))
        factor, unit = shop_unit(next(iter(waves.values())).unit)
        texts["peak to peak"] = words.with_u(factor * float(np.ptp(course)), factor * u, unit)
    for n, e in ((n, e) for n, e in numbers.items() if n not in waves):
        texts[n] = e.shown_in(*display_unit(effect, n, e.unit, machine))
        if machine is None or e.is_range:
            continue
        if e.unit == "rad":
            texts[n] += f" ({words.number(math.degrees(e.value), 2)}°)"
        elif effect == "camber":
            kelvin = words.number(abs(e.value) * machine.width / STEEL_EXPANSION, 2)
            texts[n] += f" (as {kelvin} K between the edges of a steel belt would make)"
    return texts
