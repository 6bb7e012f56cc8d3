"""One look for all pictures, and how they reach the disk; Matplotlib is imported only when one is made. Colours mean
the same everywhere, and colour-blind eyes tell them apart too (after Okabe and Ito, 2008)."""

import contextlib
import io
import os
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from belt_sim.errors import InputError
from belt_sim.io import write_text, write_with
from belt_sim.results.words import in_print

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure


INK = "#1f2933"
FAINT_INK = "#9aa5b1"
PAPER = "#ffffff"
GRID = "#e4e7eb"
BLUE = "#0072b2"
SKY = "#56b4e9"
GREEN = "#009e73"
AMBER = "#e69f00"
RED = "#d55e00"
PINK = "#cc79a7"

#: Points 1-4, in this order: the two ends at the tail pulley, the two at the head pulley.
POINT_COLOURS = (BLUE, AMBER, GREEN, RED)
POINT_NAMES = (
    "1 upper end, tail pulley",
    "2 lower end, tail pulley",
    "3 lower end, head pulley",
    "4 upper end, head pulley",
)
SHORT_POINT_NAMES = tuple(name.replace(" end", "").replace(" pulley", "") for name in POINT_NAMES)

MEASURED = INK
BEFORE_COLOUR = RED
AFTER_COLOUR = BLUE

#: For any further models or runs, in order of use.
CYCLE = (BLUE, RED, GREEN, AMBER, PINK, SKY, "#5d4e9c", "#7a7a2e")

#: Diverging map, blue - white - red, as (position, colour); blue is negative.
DIVERGING = ((0.0, "#16527e"), (0.25, "#6faed6"), (0.5, "#f5f5f2"), (0.75, "#ec9a6a"), (1.0, "#a03a00"))


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green, blue [0..255] of ``#rrggbb``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


DPI = 150
FONT = 10.0

LOOK: Any = {
    "font.family": "DejaVu Sans",
    "font.size": FONT,
    "axes.titlesize": FONT + 1,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # no ticks stand above, to be looked for three times a picture
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT_INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.bottom": False,  # the grid marks the numbers
    "ytick.left": False,
    "xtick.labelsize": FONT - 1,
    "ytick.labelsize": FONT - 1,
    "legend.frameon": False,
    "legend.fontsize": FONT - 1,
    "lines.linewidth": 1.8,
    "figure.facecolor": PAPER,
    "svg.fonttype": "none",  # words stay words: smaller, and they can be searched
    "svg.hashsalt": "belt-sim",  # the same picture is the same file
}


@contextlib.contextmanager
def in_look() -> Iterator[None]:
    """Give Matplotlib our look, and nothing of the user's own matplotlibrc: in a with block, or as a decorator."""
    from matplotlib import style

    with style.context(["default", LOOK]):
        yield


picture: Any = in_look()  # decorates a function that draws a picture


def figure(
    width: float,
    height: float,
    rows: int = 1,
    columns: int = 1,
    *,
    count: int | None = None,
    layout: Literal["constrained"] | None = "constrained",
    **grid,
) -> "tuple[Figure, list[Axes]]":
    """An empty figure [inch] and the first ``count`` axes of its rows x columns (None: all), row by row, the others
    hidden; layout: None where axes are placed by hand."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(width, height), dpi=DPI, layout=layout)
    FigureCanvasAgg(fig)
    axes = fig.subplots(rows, columns, squeeze=False, **grid).ravel().tolist()
    count = len(axes) if count is None else count
    for ax in axes[count:]:
        ax.set_visible(False)
    return fig, axes[:count]


LETTER, TITLE_LINE = 0.108, 0.2  # [inch], mean width of a letter of a title, and of one more line of it


def place(
    fig: "Figure", headline: str, rows: int, columns: int, *,
    left: float, right: float, top: float, bottom: float, across: float = 0.0, down: float = 0.0,
) -> None:  # fmt: skip
    """Write the headline, and place axes that are all alike by distances [inch] around them (top: below one line) and
    between them, which takes half the time of a layout that looks at every tick."""
    (width, height), top = fig.get_size_inches(), top + TITLE_LINE * (title(fig, headline) - 1)
    wide = (width - left - right - (columns - 1) * across) / columns
    high = (height - top - bottom - (rows - 1) * down) / rows
    share = {"left": left / width, "right": 1.0 - right / width, "bottom": bottom / height, "top": 1.0 - top / height}
    fig.subplots_adjust(**share, wspace=across / wide, hspace=down / high)


def title(fig: "Figure", text: str) -> int:
    """Write the headline of a picture at its left, and return its number of lines."""
    whole = re.sub("(?<=[0-9]) ", "\u00a0", text)  # a unit stays beside its number
    lines = [line.replace("\u00a0", " ") for line in textwrap.wrap(whole, int(fig.get_figwidth() / LETTER))]
    where = {} if fig.get_layout_engine() else {"y": 1.0 - 0.12 / fig.get_figheight()}
    look: Any = {"x": 0.01, "ha": "left", "fontsize": FONT + 3, "fontweight": "bold", "color": INK}
    fig.suptitle("\n".join(lines), **where, **look, gid="title")
    return len(lines)


ENDINGS = (".png", ".svg", ".pdf")


def save(fig: "Figure", path: str | os.PathLike | None, headline: str = "", dpi: float | None = None) -> Any:
    """Write the figure, its units as in print, as its file's ending says (.png, .svg, .pdf), and return the path.

    headline: written above it; path: None returns the figure itself, laid out; dpi: dots per inch of a PNG. Raises
    InputError, UnwritableError.
    """
    from matplotlib.text import Text

    if headline:
        title(fig, headline)
    for text in fig.findobj(Text):
        text.set_text(in_print(text.get_text()))
    if (layout := fig.get_layout_engine()) is not None:
        layout.execute(fig)
        fig.set_layout_engine("none")
    if path is None:
        return fig
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise InputError("picture", path.name, "", f"give a name that ends in {', '.join(ENDINGS)}")
    if path.suffix.lower() == ".svg":
        return write_text(path, svg_text(fig))
    quick: Any = {"pil_kwargs": {"compress_level": 1}} if path.suffix.lower() == ".png" else {}
    with in_look():
        return write_with(path, lambda draft: fig.savefig(draft, dpi=dpi or DPI, **quick))


def svg_text(fig: "Figure") -> str:
    """Return the figure as SVG, its numbers to a tenth of a point."""
    page = io.StringIO()
    with in_look():
        fig.savefig(page, format="svg", metadata={"Date": None})
    return re.sub(r'(?<==)"[^"<]*"', lambda a: re.sub(r"(\d\.\d)\d+", r"\1", a[0]), page.getvalue())


def diverging_map() -> "LinearSegmentedColormap":
    """Blue - white - red."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("belt", list(DIVERGING))
