"""Fig. 2: the characteristic moving curve of the upper span of a highly tensioned belt."""

from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import POINTS
from studies.closed_forms import steady_offsets
from studies.paper import drawing
from studies.paper.models import case_at, rate_mm_per_m, steady, y_mm
from studies.paper.plate import Plate, column

NUMBER, TITLE = 2, "Characteristic belt moving curve"
TENSION, MODEL = 100.0, "beam_th2"  # [N/mm2]
TRAVEL = 45.0  # [m]
READ, ACROSS = (30.0, 38.0), 42.0  # [m], where slope and offset are drawn


def plate(in_space: bool = True) -> Plate:
    """Points 1 and 4 against travel, the steady rate and the steady offset (paper eq. 2)."""
    case, model = case_at(TENSION), analytic_model(MODEL)
    curves, (upper, _) = model.run(case, travel=TRAVEL), steady_offsets(case, model)
    rate, offset = float(rate_mm_per_m(steady(MODEL, TENSION))), float(y_mm(upper))
    numbers = {
        "tension_N_per_mm2": TENSION,
        "travel_m": column(curves.travel),
        "y1_mm": column(y_mm(curves.y[0])),
        "y4_mm": column(y_mm(curves.y[3])),
        "steady_rate_mm_per_m": rate,
        "steady_offset_mm": offset,
    }
    caption = (
        f"Upper span of the test rig at {TENSION:g} N/mm2, beam of 2nd order: after the transient, both of its ends "
        f"move at {rate:.4f} mm per m of travel, {offset:.2f} mm apart (closed forms of rate and offset; eq. 2)."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, [[ax]] = style.figure(8.0, 4.6)
    s, y1, y4 = (np.array(n[k]) for k in ("travel_m", "y1_mm", "y4_mm"))
    ax.plot(s, y1, color=POINTS[0], label="run-up point 1")
    ax.plot(s, y4, color=POINTS[3], label="run-off point 4")
    drawing.zero_line(ax)
    begin, end = READ
    low, high = np.interp(READ, s, y4)
    ax.plot([begin, end, end], [low, low, high], color=POINTS[3], linewidth=1.0)
    velocity = f"Δx\nsteady-state velocity\nΔy/Δx = {n['steady_rate_mm_per_m']:.3f} mm/m"
    below: dict[str, Any] = {"xytext": (0, -4), "textcoords": "offset points", "ha": "center", "va": "top"}
    ax.annotate(velocity, (0.5 * (begin + end), low), **below)
    ax.annotate("Δy", (end, 0.5 * (low + high)), xytext=(5, 0), textcoords="offset points", va="center")
    ends = [(ACROSS, float(np.interp(ACROSS, s, y))) for y in (y4, y1)]
    words = f"steady-state\noffset {n['steady_offset_mm']:.2f} mm"
    drawing.dimension(ax, ends, words, ha="right", xytext=(-6, 0))
    ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, TRAVEL))
    ax.legend(loc="upper left")
    style.title(fig, f"{TITLE}: {n['tension_N_per_mm2']:g} N/mm², upper span")
    return style.save(fig, path)
