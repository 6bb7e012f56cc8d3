"""A plate: one figure of the paper, computed; and what figures draw with: axes, marks, a belt in space on paper."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.case import Rig
from belt_sim.errors import InputError
from belt_sim.show import style
from belt_sim.show.geometry import tilt
from belt_sim.show.style import FAINT_INK, INK
from studies.paper.case import PAPER_BELT, TEST_RIG, YAW
from studies.paper.stored_runs import Shape

TRAVEL_LABEL = "belt travel x [m]"
Y_LABEL = "lateral position y [mm]"
BOTH_WAYS = {"arrowstyle": "<->", "color": INK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}


def mosaic(width: float, height: float, layout: Sequence[Sequence[str]], **grid: Any) -> tuple[Any, dict[str, Any]]:
    """A figure [inch] and its axes by the names in ``layout``; ``grid`` as for Figure.subplot_mosaic."""
    fig, [whole] = style.figure(width, height)
    whole.remove()
    return fig, fig.subplot_mosaic([list(row) for row in layout], **grid)


def zero_line(ax: Any) -> None:
    """A thin line at y = 0, and curves that begin at the frame."""
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    ax.margins(x=0.0)


def note(ax: Any, words: str, at: tuple, offset: tuple[float, float], **text: Any) -> None:
    """Words beside a place, ``offset`` points from it."""
    ax.annotate(words, at, xytext=offset, textcoords="offset points", **text)


def bare(ax: Any) -> None:
    """A drawing: no grid, no frame, no ticks."""
    ax.set_axis_off()
    ax.set_aspect("equal")


DEPTH = np.array([0.42, 0.34])  # what a metre of y is drawn as, to the right and up
ROUND = np.linspace(0.0, 2.0 * np.pi, 120)


@dataclass(frozen=True, kw_only=True)
class Oblique:
    """width: times the belt's width is enlarged; lateral: its sideways movement; height: z; tilt: of cross-sections
    (beside height). half_width [m] of the belt."""

    width: float
    lateral: float
    height: float
    tilt: float
    rig: Rig
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
        return np.stack([self.rig.centre_distance - x + DEPTH[0] * y, self.height * z + DEPTH[1] * y], axis=1)

    def pulleys(self, ax: Any, yaw: float) -> None:
        """Both cylinders, the tail pulley turned by its yaw, enlarged like the movements."""
        from scipy.spatial import ConvexHull

        reach, radius = 1.25 * self.width * self.half_width, self.rig.tail_radius
        for x, turn in ((self.rig.centre_distance, yaw), (0.0, 0.0)):
            lean = -turn * self.lateral * reach
            rings = []
            for s in (-1.0, 1.0):
                ring = x + s * lean + radius * np.sin(ROUND), np.full(len(ROUND), s * reach), radius * np.cos(ROUND)
                rings.append(self.flat(np.stack(ring, axis=1)))
            both = np.concatenate(rings)
            ax.fill(*both[ConvexHull(both).vertices].T, facecolor=FAINT_INK, alpha=0.22, linewidth=0, zorder=1)
            ax.plot(*rings[1].T, color=FAINT_INK, linewidth=0.9, zorder=1)

    def tilted_belt(self, fig: Any, ax: Any, shape: Shape) -> None:
        """The machine with its ribbon, lower parts first, coloured by the tilt of its cross-sections."""
        from matplotlib.collections import PolyCollection

        self.pulleys(ax, YAW)
        left, right = self.edges(shape)
        after = np.roll(np.arange(len(left)), -1)
        quads = np.stack([left, left[after], right[after], right], axis=1)
        order, angle = np.argsort(shape.middle[:, 2], kind="stable"), 1e3 * tilt(shape.left, shape.right)
        patches = PolyCollection(list(quads[order]), array=angle[order], cmap=style.diverging_map(),
                                 edgecolors="face", linewidths=0.2, zorder=2)  # fmt: skip
        full = float(np.max(np.abs(angle))) or 1.0
        patches.set_clim(-full, full)
        ax.add_collection(patches)
        for edge in (left, right):
            ax.plot(*np.vstack([edge, edge[:1]]).T, color=INK, linewidth=0.7, zorder=3)
        fig.colorbar(patches, ax=ax, label="tilt [mrad]", shrink=0.8, pad=0.01)
        for x, name in ((self.rig.centre_distance, "tail pulley (yawed)"), (0.0, "head pulley")):
            place = self.flat(np.array([[x, 1.25 * self.width * self.half_width, -self.rig.tail_radius]]))[0]
            note(ax, name, tuple(place), (0, -6), ha="center", va="top")
        bare(ax)


TEST_RIG_DRAWN = Oblique(width=5.0, lateral=60.0, height=3.0, tilt=15.0, rig=TEST_RIG,
                         half_width=0.5 * PAPER_BELT.width)  # fmt: skip


# Plates: which there are, and which have nothing to compute.


DIGITS = 7  # significant, of the numbers written down


@dataclass(frozen=True, kw_only=True)
class Plate:
    """number and title as in the paper; caption: what was computed here, in plain words.

    numbers: everything that is drawn, JSON-able, units in the names; draw: returns the picture, a matplotlib figure;
    stored: names of the stored runs in three dimensions that it shows.
    """

    number: int
    title: str
    caption: str
    numbers: Mapping[str, Any]
    draw: Callable[[], Any]
    stored: tuple[str, ...] = ()

    @property
    def file(self) -> str:
        """Name of its picture."""
        return f"figure_{self.number:02d}.png"

    def save(self, folder: Path) -> Path:
        """Draw it into a folder."""
        drawn: Path = style.picture(lambda path: style.save(self.draw(), path))(folder / self.file)
        return drawn


def column(values: Any) -> list[float]:
    """Numbers of an array as they are written down."""
    return [float(f"{v:.{DIGITS}g}") + 0.0 for v in np.asarray(values, float).ravel()]


FIGURES = (2, 6, 9, 12, 13, 14)

#: figures of the paper that nothing is computed for, and why
_CHAIN, _BELT = (f"particles in three dimensions: belt-sim simulate +experiment=figure_{n}" for n in (16, 19))
NOT_COMPUTED = {
    1: "a sketch of how the tail pulley is yawed (eq. 1): a definition",
    3: "a sketch that names the run-up and run-off points 1 to 4: a definition",
    4: "a sketch of the angles at the run-up point (eq. 5, 6): a definition; what follows from it is Fig. 6",
    5: "the rope from above at six moments of Fig. 6",
    7: "the rope from above for either sign of the yaw: Fig. 6 and its mirror",
    8: "a sketch of the beam with its boundary values (eq. 7): what follows from it is Fig. 9",
    10: "a sketch of where a hanging span leaves its pulleys: what follows from it is Fig. 14",
    11: "a photograph of the test rig",
    15: _CHAIN,
    16: _CHAIN,
    17: _CHAIN.replace("16", "17"),
    18: _BELT,
    19: _BELT,
    20: _BELT,
}


def compute(number: int, *, in_space: bool = True) -> Plate:
    """A figure; in_space: with the stored belts in three dimensions beside the laws."""
    from studies.paper import by_laws

    return by_laws.FIGURES[number](in_space)


def select_figures(figures: object) -> list[int]:
    """The numbers asked for (None: all that can be had); raises InputError for one that there is none of."""
    if figures is None:
        return [*FIGURES]
    wanted = figures if isinstance(figures, list | tuple) else [figures]
    for number in wanted:
        if isinstance(number, bool) or not isinstance(number, int):
            raise InputError("figures", number, "", "give numbers, as figures=[12,13]")
        if number in NOT_COMPUTED:
            raise InputError("figures", number, "", f"is {NOT_COMPUTED[number]}; nothing to compute")
        if number not in FIGURES:
            raise InputError("figures", number, "", f"use some of {', '.join(map(str, FIGURES))}")
    return sorted({*wanted})
