"""Made-up figures in the place of the paper's Figs 12 and 13: python -m studies.made_up_figures.

The values behind those figures are not public. These come from no belt and from no model of the house, but from two
formulas with round numbers; they show how a digitised figure is written down, imported and compared. Who has the true
values puts them into the same files.
"""

from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.io import write_text
from studies.application import application

#: tension [N/mm2] -> offset [mm], length [m] and late rate [mm/m] of an invented start
INVENTED = {7: (1.0, 6.0, 0.05), 10: (1.5, 5.0, 0.10), 20: (2.5, 4.0, 0.20), 40: (3.0, 3.0, 0.30)}
RATES = {4: 0.03, 7: 0.05, 10: 0.10, 15: 0.15, 20: 0.20, 30: 0.26, 40: 0.30, 60: 0.33}
#: Pixels of the picture: travel 0 and 25 m, y 0 and -10 mm (the yaw is negative, y grows downwards).
X, Y, LENGTH, DEPTH = (80, 680), (60, 460), 25.0, 10.0


def figure_12() -> str:
    """Pixels of four curves, each with a column of its own for either axis; curves end at different points."""
    columns: dict[str, list[str]] = {}
    for k, (tension, (offset, length, rate)) in enumerate(INVENTED.items()):
        travel = np.arange(0.0, LENGTH - k, 0.8)
        depth = offset * (1.0 - np.exp(-travel / length)) + rate * travel
        x = X[0] + (X[1] - X[0]) * travel / LENGTH
        y = Y[0] + (Y[1] - Y[0]) * depth / DEPTH
        columns[f"x of {tension}"] = [f"{p:.0f}" for p in x]
        columns[f"y of {tension}"] = [f"{p:.0f}" for p in y]
    longest = max(len(c) for c in columns.values())
    rows = zip(*([*c, *[""] * (longest - len(c))] for c in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(r) for r in rows), ""])


def figure_13() -> str:
    """Late rates, in axis values."""
    rows = [f"{tension},{-rate:.2f}" for tension, rate in RATES.items()]
    return "\n".join(["tension [N/mm2],rate [mm/m]", *rows, ""])


def made_up_figures(config: dict[str, Any]) -> None:
    """Write both tables."""
    for name, text in (("figure_12", figure_12()), ("figure_13", figure_13())):
        print(write_text(Path(config["out"]) / f"made_up_{name}.csv", text))


if __name__ == "__main__":
    application("made_up_figures", made_up_figures)
