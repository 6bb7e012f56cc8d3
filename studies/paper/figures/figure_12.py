"""Fig. 12: the start and the run of a belt whose tension is reduced, by every model."""

from pathlib import Path

import numpy as np

from belt_sim.show import style
from belt_sim.show.style import CYCLE, INK
from studies.paper import drawing
from studies.paper.models import LOOKS, MEASURED, MOVING, TRAVEL, moving, rate_mm_per_m, steady, y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import stored_run

NUMBER, TITLE = 12, "Comparison of models and measurement"
ABOVE = ("beam_th2", "strip")  # together in the upper panel, as the paper draws all tensions in one
DOT_EVERY = 8  # records of a stored run between two dots
IN_SPACE = "mujoco_flex"


def plate(in_space: bool = True) -> Plate:
    """y of point 1 after the yaw step; Ritzinger's formula knows a rate alone, drawn as a slope."""
    numbers: dict = {"travel_m": column(moving("strip", 7.0).travel)}
    for tension in MEASURED:
        at = {model: column(y_mm(moving(model, tension).y[0])) for model in MOVING}
        numbers[f"{tension:g}_N_per_mm2"] = {f"{m}_y1_mm": y for m, y in at.items()} | {
            "ritzinger_rate_mm_per_m": float(rate_mm_per_m(steady("ritzinger", tension)))
        }
        if in_space:
            numbers[f"{tension:g}_N_per_mm2"] |= _in_space(tension)
    caption = (
        "Run-up point 1 on the test rig after a yaw of -0.042 degrees. Above, as in the paper, all tensions together; "
        "below, every model at each. The paper's measured curves are not in its text and are not drawn. Ritzinger's "
        "formula gives a steady rate alone: a line of that slope from the origin."
    )
    names = tuple(f"flex_{t:g}" for t in MEASURED) if in_space else ()
    return Plate(
        number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers), stored=names
    )


def _in_space(tension: float) -> dict:
    curves = stored_run(f"flex_{tension:g}").curves
    early = np.asarray(curves.travel) <= TRAVEL
    return {
        "mujoco_flex_travel_m": column(np.asarray(curves.travel)[early]),
        "mujoco_flex_y1_mm": column(y_mm(np.asarray(curves.y)[0, early])),
    }


@style.picture
def _draw(path: Path, n: dict) -> Path:
    below = [f"{t:g}" for t in MEASURED]
    fig, axes = drawing.mosaic(9.6, 8.4, [["all"] * 4, below], height_ratios=[1.15, 1.0])
    _all_tensions(axes["all"], n)
    for k, name in enumerate(below):
        _each(axes[name], n["travel_m"], n[f"{name}_N_per_mm2"])
        axes[name].set_title(f"{name} N/mm²")
        axes[name].set(ylim=(-0.3, 6.3), xlabel=drawing.TRAVEL_LABEL)
        if k:
            axes[name].tick_params(labelleft=False)
    axes[below[0]].set_ylabel("y of point 1 [mm]")
    handles, labels = axes[below[-1]].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=4)
    style.title(fig, "Models beside one another: point 1, test rig")
    return style.save(fig, path)


def _all_tensions(ax, n: dict) -> None:
    for k, tension in enumerate(MEASURED):
        at, colour = n[f"{tension:g}_N_per_mm2"], CYCLE[k]
        ax.plot(n["travel_m"], at["beam_th2_y1_mm"], color=colour, linewidth=1.2, linestyle=(0, (4, 2)))
        ax.plot(n["travel_m"], at["strip_y1_mm"], color=colour, label=f"{tension:g} N/mm²")
        if f"{IN_SPACE}_y1_mm" in at:
            _dots(ax, at)
    drawing.zero_line(ax)
    ax.set(xlim=(0.0, TRAVEL), xlabel=drawing.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]")
    keys = [
        *ax.get_legend_handles_labels()[0],
        *ax.plot([], [], color=INK, linestyle=(0, (4, 2)), linewidth=1.2, label="beam, 2nd order"),
        *ax.plot([], [], color=INK, label="hanging strip"),
    ]
    if f"{IN_SPACE}_y1_mm" in n["7_N_per_mm2"]:
        keys += ax.plot([], [], "o", color=INK, markersize=3, label="belt in 3D (stored)")
    ax.legend(handles=keys, loc="upper left", ncols=2)


def _each(ax, s: list[float], at: dict) -> None:
    for model in MOVING:
        front = {"zorder": 3, "linewidth": 2.0} if model in ABOVE else {"linewidth": 1.4}
        ax.plot(s, at[f"{model}_y1_mm"], **LOOKS[model].line, **front)
    ends = np.array([0.0, TRAVEL])
    ax.plot(ends, at["ritzinger_rate_mm_per_m"] * ends, linewidth=1.2, **LOOKS["ritzinger"].line)
    if f"{IN_SPACE}_y1_mm" in at:
        _dots(ax, at, LOOKS[IN_SPACE].words)
    drawing.zero_line(ax)
    ax.set_xlim(0.0, TRAVEL)


def _dots(ax, at: dict, label: str | None = None) -> None:
    s, y = (np.array(at[f"{IN_SPACE}_{k}"])[::DOT_EVERY] for k in ("travel_m", "y1_mm"))
    ax.plot(s, y, "o", color=INK, markersize=2.6, markeredgewidth=0.0, zorder=4, label=label)
