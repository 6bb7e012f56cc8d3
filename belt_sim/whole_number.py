"""A whole number that somebody asked for."""

from typing import Any

from belt_sim.errors import InputError


def whole(name: str, value: Any, least: int = 1, most: int | None = None, *, otherwise: str = "") -> int:
    """``value`` if it is a whole number of at least ``least`` and at most ``most``; raises InputError otherwise.

    otherwise: what else may stand there, as in "auto or "; for the message.
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(name, value, "", f"give {otherwise}a whole number of at least {least}")
    if most is not None and value > most:
        raise InputError(name, value, "", f"give {otherwise}a whole number of at most {most}")
    return value
