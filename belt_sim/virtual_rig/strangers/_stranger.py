"""A fault that no catalogue lists, and the words that describe it."""

from dataclasses import dataclass
from typing import ClassVar

from belt_sim.virtual_rig.fault import Fault


@dataclass(frozen=True, kw_only=True)
class Stranger(Fault):
    """place, variable and form: words of ``words.py``; also: other pairs (variable, form) that are as right.

    blind: made for blind tests, after the development set.
    """

    place: ClassVar[str] = ""
    variable: ClassVar[str] = ""
    form: ClassVar[str] = ""
    also: ClassVar[tuple[tuple[str, str], ...]] = ()
    blind: ClassVar[bool] = False
