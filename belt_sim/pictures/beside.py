"""The belt in three dimensions beside the strip law, a panel a tension."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import BLUE, INK, RED
from belt_sim.si import MM

_POINTS = ((0, BLUE), (2, RED))


@dataclass(frozen=True)
class Beside:
    """One run. tension [N/mm2]; friction [1]; travel [m], shape (n,); y, law [m], shape (4, n): 3D and strip law."""

    tension: float
    friction: float
    travel: np.ndarray
    y: np.ndarray
    law: np.ndarray


@style.picture
def beside_picture(path: str | os.PathLike, runs: Sequence[Beside]) -> Path:
    """Points 1 and 3 of 3D runs (sticking: lines, slipping: dashes) over the strip law (thick and faint)."""
    tensions = sorted({r.tension for r in runs})
    rows = -(-len(tensions) // 2)
    fig, axes = style.figure(9.0, 2.9 * rows, rows, min(len(tensions), 2), sharex=True)
    panels = [axis for row in axes for axis in row]
    for tension, axis in zip(tensions, panels, strict=False):
        these = [r for r in runs if r.tension == tension]
        for k, (point, colour) in enumerate(_POINTS):
            longest = max(these, key=lambda r: r.travel[-1])
            axis.plot(longest.travel, longest.law[point] / MM, color=colour, alpha=0.25, linewidth=5.0,
                      label=f"strip law, point {point + 1}")  # fmt: skip
            for r in these:
                line = "-" if np.isinf(r.friction) else "--"
                name = "sticking" if np.isinf(r.friction) else f"friction {r.friction:g}"
                label = f"3D, {name}" if k == 0 else None
                axis.plot(r.travel, r.y[point] / MM, line, color=INK if line == "--" else colour, linewidth=1.1,
                          label=label)  # fmt: skip
        axis.set_title(f"{tension:g} N/mm$^2$")
        axis.set(xlabel="travel [m]", ylabel="y [mm]")
    panels[0].legend(fontsize=8)
    return style.save(fig, path)
