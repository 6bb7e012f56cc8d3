"""Fig. 8: the beam model: the deformed span right after the yaw, and its bending moment."""

from pathlib import Path

import numpy as np

from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import FAINT, INK, RED
from studies.paper import drawing
from studies.paper.case import TEST_RIG, YAW
from studies.paper.models import LOOKS, case_at, x_m, y_mm
from studies.paper.plate import Plate, column
from studies.paper.span_shape import span_shape

NUMBER, TITLE = 8, "The beam model"
TENSIONS = (10.0, 40.0, 100.0)  # [N/mm2] of the beam of 2nd order


def plate(in_space: bool = True) -> Plate:
    """Bending lines with the boundary values of eq. 7, y(0) = y(a) = 0, y'(0) = beta, y'(a) = 0, and M = -EI y''."""
    shapes = {"beam_th1": ("beam_th1", 40.0)} | {f"beam_th2_{t:g}_N_per_mm2": ("beam_th2", t) for t in TENSIONS}
    numbers: dict = {}
    for name, (model, tension) in shapes.items():
        case = case_at(tension)
        shape = span_shape(case, analytic_model(model), (0.0, 0.0), (0.0, YAW))
        numbers["x_m"] = column(x_m(shape.x, case.rig.centre_distance))
        moment = float(case.belt.bending_stiffness) * shape.curvature  # -EI y'', with y of the paper
        numbers[name] = {"y_mm": column(y_mm(shape.y)), "moment_Nm": column(moment)}
    stiffness = float(case_at(40.0).belt.bending_stiffness)
    numbers["first_order_entry_moment_Nm"] = 4.0 * stiffness * YAW / TEST_RIG.centre_distance  # eq. 17
    caption = (
        "Upper span of the test rig right after a yaw of -0.042 degrees, boundary values of eq. 7: run-up point 1 at "
        f"x = 0. The entry moment by Th 1. O is 4 EI β/a = {numbers['first_order_entry_moment_Nm']:.2f} N m."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, axes = style.figure(8.0, 6.2, 2, 1, sharex=True)
    line, moment = axes[0][0], axes[1][0]
    for name in (k for k in n if k.startswith("beam_")):
        tension = name.split("_")[2] if name != "beam_th1" else ""
        look = LOOKS["beam_th1"].line | {"linewidth": 2.4}
        if tension:
            k = TENSIONS.index(float(tension))
            look = {
                "color": RED,
                "alpha": 0.4 + 0.3 * k,
                "label": f"beam, 2nd order, {tension} N/mm²",
                "linewidth": 1.5,
            }
        line.plot(n["x_m"], n[name]["y_mm"], **look)
        moment.plot(n["x_m"], n[name]["moment_Nm"], **look)
    steep = np.array([0.0, 1.6])
    line.plot(steep, YAW * steep / 1e-3, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    line.annotate("slope β", (steep[1], YAW * steep[1] / 1e-3), xytext=(5, 0), textcoords="offset points", va="center")
    for place, name in ((0.0, "1: y = 0, y' = β"), (TEST_RIG.centre_distance, "4: y = 0, y' = 0")):
        at_left = place == 0.0
        line.plot(place, 0.0, "o", color=INK, markersize=6, clip_on=False, zorder=4)
        line.annotate(name, (place, 0.0), xytext=(8 if at_left else -8, 8), textcoords="offset points",
                      ha="left" if at_left else "right")  # fmt: skip
    for ax in (line, moment):
        drawing.zero_line(ax)
    line.axhline(0.0, color=FAINT, linewidth=0.8)
    line.set(ylabel="y [mm]", title="Bending line", ylim=(-1.35, 0.25))
    moment.set(xlabel="x from run-up point 1 [m]", ylabel="bending moment M [N m]", title="Bending moment")
    moment.legend(loc="best")
    style.title(fig, f"{TITLE}: a span between its pulleys, one of them yawed")
    return style.save(fig, path)
