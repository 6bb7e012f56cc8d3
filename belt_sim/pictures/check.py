"""How small an effect may be and still show."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import AFTER, FAINT, INK
from belt_sim.results.check import WELL, Visible

#: Shares of the largest plausible size between which bars are drawn.
LEAST, MOST = 1e-4, 10.0


@style.picture
def visible_picture(path: str | os.PathLike, visible: Sequence[Visible], title: str) -> Path:
    """A bar an effect, from its smallest visible size to the largest that a machine could have; none where it hides."""
    fig, [[ax]] = style.figure(8.0, 0.3 * len(visible) + 1.8)
    rows = np.arange(len(visible))[::-1]
    for row, v in zip(rows, visible, strict=True):
        if v.share < 1.0:
            start = max(v.share, LEAST)
            ax.barh(row, 1.0 - start, left=start, height=0.7, color=AFTER, alpha=1.0 if v.share < WELL else 0.45)
        else:
            ax.annotate("hidden" if v.smallest is None else "only beyond", (1.05, row), va="center", color=INK)
    ax.axvline(1.0, color=FAINT, linewidth=1.2)
    ax.set(xscale="log", xlim=(LEAST, MOST), ylim=(-0.7, len(visible) - 0.3))
    ax.set_xlabel("size that shows, over the largest that a machine could have")
    ax.set_yticks(rows, [v.effect for v in visible])
    ax.grid(False, axis="y")
    style.title(fig, f"What would show: {title}"[:70])
    return style.save(fig, path)
