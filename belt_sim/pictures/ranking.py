"""How much each candidate effect explains, against what chance explains."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import AFTER, FAINT, INK
from belt_sim.results.found import Tried

#: The axis is linear up to one threshold and logarithmic beyond.
LINEAR = 1.0


@style.picture
def ranking_picture(path: str | os.PathLike, ranking: Sequence[Tried], title: str) -> Path:
    """A bar an effect: its gain in units of its bootstrap threshold; the line at 1 is chance.

    ranking: best first; a candidate that the readings cannot show has no threshold and no bar.
    """
    names = [c.id for c in ranking]
    ratio = np.array([max(c.gain, 0.0) / c.threshold if c.threshold else 0.0 for c in ranking])
    fig, [[ax]] = style.figure(8.0, 0.34 * len(names) + 1.7)
    rows = np.arange(len(names))[::-1]
    ax.barh(rows, ratio, height=0.72, color=[AFTER if r > 1.0 else FAINT for r in ratio])
    for row, r in zip(rows, ratio, strict=True):
        ax.annotate(f"{r:.3g}", (r, row), xytext=(4, 0), textcoords="offset points", va="center")
    ax.axvline(1.0, color=INK, linewidth=1.2)
    ax.annotate("chance (5 %)", (1.0, rows[0] + 0.6), xytext=(4, 0), textcoords="offset points", va="bottom")
    ax.set_xscale("symlog", linthresh=LINEAR)
    top = max(2.0, 2.2 * float(ratio.max()))
    ticks = [0.0, 0.5, *[t for p in range(8) for t in (10**p, 3 * 10**p) if t < top]]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_xticks([], minor=True)
    ax.set(xlim=(0.0, top), ylim=(-0.6, len(names) + 0.2), xlabel="chi-square gain / bootstrap threshold")
    ax.set_yticks(rows, names)
    ax.grid(False, axis="y")
    style.title(fig, title)
    return style.save(fig, path)
