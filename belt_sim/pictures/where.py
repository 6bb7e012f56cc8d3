"""Where a model fails: error over uncertainty against tension and travel, by signal and yaw sign."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import INK
from belt_sim.results.drawings import FailureMap

#: |E / u_val| inside of which nothing can be said (ASME V&V 20 with k = 2), and where the colour is full.
SAYS_NOTHING = 2.0
FULL = 10.0


@style.picture
def where_map_picture(path: str | os.PathLike, maps: Sequence[FailureMap], title: str, sentence: str = "") -> Path:
    """A heat map a signal and yaw sign; the number in each cell is E/u_val, grey cells were not measured."""
    columns = min(2, len(maps))
    rows = -(-len(maps) // columns)
    most = max(len(m.tension) for m in maps)
    fig, axes = style.figure(5.6 * columns + 0.8, rows * (0.42 * most + 1.1) + 1.1, rows, columns)
    flat = [ax for row in axes for ax in row]
    meshes = [_map(ax, one) for ax, one in zip(flat, maps, strict=False)]
    for ax in flat[len(maps) :]:
        ax.set_visible(False)
    bar = fig.colorbar(
        meshes[-1], ax=flat[: len(maps)], label="E / u_val  (model - measured)", shrink=0.9, extend="both"
    )
    bar.set_ticks([-FULL, -5, -SAYS_NOTHING, 0, SAYS_NOTHING, 5, FULL])
    bar.outline.set_visible(False)
    style.title(fig, title)
    if sentence:
        fig.supxlabel(sentence, x=0.01, ha="left", fontsize=style.FONT, color=INK)
    return style.save(fig, path)


def _map(ax, one: FailureMap):
    """One heat map; cells that say nothing stay white."""
    ratio = np.asarray(one.ratio, float)
    shown = np.ma.masked_invalid(np.sign(ratio) * np.maximum(np.abs(ratio) - SAYS_NOTHING, 0.0))
    rows = np.arange(len(one.tension) + 1)
    full = FULL - SAYS_NOTHING
    ax.set_facecolor("#e4e7eb")
    mesh = ax.pcolormesh(
        one.edges,
        rows,
        np.ma.masked_invalid(ratio),
        cmap=_dead_zone(),
        vmin=-FULL,
        vmax=FULL,
        edgecolors="white",
    )
    middle = 0.5 * (np.asarray(one.edges)[1:] + np.asarray(one.edges)[:-1])
    for i, j in np.argwhere(np.isfinite(ratio)):
        strong = abs(float(shown[i, j])) > 0.55 * full
        ink: dict[str, Any] = {
            "color": "white" if strong else INK,
            "fontsize": style.FONT - 2,
            "ha": "center",
            "va": "center",
        }
        ax.text(middle[j], i + 0.5, f"{ratio[i, j]:.0f}" if abs(ratio[i, j]) >= 1.0 else "·", **ink)
    ax.set_yticks(rows[:-1] + 0.5, [f"{t:g}" for t in one.tension])
    ax.set(xlabel="belt travel [m]", ylabel="tension [N/mm$^2$]", title=one.title)
    ax.grid(False)
    return mesh


def _dead_zone():
    """The diverging map, white wherever |E/u_val| says nothing."""
    from matplotlib.colors import ListedColormap

    at = np.linspace(-FULL, FULL, 401)
    beyond = np.sign(at) * np.maximum(np.abs(at) - SAYS_NOTHING, 0.0) / (FULL - SAYS_NOTHING)
    return ListedColormap(style.diverging()(0.5 + 0.5 * beyond))
