"""Errors that a user can act on: name, value, unit, remedy, in one line; what a model is told to be beyond; and the
checks of a number and a flag."""

import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from numbers import Real
from typing import Any


class BeltError(Exception):
    """Any failure that the command line reports as one line, without a traceback."""


class InputError(BeltError, ValueError):
    """A value that cannot be used as given."""

    def __init__(self, name: str, value: object, unit: str, remedy: str) -> None:
        self.name, self.value, self.unit, self.remedy = name, value, unit, remedy
        super().__init__(f"{name} = {value}{' ' + unit if unit else ''}: {remedy}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.name, self.value, self.unit, self.remedy)


class UnwritableError(BeltError, OSError):
    """A file that cannot be written: errno, strerror and filename, as the system says."""

    def __str__(self) -> str:
        return f"{self.filename}: cannot be written ({self.strerror}); choose another folder"


class CannotRepresent(BeltError):
    """A model was asked for something outside the laws that it reads."""


class SimulationError(BeltError):
    """A simulation stopped before its end; the message names the quantity, the place and the setting to change.

    curves: what there was until then (``belt_sim.curves.Curves``), None when there was nothing.
    """

    curves: Any = None


@dataclass(frozen=True)
class Limit:
    """One boundary of a model's validity. load: how far the case has come towards it, 1 = there; words: what happens
    beyond it; given: what has to be so, where the campaign does not say it (the friction)."""

    id: str
    load: float
    words: str
    given: str = ""

    @property
    def sentence(self) -> str:
        """What happens beyond it, with what has to be so."""
        return f"{self.given}, {self.words}" if self.given else self.words

    @property
    def exceeded_by(self) -> str:
        """How far beyond it the case is, as people say it: "180 times the limit"."""
        return f"{float(f'{self.load:.2g}'):,.12g} times the limit"


def warning(model: str, beyond: Iterable[Limit]) -> str:
    """One line, empty when nothing is exceeded."""
    said = "; ".join(f"{x.id} ({x.exceeded_by}): {x.sentence}" for x in beyond)
    return f"{model} used beyond its validity: {said}" if said else ""


def finite(
    name: str,
    value: Any,
    unit: str = "",
    remedy: str = "give a finite number (a power of ten as 2.1e11)",
    fits: Callable[[float], bool] = lambda value: True,
) -> float:
    """``value`` as a float if it is a finite number (of NumPy or JAX, too) that ``fits``; raises InputError with
    ``remedy`` otherwise."""
    _refuse_quoted(name, value, unit)
    value = value.item() if getattr(value, "ndim", None) == 0 else value
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    remedy = "give one number; only a sweep takes a list" if isinstance(value, list | tuple) else remedy
    if not is_number or not abs(value) <= sys.float_info.max or not fits(value):  # nan, inf, a whole number beyond
        raise InputError(name, value, unit, remedy)
    return float(value)


def _refuse_quoted(name: str, value: Any, unit: str) -> None:
    """Raise InputError for a number that is written as a text; 012 needs no quotes to be read as one."""
    if isinstance(value, str) and re.fullmatch(r"[+-]?(?!0\d)[\d.]+", value):
        raise InputError(name, repr(value), unit, "is a text; leave the quotes out")


def flag(name: str, value: Any) -> bool:
    """``value`` if it is true or false; raises InputError otherwise."""
    if not isinstance(value, bool):
        raise InputError(name, value, "", "give true or false")
    return value


def whole(name: str, value: Any, least: int = 1, most: int | None = None, *, otherwise: str = "") -> int:
    """``value`` if it is a whole number of at least ``least`` and at most ``most``; raises InputError otherwise.

    otherwise: what else may stand there, as in "auto or "; for the message.
    """
    _refuse_quoted(name, value, "")
    value = value.item() if getattr(value, "ndim", None) == 0 else value
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(name, value, "", f"give {otherwise}a whole number of at least {least}")
    if most is not None and value > most:
        raise InputError(name, value, "", f"give {otherwise}a whole number of at most {most}")
    return value
