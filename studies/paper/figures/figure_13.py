"""Fig. 13: steady rates against belt tension, and what a record of 10 to 15 m would take for them."""

from pathlib import Path

import numpy as np

from belt_sim.show import style
from belt_sim.show.style import INK
from studies.paper import drawing
from studies.paper.models import LOOKS, MEASURED, MOVING, moving, rate_mm_per_m, read_rate, steady
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import SETTLED, stored_run

NUMBER, TITLE = 13, "Comparison of steady-state velocities"
FINE = np.round(np.concatenate([np.arange(4.0, 15.0, 0.5), np.arange(15.0, 61.0, 1.5)]), 6)  # [N/mm2]
READ_AT = (5.0, 6.0, *FINE[6:23], 17.5, *np.arange(20.0, 61.0, 5.0))  # [N/mm2]
READ = (10.0, 15.0)  # [m]
CLOSED = ("rope", "beam_th1", "beam_th2", "ritzinger", "ernst_beam", "strip", "strip_lift_off")
RECORDS = {7.0: "flex_7_far", 10.0: "flex_10_far", 20.0: "flex_20", 40.0: "flex_40"}


def plate(in_space: bool = True) -> Plate:
    """Closed forms; stored runs in three dimensions as dots, their bars from the slowest to the fastest point."""
    numbers: dict = {"tension_N_per_mm2": column(FINE), "read_tension_N_per_mm2": column(READ_AT)}
    for model in CLOSED:
        numbers[f"{model}_mm_per_m"] = column([rate_mm_per_m(steady(model, t)) for t in FINE])
    for model in MOVING:
        read = [rate_mm_per_m(read_rate(moving(model, t), *READ)) for t in READ_AT]
        numbers[f"{model}_read_over_10_to_15_m_mm_per_m"] = column(read)
    if in_space:
        numbers["mujoco_flex"] = {f"{t:g}_N_per_mm2": _in_space(t) for t in MEASURED}
    caption = (
        "Left: steady rates of point 1 on the test rig, yaw -0.042 degrees, by closed forms; 3D: mean of points 1-4 "
        f"from {SETTLED:g} m to the end of the record (70 m, 200 m at 7 and 10 N/mm2), bars from the slowest point to "
        "the fastest. Right: what point 1 does over 10 to 15 m of travel, which a short "
        "record takes for steady. The paper's measured rates are not in its text and are not drawn."
    )
    names = tuple(RECORDS.values()) if in_space else ()
    return Plate(
        number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers), stored=names
    )


def _in_space(tension: float) -> dict[str, float]:
    run = stored_run(RECORDS[tension])
    mean, ends = run.rates()[0], sorted(float(rate_mm_per_m(r)) for r in run.rates()[1:])
    return {
        "mm_per_m": float(rate_mm_per_m(mean)),
        "slowest_point_mm_per_m": ends[0],
        "fastest_point_mm_per_m": ends[1],
        "read_over_10_to_15_m_mm_per_m": float(rate_mm_per_m(read_rate(run.curves, *READ))),
    }


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, [[late, read]] = style.figure(9.6, 5.4, 1, 2, sharey=True)
    for model in CLOSED:
        late.plot(n["tension_N_per_mm2"], n[f"{model}_mm_per_m"], **LOOKS[model].line)
    for model in MOVING:
        read.plot(n["read_tension_N_per_mm2"], n[f"{model}_read_over_10_to_15_m_mm_per_m"], **LOOKS[model].line)
    if "mujoco_flex" in n:
        _dots(late, read, n["mujoco_flex"])
    for ax in (late, read):
        drawing.zero_line(ax)
        ax.set(xlim=(0.0, 60.0), xlabel="belt tension [N/mm²]")
    late.set(ylabel="rate of point 1 [mm per m of travel]", title="Steady rate")
    read.set_title(f"As read over {READ[0]:g} to {READ[1]:g} m")
    fig.legend(*late.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    style.title(fig, "Steady rates against tension: point 1, test rig")
    return style.save(fig, path)


def _dots(late, read, runs: dict) -> None:
    tension = np.array(MEASURED)
    of = {k: np.array([runs[f"{t:g}_N_per_mm2"][k] for t in MEASURED]) for k in next(iter(runs.values()))}
    mean = of["mm_per_m"]
    bars = [mean - of["slowest_point_mm_per_m"], of["fastest_point_mm_per_m"] - mean]
    look = {"fmt": "o", "color": INK, "markersize": 5, "capsize": 3, "elinewidth": 1.2, "zorder": 5}
    late.errorbar(tension, mean, bars, label=LOOKS["mujoco_flex"].words, **look)
    read.plot(tension, of["read_over_10_to_15_m_mm_per_m"], "o", color=INK, markersize=5, zorder=5)
