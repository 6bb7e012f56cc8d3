"""Fig. 16: the moving diagram of the upper span of a highly tensioned particle chain."""

from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.curves import late_rates
from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import INK, POINTS
from studies.closed_forms import steady_offsets
from studies.paper import drawing
from studies.paper.models import case_at, rate_mm_per_m, y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import stored_run

NUMBER, TITLE = 16, "Moving diagram for the upper rope span"
RUN, TENSION = "rope_100", 100.0  # [N/mm2]
SHOWN = {1: "run-up point 1", 4: "run-off point 4"}


def plate(in_space: bool = True) -> Plate:
    """Points 1 and 4 of the stored rope in 3D, and of the rope model."""
    curves, case, model = stored_run(RUN).curves, case_at(TENSION, short=True), analytic_model("rope")
    law = model.run(case, travel=float(curves.travel[-1]))
    numbers = {"travel_m": column(curves.travel), "law_travel_m": column(law.travel)}
    for k in SHOWN:
        numbers |= {f"y{k}_mm": column(y_mm(curves.y[k - 1])), f"law_y{k}_mm": column(y_mm(law.y[k - 1]))}
    rate, offset = late_rates(curves)[0], np.asarray(curves.y)[0, -1] - np.asarray(curves.y)[3, -1]
    more = {
        "late_rate_mm_per_m": float(rate_mm_per_m(rate)),
        "law_steady_rate_mm_per_m": float(rate_mm_per_m(model.steady_rate(case))),
        "late_offset_mm": float(y_mm(offset)),
        "law_steady_offset_mm": float(y_mm(steady_offsets(case, model)[0])),
    }
    caption = (
        "Particle chain in three dimensions (dots) and rope model (lines): steady-state velocity "
        f"{more['late_rate_mm_per_m']:.4f} and {more['law_steady_rate_mm_per_m']:.4f} mm/m, steady-state offset "
        f"{more['late_offset_mm']:.3f} and {more['law_steady_offset_mm']:.3f} mm."
    )
    n = numbers | more
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=n, draw=lambda p: _draw(p, n), stored=(RUN,))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, [[ax]] = style.figure(8.0, 4.6)
    for k, name in SHOWN.items():
        ax.plot(n["law_travel_m"], n[f"law_y{k}_mm"], color=POINTS[k - 1], linewidth=1.2)
        look: dict[str, Any] = {"color": POINTS[k - 1], "markersize": 3.2, "markeredgewidth": 0.0}
        ax.plot(n["travel_m"][::4], n[f"y{k}_mm"][::4], "o", label=name, **look)
    drawing.zero_line(ax)
    ax.plot([], [], color=INK, linewidth=1.2, label="rope model")
    ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, n["travel_m"][-1]))
    ax.legend(loc="upper left")
    style.title(fig, f"{TITLE}: particle chain, {TENSION:g} N/mm²")
    return style.save(fig, path)
