"""Axes, marks, and a belt in space on paper: what several figures draw with."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from belt_sim.show import style
from belt_sim.show.style import FAINT, INK
from studies.paper.stored_runs import Shape

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


DEPTH = np.array([0.42, 0.34])  # what a metre of y is drawn as, to the right and up
ROUND = np.linspace(0.0, 2.0 * np.pi, 120)


@dataclass(frozen=True, kw_only=True)
class Oblique:
    """width: times the belt's width is enlarged; lateral: its sideways movement; height: z; tilt: of cross-sections
    (beside height). radius, centre_distance, half_width [m] of the machine and the belt."""

    width: float
    lateral: float
    height: float
    tilt: float
    radius: float
    centre_distance: float
    half_width: float

    def edges(self, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
        """Both edges of the belt (n, 2) where they are drawn."""
        middle, half = shape.middle, 0.5 * (shape.left - shape.right)
        middle = middle * [1.0, self.lateral, 1.0]
        half = half * [0.0, self.width, self.tilt]
        return self.flat(middle + half), self.flat(middle - half)

    def flat(self, place: np.ndarray) -> np.ndarray:
        """(n, 3) [m] of the machine -> (n, 2) of the drawing, the tail pulley at the left as in the paper."""
        x, y, z = np.asarray(place, float).T
        y = -y  # of the paper
        return np.stack([self.centre_distance - x + DEPTH[0] * y, self.height * z + DEPTH[1] * y], axis=1)

    def pulleys(self, ax: Any, yaw: float) -> None:
        """Both cylinders, the tail pulley turned by its yaw, enlarged like the movements."""
        from scipy.spatial import ConvexHull

        reach = 1.25 * self.width * self.half_width
        for x, turn in ((self.centre_distance, yaw), (0.0, 0.0)):
            lean = -turn * self.lateral * reach
            rings = [
                self.flat(np.stack([x + s * lean + self.radius * np.sin(ROUND), np.full(len(ROUND), s * reach),
                                    self.radius * np.cos(ROUND)], axis=1)) for s in (-1.0, 1.0)
            ]  # fmt: skip
            both = np.concatenate(rings)
            ax.fill(*both[ConvexHull(both).vertices].T, facecolor=FAINT, alpha=0.22, linewidth=0, zorder=1)
            ax.plot(*rings[1].T, color=FAINT, linewidth=0.9, zorder=1)

    def name_pulleys(self, ax: Any) -> None:
        """Which is which."""
        for x, name in ((self.centre_distance, "tail pulley (yawed)"), (0.0, "head pulley")):
            place = self.flat(np.array([[x, 1.25 * self.width * self.half_width, -self.radius]]))[0]
            ax.annotate(name, place, xytext=(0, -6), textcoords="offset points", ha="center", va="top")

    def belt(self, ax: Any, shape: Shape, colours: np.ndarray | None = None, **look: Any) -> Any:
        """The ribbon, lower parts first; colours: a value a station for the diverging map."""
        from matplotlib.collections import PolyCollection

        left, right = self.edges(shape)
        after = np.roll(np.arange(len(left)), -1)
        quads = np.stack([left, left[after], right[after], right], axis=1)
        order = np.argsort(shape.middle[:, 2], kind="stable")
        given: dict[str, Any] = {"linewidths": 0.2, "zorder": 2} | look
        if colours is None:
            patches = PolyCollection(list(quads[order]), **({"facecolors": "#cfd8e3", "edgecolors": "#8899aa"} | given))
        else:
            full = float(np.max(np.abs(colours))) or 1.0
            patches = PolyCollection(list(quads[order]), array=colours[order], cmap=style.diverging_map(),
                                     edgecolors="face", **given)  # fmt: skip
            patches.set_clim(-full, full)
        ax.add_collection(patches)
        for edge in (left, right):
            closed = np.vstack([edge, edge[:1]])
            ax.plot(*closed.T, color=INK, linewidth=0.7, zorder=3)
        return patches

    def rope(self, ax: Any, shape: Shape, colour: str, label: str | None = None) -> None:
        """Particles of a chain."""
        place = self.flat(shape.middle * [1.0, self.lateral, 1.0])
        ax.plot(*place.T, "o", color=colour, markersize=2.6, markeredgewidth=0.0, zorder=3, label=label)
