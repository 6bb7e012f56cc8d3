"""What 5 % in tension or in Young's modulus does to M2 and M3: ``python -m studies.sensitivity``.

M2 is the slow start of a slack belt, M3 its rate once it moves (docs/open_question.md). Lambda ~ E/sigma^3 drives both.
A row a tension and a quantity: changes of the hanging strip with its bending layer by -5 and +5 % of the quantity.
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

STARTS, READ = (1.0, 3.0), ((10.0, 15.0), (15.0, 25.0))  # [m] of travel; a record of 15 to 25 m is read over READ


def figures(case: Case, model: str, travel: float) -> np.ndarray:
    """y of point 1 at STARTS [m], its mean slopes over READ and the steady rate [m/m], shape (5,)."""
    engine = analytic_model(model)
    curves = engine.run(case, travel=travel)

    def y(at: float) -> float:
        return float(np.interp(at, curves.travel, np.asarray(curves.y)[0]))

    return np.array([*map(y, STARTS), *((y(b) - y(a)) / (b - a) for a, b in READ), engine.steady_rate(case)])


def sensitivity(config: dict[str, Any]) -> None:
    """Print the table."""
    names = ("y_1 at 1 m", "y_1 at 3 m", "rate read over 10-15 m", "over 15-25 m", "late rate")
    share = config["share"]
    table = Table("N/mm2", "of", *names, title=f"changes in % by -{100 * share:g} / +{100 * share:g} %; mm and mm/m")
    for tension in config["tensions"]:
        case = case_from(config | {"tension": tension})
        stress, modulus = case.settings.tension, case.belt.youngs_modulus
        middle = figures(case, config["base"], config["travel"])
        table.add_row(f"{tension:g}", "", *(f"{v / MM:.4f}" for v in middle))
        changed = {
            "tension": [
                replace(case, settings=replace(case.settings, tension=stress * f)) for f in (1 - share, 1 + share)
            ],
            "modulus": [
                replace(case, belt=replace(case.belt, youngs_modulus=modulus * f)) for f in (1 - share, 1 + share)
            ],
        }
        for what, both in changed.items():
            change = [100 * (figures(c, config["base"], config["travel"]) / middle - 1) for c in both]
            table.add_row("", what, *(f"{a:+.1f} / {b:+.1f}" for a, b in zip(*change, strict=True)))
    Console(width=130).print(table)


if __name__ == "__main__":
    application("sensitivity", sensitivity)
