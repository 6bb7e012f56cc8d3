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


ANALYTIC = (2, 5, 6, 7, 8, 9, 10, 12, 13, 14)
IN_SPACE = (15, 16, 17, 18, 19, 20)
FIGURES = ANALYTIC + IN_SPACE

#: figures of the paper that nothing is computed for, and why
NOT_COMPUTED = {
    1: "a sketch of how the tail pulley is yawed (eq. 1): a definition",
    3: "a sketch that names the run-up and run-off points 1 to 4: a definition",
    4: "a sketch of the angles at the run-up point (eq. 5, 6): a definition; what follows from it is Fig. 6",
    11: "a photograph of the test rig",
}


def compute(number: int, *, in_space: bool = True) -> Plate:
    """A figure; in_space: with the stored belts in three dimensions beside the laws."""
    from studies.paper import by_laws
    from studies.paper import in_space as stored

    return stored.FIGURES[number]() if number in IN_SPACE else by_laws.FIGURES[number](in_space)


def select_figures(figures: object, *, in_space: bool) -> list[int]:
    """The numbers asked for (None: all that can be had); raises InputError for one that there is none of."""
    there = FIGURES if in_space else ANALYTIC
    if figures is None:
        return [*there]
    wanted = figures if isinstance(figures, list | tuple) else [figures]
    for number in wanted:
        if isinstance(number, bool) or not isinstance(number, int):
            raise InputError("figures", number, "", "give numbers, as figures=[12,13]")
        if number in NOT_COMPUTED:
            raise InputError("figures", number, "", f"is {NOT_COMPUTED[number]}; nothing to compute")
        if number in FIGURES and number not in there:
            raise InputError("figures", number, "", "is a belt in three dimensions; ask without fast=true")
        if number not in there:
            raise InputError("figures", number, "", f"use some of {', '.join(map(str, there))}")
    return sorted({*wanted})
