"""Points 1-4 against belt travel."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.curves import Curves
from belt_sim.pictures import style
from belt_sim.pictures.colours import CYCLE, INK, POINT_NAMES, POINTS
from belt_sim.si import MM

DASHES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))


@style.picture
def curves_picture(path: str | os.PathLike, curves: Mapping[str, Curves], title: str = "") -> Path:
    """Lateral position of points 1-4 [mm] against travel [m] for any number of named curves.

    One set of curves: one plot, a colour a point. Several: a plot a point, a colour a set.
    """
    draw = _one if len(curves) == 1 else _several
    fig = draw(curves)
    style.title(fig, title or ", ".join(curves))
    return style.save(fig, path)


def _one(curves: Mapping[str, Curves]):
    """All points in one plot, each named at the end of its curve."""
    fig, [[ax]] = style.figure(8.0, 4.6)
    (only,) = curves.values()
    for k, colour in enumerate(POINTS):
        ax.plot(only.travel, np.asarray(only.y)[k] / MM, color=colour, label=POINT_NAMES[k])
    _axes(ax)
    ax.legend(loc="best", labelcolor="linecolor")
    ax.set_ylabel("lateral position y [mm]")
    ax.set_xlabel("belt travel [m]")
    return fig


def _several(curves: Mapping[str, Curves]):
    """A plot a point, placed as on the machine: head left, tail right, upper span above."""
    fig, axes = style.figure(10.0, 6.4, 2, 2, sharex=True, sharey=True)
    places = {3: axes[0][0], 0: axes[0][1], 2: axes[1][0], 1: axes[1][1]}
    for k, ax in places.items():
        for n, (name, run) in enumerate(curves.items()):
            line: dict[str, Any] = {
                "color": CYCLE[n % len(CYCLE)],
                "linestyle": DASHES[n % len(DASHES)],
                "label": name,
            }
            ax.plot(run.travel, np.asarray(run.y)[k] / MM, **line)
        ax.set_title(f"Point {POINT_NAMES[k]}")
        _axes(ax)
    for row in axes:
        row[0].set_ylabel("y [mm]")
    for ax in axes[1]:
        ax.set_xlabel("belt travel [m]")
    handles, labels = axes[0][0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=min(len(curves), 5))
    return fig


def _axes(ax) -> None:
    """A zero line and tight travel."""
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    ax.margins(x=0.0)
