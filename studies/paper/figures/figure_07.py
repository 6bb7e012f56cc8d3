"""Fig. 7: a rope runs towards the side where the belt is less tight."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from belt_sim.case import Schedule
from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import AMBER, BLUE, FAINT, INK
from belt_sim.si import DEGREE, MM
from studies.paper import drawing
from studies.paper.case import ROPE_EXAMPLE, YAW
from studies.paper.models import case_at, y_mm
from studies.paper.plate import Plate, column

NUMBER, TITLE = 7, "Direction of the rope movement"
TRAVEL, SHOWN = 20.0, (0.0, 5.0, 10.0, 15.0, 20.0)  # [m]
ENLARGED = 150.0  # lateral movements and yaw
REACH = 1.15  # [m] drawn of a pulley to either side


def plate(in_space: bool = True) -> Plate:
    """The upper span (points 1 and 4) on its way, for either sign of the yaw."""
    model, case = analytic_model("rope"), case_at(100.0, short=True)
    numbers: dict = {"travel_m": column(SHOWN)}
    for yaw in (YAW, -YAW):
        turned = replace(case, settings=replace(case.settings, yaw=Schedule.step(yaw)))
        curves = model.run(turned, travel=TRAVEL)
        at = {f"y{k}_mm": column(y_mm(np.interp(SHOWN, curves.travel, curves.y[k - 1]))) for k in (1, 4)}
        numbers[f"yaw_{yaw / DEGREE:+.3f}_deg"] = at | {"shorter_side": "+y" if yaw < 0.0 else "-y"}
    caption = (
        "Rope model seen from above: the yawed tail pulley brings the axes nearer to each other on one side, where a "
        "belt is less tight (shaded), and the rope runs there, for either sign of the yaw. Upper span every 5 m of "
        f"travel; lateral movements and yaw {ENLARGED:g} times enlarged."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, axes = style.figure(9.6, 4.4, 1, 2, sharey=True)
    for ax, yaw in zip(axes[0], (YAW, -YAW), strict=True):
        at = n[f"yaw_{yaw / DEGREE:+.3f}_deg"]
        _seen_from_above(ax, yaw, at, n["travel_m"])
        ax.set_title(f"yaw {yaw / DEGREE:+.3f}°")
    style.title(fig, f"{TITLE}: towards the lower belt tension")
    return style.save(fig, path)


def _seen_from_above(ax, yaw: float, at: dict, travel: list[float]) -> None:
    a, radius, side = ROPE_EXAMPLE.centre_distance, ROPE_EXAMPLE.tail_radius, 1.0 if yaw < 0.0 else -1.0
    slack = side * np.array([0.0, REACH])
    ax.fill_between([0.0, a], *slack, color=AMBER, alpha=0.15, linewidth=0)
    place = {"xytext": (0, side * 4), "textcoords": "offset points", "ha": "center"}
    ax.annotate("axes nearer: lower tension", (0.5 * a, slack[1]), va="bottom" if side > 0 else "top", **place)
    _pulley(ax, 0.0, radius, yaw * ENLARGED)
    _pulley(ax, a, radius, 0.0)
    for k, s in enumerate(travel):
        y = [at["y1_mm"][k] * MM * ENLARGED, at["y4_mm"][k] * MM * ENLARGED]
        ax.plot([0.0, a], y, "o-", color=BLUE, markersize=4, linewidth=1.4, alpha=0.35 + 0.65 * k / (len(travel) - 1))
        ax.annotate(f"{s:g} m", (a, y[1]), xytext=(28, 0), textcoords="offset points", va="center", fontsize=8.5)
    ax.annotate("tail pulley", (0.0, -side * REACH), xytext=(0, -side * 12), textcoords="offset points", ha="center",
                va="center")  # fmt: skip
    ax.annotate("head pulley", (a, -side * REACH), xytext=(0, -side * 12), textcoords="offset points", ha="center",
                va="center")  # fmt: skip
    drawing.bare(ax)
    ax.set(xlim=(-0.5, a + 0.75), ylim=(-1.45, 1.45))


def _pulley(ax, x: float, radius: float, turn: float) -> None:
    """A rectangle turned about its middle, and its axis."""
    corners = np.array([[-radius, -REACH], [radius, -REACH], [radius, REACH], [-radius, REACH], [-radius, -REACH]])
    cos, sin = np.cos(turn), np.sin(turn)
    place = corners @ np.array([[cos, sin], [-sin, cos]]) + [x, 0.0]
    ax.fill(*place.T, facecolor=FAINT, alpha=0.25, linewidth=0)
    ax.plot(*place.T, color=FAINT, linewidth=1.0)
    axis = np.array([[0.0, -REACH], [0.0, REACH]]) @ np.array([[cos, sin], [-sin, cos]]) + [x, 0.0]
    ax.plot(*axis.T, color=INK, linewidth=0.8, linestyle=(0, (8, 2, 2, 2)))
