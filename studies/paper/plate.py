"""A plate: one figure of the paper, computed, with the numbers behind it and how it is drawn."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

DIGITS = 7  # significant, of the numbers written down


@dataclass(frozen=True, kw_only=True)
class Plate:
    """number and title as in the paper; caption: what was computed here, in plain words.

    numbers: everything that is drawn, JSON-able, units in the names; draw: writes the picture; stored: names of the
    stored runs in three dimensions that it shows.
    """

    number: int
    title: str
    caption: str
    numbers: Mapping[str, Any]
    draw: Callable[[Path], Path]
    stored: tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """Name of its picture."""
        return f"figure_{self.number:02d}.png"


@dataclass(frozen=True, kw_only=True)
class View:
    """What a gallery shows: with or without the belt in three dimensions."""

    in_space: bool = True


def column(values: Any) -> list[float]:
    """Numbers of an array as they are written down."""
    return [float(f"{v:.{DIGITS}g}") + 0.0 for v in np.asarray(values, float).ravel()]
