"""What the bending layer changes on the test rig: ``python -m studies.lift_off``.

Two tables, at 7, 10, 20 and 40 N/mm2: a span's moments and tilt per unit of yaw, and the belt's movement after the
paper's yaw step, each as a change of what the strip without the layer does.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.effects.contact import LiftOff
from belt_sim.jax_setup import jit_float64, prepare
from belt_sim.line.span import strip
from belt_sim.line.spans import span_responses
from belt_sim.model import analytic_model
from belt_sim.units import N_PER_MM2
from studies.paper.case import paper_case

TENSIONS = (7.0, 10.0, 20.0, 40.0)  # [N/mm2]
TRAVEL = 15.0  # [m]


def spans() -> Table:
    """Entry moment, carry-over and mid-span tilt of the upper and the lower span."""
    answers = jit_float64(span_responses)
    names = ("entry", "carry-over", "tilt")
    table = Table("N/mm2", *(f"{n}, {span}" for span in ("upper", "lower") for n in names), title="change in %")
    for tension in TENSIONS:
        case = paper_case(tension * N_PER_MM2)
        plain, lifted = (answers(case, effects, strip(case)) for effects in ((), (LiftOff(),)))
        rows = [
            100.0 * (np.asarray(getattr(lifted, n))[:, 2] / np.asarray(getattr(plain, n))[:, 2] - 1.0)
            for n in ("runup", "runoff", "mid_tilt")
        ]
        table.add_row(f"{tension:g}", *(f"{rows[k][span]:+.1f}" for span in (0, 1) for k in range(3)))
    return table


def movement() -> Table:
    """Points 1 and 3 after 3 m, and the late rate."""
    table = Table("N/mm2", "y_1 at 3 m", "y_3 at 3 m", "late rate", title="change in %")
    strip_model, lifting = analytic_model("strip"), analytic_model("strip_lift_off")
    for tension in TENSIONS:
        case = paper_case(tension * N_PER_MM2)
        plain, lifted = (m.run(case, travel=TRAVEL) for m in (strip_model, lifting))
        early = [np.interp(3.0, lifted.travel, lifted.y[k]) / np.interp(3.0, plain.travel, plain.y[k]) for k in (0, 2)]
        ratios = [*early, lifting.steady_rate(case) / strip_model.steady_rate(case)]
        table.add_row(f"{tension:g}", *(f"{100.0 * (r - 1.0):+.1f}" for r in ratios))
    return table


if __name__ == "__main__":
    prepare()
    console = Console()
    console.print(spans())
    console.print(movement())
