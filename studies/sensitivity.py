"""What 5 % in tension or modulus, and the bending layer, do to a yaw step: ``python -m studies.sensitivity``.

M2 is the slow start of a slack belt, M3 its rate once it moves (docs/open_question.md). Lambda ~ E/sigma^3 drives both.
A row a tension and a quantity: changes of the hanging strip with its bending layer by -5 and +5 % of the quantity, and
of the strip without the layer by the layer.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from belt_sim.case import Case
from belt_sim.model import analytic_model
from belt_sim.settings import case_from
from belt_sim.units import MM
from studies.application import application

READ = ((10.0, 15.0), (15.0, 25.0))  # [m] over which a record of 15 to 25 m is read
NAMES = ("y_1 at 1 m", "y_1 at 3 m", "y_3 at 3 m", "rate read over 10-15 m", "over 15-25 m", "late rate")


def figures(case: Case, model: str, travel: float) -> np.ndarray:
    """y [m], mean slopes of point 1 over READ and the steady rate [m/m], in the order of NAMES."""
    engine = analytic_model(model)
    curves = engine.run(case, travel=travel)
    y1, y3 = (lambda at, k=k: float(np.interp(at, curves.travel, np.asarray(curves.y)[k])) for k in (0, 2))
    rates = [(y1(b) - y1(a)) / (b - a) for a, b in READ]
    return np.array([y1(1.0), y1(3.0), y3(3.0), *rates, engine.steady_rate(case)])


def sensitivity(config: dict[str, Any]) -> None:
    """Print the table."""
    share, base, travel = config["share"], config["base"], config["travel"]
    table = Table("N/mm2", "of", *NAMES, title=f"changes in % by -{100 * share:g} / +{100 * share:g} %; mm and mm/m")
    for tension in config["tensions"]:
        case = case_from(config | {"tension": tension})
        middle, factors = figures(case, base, travel), (1 - share, 1 + share)
        table.add_row(f"{tension:g}", "", *(f"{v / MM:.4f}" for v in middle))
        stress, modulus = case.settings.tension, case.belt.youngs_modulus
        changed = {
            "tension": [replace(case, settings=replace(case.settings, tension=stress * f)) for f in factors],
            "modulus": [replace(case, belt=replace(case.belt, youngs_modulus=modulus * f)) for f in factors],
        }
        for what, both in changed.items():
            change = [100 * (figures(c, base, travel) / middle - 1) for c in both]
            table.add_row("", what, *(f"{a:+.1f} / {b:+.1f}" for a, b in zip(*change, strict=True)))
        layer = 100 * (middle / figures(case, "strip", travel) - 1)
        table.add_row("", "bending layer", *(f"{v:+.1f}" for v in layer))
    Console(width=150).print(table)


if __name__ == "__main__":
    application("sensitivity", sensitivity)
