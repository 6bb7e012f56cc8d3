"""Fig. 5: the lateral movement of the rope, step by step."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import FAINT, INK, POINTS
from belt_sim.si import MM
from studies.paper.case import ROPE_EXAMPLE, YAW
from studies.paper.models import case_at, y_mm
from studies.paper.plate import Plate, column

NUMBER, TITLE = 5, "Lateral movement of the rope"
STEP = 0.01  # [m]
HALF = math.pi * ROPE_EXAMPLE.tail_radius  # [m] of travel, half a revolution
#: what is seen -> travel [m]
MOMENTS = {
    "I  tail pulley yawed": 0.0,
    "II  point 1 moves": 0.25,
    "III  point 2 begins": HALF + 2 * STEP,
    "IV  the lower span turns": HALF + 0.25,
    "V  point 3 speeds up": 2 * HALF - STEP,
    "VI  point 4 begins, all move": 2 * HALF + 0.35,
}


def plate(in_space: bool = True) -> Plate:
    """Points 1-4 of the rope model at six moments."""
    model = replace(analytic_model("rope"), step=STEP, keep=STEP)
    curves = model.run(case_at(100.0, short=True), travel=1.5)
    at = [*MOMENTS.values()]
    numbers = {"travel_m": column(at)}
    numbers |= {f"y{k + 1}_mm": column(y_mm([np.interp(s, curves.travel, curves.y[k]) for s in at])) for k in range(4)}
    caption = (
        "Rope model seen from above, centre distance 2 m, pulley radius 170 mm: upper span full, lower span dashed. "
        "Strokes on the pulleys: the way on which their surface carries the upper span. All at one scale, y enlarged."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, axes = style.figure(9.6, 5.0, 2, 3, sharex=True, sharey=True)
    for k, (ax, name) in enumerate(zip([*axes[0], *axes[1]], MOMENTS, strict=True)):
        _moment(ax, [n[f"y{p}_mm"][k] for p in (1, 2, 3, 4)])
        ax.set_title(f"{name}", fontsize=style.FONT)
        ax.annotate(f"{n['travel_m'][k]:.2f} m of travel", (0.5, 0.03), xycoords="axes fraction", ha="center",
                    fontsize=style.FONT - 1.5)  # fmt: skip
    for row in axes:
        row[0].set_ylabel("y [mm]")
    for ax in axes[1]:
        ax.set_xlabel("x from the tail pulley [m]")
    style.title(fig, f"{TITLE}: rope model")
    return style.save(fig, path)


def _moment(ax, y: list[float]) -> None:
    """Both spans between the pulleys; y of points 1-4 [mm]."""
    a, radius = ROPE_EXAMPLE.centre_distance, ROPE_EXAMPLE.tail_radius
    for middle, turn in ((0.0, YAW), (a, 0.0)):
        ax.axvspan(middle - radius, middle + radius, color=FAINT, alpha=0.25, linewidth=0)
        for start in np.arange(-1.0, 1.4, 0.2):
            ax.plot([middle - radius, middle + radius], start + turn / MM * np.array([-radius, radius]),
                    color=FAINT, linewidth=0.7)  # fmt: skip
    ax.plot([0.0, a], [y[0], y[3]], color=INK, linewidth=1.6)
    ax.plot([0.0, a], [y[1], y[2]], color=INK, linewidth=1.4, linestyle=(0, (4, 2)))
    above = 7 if y[3] >= y[2] else -8  # of the two at the head pulley, where point 4 is written
    for place, k, up in ((0.0, 0, 7), (0.0, 1, -8), (a, 2, -1 - above), (a, 3, above)):
        ax.plot(place, y[k], "o", color=POINTS[k], markersize=6, zorder=3)
        ax.annotate(f"{k + 1}", (place, y[k]), xytext=(-9 if place == 0.0 else 9, up), textcoords="offset points",
                    ha="center", va="center", color=POINTS[k], fontweight="bold")  # fmt: skip
    ax.grid(False)
    ax.set(xlim=(-0.35, a + 0.35), ylim=(-0.35, 1.0))
