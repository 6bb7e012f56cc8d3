"""Draw the machine with its points, axes and signs: ``python -m studies.machine_drawing docs/images/machine.svg``."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Rectangle

from belt_sim.show import style
from belt_sim.show.style import BLUE, FAINT, INK, POINTS, RED

CENTRES, RADIUS, SAG = (0.0, 6.0), 0.8, 0.35  # drawn lengths, not to scale
YAW, CANT, TILT = np.radians((12.0, 14.0, 16.0))  # drawn hundreds of times too large
WIDTH = 1.6


def arrow(axes, begin, end, colour=INK, text="", at=(0.0, 0.0), **text_style) -> None:
    """An arrow from ``begin`` to ``end`` with ``text`` beside its tip, moved by ``at``."""
    axes.add_patch(FancyArrowPatch(begin, end, arrowstyle="-|>", mutation_scale=11, color=colour, lw=1.4, zorder=4))
    if text:
        axes.text(end[0] + at[0], end[1] + at[1], text, color=colour, **text_style)


def side_view(axes) -> None:
    """x-z plane: pulleys, hanging spans, points 1-4, travel."""
    x = np.linspace(*CENTRES, 100)
    sag = 4.0 * SAG * (x - CENTRES[0]) * (CENTRES[1] - x) / (CENTRES[1] - CENTRES[0]) ** 2
    for level in (RADIUS, -RADIUS):
        axes.plot(x, level - sag, color=BLUE, lw=2.5)
    for centre, name in zip(CENTRES, ("head pulley\n(driven)", "tail pulley\n(steered)"), strict=True):
        axes.add_patch(Circle((centre, 0), RADIUS, facecolor="#eef1f4", edgecolor=FAINT, lw=1.2))
        side = 1 if centre else -1
        turn = np.radians(np.linspace(-90, 90, 50))
        axes.plot(centre + side * RADIUS * np.cos(turn), RADIUS * np.sin(turn), color=BLUE, lw=2.5)
        axes.text(centre, -0.05, name, ha="center", va="center")
    places = ((CENTRES[1], RADIUS), (CENTRES[1], -RADIUS), (CENTRES[0], -RADIUS), (CENTRES[0], RADIUS))
    names = ("run-up", "run-off", "run-up", "run-off")
    for k, ((px, pz), name) in enumerate(zip(places, names, strict=True)):
        axes.plot(px, pz, "o", color=POINTS[k], ms=9, zorder=5)
        up, left = pz > 0, px == CENTRES[0]
        axes.text(
            px, pz + (0.22 if up else -0.22), f"{k + 1}  {name}", color=POINTS[k], weight="bold",
            ha="left" if left else "right", va="bottom" if up else "top",
        )  # fmt: skip
    arrow(axes, (2.55, RADIUS - 0.1), (3.5, RADIUS - 0.1), INK, "travel", (-0.5, 0.12), ha="center")
    arrow(axes, (3.5, -RADIUS - 0.6), (2.55, -RADIUS - 0.6))
    axes.text(3.0, 0.62 - SAG, "upper span", ha="center", va="top")
    axes.text(3.0, -RADIUS - SAG + 0.16, "lower span", ha="center", va="bottom")
    arrow(axes, (-1.75, -1.3), (-0.95, -1.3), FAINT, "x", (0.06, -0.06))
    arrow(axes, (-1.75, -1.3), (-1.75, -0.5), FAINT, "z", (-0.05, 0.08))
    axes.set_title("From the side")
    axes.set_xlim(-2.0, 7.4)
    axes.set_ylim(-1.75, 1.45)


def top_view(axes) -> None:
    """x-y plane: the tail pulley yawed about +z, lateral position y."""
    half = WIDTH / 2
    x = np.linspace(CENTRES[0] - 0.35, CENTRES[1] + 0.35, 60)
    bend = 0.42 * np.clip(x / CENTRES[1], 0.0, 1.08) ** 2
    axes.fill_between(x, bend - half, bend + half, color=BLUE, alpha=0.25, lw=0, zorder=3)
    axes.plot(x, bend, color=BLUE, lw=1.2, ls="--", zorder=3)
    axes.plot([CENTRES[0] - 0.9, CENTRES[1] + 1.0], [0, 0], color=FAINT, lw=0.8, ls=":")
    for centre, angle in zip(CENTRES, (0.0, YAW), strict=True):
        box = Rectangle(
            (centre - 0.35, -1.25), 0.7, 2.5, angle=np.degrees(angle), rotation_point=(centre, 0.0),
            facecolor="#e4e7eb", edgecolor=FAINT, lw=1.2,
        )  # fmt: skip
        axes.add_patch(box)
    axes.plot([CENTRES[1]] * 2, [-1.5, 1.5], color=FAINT, lw=0.8, ls=":")
    axes.add_patch(Arc((CENTRES[1], 0), 2.9, 2.9, theta1=90, theta2=90 + np.degrees(YAW), color=RED, lw=1.6))
    axes.text(CENTRES[1] - 0.42, 1.5, "yaw > 0", color=RED, ha="center", va="bottom", weight="bold")
    axes.plot(CENTRES[1], 0.42, "o", color=POINTS[0], ms=9, zorder=5)
    arrow(axes, (CENTRES[1] + 0.75, 0.0), (CENTRES[1] + 0.75, 0.42), INK)
    axes.text(CENTRES[1] + 0.85, 0.2, "y of point 1", va="center")
    arrow(axes, (-1.75, -1.3), (-0.95, -1.3), FAINT, "x", (0.06, -0.06))
    arrow(axes, (-1.75, -1.3), (-1.75, -0.5), FAINT, "y", (-0.05, 0.08))
    axes.text(CENTRES[0], -1.45, "head", ha="center", va="top")
    axes.text(CENTRES[1], -1.6, "tail", ha="center", va="top")
    axes.set_title("From above: yaw and lateral position")
    axes.set_xlim(-2.0, 7.9)
    axes.set_ylim(-2.0, 2.0)


def end_view(axes, angle: float, name: str, what: str) -> None:
    """y-z plane seen towards -x: something turned about +x."""
    half = 1.0
    axes.plot([-1.3, 1.3], [0, 0], color=FAINT, lw=0.8, ls=":")
    along = np.array([np.cos(angle), np.sin(angle)])
    axes.plot(*np.outer(along, [-half, half]), color=BLUE, lw=6 if name == "cant" else 3, solid_capstyle="butt")
    axes.add_patch(Arc((0, 0), 1.7, 1.7, theta1=0, theta2=np.degrees(angle), color=RED, lw=1.6))
    axes.text(1.05, 0.12, f"{name} > 0", color=RED, weight="bold", va="bottom")
    axes.text(0.0, -0.55, what, ha="center", va="top")
    arrow(axes, (-1.75, -0.45), (-1.15, -0.45), FAINT, "y", (0.06, -0.06))
    arrow(axes, (-1.75, -0.45), (-1.75, 0.15), FAINT, "z", (-0.05, 0.08))
    axes.set_title("Along the belt, seen from the tail")
    axes.set_xlim(-2.0, 2.2)
    axes.set_ylim(-1.0, 0.8)


@style.picture
def machine_drawing(path: Path) -> Path:
    """The whole drawing, written to ``path`` (.svg or .png)."""
    from matplotlib.figure import Figure

    fig = Figure(figsize=(9.0, 7.6), layout="constrained")
    rows = fig.add_gridspec(3, 2, height_ratios=(3.2, 4.0, 1.8))
    views = [fig.add_subplot(rows[0, :]), fig.add_subplot(rows[1, :]), *(fig.add_subplot(rows[2, k]) for k in (0, 1))]
    side_view(views[0])
    top_view(views[1])
    end_view(views[2], TILT, "tilt", "cross-section of a span rolls about its length")
    end_view(views[3], CANT, "cant", "axis of a pulley is not level")
    for axes in views:
        axes.set_aspect("equal")
        axes.axis("off")
    fig.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None, dpi=110)
    return path


if __name__ == "__main__":
    machine_drawing(Path(sys.argv[1]))
