"""The 3D rig's own error: python -m studies.space_error measures it against the 1D line, without noise.

Every signal of every setting of the plan by lot, with nothing hidden: the best common factor between the two, what it
leaves over, and how large the difference is for the sensors, in units of noise after what nuisances explain (d). Half a
minute; ENGINE=native takes six.
"""

import os
from functools import partial

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.virtual_rig.hidden import Detectability
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.space import (
    OPTIONS,
    SENSORS,
    measure,
    run_scene,
    take_readings,
    true_cases,
    with_simulator_error,
)
from studies.application import show_help
from studies.challenge.space_campaigns import small_space_plan


def differences(space: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best factors of 3D signals on the line's, off 1, and what they leave over [m].

    space, line [m], shape (signals, n, runs); returns shapes (signals, runs) and (signals, n, runs).
    """
    factor = (space * line).sum(axis=1) / (line * line).sum(axis=1)
    return factor - 1.0, space - factor[:, None] * line


def main() -> None:
    plan, engine = small_space_plan(), os.environ.get("ENGINE", "quasi_static")
    cases = true_cases(plan, "strip", TrueErrors())
    run = partial(run_scene, effects=(), options=OPTIONS, travel=plan.length, engine=engine)
    space = take_readings(plan, measure(cases, run, 1))
    line = observe(plan, true_line(plan, "strip", TrueErrors()), ())
    off, left = differences(space, line)
    rms = np.sqrt((left**2).mean(axis=1))
    table = Table("", "rms", "worst")
    for said, values, unit, form in (
        ("best common factor of a signal, off 1", off, 1.0, ".2%"),
        ("what it leaves over, um", left, 1e6, ".1f"),
    ):
        largest = np.sqrt((values**2).mean()), np.abs(values).max()
        table.add_row(said, *(format(unit * value, form) for value in largest))
    table.add_row("the same of one signal, um", "", f"{rms.max() * 1e6:.1f}")
    Console().print(table)
    told = {"sensors alone": SENSORS, "what the file states": with_simulator_error(SENSORS, engine)[0]}
    for name, noise in told.items():
        d = float(np.linalg.norm(Detectability(plan, noise, "strip").reduce(space - line)))
        Console().print(f"d of the difference, {name}: {d:.2f}")


if __name__ == "__main__":
    show_help(__doc__)
    main()
