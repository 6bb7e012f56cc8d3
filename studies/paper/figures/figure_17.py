"""Fig. 17: particle chains of high and of low tension, shown together after 20 revolutions of the pulleys."""

import math
from pathlib import Path

import numpy as np

from belt_sim.show import style
from belt_sim.show.style import BLUE, FAINT, RED
from studies.paper import drawing
from studies.paper.case import ROPE_EXAMPLE, YAW
from studies.paper.drawing import Oblique
from studies.paper.models import y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import StoredRun, stored_run

NUMBER, TITLE = 17, "High and low tensioned particle chains on two pulleys"
RUNS = {"rope_100": ("100 N/mm²", BLUE), "rope_1": ("1 N/mm²", RED)}
TURNS = 20 * 2.0 * math.pi * ROPE_EXAMPLE.tail_radius  # [m] of travel
DRAWN = Oblique(width=1.0, lateral=50.0, height=1.0, tilt=1.0, radius=ROPE_EXAMPLE.tail_radius,
                centre_distance=ROPE_EXAMPLE.centre_distance, half_width=0.36)  # fmt: skip


def plate(in_space: bool = True) -> Plate:
    """Both stored ropes at the same travel."""
    numbers: dict = {"travel_m": TURNS}
    for name in RUNS:
        curves, shape = stored_run(name).curves, stored_run(name).shapes[-1]
        y = [np.interp(TURNS, curves.travel, row) for row in np.asarray(curves.y)]
        x, across, z = shape.middle.T
        numbers[name] = {
            "points_1_to_4_y_mm": column(y_mm(y)),
            "sag_mm": column(stored_run(name).made["sag_mm"]),
            "x_m": column(shape.tail_x - x),
            "y_mm": column(y_mm(across)),
            "z_m": column(z),
        }
    both = np.array([numbers[name]["points_1_to_4_y_mm"] for name in RUNS])
    numbers["greatest_difference_mm"] = float(np.abs(both[0] - both[1]).max())
    share = 100.0 * numbers["greatest_difference_mm"] / float(np.abs(both).max())
    caption = (
        f"Chains tensioned by their length, after 20 revolutions of the pulleys ({TURNS:.1f} m of travel), sideways "
        f"movements {DRAWN.lateral:g} times enlarged. Points 1-4 of the two differ by at most "
        f"{numbers['greatest_difference_mm']:.3f} mm, {share:.1f} % of the way: about the same place, as in the paper."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers,
                 draw=lambda p: _draw(p, [stored_run(name) for name in RUNS]), stored=tuple(RUNS))  # fmt: skip


@style.picture
def _draw(path: Path, runs: list[StoredRun]) -> Path:
    fig, [[ax]] = style.figure(8.6, 3.6)
    DRAWN.pulleys(ax, YAW)
    line = DRAWN.flat(np.array([[-0.2, 0.0, 0.0], [ROPE_EXAMPLE.centre_distance + 0.2, 0.0, 0.0]]))
    ax.plot(*line.T, color=FAINT, linewidth=0.8, linestyle=(0, (6, 3)))
    for run in runs:
        words, colour = RUNS[run.name]
        DRAWN.rope(ax, run.shapes[-1], colour, words)
    drawing.bare(ax)
    DRAWN.name_pulleys(ax)
    fig.legend(loc="outside lower center", ncols=2, markerscale=2.0)
    style.title(fig, "Particle chains after 20 revolutions of the pulleys")
    return style.save(fig, path)
