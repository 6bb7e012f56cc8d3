"""Fig. 6: moving curves of a limp rope on yawed pulleys."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import FAINT, POINT_NAMES, POINTS
from studies.paper import drawing
from studies.paper.case import ROPE_EXAMPLE
from studies.paper.models import case_at, rate_mm_per_m, y_mm
from studies.paper.plate import Plate, column

NUMBER, TITLE = 6, "Moving curves of a limp rope on yawed pulleys"
TRAVEL, RECORD = 10.0, 0.02  # [m]
TURN = 2.0 * math.pi * ROPE_EXAMPLE.tail_radius  # [m] of travel, a revolution of the pulleys


def plate(in_space: bool = True) -> Plate:
    """Points 1-4 of the rope model on the short rig."""
    model = replace(analytic_model("rope"), step=RECORD, keep=RECORD)
    case = case_at(100.0, short=True)
    curves, rate = model.run(case, travel=TRAVEL), float(rate_mm_per_m(model.steady_rate(case)))
    numbers = {"travel_m": column(curves.travel)}
    numbers |= {f"y{k + 1}_mm": column(y_mm(curves.y[k])) for k in range(4)}
    more = {"steady_rate_mm_per_m": rate, "revolution_m": TURN}
    caption = (
        f"Rope model, centre distance 2 m, pulley radius 170 mm, yaw -0.042 degrees: point 2 begins after half a "
        f"revolution of the pulleys ({0.5 * TURN:.2f} m), point 4 after a whole one, and in the end all four move at "
        f"{rate:.4f} mm per m of travel."
    )
    n = numbers | more
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=n, draw=lambda p: _draw(p, n))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, [[ax]] = style.figure(8.0, 4.6)
    for k, colour in enumerate(POINTS):
        ax.plot(n["travel_m"], n[f"y{k + 1}_mm"], color=colour, label=f"point {POINT_NAMES[k]}")
    drawing.zero_line(ax)
    for turns, name in zip(np.arange(0.5, 2.1, 0.5), ("½", "1", "1½", "2"), strict=True):
        ax.axvline(turns * TURN, color=FAINT, linewidth=0.8, linestyle=(0, (3, 3)), zorder=1)
        ax.annotate(name, (turns * TURN, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -3),
                    textcoords="offset points", va="top", fontsize=style.FONT - 1)  # fmt: skip
    ax.annotate("revolutions of the pulleys", (2.0 * TURN, 1.0), xycoords=("data", "axes fraction"), xytext=(16, -3),
                textcoords="offset points", va="top", fontsize=style.FONT - 1)  # fmt: skip
    ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, TRAVEL))
    ax.set_ylim(bottom=-0.15)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.06), labelcolor="linecolor")
    style.title(fig, TITLE)
    return style.save(fig, path)
