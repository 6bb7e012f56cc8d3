"""One look for all pictures, and how they reach the disk; Matplotlib is imported only when one is made."""

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from belt_sim.errors import BeltError
from belt_sim.files import write_with
from belt_sim.pictures.colours import DIVERGING, FAINT, INK, PAPER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.figure import Figure

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
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": FONT - 1,
    "ytick.labelsize": FONT - 1,
    "legend.frameon": False,
    "legend.fontsize": FONT - 1,
    "lines.linewidth": 1.8,
    "figure.facecolor": PAPER,
}


def picture(draw: Callable[..., Path]) -> Callable[..., Path]:
    """Decorate a function that draws a picture: everything in it has the one look."""

    @functools.wraps(draw)
    def in_style(*args, **kwargs) -> Path:
        import matplotlib

        with matplotlib.rc_context(LOOK):
            return draw(*args, **kwargs)

    return in_style


def figure(width: float, height: float, rows: int = 1, columns: int = 1, **grid) -> "tuple[Figure, list[list[Axes]]]":
    """An empty figure [inch] with rows x columns axes; ``grid`` as for Figure.subplots."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(fig)
    axes = fig.subplots(rows, columns, squeeze=False, **grid)
    return fig, [list(row) for row in axes]


def title(fig: "Figure", text: str) -> None:
    """The headline of a picture, at its left."""
    fig.suptitle(text, x=0.01, ha="left", fontsize=FONT + 3, fontweight="bold", color=INK)


def save(fig: "Figure", path: str | os.PathLike) -> Path:
    """Write the figure as PNG in one move; BeltError when that is not possible."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    path = Path(path)
    if layout := fig.get_layout_engine():
        layout.execute(fig)
        fig.set_layout_engine("none")
    try:  # savefig would draw all of it once more without a mark, for the layout that is made already
        write_with(path, FigureCanvasAgg(fig).print_png)
    except OSError as cause:
        raise BeltError(f"picture {path}: cannot be written ({cause.strerror}); choose another folder") from cause
    return path


def diverging() -> "LinearSegmentedColormap":
    """Blue - white - red."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("belt", list(DIVERGING))
