"""The 3D rig's own error: python -m studies.space_error measures it against the 1D line, without noise.

Every signal of every setting of the plan, with nothing hidden: the best common factor between the two, and what it
leaves over. Takes minutes.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.virtual_rig.observe import Errors, observe, true_line
from belt_sim.virtual_rig.plan import Plan
from belt_sim.virtual_rig.space import OPTIONS, SceneRun, measure, read, true_cases
from belt_sim.virtual_rig.space_plan import space_plan


def differences(space: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Best factors of 3D signals on the line's, off 1, and what they leave over [m].

    space, line [m], shape (signals, n, runs); returns shapes (signals, runs) and (signals, n, runs).
    """
    factor = (space * line).sum(axis=1) / (line * line).sum(axis=1)
    return factor - 1.0, space - factor[:, None] * line


def main() -> None:
    plan: Plan = space_plan()
    cases = true_cases(plan, "strip", Errors())
    space = read(plan, measure([SceneRun(c, (), OPTIONS, plan.length) for c in cases]))
    off, left = differences(space, observe(plan, true_line(plan, "strip", Errors()), ()))
    rms = np.sqrt((left**2).mean(axis=1))
    table = Table("", "rms", "worst")
    table.add_row(
        "best common factor of a signal, off 1", f"{np.sqrt((off**2).mean()):.2%}", f"{np.abs(off).max():.2%}"
    )
    table.add_row(
        "what it leaves over, um", f"{np.sqrt((left**2).mean()) * 1e6:.1f}", f"{np.abs(left).max() * 1e6:.1f}"
    )
    table.add_row("the same of one signal, um", "", f"{rms.max() * 1e6:.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
