"""How a field of a result stands in a file: its name there, its unit, and whether an empty one is left out.

The types of results are plain dataclasses in SI. pydantic reads these annotations when a file is written or read
(``belt_sim.results.json``) and makes the JSON schema of the file from them.
"""

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
)

from belt_sim.effects.base import Effect
from belt_sim.results.words import join_effects
from belt_sim.units import round_digits

IN_SI = {"units": "SI"}  # context of reading a file that has our own names and SI throughout
SETTING_DIGITS = 12  # significant digits of what somebody has set: fewer than a change of units leaves


def file_field(name: str, unit: float = 1.0, *, digits: int | None = None, omit_empty: bool = False) -> Any:
    """Return the annotation of a field that is called ``name`` in files, in units of ``unit`` (in SI).

    digits: significant digits that are written; omit_empty: an empty value (None, "", no entries) is not written.
    """
    info = Field(alias=name, exclude_if=is_empty if omit_empty else None)

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


def is_empty(value: Any) -> bool:
    """Return whether there is nothing to write: None, no text, no entries."""
    return value is None or (isinstance(value, str | tuple | list | dict) and not value)


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
    PlainSerializer(join_effects, return_type=str),
]
#: what has no layout of its own: names with whatever stands beside them
Free = Annotated[dict[str, Any], PlainValidator(dict), PlainSerializer(dict, return_type=dict[str, Any])]


def effect_json(effect: Effect) -> dict[str, Any]:
    """Return an effect as files hold it: its id, and its parameters in SI."""
    return {"id": effect.id, "parameters": {n: float(getattr(effect, n)) for n in effect.parameters}}


StoredEffect = Annotated[InstanceOf[Effect], PlainSerializer(effect_json, return_type=dict[str, Any])]
