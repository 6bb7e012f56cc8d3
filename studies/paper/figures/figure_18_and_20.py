"""A particle belt on the test rig's machine, drawn as it lies there, with its moving diagram (Figs 18 and 20)."""

from pathlib import Path

import numpy as np

from belt_sim.show import style
from belt_sim.show.geometry import tilt
from belt_sim.show.style import INK, POINTS
from studies.paper import drawing
from studies.paper.case import PAPER_BELT, TEST_RIG, YAW
from studies.paper.drawing import Oblique
from studies.paper.models import LOOKS, moving, y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import Shape, stored_run

DRAWN = Oblique(width=5.0, lateral=60.0, height=3.0, tilt=15.0, radius=TEST_RIG.tail_radius,
                centre_distance=TEST_RIG.centre_distance, half_width=0.5 * PAPER_BELT.width)  # fmt: skip


#: figure -> title, stored run, remark at the end of the caption
RUNS = {
    18: ("High tensioned particle belt", "grid_40", ""),
    20: (
        "Low tensioned particle belt",
        "grid_10",
        " The ripples are waves along the spans at that instant; particles nearer to each other were not run.",
    ),
}


def plate(number: int) -> Plate:
    """The stored run of a grid of bonded particles; beside it what the strip law says of points 1 and 4."""
    title, run_name, remark = RUNS[number]
    run = stored_run(run_name)
    shape, law = run.shapes[-1], moving("strip", run.tension)
    within = np.asarray(law.travel) <= run.curves.travel[-1] + 1e-9
    numbers: dict = {"tension_N_per_mm2": run.tension, "travel_m": column(run.curves.travel),
                     "strip_travel_m": column(np.asarray(law.travel)[within])}  # fmt: skip
    for k in (1, 4):
        numbers[f"y{k}_mm"] = column(y_mm(run.curves.y[k - 1]))
        numbers[f"strip_y{k}_mm"] = column(y_mm(np.asarray(law.y)[k - 1, within]))
    beside = np.interp(numbers["travel_m"], numbers["strip_travel_m"], numbers["strip_y1_mm"])
    off = float(np.abs(np.array(numbers["y1_mm"]) - beside).max() / np.abs(beside).max())
    numbers["point_1_off_the_strip_law"] = off
    spacing = 1e3 * run.made["options"]["dx"]
    caption = (
        f"Two lines of particles {spacing:g} mm apart with longitudinal, transverse and diagonal bonds, on the whole "
        f"test rig ({2 * len(shape.left)} particles) at {run.tension:g} N/mm2, {run.made['travel_m']:g} m after a yaw "
        "of -0.042 degrees; width 5, sag 3, sideways movement 60, tilt 45 times enlarged. Point 1 stays within "
        f"{100 * off:.1f} % of the strip law's greatest y. "
        f"The run cost {run.made['cpu_s']:.0f} CPU s, 60 m would cost about {_whole(run.made):.0f} min.{remark}"
    )
    return Plate(number=number, title=title, caption=caption, numbers=numbers, stored=(run_name,),
                 draw=lambda p: _draw(p, numbers, shape, title))  # fmt: skip


def _whole(made: dict) -> float:
    """Minutes of CPU time for 60 m, in proportion."""
    return 60.0 / made["travel_m"] * made["cpu_s"] / 60.0


@style.picture
def _draw(path: Path, n: dict, shape: Shape, title: str) -> Path:
    fig, axes = drawing.mosaic(9.6, 6.0, [["belt"], ["curves"]], height_ratios=[1.0, 1.1])
    belt, curves = axes["belt"], axes["curves"]
    DRAWN.pulleys(belt, YAW)
    angle = 1e3 * tilt(shape.left, shape.right)
    drawn = DRAWN.belt(belt, shape, angle)
    fig.colorbar(drawn, ax=belt, label="tilt [mrad]", shrink=0.8, pad=0.01)
    for edge in DRAWN.edges(shape):
        belt.plot(*edge[::2].T, "o", color=INK, markersize=1.3, markeredgewidth=0.0, zorder=4)
    DRAWN.name_pulleys(belt)
    drawing.bare(belt)
    for k, name in ((1, "run-up point 1"), (4, "run-off point 4")):
        curves.plot(n["travel_m"][::2], n[f"y{k}_mm"][::2], "o", color=POINTS[k - 1], markersize=3.2,
                    markeredgewidth=0.0, label=name)  # fmt: skip
        curves.plot(n["strip_travel_m"], n[f"strip_y{k}_mm"], color=POINTS[k - 1], linewidth=1.2)
    curves.plot([], [], color=INK, linewidth=1.2, label=LOOKS["strip"].words)
    drawing.zero_line(curves)
    curves.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, n["travel_m"][-1]))
    curves.legend(loc="upper left")
    style.title(fig, f"{title}: {n['tension_N_per_mm2']:g} N/mm²")
    return style.save(fig, path)
