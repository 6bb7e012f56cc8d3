"""Turns that are no longer small, by shell elements beside the linear strip law: ``python -m studies.shell.far``.

One span, hinged ends, turned at its run-up step by step: entry moment, carry-over and tilt of mid-span, and how far
the case is over the limits of belt_sim.validity that have to do with it.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Schedule
from belt_sim.settings import case_from
from belt_sim.units import DEGREE
from belt_sim.validity import limits
from studies.application import application
from studies.shell import ccx
from studies.shell.span import Mesh, by_law, by_shell

LIMITS = ("slack_edge", "second_order")


def far_study(config: dict[str, Any]) -> None:
    """The table."""
    if not ccx.is_installed():
        print(f"skipped: {ccx.MISSING}")
        return
    case, mesh = case_from(config), Mesh(**config["mesh"])
    wanted = [t * DEGREE for t in config["turns"]]
    law = by_law(case, config["ends"])
    columns = ("turn deg", "entry N m", "over law %", "carried N m", "over law %", "tilt mrad", "over law %")
    table = Table(*columns, *(f"{name}, load" for name in LIMITS))
    for state in by_shell(case, wanted, config["ends"], Path(config["out"]), mesh):
        shell = np.array([state.entry, state.carried, state.tilt * 1e3])
        apart = 100 * (state.stiffness / law - 1)
        cells = [
            f"{v:{form}}"
            for pair in zip(shell, apart, strict=True)
            for v, form in zip(pair, (".2f", "+.1f"), strict=True)
        ]
        yawed = replace(case, settings=replace(case.settings, yaw=Schedule.step(state.turn)))
        load = {x.id: x.load for x in limits(yawed)}
        table.add_row(f"{state.turn / DEGREE:.4f}", *cells, *(f"{load[name]:.2f}" for name in LIMITS))
    Console(width=150).print(table)


if __name__ == "__main__":
    application("shell_far", far_study)
