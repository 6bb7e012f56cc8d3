"""Axes for a plate that has panels of several sizes, and marks that plates share."""

from collections.abc import Sequence
from typing import Any

from belt_sim.pictures import style
from belt_sim.pictures.colours import FAINT, INK

TRAVEL_LABEL = "belt travel x [m]"
Y_LABEL = "lateral position y [mm]"


def mosaic(width: float, height: float, layout: Sequence[Sequence[str]], **grid: Any) -> tuple[Any, dict[str, Any]]:
    """A figure [inch] and its axes by the names in ``layout``; ``grid`` as for Figure.subplot_mosaic."""
    fig, [[whole]] = style.figure(width, height)
    whole.remove()
    return fig, fig.subplot_mosaic([list(row) for row in layout], **grid)


def zero_line(ax: Any) -> None:
    """A thin line at y = 0, and curves that begin at the frame."""
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    ax.margins(x=0.0)


def dimension(ax: Any, ends: Sequence[tuple[float, float]], words: str, **text: Any) -> None:
    """A dimension line between two places, with its name in the middle."""
    begin, end = ends
    ax.annotate("", end, begin, arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0,
                                            "shrinkB": 0})  # fmt: skip
    middle = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]))
    place = {"xytext": (6, 0), "textcoords": "offset points", "va": "center", "color": INK} | text
    ax.annotate(words, middle, **place)


def bare(ax: Any) -> None:
    """A drawing: no grid, no frame, no ticks."""
    ax.set_axis_off()
    ax.set_aspect("equal")


FAINT_LINE = {"color": FAINT, "linewidth": 0.8}
