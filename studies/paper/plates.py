"""Which figures there are, which of them need the belt in three dimensions, and which have nothing to compute."""

import importlib
from collections.abc import Iterable
from types import ModuleType

from belt_sim.errors import InputError

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


def module(number: int) -> ModuleType:
    """The file of a figure."""
    return importlib.import_module(f"studies.paper.figures.figure_{number:02d}")


def chosen(figures: object, *, in_space: bool) -> list[int]:
    """The numbers asked for (None: all that can be had); raises InputError for one that there is none of."""
    there = FIGURES if in_space else ANALYTIC
    if figures is None:
        return [*there]
    wanted = figures if isinstance(figures, list | tuple) else [figures]
    for number in wanted:
        _check(number, there)
    return sorted({*wanted})


def _check(number: object, there: Iterable[int]) -> None:
    if isinstance(number, bool) or not isinstance(number, int):
        raise InputError("figures", number, "", "give numbers, as figures=[12,13]")
    if number in NOT_COMPUTED:
        raise InputError("figures", number, "", f"is {NOT_COMPUTED[number]}; nothing to compute")
    if number in FIGURES and number not in there:
        raise InputError("figures", number, "", "is a belt in three dimensions; ask without fast=true")
    if number not in there:
        raise InputError("figures", number, "", f"use some of {', '.join(map(str, there))}")
