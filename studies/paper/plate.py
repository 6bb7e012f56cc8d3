"""A plate: one figure of the paper, computed; which there are, and which have nothing to compute."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.errors import InputError
from belt_sim.show import style

DIGITS = 7  # significant, of the numbers written down


@dataclass(frozen=True, kw_only=True)
class Plate:
    """number and title as in the paper; caption: what was computed here, in plain words.

    numbers: everything that is drawn, JSON-able, units in the names; draw: returns the picture, a matplotlib figure;
    stored: names of the stored runs in three dimensions that it shows.
    """

    number: int
    title: str
    caption: str
    numbers: Mapping[str, Any]
    draw: Callable[[], Any]
    stored: tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """Name of its picture."""
        return f"figure_{self.number:02d}.png"

    def save(self, folder: Path) -> Path:
        """Draw it into a folder."""
        drawn: Path = style.picture(lambda path: style.save(self.draw(), path))(folder / self.file)
        return drawn


def column(values: Any) -> list[float]:
    """Numbers of an array as they are written down."""
    return [float(f"{v:.{DIGITS}g}") + 0.0 for v in np.asarray(values, float).ravel()]


FIGURES = (2, 6, 9, 12, 13, 14)

#: figures of the paper that nothing is computed for, and why
_CHAIN, _BELT = (f"particles in three dimensions: belt-sim simulate +experiment=figure_{n}" for n in (16, 19))
NOT_COMPUTED = {
    1: "a sketch of how the tail pulley is yawed (eq. 1): a definition",
    3: "a sketch that names the run-up and run-off points 1 to 4: a definition",
    4: "a sketch of the angles at the run-up point (eq. 5, 6): a definition; what follows from it is Fig. 6",
    5: "the rope from above at six moments of Fig. 6",
    7: "the rope from above for either sign of the yaw: Fig. 6 and its mirror",
    8: "a sketch of the beam with its boundary values (eq. 7): what follows from it is Fig. 9",
    10: "a sketch of where a hanging span leaves its pulleys: what follows from it is Fig. 14",
    11: "a photograph of the test rig",
    15: _CHAIN,
    16: _CHAIN,
    17: _CHAIN.replace("16", "17"),
    18: _BELT,
    19: _BELT,
    20: _BELT,
}


def compute(number: int, *, in_space: bool = True) -> Plate:
    """A figure; in_space: with the stored belts in three dimensions beside the laws."""
    from studies.paper import by_laws

    return by_laws.FIGURES[number](in_space)


def select_figures(figures: object) -> list[int]:
    """The numbers asked for (None: all that can be had); raises InputError for one that there is none of."""
    if figures is None:
        return [*FIGURES]
    wanted = figures if isinstance(figures, list | tuple) else [figures]
    for number in wanted:
        if isinstance(number, bool) or not isinstance(number, int):
            raise InputError("figures", number, "", "give numbers, as figures=[12,13]")
        if number in NOT_COMPUTED:
            raise InputError("figures", number, "", f"is {NOT_COMPUTED[number]}; nothing to compute")
        if number not in FIGURES:
            raise InputError("figures", number, "", f"use some of {', '.join(map(str, FIGURES))}")
    return sorted({*wanted})
